"""The host's queues: their order, their events, their devices, and their health after errors."""

from __future__ import annotations

import dataclasses
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyopencl as cl
import pyopencl.array as cl_array
import pytest

import clpt
from clpt import device as dev
from clpt.device import DeviceInfo, assemble, build, program
from clpt.scene.shapes import Mesh
from tests.embedding.conftest import SLOTS

COMPLETE = cl.command_execution_status.COMPLETE
PROPERTIES = cl.command_queue_properties
QUEUES = {
    "in_order": 0,
    "out_of_order": PROPERTIES.OUT_OF_ORDER_EXEC_MODE_ENABLE,
    "profiled": PROPERTIES.PROFILING_ENABLE | PROPERTIES.OUT_OF_ORDER_EXEC_MODE_ENABLE,
}


def fresh_view(queue: cl.CommandQueue, properties: int = 0) -> cl.CommandQueue:
    """A queue in the same context."""
    return cl.CommandQueue(queue.context, queue.device, properties)


@pytest.mark.parametrize("kind", QUEUES)
def test_orders(scene: clpt.Scene, queue: cl.CommandQueue, picture: np.ndarray, kind: str) -> None:
    """Steps, a reset and a camera between them: one after the other, whatever the queue allows."""
    with clpt.Renderer(scene, queue=fresh_view(queue, QUEUES[kind]), slots=SLOTS) as renderer:
        renderer.step(2)
        renderer.update(camera=dataclasses.replace(scene.camera, fov=25.0))
        renderer.step(1)
        renderer.update(camera=scene.camera)
        for samples in (1, 2, 1):
            event = renderer.step(samples)
        assert np.array_equal(renderer.image(), picture)
        assert event.command_execution_status == COMPLETE
        shown = renderer.resolve().get()
    off = shown[..., :3].astype(int) - clpt.images.to_srgb8(picture)
    assert np.abs(off).max() <= 1


@pytest.mark.parametrize("kind", ["in_order", "out_of_order"])
def test_a_step_begins_after_the_hosts_event(
    scene: clpt.Scene, queue: cl.CommandQueue, picture: np.ndarray, kind: str
) -> None:
    """The host's thread goes on; the step, and all after it, wait for an event set much later."""
    with clpt.Renderer(scene, queue=fresh_view(queue, QUEUES[kind]), slots=SLOTS) as renderer:
        late = cl.UserEvent(queue.context)
        events = [
            renderer.step(1, wait_for=[late]),
            renderer.step(2),
            renderer.reset(),
            renderer.step(4),
        ]
        looks = cl_array.zeros(fresh_view(queue), 4, np.float32)  # another queue is not held up
        assert not looks.get().any()
        assert all(event.command_execution_status != COMPLETE for event in events)
        late.set_status(COMPLETE)
        events[-1].wait()
        assert np.array_equal(renderer.film.get()[..., :3], picture)


def test_an_event_that_has_failed_is_refused(
    scene: clpt.Scene, queue: cl.CommandQueue, picture: np.ndarray
) -> None:
    """At once, by each method that takes events: PoCL would wait for it for ever."""
    bad = cl.UserEvent(queue.context)
    bad.set_status(cl.status_code.OUT_OF_RESOURCES)
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    accel = clpt.Accel(queue, corners, np.array([[0, 1, 2]], np.uint32))
    with clpt.Renderer(scene, queue=fresh_view(queue), slots=SLOTS) as renderer:
        for use in (
            lambda: renderer.step(1, wait_for=[bad]),
            lambda: renderer.reset(wait_for=[bad]),
            lambda: renderer.resolve(wait_for=[bad]),
            lambda: renderer.update(camera=scene.camera, wait_for=[bad]),
            lambda: accel.update(corners, wait_for=[bad]),
            lambda: accel.intersect(corners, corners + 1, wait_for=[bad]),
            lambda: accel.occluded(corners, corners + 1, wait_for=[bad]),
        ):
            with pytest.raises(clpt.DeviceError, match=r"wait_for.*OUT_OF_RESOURCES"):
                use()
        renderer.reset()
        renderer.run(4)
        assert np.array_equal(renderer.image(), picture)


def test_a_queue_that_has_lost_its_context_is_refused(queue: cl.CommandQueue) -> None:
    """As with Intel's runtime, whose queues do not hold their context."""

    class Lost:
        device = queue.device

        @property
        def context(self) -> cl.Context:
            cl.Context([])  # no device: what PyOpenCL raises is an error of OpenCL

    with pytest.raises(clpt.DeviceError, match="keep it in a variable"):
        dev.Device.adopt(Lost())


def test_another_queue_waits_for_a_step(
    scene: clpt.Scene, queue: cl.CommandQueue, picture: np.ndarray
) -> None:
    """The host's commands on a second queue see the film that the event promised, and hold it."""
    other = fresh_view(queue)
    with clpt.Renderer(scene, queue=fresh_view(queue), slots=SLOTS) as renderer:
        copied = np.zeros((20, 24, 4), np.float32)
        for _ in range(3):
            done = renderer.step(4)
            read = cl.enqueue_copy(
                other, copied, renderer.film.data, wait_for=[done], is_blocking=False
            )
            renderer.reset(wait_for=[read])
            read.wait()
            assert np.array_equal(copied[..., :3], picture)


def test_neighbours_do_not_disturb(
    scene: clpt.Scene, queue: cl.CommandQueue, picture: np.ndarray
) -> None:
    """Two renderers whose commands alternate on one queue, and a host that writes there too."""
    scratch = cl_array.zeros(queue, 1 << 12, np.float32)
    other = dataclasses.replace(scene, seed=7)
    with (
        clpt.Renderer(scene, queue=queue, slots=SLOTS) as first,
        clpt.Renderer(other, queue=queue, slots=SLOTS) as second,
    ):
        for _ in range(4):
            first.step(1)
            scratch += 1
            second.step(1)
        assert np.array_equal(first.image(), picture)
        assert not np.array_equal(second.image(), picture)
    assert (scratch.get() == 4).all()


def test_errors_leave_the_queue_usable(
    scene: clpt.Scene, queue: cl.CommandQueue, picture: np.ndarray, monkeypatch
) -> None:
    """Too little memory, a scene and a kernel that make no sense; in the midst of a render too."""
    broken = dataclasses.replace(scene, shapes=[Mesh(vertices=np.full((3, 3), np.nan), faces=FACE)])
    with clpt.Renderer(scene, queue=queue, slots=SLOTS) as renderer:
        renderer.step(1)
        with pytest.raises(clpt.SceneError):
            clpt.Renderer(broken, queue=queue)
        with monkeypatch.context() as full:
            full.setattr(DeviceInfo, "free_memory", lambda info: 1 << 14)
            with pytest.raises(clpt.MemoryBudgetError):
                clpt.Renderer(scene, queue=queue, slots=1 << 16)
        with pytest.raises(clpt.KernelBuildError):
            build(renderer.device, assemble("bad.cl", {"bad.cl": "kernel void bad() { none(); }"}))
        with pytest.raises(clpt.SceneError):
            renderer.update(vertices={"no such shape": np.zeros((3, 3))})
        with pytest.raises(clpt.SceneError):
            renderer.step(0)
        renderer.step(3)
        assert np.array_equal(renderer.image(), picture)
    assert (cl_array.arange(queue, 8, dtype=np.int32).get() == np.arange(8)).all()


def test_a_failed_program_is_not_kept(
    scene: clpt.Scene, queue: cl.CommandQueue, picture: np.ndarray, monkeypatch
) -> None:
    """What failed once, because a driver ran out of something, is tried again."""
    text = assemble("late.cl", {"late.cl": "kernel void late(global int *x) { x[0] = 1; }"})
    device = clpt.Renderer(scene, queue=queue, slots=SLOTS).device
    with monkeypatch.context() as failing:
        failing.setattr(program, "_signature", lambda kernel: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            build(device, text)
    assert build(device, text).kernel("late")


def test_a_context_of_several_devices(scenes: Path) -> None:
    """PoCL can show its device twice: each gets its programs, and they see the same."""
    root = Path(__file__).resolve().parents[2]
    path = os.pathsep.join(filter(None, [str(root), os.environ.get("PYTHONPATH")]))
    done = subprocess.run(
        [sys.executable, "-m", "tests.embedding.several_devices", str(scenes / "cornell.xml")],
        env={**os.environ, "POCL_DEVICES": "pthread pthread", "PYTHONPATH": path},
        cwd=root, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    if report["devices"] < 2:
        pytest.skip("the platform shows one device")
    assert report["same pictures"] and report["mean"] > 0.05
    assert report["same hits"] and report["hits"] > 10
    assert report["built for"] == 1, "programs were built for the other device too"


FACE = np.array([[0, 1, 2]], np.uint32)
