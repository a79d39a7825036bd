"""Renderers that come, go, are closed, cancelled, and used from several threads."""

from __future__ import annotations

import copy
import dataclasses
import gc
import logging
import pickle
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

import clpt
from tests.embedding.conftest import SLOTS


@pytest.fixture
def made(scene: clpt.Scene, queue: cl.CommandQueue) -> Iterator[clpt.Renderer]:
    with clpt.Renderer(scene, queue=queue, slots=SLOTS) as renderer:
        yield renderer


@pytest.fixture
def no_collector() -> Iterator[None]:
    """Cycles of references stay, so that what hangs in one is found."""
    gc.collect()
    gc.disable()
    yield
    gc.enable()


def resident() -> int:
    """Memory of this process [bytes]."""
    return 4096 * int(Path("/proc/self/statm").read_text().split()[1])


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="no /proc")
@pytest.mark.parametrize("count", [20, pytest.param(100, marks=pytest.mark.slow)])
def test_memory_is_flat(
    scene: clpt.Scene, queue: cl.CommandQueue, no_collector: None, count: int
) -> None:
    """One of these holds 4 MB and more; many of them, closed or dropped, leave less than that."""
    for i in range(count + 10):
        renderer = clpt.Renderer(scene, queue=queue, slots=1 << 14)
        renderer.step(1).wait()
        if i % 2:
            renderer.close()
        del renderer
        if i == 10:  # the first ones bring programs, threads and pools
            before = resident()
    assert resident() - before < 4 << 20


def test_a_closed_one_tells(made: clpt.Renderer, scene: clpt.Scene) -> None:
    made.step()
    film = made.film
    made.close()
    made.close()
    for use in (made.step, made.image, made.reset, lambda: made.run(1), lambda: made.film):
        with pytest.raises(clpt.DeviceError, match="this Renderer is closed; make another one"):
            use()
    assert film.get().any(), "what the host still holds stays"
    assert made.scene is scene


@pytest.mark.parametrize("end", [clpt.Renderer.close, lambda renderer: None])
def test_what_was_enqueued_ends_without_its_renderer(
    scene: clpt.Scene, queue: cl.CommandQueue, picture: np.ndarray, end
) -> None:
    """Closed or dropped while its commands are held up; it does not wait for them either."""
    late = cl.UserEvent(queue.context)
    renderer = clpt.Renderer(scene, queue=queue, slots=SLOTS)
    film = renderer.film
    renderer.update(camera=dataclasses.replace(scene.camera, fov=25.0), wait_for=[late])
    renderer.update(camera=scene.camera)
    event = renderer.step(4)
    end(renderer)
    del renderer
    late.set_status(cl.command_execution_status.COMPLETE)
    event.wait()
    assert np.array_equal(film.get()[..., :3], picture)


@pytest.mark.parametrize("take", [pickle.dumps, copy.copy, copy.deepcopy])
def test_a_renderer_is_neither_pickled_nor_copied(made: clpt.Renderer, take) -> None:
    with pytest.raises(TypeError, match="pickle its scene"):
        take(made)


def test_another_thread_cancels_a_run(made: clpt.Renderer) -> None:
    begun = threading.Event()

    def progress(_: clpt.Progress) -> bool:
        begun.set()
        return True

    threading.Thread(target=lambda: (begun.wait(), made.cancel())).start()
    start = time.perf_counter()
    assert not made.run(100_000_000, progress)
    assert time.perf_counter() - start < 30
    assert np.isfinite(made.image()).all() and made.image().mean() > 0.01
    made.reset()
    assert made.run(1), "the next run is not stopped"


def test_what_the_callback_of_a_run_raises_comes_through(made: clpt.Renderer) -> None:
    with pytest.raises(ZeroDivisionError):
        made.run(1_000_000, lambda progress: 1 / 0)
    assert np.isfinite(made.image()).all()


def test_what_the_callback_of_a_step_raises_is_logged(
    scene: clpt.Scene, queue: cl.CommandQueue, picture: np.ndarray, caplog
) -> None:
    calls: list[clpt.Progress] = []

    def progress(now: clpt.Progress) -> None:
        calls.append(now)
        raise ValueError("the host's own mistake")

    with clpt.Renderer(scene, queue=queue, slots=SLOTS, progress=progress) as renderer:
        with caplog.at_level(logging.ERROR, "clpt"):
            for _ in range(4):
                renderer.step(1).wait()
            for _ in range(500):  # it is logged by a thread of the driver, after the call
                if len(calls) == 4 and "the host's own mistake" in caplog.text:
                    break
                time.sleep(0.01)
        assert sorted(now.samples for now in calls) == [1, 2, 3, 4]
        assert "the host's own mistake" in caplog.text
        assert np.array_equal(renderer.image(), picture)


def test_renderers_in_threads(
    scene: clpt.Scene, queue: cl.CommandQueue, picture: np.ndarray
) -> None:
    """Made and used at once in one context, on one queue and on others: one picture."""
    context, results = queue.context, {}

    def work(name: int, on: cl.CommandQueue) -> None:
        with clpt.Renderer(scene, queue=on, slots=SLOTS) as renderer:
            for _ in range(4):
                renderer.step(1)
            results[name] = renderer.image()

    queues = [queue, queue, cl.CommandQueue(context), cl.CommandQueue(context)]
    threads = [threading.Thread(target=work, args=item) for item in enumerate(queues)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(results) == 4
    assert all(np.array_equal(image, picture) for image in results.values())


def test_one_renderer_in_threads(made: clpt.Renderer, picture: np.ndarray) -> None:
    """Steps from four threads are four samples, and pictures in between are whole."""
    failures: list[BaseException] = []

    def work() -> None:
        try:
            made.step(1)
            assert np.isfinite(made.image()).all()
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures
    assert made.samples == 4
    assert np.array_equal(made.image(), picture)
