"""Several workers in processes of their own: the picture of one, whatever they do."""

from __future__ import annotations

import dataclasses
import os
import sys
import threading
import time
from pathlib import Path

import pytest

pytest.importorskip("distributed")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

sys.path.insert(0, str(Path(__file__).parent))
from machines import ROOT, digest_of_one_process, machines, scene, wait_until  # noqa: E402

import clpt  # noqa: E402
from clpt.cluster import tasks  # noqa: E402
from clpt.cluster.cluster_renderer import ClusterRenderer  # noqa: E402
from clpt.errors import ClusterError  # noqa: E402

SAMPLES = 200


@pytest.fixture(scope="module")
def two():
    """Two workers."""
    with machines(2) as found:
        yield found


@pytest.fixture(scope="module")
def expected():
    """The digest of the film of one process."""
    return digest_of_one_process(SAMPLES)


def digest(renderer):
    return tasks.film_digest(renderer.film_state())


def test_two_workers_are_one(two, expected):
    for _ in range(10):  # until both had a block: one may be busy with what others run here
        with ClusterRenderer(scene(), two.client) as renderer:
            assert renderer.run(SAMPLES)
            assert digest(renderer) == expected
            took_part = len(renderer.workers)
        if took_part == 2:
            break
    assert took_part == 2
    with ClusterRenderer(scene(), two.client) as renderer:
        told = []
        assert renderer.run(SAMPLES, lambda progress: told.append(progress.samples))
        assert renderer.samples == SAMPLES
        assert sum(record.samples for record in renderer.workers.values()) == SAMPLES
        assert renderer.counts.samples == SAMPLES * 32 * 24
        assert told == sorted(told) and told[-1] == SAMPLES
        assert renderer.image().shape == (24, 32, 3)


@pytest.mark.slow
def test_images_travel(two):
    """They are files, of which workers keep no copy in the folder of an open scene."""
    whole = clpt.load(ROOT / "scenes/three_spheres")
    film = dataclasses.replace(whole.film, width=16, height=12, mode="rgb")
    integrator = clpt.scene.integrators.Path(light_paths=0)
    plan = dataclasses.replace(whole, film=film, integrator=integrator)
    with ClusterRenderer(plan, two.client) as renderer:
        assert renderer.run(2)
        assert digest(renderer) == digest_of_one_process(2, plan)


def test_a_run_that_is_stopped_leaves_a_picture(two):
    """What is missing is rendered by the next run, perhaps with fewer samples in some pixels."""
    with ClusterRenderer(scene(), two.client) as renderer:
        assert not renderer.run(10**6, lambda progress: progress.samples < 20)
        stopped = renderer.samples
        assert 20 <= stopped < 10**6
        renderer.cancel()
        assert not renderer.run(1)
        assert renderer.run(10)
        assert renderer.samples == stopped + 10


def test_a_killed_worker_is_not_missed(two):
    third = two.start()
    two.wait(3)
    with ClusterRenderer(scene(), two.client) as renderer:
        while len(renderer.workers) < 3:
            assert renderer.run(100)

        def kill(progress):
            if len(renderer.workers) == 3 and third.poll() is None:
                os.kill(third.pid, 9)
                third.wait()

        assert renderer.run(3000, kill)
        assert third.poll() is not None
        assert digest(renderer) == digest_of_one_process(renderer.samples)
    two.started.remove(third)
    two.wait(2)


WRONG = {
    "another version": ("tasks.VERSION_OF_CLPT = '9.9'", "it has clpt 9.9"),
    "other kernels": ("tasks.kernels_digest = lambda: 'f00'", "it has kernels f00"),
    "another device": ("tasks.device_class = lambda one: 'a toaster'", "another class of device"),
    "a full disk": (
        "import errno, os\n"
        "def add(*a): raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))\n"
        "tasks.Store.lacks = add", "its disk: No space left",
    ),
    "a damaged film": ("tasks.film_digest = lambda state: '0' * 64", "is wrong"),
    "a wrong film": (
        "whole = tasks.state_to_arrays\n"
        "def wrong(state):\n"
        "    state.words[0, 0, 5, 5] ^= 1\n"
        "    return whole(state)\n"
        "tasks.state_to_arrays = wrong", "is wrong",
    ),
}  # fmt: skip


@pytest.mark.parametrize("how", WRONG)
def test_a_worker_that_is_wrong_is_refused(how, two, expected):
    code, reason = WRONG[how]
    third = two.start(f"from clpt.cluster import tasks\n{code}")
    two.wait(3)
    known = set(two.client.nthreads())
    try:
        with ClusterRenderer(scene(), two.client) as renderer:
            assert renderer.run(SAMPLES)
            while not renderer.refused:
                assert renderer.run(1)
            if any("others: a toaster" in text for text in renderer.refused.values()):
                return  # it came first, and the others are refused
            assert renderer.refused.keys() <= known
            assert len(renderer.refused) == 1
            assert reason in next(iter(renderer.refused.values()))
            if renderer.samples == SAMPLES:
                assert digest(renderer) == expected
    finally:
        two.end(third)


TWO_DEVICES = "tasks._devices = lambda: [dev.choose(threads=1), dev.choose(threads=1)]"
FAILS = """
from clpt.cluster import crew
whole, numbers = crew.DeviceWorker.do, iter(range(10**9))
def do(self, job, first, end, on_batch):
    if self.name.endswith("#2") and next(numbers) == 2:
        open({path!r}, "w").close()
        raise RuntimeError("the card is gone")
    return whole(self, job, first, end, on_batch)
crew.DeviceWorker.do = do
"""


@pytest.mark.parametrize("more", ["", FAILS], ids=["both", "one fails"])
def test_a_worker_with_two_devices(more, two, expected, tmp_path):
    """Beside workers with one, with which its films are compared: to the bit."""
    gone, more = tmp_path / "gone", more.format(path=str(tmp_path / "gone"))
    third = two.start(
        f"from clpt import device as dev\nfrom clpt.cluster import tasks\n{TWO_DEVICES}\n{more}"
    )
    known = set(two.client.nthreads())
    two.wait(3)
    [third_address] = set(two.client.nthreads()) - known
    try:
        with ClusterRenderer(scene(), two.client) as renderer:
            assert renderer.run(SAMPLES)
            assert digest(renderer) == expected
            while third_address not in renderer.workers:
                assert renderer.run(1)
            assert renderer.workers[third_address].kind in {
                record.kind for name, record in renderer.workers.items() if name in known
            }

            def had_blocks():
                assert renderer.run(4000)
                return renderer.workers[third_address].samples and gone.exists() == bool(more)

            wait_until(had_blocks, "blocks of the third worker")
            assert renderer.workers[third_address].samples > 0
            assert renderer.workers[third_address].failures == 0
            assert gone.exists() == bool(more)
            before = renderer.samples
            assert digest(renderer) == digest_of_one_process(before)
            stops = iter((True, False))
            assert not renderer.run(10**6, lambda progress: next(stops, False))
            assert not renderer.refused
            renderer._hold()
            held = renderer.saved_film(held=True).film
            assert held.samples.max() == held.samples.min() >= before
    finally:
        two.end(third)


def test_no_worker_that_can(two):
    plan = scene()
    with ClusterRenderer(plan, two.client) as renderer:
        maker = renderer._maker
        text = maker.job.text.replace('"format":"clpt job"', '"format":"other"')
        maker.job = dataclasses.replace(maker.job, text=text)
        with pytest.raises(ClusterError, match=r"no worker can render this: .* is no job of clpt"):
            renderer.run(1)


def test_a_task_that_nobody_waits_for_ends(two):
    """As of a client that is gone: the worker is free again soon."""
    with ClusterRenderer(scene(), two.client) as renderer:
        renderer.run(4)
        address = next(iter(two.client.nthreads()))
        job = renderer.digest
        future = two.client.submit(tasks.render_block, job, 0, 2**30, workers=[address])
        time.sleep(1.0)
        assert not future.done()
        future.release()
        del future
        began = time.monotonic()
        free = two.client.submit(tasks.give, b"free", workers=[address], key="free")
        assert free.result(timeout=20) == b"free"
        assert time.monotonic() - began < 20


def test_cancel_from_another_thread(two):
    with ClusterRenderer(scene(), two.client) as renderer:
        timer = threading.Timer(1.0, renderer.cancel)
        timer.start()
        assert not renderer.run(10**7)
        timer.join()
        assert 0 <= renderer.samples < 10**7


def test_a_scene_that_no_cluster_takes(two):
    with pytest.raises(TypeError, match="no option 'samples'"):
        ClusterRenderer(scene(), two.client, samples=3)
    with pytest.raises(TypeError, match="of one device"):
        ClusterRenderer(scene(), two.client, threads=3)
    wait_until(lambda: len(two.client.nthreads()) == 2, "both workers")
