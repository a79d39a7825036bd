"""A process that was forked lowers scenes too, and says at once what it cannot do.

Threads of its parent did not come along.
"""

from __future__ import annotations

import multiprocessing
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyopencl as cl
import pytest

import clpt
from clpt import device as dev
from clpt.errors import DeviceError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene, cameras, materials, shapes, textures


def scene(image: Path) -> Scene:
    paint = materials.Diffuse(reflectance=textures.Bitmap(image=image))
    return Scene(camera=cameras.Perspective(), shapes=[shapes.Rectangle(material=paint)])


def lower_files(folder: Path) -> None:
    for image in sorted(folder.glob("*.png")):
        lower(scene(image))


pytestmark = [
    pytest.mark.skipif(
        "fork" not in multiprocessing.get_all_start_methods(), reason="this system does not fork"
    ),
    pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning"),
]


def test_images_are_read_after_a_fork(tmp_path: Path) -> None:
    for name in "abc":
        clpt.write_image(tmp_path / f"{name}.png", np.zeros((2, 2, 3)))
    lower_files(tmp_path)
    child = multiprocessing.get_context("fork").Process(target=lower_files, args=(tmp_path,))
    child.start()
    child.join(20.0)
    ended = child.exitcode
    child.kill()
    assert ended == 0


def answer(work: Callable[[], Any], pipe: Any) -> None:
    """What happens in the child, by name and words."""
    try:
        work()
        pipe.send("it worked")
    except DeviceError as error:
        pipe.send(str(error))


def in_a_fork(work: Callable[[], Any]) -> str:
    """What a forked child says of its work within 20 s."""
    ours, theirs = multiprocessing.Pipe()
    process = multiprocessing.get_context("fork").Process(target=answer, args=(work, theirs))
    process.start()
    try:
        return str(ours.recv()) if ours.poll(20.0) else "nothing"
    finally:
        process.kill()
        process.join()


def of_pocl() -> dev.Device:
    """The device of all tests, which has run kernels."""
    device = dev.choose()
    if "pocl" not in device.info.version.casefold():
        pytest.skip("PoCL is the driver that a fork does not leave whole")
    return device


TRIANGLE = ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])


def test_pocl_in_a_fork_is_an_error_at_once() -> None:
    """New and inherited objects alike: their commands would never end."""
    device = of_pocl()
    film = clpt.scene.Film(width=4, height=4, mode="rgb")
    even = Scene(
        camera=cameras.Perspective(),
        film=film,
        lights=[clpt.scene.lights.Constant(radiance=1.0)],
    )
    queue = device.queue
    accel = clpt.Accel(queue, *map(np.array, TRIANGLE))
    rays = np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32)
    with clpt.Renderer(even, queue=queue) as renderer:
        renderer.run(1)
        works = {
            "a new renderer": lambda: clpt.Renderer(even, device="pocl"),
            "one on an old queue": lambda: clpt.Renderer(even, queue=queue),
            "one on a new queue": lambda: clpt.Renderer(even, queue=cl.CommandQueue(queue.context)),
            "an old renderer": lambda: renderer.run(1),
            "its picture": renderer.image,
            "its array": renderer.film.get,
            "a new accel": lambda: clpt.Accel(queue, *map(np.array, TRIANGLE)),
            "an old accel": lambda: accel.intersect(*rays),
        }
        said = {name: in_a_fork(work) for name, work in works.items()}
    wrong = {name: words for name, words in said.items() if "spawn or forkserver" not in words}
    assert not wrong


def test_a_fork_of_a_process_without_opencl_renders() -> None:
    """In a process of its own: this one has used OpenCL."""
    of_pocl()
    context = multiprocessing.get_context("spawn")
    queue = context.Queue()
    process = context.Process(target=fork_first, args=(queue,))
    process.start()
    said = queue.get(timeout=60.0)
    process.join(10.0)
    assert said == "it worked"


def fork_first(queue: Any) -> None:
    """Fork before OpenCL is used, and tell what the child says."""
    queue.put(in_a_fork(lambda: dev.choose("pocl")))


def even() -> Scene:
    return Scene(
        camera=cameras.Perspective(),
        film=clpt.scene.Film(width=4, height=4, mode="rgb"),
        lights=[clpt.scene.lights.Constant(radiance=1.0)],
    )


def test_a_fork_while_another_thread_works_is_an_error_at_once() -> None:
    """The lock of the renderer is then held by a thread that the child does not have."""
    device = of_pocl()
    accel = clpt.Accel(device.queue, *map(np.array, TRIANGLE))
    rays = np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32)
    begun, asked = threading.Event(), threading.Event()
    with clpt.Renderer(even(), queue=device.queue) as renderer:

        def progress(_: clpt.Progress) -> bool:
            with accel._lock:
                begun.set()
                asked.wait(60.0)
            return False

        thread = threading.Thread(target=renderer.run, args=(1, progress))
        thread.start()
        begun.wait(60.0)
        works = {
            "a run": lambda: renderer.run(1),
            "a reset": renderer.reset,
            "a picture": renderer.image,
            "rays": lambda: accel.intersect(*rays),
            "a new one": lambda: clpt.Renderer(even(), device="pocl"),
        }
        said = {name: in_a_fork(work) for name, work in works.items()}
        asked.set()
        thread.join()
        assert renderer.samples == 1, "the parent goes on"
    wrong = {name: words for name, words in said.items() if "spawn or forkserver" not in words}
    assert not wrong


def test_what_else_is_on_a_device_says_so_in_a_fork() -> None:
    device = of_pocl()
    array = dev.DeviceArray(device.queue, (4,), np.float32)
    array.fill(1.0)
    accel = clpt.Accel(device.queue, *map(np.array, TRIANGLE))
    rays = np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32)
    with clpt.MultiRenderer(even(), [device]) as several:
        several.run(1)
        works = {
            "an array's copy": lambda: array.get(),
            "an array for numpy": lambda: np.asarray(array),
            "an array for others": lambda: array.__dlpack__(),
            "an occlusion": lambda: accel.occluded(*rays),
            "all hits": lambda: accel.intersect_all(*rays),
            "a moved mesh": lambda: accel.update(np.array(TRIANGLE[0], np.float32)),
            "several devices": lambda: several.run(1),
            "their picture": several.image,
            "others": lambda: clpt.MultiRenderer(even(), "pocl"),
            "a render": lambda: clpt.render(even(), 1, device="pocl"),
        }
        said = {name: in_a_fork(work) for name, work in works.items()}
    wrong = {name: words for name, words in said.items() if "spawn or forkserver" not in words}
    assert not wrong


def pooled(number: int) -> str:
    """What a worker of a pool says."""
    try:
        clpt.render(even(), number, device="pocl")
    except DeviceError as error:
        return str(error)
    return "it worked"


@pytest.mark.parametrize(("method", "wanted"), [("fork", "spawn or forkserver"), ("spawn", "it")])
def test_a_pool(method: str, wanted: str) -> None:
    of_pocl()
    with multiprocessing.get_context(method).Pool(1) as pool:
        assert wanted in pool.apply_async(pooled, (1,)).get(timeout=60.0)
