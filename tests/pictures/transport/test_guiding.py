"""`path` with guiding makes the picture of `path`, with less noise where light comes by few ways.

Means over blocks are compared; see tests/pictures/support.py for the significance.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.render.transport import light_caches
from clpt.scene import Film, Scene, media, phases
from clpt.scene import materials as m
from clpt.scene.cameras import Orthographic, Perspective
from clpt.scene.integrators import Gaussian, Path
from clpt.scene.lights import Constant, Point
from clpt.scene.shapes import Cube, Rectangle, Shape, Sphere
from tests.pictures.media.test_fog_light import CHROMATIC, FOGS, GLASS, LAMP, SPOT, room
from tests.pictures.support import assert_agree, assert_mean, blocks, exposures, quick, with_film
from tests.pictures.transport.test_hybrid import caustic, corner, lamp, narrow
from tests.pictures.transport.test_light_tracing import LIGHTS, UP

QUICK = ("sphere",)
MATERIALS = (
    m.Diffuse(reflectance=(0.7, 0.5, 0.3)),
    m.Plastic(),
    m.RoughPlastic(),
    m.Conductor(),
    m.Dielectric(),
    m.RoughConductor(alpha_u=0.3, alpha_v=0.3),
    m.Blend(first=m.Diffuse(), second=m.Conductor(), weight=0.5),
    m.TwoSided(front=m.Diffuse()),
    m.Phong(),
    m.CoatedConductor(),
    m.RoughDielectric(),
    m.Principled(roughness=0.4, metallic=0.3, clearcoat=0.5),
    m.PrincipledThin(roughness=0.4, diff_trans=0.6),
    m.DiffuseTransmission(),
    m.GltfSurface(roughness=0.4),
)


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """It learns from few light paths: no mean depends on them."""
    monkeypatch.setattr(light_caches, "GUIDE_PATHS", 1 << 12)


def guided(scene: Scene, **changes: Any) -> Scene:
    return dataclasses.replace(scene, integrator=Path(guiding=True, light_paths=0, **changes))


def both(scene: Scene, spp: int, what: str, **integrator: Any) -> None:
    """Compare `path` with and without guiding on a scene."""
    alone = dataclasses.replace(scene, integrator=Path(light_paths=0, **integrator))
    reference = blocks(exposures(alone, 12, spp, device=narrow()))
    made = exposures(guided(scene, **integrator), 12, spp, first_seed=101, device=narrow())
    assert_agree(blocks(made), reference, what)


@pytest.mark.parametrize("kind", quick(LIGHTS, *QUICK))
def test_every_light(kind: str) -> None:
    both(corner({kind: LIGHTS[kind]}), 256, kind, max_depth=6)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("material", MATERIALS, ids=lambda material: material.kind)
def test_every_material(material: m.Material, mode: str) -> None:
    ball = Sphere(center=(0.2, 0.4, 0.2), radius=0.4, material=material)
    scene = corner({}, lamp(), ball, mode=mode)
    both(scene, 512, material.kind, max_depth=-1, rr_depth=2)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("fog", FOGS)
def test_every_medium(fog: str, mode: str) -> None:
    """Directions at collisions are guided too, along with those of the floor."""
    both(room(FOGS[fog], SPOT, mode=mode), 64, fog, max_depth=6)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize(
    "phase", [phases.Rayleigh(), phases.Draine(g=0.3, alpha=2.0), phases.Blend(weight=0.3)]
)
def test_phase_functions(phase: phases.Phase, mode: str) -> None:
    fog = media.Homogeneous(sigma_s=CHROMATIC, phase=phase)
    both(room(fog, LAMP, inside=True, mode=mode), 128, phase.kind, max_depth=-1, rr_depth=2)


@pytest.mark.slow
def test_a_ball_of_glass_in_fog() -> None:
    fog = FOGS["chromatic"]
    ball = Sphere(radius=0.3, material=GLASS, exterior=fog)
    both(room(fog, LAMP, ball), 256, "glass in fog", max_depth=-1, rr_depth=2)


def test_where_no_light_path_can_start() -> None:
    """It is left aside, and that is told."""
    wall = Rectangle(material=m.Null(), interior=FOGS["grey"], name="wall")
    made = lower(guided(room(FOGS["grey"], SPOT, wall)))
    assert not made.features.transport.guided
    assert any("guiding: left aside, as " in one for one in made.warnings)


@pytest.mark.slow
def test_a_camera_that_cannot_be_joined() -> None:
    both(dataclasses.replace(corner({}, lamp()), camera=Orthographic()), 128, "orthographic")


@pytest.mark.slow
def test_furnace() -> None:
    """What absorbs nothing is as bright as the sky around it."""
    white = m.Diffuse(reflectance=1.0)
    shapes: list[Shape] = [Sphere(radius=0.5, material=white)]
    shapes += [Cube(to_world=tf.translate([0.8, 0, 0]) @ tf.scale(0.2), material=white)]
    scene = Scene(
        camera=Perspective(to_world=tf.look_at([0, 0, 3], [0, 0, 0], UP), fov=50),
        shapes=shapes,
        lights=[Constant(radiance=(1.0, 1.0, 1.0))],
        film=Film(width=8, height=8, mode="rgb"),
    )
    made = exposures(guided(scene, max_depth=-1), 12, 256, device=narrow())
    assert_mean(made, (1.0, 1.0, 1.0), 2e-3, 1e-3)


def slit(fog: media.Medium | None = None) -> Scene:
    """A room that is lit from the next one, through a slit of a sixteenth of the wall."""
    room = Cube(flip_normals=True, material=m.Diffuse(reflectance=0.7))
    turn = tf.rotate([0, 1, 0], 90) @ tf.scale([15.0 / 16.0, 1.0, 1.0])
    wall = Rectangle(
        to_world=tf.translate([0.0, 0.0, 1.0 / 16.0]) @ turn,
        material=m.TwoSided(front=m.Diffuse(reflectance=0.7)),
    )
    haze = [Cube(to_world=tf.scale(1.01), material=m.Null(), interior=fog)] if fog else []
    eye = tf.look_at([-0.9, 0.0, 0.9], [-0.4, -0.2, -0.9], UP)
    return Scene(
        camera=Perspective(to_world=eye, fov=60, medium=fog),
        shapes=[room, wall, *haze],
        lights=[Point(position=(0.8, 0.5, 0.8))],
        film=Film(width=16, height=16, mode="rgb"),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fog", "most"), [(None, 0.5), (media.Homogeneous(sigma_s=0.5), 0.8)], ids=["clear", "fog"]
)
def test_noise_falls_where_light_comes_through_a_slit(
    monkeypatch: pytest.MonkeyPatch, fog: media.Medium | None, most: float
) -> None:
    """Seventeen exposures of each: that their variances differ by chance as much has a probability
    below 1e-6, by the F distribution of a few hundred pixels' means."""
    monkeypatch.setattr(light_caches, "GUIDE_PATHS", 1 << 18)
    noise = []
    for integrator in (Path(light_paths=0), Path(light_paths=0, guiding=True)):
        scene = dataclasses.replace(slit(fog), integrator=integrator)
        made = exposures(scene, 17, 64, device=narrow())
        noise.append(np.median(made.var(axis=0, ddof=1) / made.mean(axis=0) ** 2))
    assert noise[1] < most * noise[0], noise


def picture(scene: Scene, *runs: int, **options: Any) -> np.ndarray:
    renderer = clpt.Renderer(scene, narrow(), **options)
    for samples in runs:
        renderer.run(samples)
    return renderer.image()


@pytest.mark.slow
def test_same_bits_however_samples_are_split() -> None:
    """Runs, slots, steps, stages that the host enqueues, films that are merged."""
    scene = guided(caustic(filter=Gaussian()))
    whole = picture(scene, 7)
    assert np.array_equal(picture(scene, 3, 4), whole)
    assert np.array_equal(picture(scene, 7, slots=128), whole)
    assert np.array_equal(picture(scene, 7, looped=False), whole)
    renderer = clpt.Renderer(scene, narrow())
    for samples in (5, 2):
        event = renderer.step(samples)
    event.wait()
    assert np.array_equal(renderer.film.get()[..., :3], whole)
    renderer.reset()
    renderer.run(7)
    assert np.array_equal(renderer.image(), whole)
    parts = [clpt.Renderer(scene, narrow(), first_sample=first) for first in (0, 3)]
    for part, samples in zip(parts, (3, 4), strict=True):
        part.run(samples)
    parts[0].merge(parts[1].film_state())
    assert np.array_equal(parts[0].image(), whole)


def test_same_bits_in_fog() -> None:
    scene = guided(room(FOGS["chromatic"], SPOT), max_depth=6)
    whole = picture(scene, 7)
    assert np.array_equal(picture(scene, 3, 4), whole)
    assert np.array_equal(picture(scene, 7, slots=128), whole)


@pytest.mark.slow
def test_a_crop_has_the_bits_of_the_whole() -> None:
    """A guide learns from the same light paths whatever the film is."""
    scene = guided(caustic())
    part = picture(with_film(scene, crop=(3, 2, 7, 5)), 4)
    assert np.array_equal(part, picture(scene, 4)[2:7, 3:10])


def test_what_is_counted_is_the_cameras() -> None:
    renderer = clpt.Renderer(guided(caustic()), narrow())
    renderer.run(3)
    assert renderer._wavefront.counts.samples == 3 * 16 * 12


def test_update_learns_again() -> None:
    scene = guided(caustic())
    renderer = clpt.Renderer(scene, narrow())
    renderer.run(2)
    shapes = [dataclasses.replace(scene.shapes[0], material=m.Plastic()), *scene.shapes[1:]]
    turned = dataclasses.replace(scene, shapes=shapes)
    renderer.update(scene=turned)
    renderer.run(3)
    assert np.array_equal(renderer.image(), picture(turned, 3))
    alone = dataclasses.replace(turned, integrator=Path(light_paths=0))
    renderer.update(scene=alone)
    renderer.run(3)
    assert np.array_equal(renderer.image(), picture(alone, 3))


def test_it_is_without_light_paths() -> None:
    with pytest.raises(SceneError, match="ask for no light_paths"):
        Path(guiding=True, light_paths=1)
    made = lower(dataclasses.replace(caustic(), integrator=Path(guiding=True, max_depth=5)))
    assert made.features.transport.guided and not made.features.transport.weighed
    assert made.settings["max_depth"] == 5 and made.reason == "directions are guided"
