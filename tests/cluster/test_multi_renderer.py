"""Several devices take the samples that one would, to the bit, whatever fails.

Films of devices that work are proved in test_film_algebra.py.
"""

from __future__ import annotations

import dataclasses
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pyopencl as cl
import pytest

import clpt
from clpt import device as dev
from clpt.cluster import crew
from clpt.device.stream import Stream
from clpt.errors import ClusterError, DeviceError, SceneError
from clpt.scene import Scene
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.motion import Shutter
from tests.pictures.support import with_film

SPP = 12
SIZE = {"width": 26, "height": 18}
NOISE = 0.12

Fault = Callable[[], None]


def small(scenes: Path, kind: str = "path") -> Scene:
    scene = with_film(clpt.load(scenes / "cornell.xml"), mode="rgb", **SIZE)
    if kind == "light_paths":
        scene = dataclasses.replace(scene, integrator=PathIntegrator(light_paths=1.0))
    return scene


def same(a: clpt.FilmState, b: clpt.FilmState) -> bool:
    equal = np.array_equal(a.words, b.words) and np.array_equal(a.bands, b.bands)
    return equal and a.taken == b.taken


@pytest.fixture
def pair() -> list[dev.Device]:
    """Two queues on one device, in one context, so that programs are built once."""
    return [dev.choose(), dev.choose()]


@pytest.fixture
def faults(monkeypatch) -> dict[cl.CommandQueue, Fault]:
    """What happens before each command, by its queue."""
    found: dict[cl.CommandQueue, Fault] = {}
    run, other = Stream.run, Stream._enqueue

    def checked(method):
        def command(self, *args, **named):
            if self.queue in found:
                found[self.queue]()
            return method(self, *args, **named)

        return command

    monkeypatch.setattr(Stream, "run", checked(run))
    monkeypatch.setattr(Stream, "_enqueue", checked(other))
    return found


class FailsAfter:
    """Refuses every command after the first `commands`, as a driver does that was reset."""

    def __init__(self, commands: int):
        self.left = commands

    def __call__(self) -> None:
        self.left -= 1
        if self.left < 0:
            raise cl.RuntimeError("clEnqueueNDRangeKernel failed: DEVICE_NOT_AVAILABLE")


def slow() -> None:
    """What makes a device slow."""
    time.sleep(0.002)


@pytest.fixture(scope="module")
def scene(scenes: Path) -> Scene:
    return small(scenes)


@pytest.fixture(scope="module")
def whole(scene: Scene) -> clpt.FilmState:
    """The film of one renderer."""
    with clpt.Renderer(scene) as renderer:
        renderer.run(SPP)
        return renderer.film_state()


def test_parts_of_a_processor(scene, whole):
    """Devices with contexts of their own."""
    info = dev.choose().info
    counts = [cl.device_partition_property.BY_COUNTS, 1, 1, 0]
    if info.compute_units < 2:
        pytest.skip("a processor of one core has no parts")
    try:
        parts = info.cl_device.create_sub_devices(counts)
    except cl.Error as error:
        pytest.skip(f"the driver has no parts of a device: {error}")
    devices = [
        dev.Device.open(dataclasses.replace(info, cl_device=part, compute_units=1))
        for part in parts
    ]
    with clpt.MultiRenderer(scene, devices) as several:
        several.run(SPP)
        assert same(several.film_state(), whole)
        assert [share.name[-3:] for share in several.shares] == [" #1", " #2"]
        assert sum(share.share for share in several.shares) == pytest.approx(1.0)


def test_a_slow_device_takes_fewer_samples(scene, whole, pair, faults):
    faults[pair[1].queue] = lambda: time.sleep(0.05)
    with clpt.MultiRenderer(scene, pair) as several:
        several.run(200)
        fast, slow = several.shares
        assert slow.share < fast.share and slow.failure is None
        with clpt.Renderer(scene) as one:
            one.run(200)
            assert same(several.film_state(), one.film_state())


def commands_of(scene: Scene, device: dev.Device, faults) -> int:
    """How many commands a device gets until it is ready."""
    count = [0]

    def note() -> None:
        count[0] += 1

    faults[device.queue] = note
    clpt.MultiRenderer(scene, [device]).close()
    return count[0]


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("when", ["start", "first", "middle", "end"])
def test_a_device_that_fails_is_replaced(scene, whole, pair, faults, caplog, which, when):
    other = dev.choose()
    ready = commands_of(scene, other, faults)
    after = {
        "start": ready // 2, "first": ready, "middle": ready + 12, "end": None
    }[when]  # fmt: skip
    faults[pair[1 - which].queue] = slow  # so that the other one gets its blocks
    if after is not None:
        faults[pair[which].queue] = FailsAfter(after)
    with clpt.MultiRenderer(scene, pair) as several:
        assert several.run(SPP // 2)
        if when == "end":  # its film cannot be read
            faults[pair[which].queue] = FailsAfter(0)
        assert several.run(SPP - SPP // 2)
        assert same(several.film_state(), whole)
        assert len(several.devices) == 1
        assert "failed and is left out" in several.warnings[-1]
        logged = sum("left out" in record.message for record in caplog.records)
        assert logged == (when != "start")
        with clpt.Renderer(scene) as one:
            one.run(SPP)
            np.testing.assert_array_equal(several.image(), one.image())


def test_a_film_that_cannot_be_read_is_taken_again(scene, whole, pair, faults):
    with clpt.MultiRenderer(scene, pair) as several:
        several.run(SPP)
        faults[pair[0].queue] = FailsAfter(0)
        image = several.image()
        assert len(several.devices) == 1 and same(several.film_state(), whole)
        with clpt.Renderer(scene) as one:
            one.run(SPP)
            np.testing.assert_array_equal(image, one.image())


def test_random_failures_change_nothing(scene, whole, faults):
    random, left = np.random.default_rng(5), []
    for _ in range(8):
        devices = [dev.choose() for _ in range(3)]
        with clpt.MultiRenderer(scene, devices) as several:
            for device in devices[:2]:
                faults[device.queue] = FailsAfter(int(random.integers(30)))
            faults[devices[2].queue] = slow
            for samples in (1, 4, 7):
                assert several.run(samples)
            assert same(several.film_state(), whole)
            left.append(len(several.devices))
    assert min(left) == 1


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["path", "light_paths"])
@pytest.mark.parametrize("which", [0, 1])
def test_failures_with_noise(scenes, faults, kind, which):
    """The first device decides; another one only takes samples."""
    scene = small(scenes, kind)
    with clpt.Renderer(scene) as one:
        for samples in (30, 300):
            one.run(samples, noise=NOISE)
        state, image = one.film_state(), one.image()
    for commands in (0, 3, 25, 60, 120)[: 5 - 2 * which]:
        devices = [dev.choose() for _ in range(2)]
        with clpt.MultiRenderer(scene, devices) as several:
            faults[devices[which].queue] = FailsAfter(commands)
            faults[devices[1 - which].queue] = slow
            for samples in (30, 300):
                assert several.run(samples, noise=NOISE)
            assert same(several.film_state(), state)
            assert several.devices == (devices[1 - which],)
            np.testing.assert_array_equal(several.image(), image)


def test_the_last_device_fails(scene, whole, pair, faults, monkeypatch):
    monkeypatch.setattr(crew, "SAVE_SECONDS", 0.0)
    with clpt.MultiRenderer(scene, pair) as several:
        several.run(4)
        before = several.film_state()
        for device in pair:
            faults[device.queue] = FailsAfter(60)
        with pytest.raises(ClusterError, match=r"no device is left.*DEVICE_NOT_AVAILABLE"):
            several.run(1000)
        kept = several.film_state()
        assert kept.taken and kept.taken[0][1] >= before.taken[0][1]
        count = sum(end - first for first, end in kept.taken)
        assert (kept.samples == count).all()
        with pytest.raises(ClusterError):
            several.image()
    with clpt.Renderer(scene) as later:  # it goes on where those ended
        later.merge(kept)
        assert later.samples == kept.taken[-1][1]


def test_all_devices_fail_at_once(scene, pair, faults):
    for device in pair:
        faults[device.queue] = FailsAfter(3)
    with pytest.raises((DeviceError, cl.Error)):
        clpt.MultiRenderer(scene, pair)


def test_a_stop_leaves_a_whole_film(scene, pair):
    with clpt.MultiRenderer(scene, pair) as several:
        assert not several.run(100_000, lambda progress: progress.samples < 8)
        state = several.film_state()
        ranges = np.array(state.taken)
        assert 0 < state.samples.max() <= (ranges[:, 1] - ranges[:, 0]).sum() < 100_000
        first = several.samples
        assert first == state.taken[-1][1]
        assert several.run(2) and several.samples == first + 2
        threading.Timer(0.3, several.cancel).start()
        assert not several.run(10**6)
        several.cancel()
        assert not several.run(1)


def test_what_progress_raises_is_raised(scene, pair):
    def fail(progress: clpt.Progress) -> None:
        raise KeyError("here")

    with clpt.MultiRenderer(scene, pair) as several:
        with pytest.raises(KeyError, match="here"):
            several.run(1000, fail)
        with pytest.raises(DeviceError, match="at work"):
            several.run(1000, lambda progress: several.image() is None)


@pytest.mark.parametrize("kind", ["path", "light_paths"])
@pytest.mark.parametrize("noise", [None, NOISE])
def test_a_device_fails_after_a_film_was_loaded(scenes, tmp_path, pair, faults, kind, noise):
    scene, path = small(scenes, kind), tmp_path / "a.film"

    with clpt.Renderer(scene) as one:
        one.run(20, noise=noise)
        one.save_state(path)
        one.run(100, noise=noise)
        state = one.film_state()
    with clpt.MultiRenderer(scene, pair) as several:
        several.load_state(path)
        several.run(5, noise=noise)
        faults[pair[0].queue] = FailsAfter(0)
        several.run(95, noise=noise)
        assert same(several.film_state(), state) and len(several.devices) == 1
        assert len(several.saved_film().sessions) == 2
    other = with_film(scene, exposure=2.0)
    several = clpt.MultiRenderer(other, pair[1:])
    with several, pytest.raises(SceneError, match=r"film\.exposure"):
        several.load_state(path)


def test_updates_reach_all_devices(scene, pair):
    """The scene changes in each of the three ways, and twice by the key of the first scene."""
    shape = scene.shapes[0]
    moved, further = np.eye(4), np.eye(4)
    moved[:3, 3], further[:3, 3] = (0.1, 0.2, 0.0), (0.2, -0.1, 0.1)
    camera = dataclasses.replace(scene.camera, fov=30.0)
    brighter = dataclasses.replace(scene, shapes=scene.shapes[1:])
    changes = (
        {"camera": camera}, {"transforms": {shape: moved}}, {"transforms": {0: further}},
        {"scene": brighter},
    )  # fmt: skip
    with clpt.Renderer(scene) as one, clpt.MultiRenderer(scene, pair) as several:
        for change in changes:
            several.run(2)
            one.update(**change)
            several.update(**change)
            assert several.samples == 0
            one.run(4)
            several.run(4)
            assert same(several.film_state(), one.film_state()), change
            assert several.counts.samples == one.counts.samples
        several.update(transforms={several.scene.shapes[0]: moved})
        several.reset(seed=5)
        one.reset(seed=5).wait()
        assert several.scene.seed == 5
        with pytest.raises(SceneError, match="no shape"):
            several.update(transforms={99: moved})
        assert len(several.devices) == 2


@pytest.mark.slow
def test_updates_with_motion_reach_all_devices(scene, pair):
    place = np.eye(4)
    place[:3, 3] = (0.1, 0.2, 0.0)
    still = next(i for i, shape in enumerate(scene.shapes) if shape.emission is None)
    scene = dataclasses.replace(
        scene, camera=dataclasses.replace(scene.camera, shutter=Shutter(0.0, 1.0))
    )
    with clpt.Renderer(scene) as one, clpt.MultiRenderer(scene, pair) as several:
        for changed in (one, several):
            changed.update(transforms={still: place}, motion=True)
            changed.run(4)
        assert one._wavefront.features.motion.parts
        assert same(several.film_state(), one.film_state())


def test_what_makes_no_sense(scene, pair):
    with pytest.raises(DeviceError, match="a queue is of one device"):
        clpt.MultiRenderer(scene, pair, queue=pair[0].queue)
    with pytest.raises(DeviceError, match="named twice"):
        clpt.MultiRenderer(scene, "0,0")
    with pytest.raises(DeviceError, match="at least one"):
        clpt.MultiRenderer(scene, [])
    with pytest.raises(DeviceError, match="there is"):
        clpt.MultiRenderer(scene, "0,nowhere")
    with pytest.raises(TypeError, match=r"clpt\.load"):
        clpt.MultiRenderer("scene.json", pair)
    renderer = clpt.MultiRenderer(scene, pair)
    renderer.close()
    with pytest.raises(DeviceError, match="closed"):
        renderer.run(1)


def test_all_devices_are_chosen_by_name():
    everything = dev.choose_all("all")
    assert everything
    processors = [device for device in everything if device.info.is_cpu]
    assert len(processors) <= 1  # runtimes of one processor are one device
    if not any(info.kind == "gpu" for info in dev.devices()):
        with pytest.raises(DeviceError, match="no GPU works"):
            dev.choose_all("gpu")
    assert dev.names_several("all") and dev.names_several("0,1")
    assert not dev.names_several("0") and not dev.names_several(None)


@pytest.fixture(autouse=True)
def quick_blocks(monkeypatch) -> Iterator[None]:
    """Blocks of few samples, so that small pictures have many."""
    monkeypatch.setattr(crew, "BLOCK_SECONDS", 0.005)
    yield


@pytest.mark.parametrize("noise", [None, NOISE])
@pytest.mark.parametrize("when", ["never", "before", "after", "in a run"])
def test_films_are_held_on_their_devices(scene, pair, faults, monkeypatch, noise, when):
    """Nothing goes to the host before it is asked for; a device that fails is made up for.

    With noise the host has the film after each run: no device can take a part of it away.
    """
    with clpt.Renderer(scene) as one:
        one.run(20, noise=noise)
        state = one.film_state()
    with clpt.MultiRenderer(scene, pair) as several:
        several.run(20, noise=noise)
        workers = several._maker.crew.workers
        assert noise is None or not any(one.unsaved for one in workers)
        worked = next((one for one in workers if one.unsaved), workers[0])  # on a busy machine: any
        queue = worked.film.device.queue
        with monkeypatch.context() as patched:
            if when == "before":
                faults[queue] = FailsAfter(0)
            else:
                patched.setattr(crew.DeviceWorker, "take", None)
                patched.setattr(crew.DeviceWorker, "show", None)
            several._hold()
        if when in ("never", "in a run"):
            little = noise and 1e-4
            assert not several.run(10**6, lambda progress: progress.samples < 40, noise=little)
        if when in ("after", "in a run"):
            faults[queue] = FailsAfter(0)
        if when == "in a run" and noise is None:
            with pytest.raises(SceneError, match="had a part of the film"):
                several.saved_film(held=True)
            return
        saved = several.saved_film(held=True)
        assert same(saved.film, state) and saved.counts["samples"] >= state.samples.sum()
        assert several.saved_film(held=True) is saved
        assert len(several.devices) == (2 if when == "never" or noise else 1)
