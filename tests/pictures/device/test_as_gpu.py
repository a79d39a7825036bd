"""A device that says it is a GPU gets the forms for GPUs: the picture is the same."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import device as dev
from clpt import transforms as tf
from clpt.device import choosing
from clpt.render.wavefront.path_buffers import MOST_SLOTS, UNIT_SLOTS, default_slots
from clpt.scene import materials as m
from clpt.scene.integrators import Integrator, ParticleTracer, Vcm
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.shapes import Rectangle, Sphere
from tests.pictures.support import with_film
from tests.pictures.transport.test_hybrid import corner, lamp

INTEGRATORS = (PathIntegrator(light_paths=2), Vcm(), ParticleTracer())


@pytest.fixture(scope="module")
def gpu() -> dev.Device:
    """The device of all tests in disguise: with two compute units, and enough memory."""
    on = dev.choose()
    changes = {"kind": "gpu", "vendor": "any", "compute_units": 2}
    return dev.Device(on.context, on.queue, dataclasses.replace(on.info, **changes))


def test_forms(gpu: dev.Device, scenes: Path) -> None:
    """One lane, queues that are appended to, compressed nodes; in all but a few pixels the same."""
    scene = with_film(clpt.load(scenes / "instances.xml"), mode="rgb")
    renderer = clpt.Renderer(scene, gpu)
    front = renderer._wavefront
    slots, strategy = front.paths.slots, front.scene.strategy
    assert (front.lanes, strategy.layout, strategy.queued) == (1, "compact", True)
    assert UNIT_SLOTS < slots <= 2 * UNIT_SLOTS  # whole pictures
    renderer.run(2)
    image, plain = renderer.image(), clpt.render(scene, 2, slots=slots)
    off = np.abs(image - plain).max(axis=2) > 1e-3 * (1e-2 + np.abs(plain).max(axis=2))
    assert off.mean() < 0.005
    np.testing.assert_allclose(image.mean(), plain.mean(), rtol=2e-3)
    in_place = clpt.Renderer(scene, gpu, queued=False)
    in_place.run(2)
    np.testing.assert_array_equal(image, in_place.image())


@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("name", ["instances", "glass_metal"])
def test_the_order_of_rays_changes_no_bit(
    gpu: dev.Device, scenes: Path, name: str, mode: str
) -> None:
    scene = with_film(clpt.load(scenes / f"{name}.xml"), mode=mode)
    images = []
    for sorts in (False, True):
        renderer = clpt.Renderer(scene, gpu, layout="compact", sorted_rays=sorts)
        renderer.run(2)
        names = [step.name for step in renderer._wavefront.stages]
        assert ("rays_place" in names) == sorts
        images.append(renderer.image())
    np.testing.assert_array_equal(*images)


@pytest.mark.parametrize("sorts", [False, True])
def test_a_trial_during_a_render_decides_on_the_order(
    gpu: dev.Device, scenes: Path, monkeypatch: pytest.MonkeyPatch, no_trials: None, sorts: bool
) -> None:
    """Both ways are tried on the same rays; neither changes a bit."""
    scene = with_film(clpt.load(scenes / "instances.xml"), mode="rgb")
    least, trials = choosing.least_seconds, []

    def seconds(runs: list, rounds: int) -> list[float]:
        trials.append(least(runs, rounds))
        return [1.0, 0.5 if sorts else 1.5]

    monkeypatch.setattr(choosing, "least_seconds", seconds)
    images = []
    for wish in (None, None, False):
        renderer = clpt.Renderer(scene, gpu, slots=4096, sorted_rays=wish)
        renderer.run(32)
        names = [step.name for step in renderer._wavefront.stages]
        assert ("rays_place" in names) == (sorts and wish is None)
        images.append(renderer.image())
    assert len(trials) == 1 and min(trials[0]) > 0.0
    np.testing.assert_array_equal(images[0], images[2])
    np.testing.assert_array_equal(images[1], images[2])


@pytest.mark.slow
@pytest.mark.parametrize("integrator", INTEGRATORS, ids=lambda one: one.kind)
def test_forms_of_light_paths(gpu: dev.Device, integrator: Integrator) -> None:
    """The same of a caustic, seen and in a mirror."""
    ball = Sphere(center=(0.1, 0.45, 0.2), radius=0.4, material=m.Dielectric(int_ior=1.5))
    plate = tf.translate([-0.9, 0.5, -0.2]) @ tf.rotate([0, 1, 0], 60) @ tf.scale(0.5)
    mirror = Rectangle(to_world=plate, material=m.TwoSided(front=m.Conductor()))
    scene = dataclasses.replace(corner({}, lamp(0.1, 250.0), ball, mirror), integrator=integrator)
    renderer = clpt.Renderer(scene, gpu, layout="compact", queued=True)
    front = renderer._wavefront
    assert front.lanes == 1 and front.scene.strategy.queued
    renderer.run(8)
    image, plain = renderer.image(), clpt.render(scene, 8)
    off = np.abs(image - plain).max(axis=2) > 1e-2 * (1e-2 + np.abs(plain).max(axis=2))
    assert off.mean() < 0.02
    np.testing.assert_allclose(image.mean(), plain.mean(), rtol=2e-3)


def test_slots_grow_with_the_device(gpu: dev.Device) -> None:
    units = [dataclasses.replace(gpu.info, compute_units=n) for n in (1, 20, 10_000)]
    assert [*map(default_slots, units)] == [UNIT_SLOTS, 20 * UNIT_SLOTS, MOST_SLOTS]
