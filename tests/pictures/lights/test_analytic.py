"""Pictures that a formula tells, in both modes: lights on a plane, furnaces, depths, mixtures.

Means are tested against the formula by the spread of independent exposures (see
tests/pictures/support.py for the significance), and within a stated relative bound.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Direct, Independent, Path
from clpt.scene.lights import Area, Constant, CubeMap
from clpt.scene.shapes import Rectangle, Sphere
from clpt.scene.textures import Checkerboard
from tests.pictures.builders import (
    ALBEDO,
    EXPECTED,
    RADIANCE,
    UP,
    furnace,
    lit_ground,
)
from tests.pictures.support import assert_mean, exposures

MODES = ("rgb", "spectral")
COLOUR = {"rgb": 2e-4, "spectral": 1e-3}  # what uplifting a colour may change


@pytest.mark.parametrize("kind", EXPECTED)
def test_light_on_a_plane_in_rgb(kind: str) -> None:
    assert_light(kind, "rgb")


@pytest.mark.slow
@pytest.mark.parametrize("kind", EXPECTED)
def test_light_on_a_plane_of_wavelengths(kind: str) -> None:
    assert_light(kind, "spectral")


def assert_light(kind: str, mode: str) -> None:
    """Irradiance from every kind of light, through `path`."""
    images = exposures(lit_ground(kind, mode), 24, 64)
    expected = ALBEDO / np.pi * RADIANCE * EXPECTED[kind]
    assert_mean(images, [expected] * 3, 0.01, COLOUR[mode])


@pytest.mark.parametrize("kind", ["disk", "constant"])
def test_direct_integrator(kind: str) -> None:
    images = exposures(lit_ground(kind, "rgb", Direct()), 24, 64)
    assert_mean(images, [ALBEDO / np.pi * RADIANCE * EXPECTED[kind]] * 3, 0.01)


@pytest.mark.slow
@pytest.mark.parametrize("kind", [pytest.param("sphere", marks=pytest.mark.slow), "envmap"])
def test_independent_sampler(kind: str) -> None:
    images = exposures(lit_ground(kind, "rgb", sampler=Independent()), 24, 64)
    assert_mean(images, [ALBEDO / np.pi * RADIANCE * EXPECTED[kind]] * 3, 0.02)


def replaced(scene: Scene, kind: str, **changes: object) -> Scene:
    """The scene with other parameters of its light of a kind."""
    shapes = [dataclasses.replace(s, **changes) if s.name == kind else s for s in scene.shapes]
    return dataclasses.replace(scene, shapes=shapes)


@pytest.mark.parametrize("radius", [0.001, 0.1, 0.5, 0.9])
def test_small_and_huge_sphere_lights(radius: float) -> None:
    """Tiny ones are found by sampling the light, huge ones mostly by sampling the surface."""
    scene = replaced(lit_ground("sphere", "rgb"), "sphere", radius=radius)
    assert_mean(exposures(scene, 24, 64), [ALBEDO * RADIANCE * radius**2] * 3, 0.005, 5e-4)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["rectangle", "mesh"])
def test_textured_light(kind: str) -> None:
    """Small squares by turns bright and dim shine like their mean."""
    uv = np.diag([32.0, 32.0, 1.0])
    board = Checkerboard(color0=(0.9, 0.9, 0.9), color1=(0.3, 0.3, 0.3), to_uv=uv)
    scene = replaced(lit_ground(kind, "rgb"), kind, emission=Area(radiance=board))
    if kind == "mesh":
        uvs = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
        scene = replaced(scene, kind, uvs=uvs)
    expected = ALBEDO / np.pi * 0.6 * EXPECTED[kind]
    assert_mean(exposures(scene, 24, 64), [expected] * 3, 0.02, 5e-3)


def test_light_leaves_the_front_only() -> None:
    scene = replaced(lit_ground("disk", "rgb"), "disk", flip_normals=True)
    assert exposures(scene, 2, 16).max() == 0.0


@pytest.mark.parametrize("mode", [pytest.param("rgb", marks=pytest.mark.slow), "spectral"])
@pytest.mark.parametrize("albedo", [0.0, 0.3, 0.8])
def test_sphere_in_a_furnace(albedo: float, mode: str) -> None:
    """A convex diffuse body in even light shows its albedo."""
    scene = furnace(m.Diffuse(reflectance=albedo), mode, radiance=RADIANCE)
    assert_mean(exposures(scene, 24, 16), [albedo * RADIANCE] * 3, 0.01, COLOUR[mode])


@pytest.mark.parametrize(
    ("path", "bounces"),
    [
        ({"max_depth": 1}, 0),
        ({"max_depth": 2}, 1),
        ({"max_depth": 3}, 2),
        ({"max_depth": 7, "rr_depth": 100}, 6),
        ({"max_depth": -1, "rr_depth": 2}, np.inf),
        ({"max_depth": 40, "rr_depth": 100}, np.inf),
    ],
)
def test_depth_in_a_closed_furnace(path: dict, bounces: float) -> None:
    """Inside an emitting sphere every bounce adds the last one times the albedo.

    Such a geometric series is met in its whole length, with Russian roulette and without.
    """
    scene = furnace(m.Diffuse(reflectance=ALBEDO), "rgb", closed=True, **path)
    expected = (1.0 - ALBEDO ** (bounces + 1.0)) / (1.0 - ALBEDO)
    assert_mean(exposures(scene, 16, 16), [expected] * 3, 0.01, 5e-4)


def test_hidden_lights() -> None:
    """`hide_lights` takes away what the camera sees directly, and no more."""
    scene = furnace(m.Diffuse(reflectance=ALBEDO), "rgb", max_depth=3, hide_lights=True)
    assert_mean(exposures(scene, 24, 16), [ALBEDO] * 3, 0.01, 5e-4)
    scene = furnace(m.Diffuse(), "rgb", closed=True, max_depth=3, hide_lights=True)
    assert np.abs(exposures(scene, 2, 4)).max() == 0.0  # the camera sees through a shape that emits
    scene = furnace(m.Null(), "rgb", max_depth=8, hide_lights=True)
    scene.camera = Orthographic(to_world=tf.look_at([0, 0, 4], [0, 0, 9], UP))
    assert np.abs(exposures(scene, 2, 4)).max() == 0.0


def test_lossless_bodies_in_a_furnace() -> None:
    """In even light nothing lossless can be seen: glass, thin glass, no surface, a mirror."""
    kinds = [
        m.Dielectric(int_ior=1.5, ext_ior=1.0),
        m.ThinDielectric(),
        m.Null(),
        m.Conductor(eta=0.0, k=1.0),
    ]
    balls = [
        Sphere(center=(x, y, 0.0), radius=0.45, material=kind)
        for kind, (x, y) in zip(
            kinds, [(-0.5, 0.5), (0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)], strict=True
        )
    ]
    scene = Scene(
        camera=Orthographic(to_world=tf.look_at([0, 0, 4], [0, 0, 0], UP)),
        shapes=balls,
        lights=[Constant(radiance=(1.0, 1.0, 1.0))],
        integrator=Path(max_depth=-1),
        film=Film(width=16, height=16, mode="spectral"),
    )
    images = exposures(scene, 24, 16)
    for rows in (slice(0, 8), slice(8, 16)):
        for columns in (slice(0, 8), slice(8, 16)):
            assert_mean(images[:, rows, columns], [1.0] * 3, 0.01, COLOUR["spectral"])


@pytest.mark.parametrize("mode", [pytest.param("rgb", marks=pytest.mark.slow), "spectral"])
def test_sides_and_mixtures(mode: str) -> None:
    """Masks, blends, one-sided and two-sided squares in even light, each as its formula says."""
    a, b = m.Diffuse(reflectance=0.6), m.Diffuse(reflectance=0.2)
    nested = 0.5 * 0.6 + 0.5 * (0.5 * 0.2 + 0.5)
    cases = [
        (a, False, 0.6),
        (a, True, 0.0),
        (m.TwoSided(front=a), True, 0.6),
        (m.TwoSided(front=a, back=b), False, 0.6),
        (m.TwoSided(front=a, back=b), True, 0.2),
        (m.Mask(material=a, opacity=0.25), False, 0.25 * 0.6 + 0.75),
        (m.Mask(material=a, opacity=0.25), True, 0.75),
        (m.Mask(material=m.TwoSided(front=a), opacity=0.5), True, 0.5 * 0.6 + 0.5),
        (m.TwoSided(front=m.Blend(first=a, second=b, weight=0.3)), True, 0.7 * 0.6 + 0.3 * 0.2),
        (m.Blend(first=a, second=m.Null(), weight=0.4), False, 0.6 * 0.6 + 0.4),
        (m.Blend(first=a, second=m.Mask(material=b, opacity=0.5), weight=0.5), False, nested),
        (m.Null(), False, 1.0),
    ]
    squares = [
        Rectangle(
            material=material,
            to_world=tf.translate([2.0 * i - 11.0, 0.0, 0.0])
            @ (tf.rotate([0, 1, 0], 180) if back else np.eye(4)),
        )
        for i, (material, back, _) in enumerate(cases)
    ]
    view = tf.look_at([0, 0, 4], [0, 0, 0], UP) @ tf.scale([12.0, 12.0, 1.0])
    scene = Scene(
        camera=Orthographic(to_world=view),
        shapes=squares,
        lights=[Constant(radiance=(1.0, 1.0, 1.0))],
        integrator=Path(max_depth=8),
        film=Film(width=4 * len(cases), height=4, mode=mode),
    )
    images = exposures(scene, 32, 32)
    for i, (_, _, expected) in enumerate(cases):
        assert_mean(images[:, :, 4 * i : 4 * i + 4], [expected] * 3, 0.05, COLOUR[mode])


def test_a_sky_over_a_film_that_fills_no_block_of_slots() -> None:
    """Slots without a pixel look into no direction, beside others that look into the cube map."""
    image = np.tile(np.float32([0.25, 0.5, 0.75]), (6, 4, 4, 1))
    film = Film(width=50, height=38, mode="rgb")
    scene = Scene(camera=Orthographic(), lights=[CubeMap(image=image)], film=film)
    assert np.allclose(clpt.render(scene, 4), [0.25, 0.5, 0.75], rtol=1e-5)
