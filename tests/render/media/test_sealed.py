"""Media that no ray to a light leaves: which they are, and that pictures do not change by it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.render.flow import find as analyse
from clpt.render.flow import vertices
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, lights, media, phases
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Box, Direct
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.shapes import Group, Instance, Rectangle, Shape, Sphere
from tests.pictures.support import assert_agree, blocks, exposures

MILK = media.Homogeneous(sigma_s=20.0)
ABOVE = Rectangle(
    to_world=tf.translate([0, 3, 0]) @ tf.rotate([1, 0, 0], 90), emission=lights.Area(radiance=5.0)
)
SKY = lights.Constant(radiance=0.5)


def glass(*shapes: Shape, material: m.Material | None = None, light: lights.Light = SKY) -> Scene:
    """A ball of milk under a lamp and a sky, with more around it."""
    ball = Sphere(material=material or m.Dielectric(int_ior=1.33), interior=MILK)
    return Scene(
        camera=Perspective(fov=40.0, to_world=tf.look_at([0, 1, 4], [0, 0, 0], [0, 1, 0])),
        shapes=[ball, ABOVE, *shapes],
        lights=[light],
        film=Film(width=24, height=24, filter=Box()),
        integrator=PathIntegrator(max_depth=64),
    )


SMALL = Sphere(radius=0.1, emission=lights.Area(radiance=5.0))
SCENES = {
    "glass": (glass(), True),
    "rough": (glass(material=m.RoughDielectric()), True),
    "null": (glass(material=m.Null()), False),
    "holes": (glass(material=m.Mask(opacity=0.5, material=m.Dielectric())), False),
    "lamp inside": (glass(SMALL), False),
    "lamp beside": (glass(dataclasses.replace(SMALL, center=(2.0, 0.0, 0.0))), True),
    "point": (glass(light=lights.Point(position=(0.0, 5.0, 0.0))), False),
    "outside too": (glass(Sphere(center=(5, 0, 0), exterior=MILK)), False),
    "priorities": (glass(Sphere(center=(0.5, 0, 0), material=m.Dielectric(), priority=2)), False),
}


@pytest.mark.parametrize("name", SCENES)
def test_which_are_sealed(name: str) -> None:
    scene, sealed = SCENES[name]
    assert lower(scene).features.media.sealed == sealed


def test_not_beside_light_paths() -> None:
    """These are weighed against rays to lights."""
    scene = dataclasses.replace(glass(), integrator=PathIntegrator(guiding=True, light_paths=0))
    features = lower(scene).features
    assert not (features.media.sealed and (features.transport.guided or features.transport.weighed))


@pytest.mark.slow
def test_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    """A ray to a light brings nothing where it is stopped; neither do blocks of walking paths."""
    scene = glass(material=m.RoughDielectric())
    sealed = clpt.render(scene, 4)
    stages = clpt.Renderer(scene, looped=False)
    stages.run(4)
    np.testing.assert_array_equal(stages.image(), sealed)
    monkeypatch.setattr(analyse, "sealed_media", lambda *_: frozenset())
    assert not lower(scene).features.media.sealed
    np.testing.assert_array_equal(clpt.render(scene, 4), sealed)
    assert sealed.std() > 0.01


def means(scene: Scene, seed: int) -> np.ndarray:
    """Of 32 pictures of 4 samples."""
    seeds = range(seed, seed + 32)
    return np.array([clpt.render(dataclasses.replace(scene, seed=i), 4).mean() for i in seeds])


@pytest.mark.slow
def test_a_lamp_that_moves_in_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Wherever boxes say that lamps are: what is met by chance has its whole weight.

    The significance is that of two means of 32 pictures, 4 standard errors.
    """
    scene = glass(dataclasses.replace(SMALL, radius=0.4), material=m.Null())
    plain = means(scene, 0)
    monkeypatch.setattr(analyse, "sealed_media", lambda *_: frozenset([MILK]))
    assert lower(scene).features.media.sealed
    met = means(scene, 100)
    error = np.hypot(plain.std(ddof=1), met.std(ddof=1)) / np.sqrt(32.0)
    assert abs(plain.mean() - met.mean()) < 4.0 * error


def test_rays_leave_toward_lamps_in_instances_too() -> None:
    beside = Instance(group=Group(shapes=[SMALL]), to_world=tf.translate([2.0, 0.0, 0.0]))
    assert [lower(scene).settings["aim_count"] for scene in (glass(), glass(beside))] == [1, 2]


BLEND = m.Blend(first=m.Dielectric(), second=m.Diffuse())
LEFT = {
    "smooth": (glass(), True),
    "rough": (glass(material=m.RoughDielectric()), False),
    "lamp inside": (glass(SMALL), False),
    "dispersive": (glass(material=m.Dielectric(int_ior="BK7")), False),
    "a mixture beside": (glass(Sphere(center=(4, 0, 0), material=BLEND)), False),
    "another index beside": (glass(Sphere(center=(4, 0, 0), material=m.Dielectric())), True),
    "direct light": (dataclasses.replace(glass(), integrator=Direct()), False),
}


@pytest.mark.parametrize("name", LEFT)
def test_where_rays_leave_them(name: str) -> None:
    """They go through smooth boundaries that bend all light alike, to lamps outside."""
    scene, leaves = LEFT[name]
    found = lower(scene)
    assert found.features.media.escapes == leaves
    assert bool(found.settings["aim_count"]) == leaves
    assert not found.features.transport.aimed


@pytest.mark.slow
def test_rays_that_leave_change_no_mean(monkeypatch: pytest.MonkeyPatch) -> None:
    """Blocks of pictures with and without them agree, and the former have less noise.

    One colour of the lamp's, in a body that scatters a few times; significance as in
    tests/pictures/support.py.
    """
    lamp = dataclasses.replace(SMALL, center=(1.2, 1.2, 0.3))
    scene = dataclasses.replace(glass(lamp), lights=[], spp=64)
    with_rays = blocks(exposures(scene, 24, 64))
    monkeypatch.setattr(analyse, "escape_lamps", lambda *_: np.zeros((0, 5), np.float32))
    assert not lower(scene).features.media.escapes
    without = blocks(exposures(scene, 24, 64, first_seed=1001))
    assert_agree(with_rays, without)
    assert with_rays.var(axis=0).mean() < 0.8 * without.var(axis=0).mean()


def bodies(kind: str) -> Scene:
    """Bodies beside a small lamp: one that absorbs, milk in a shell of glass, or two kinds."""
    scene = glass(dataclasses.replace(SMALL, center=(1.2, 1.2, 0.3)))
    milk, *others = scene.shapes
    integrator = PathIntegrator(max_depth=64)
    if kind == "absorbing":  # roulette ends many paths
        integrator = PathIntegrator(max_depth=64, rr_depth=1)
        milk = dataclasses.replace(milk, interior=media.Homogeneous(sigma_s=5.0, sigma_a=2.0))
    if kind == "in a shell":
        inner = m.Dielectric(int_ior=1.33, ext_ior=1.5)
        milk = dataclasses.replace(milk, material=inner, radius=0.8)
        others.append(Sphere(radius=0.9, material=m.Dielectric(int_ior=1.5)))
    if kind == "two kinds":
        milk = dataclasses.replace(milk, radius=0.5, center=(-0.6, 0.0, 0.0))
        air = media.Homogeneous(sigma_s=20.0, phase=phases.Rayleigh())
        others.append(dataclasses.replace(milk, center=(0.6, 0.0, 0.0), interior=air))
    shapes = [milk, *others]
    return dataclasses.replace(scene, shapes=shapes, lights=[], integrator=integrator)


def test_phase_functions_that_send_rays_are_shaded_alone() -> None:
    """A vertex of several kinds asks each once, and one that sends rays asks twice."""
    features = lower(bodies("two kinds")).features
    assert features.media.escapes
    for vertex in vertices.vertices(features, 8):
        phase = any(features.materials.leaves[kind].is_phase for kind in vertex.kinds)
        assert not (phase and vertex.shared)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["absorbing", "in a shell", "two kinds"])
def test_rays_that_leave_bodies_change_no_mean(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    """Of roulette, of several boundaries and of several phase functions.

    The significance is that of two means of 24 pictures, 4 standard errors.
    """
    scene = dataclasses.replace(bodies(kind), spp=128)
    with_rays = exposures(scene, 24, 128).mean(axis=(1, 2, 3))
    monkeypatch.setattr(analyse, "escape_lamps", lambda *_: np.zeros((0, 5), np.float32))
    assert not lower(scene).features.media.escapes
    without = exposures(scene, 24, 128, first_seed=1001).mean(axis=(1, 2, 3))
    error = np.hypot(with_rays.std(ddof=1), without.std(ddof=1)) / np.sqrt(24.0)
    assert abs(with_rays.mean() - without.mean()) < 4.0 * error
