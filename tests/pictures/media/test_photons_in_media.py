"""Photons in media: light that is gathered along rays, with a formula, and beside `path`.

Significance as in tests/pictures/support.py.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.scene import Film, Scene, media, phases
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective, Spherical
from clpt.scene.integrators import Path, Vcm
from clpt.scene.lights import Constant, Spot
from clpt.scene.shapes import Cube, Shape, Sphere
from tests.pictures.media.test_fog_light import FOGS, LAMP, room
from tests.pictures.support import assert_agree, assert_mean, blocks, exposures, pictures_of_parts
from tests.pictures.transport.test_hybrid import narrow
from tests.pictures.transport.test_vcm import (
    HEIGHT,
    INTENSITY,
    WATER,
    flat_pool,
    flat_pool_irradiance,
    transmitted,
)

DEEP = 2.0  # the sea [m]
SCATTERED, ABSORBED = 0.8, 0.4  # [1/m]


def sea(mode: str = "rgb", **integrator: Any) -> Scene:
    """Water that scatters, in the light of a spot above: no path from the camera finds that.

    In what the camera sees the spot is the point of `flat_pool`.
    """
    water = media.Homogeneous(sigma_s=SCATTERED, sigma_a=ABSORBED)
    box = tf.translate([0.0, -DEEP / 2.0, 0.0]) @ tf.scale([1.0, DEEP / 2.0, 1.0])
    body = Cube(to_world=box, material=m.Dielectric(int_ior=WATER), interior=water)
    above = tf.look_at([0.6, 1.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 1.0])
    return dataclasses.replace(
        flat_pool(mode),
        shapes=[body],
        lights=[Spot(to_world=above, intensity=INTENSITY, cutoff=42.0, beam_width=41.0)],
        integrator=Vcm(max_depth=4, light_paths=64, **integrator),
    )


def sea_radiance(samples: int = 4, steps: int = 64) -> np.ndarray:
    """What the camera sees of light that the sea has scattered once, (8, 8).

    Along the refracted ray at depth y: sigma_s / 4 pi times the flux through an area across the
    light, which is the irradiance of a floor there over its cosine; both ways are dimmed.
    """
    at = (np.arange(8 * samples) + 0.5) / (4 * samples) - 1.0
    x, z = np.meshgrid(-at, -at)
    slope, across = np.tan(np.radians(8.0)) * np.hypot(x, z), np.arctan2(z, x)
    out = np.arctan(slope)
    inside = np.arcsin(np.sin(out) / WATER)
    nodes, weights = np.polynomial.legendre.leggauss(steps)
    total, extinction = np.zeros_like(out), SCATTERED + ABSORBED
    for node, weight in zip(nodes, weights, strict=True):
        y = DEEP * (node + 1.0) / 2.0
        far = HEIGHT * np.tan(out) + y * np.tan(inside)
        irradiance, cosine = flat_pool_irradiance(far * np.cos(across), far * np.sin(across), y)
        dims = np.exp(-extinction * y * (1.0 / np.cos(inside) + 1.0 / cosine))
        total += weight * DEEP / 2.0 / np.cos(inside) * irradiance / cosine * dims
    seen = SCATTERED / (4.0 * np.pi) * total * transmitted(out) / WATER**2
    return seen.reshape(8, samples, 8, samples).mean(axis=(1, 3))


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_a_point_seen_in_water(mode: str) -> None:
    """Light scattered once in a sea, in by refraction and out by it: 1 %."""
    made = exposures(sea(mode, radius=0.1), 8, 64, device=narrow())
    expected = sea_radiance()
    if mode == "spectral":
        made = made[..., 1:2] / made[..., 1].mean() * expected.mean()  # the formula has no colours
    assert_mean(blocks(made, 8), expected.mean(), 0.01)
    assert_agree(blocks(made[..., :1]), blocks(expected[None, :, :, None]), mode, allowed=0.01)


@pytest.mark.slow
def test_a_sea_without_end_that_keeps_no_red() -> None:
    """Its green is that of a sea that is the same for all light: 1 %, and as little noise."""
    scene, deep = sea(radius=0.1), 1e4
    box = tf.translate([0.0, -deep / 2.0, 0.0]) @ tf.scale([deep, deep / 2.0, deep])
    means = []
    for red in (1.0, 0.0):
        scattered, absorbed = (tuple(n * c for c in (red, 1, 1)) for n in (SCATTERED, ABSORBED))
        water = media.Homogeneous(sigma_s=scattered, sigma_a=absorbed)
        body = dataclasses.replace(scene.shapes[0], to_world=box, interior=water)
        made = exposures(dataclasses.replace(scene, shapes=[body]), 8, 64, device=narrow())
        means.append(made[..., 1].mean(axis=(1, 2)))
    grey, green = means
    assert green.std() < 4.0 * grey.std()
    assert green.mean() == pytest.approx(grey.mean(), rel=0.01)


BALL_OF = {
    "grey": FOGS["grey"],
    "chromatic": FOGS["chromatic"],
    "blend": media.Homogeneous(sigma_s=2.0, phase=phases.Blend(weight=0.3)),
    "grid": FOGS["grid"],
}


def ball(medium: media.Medium, mode: str = "rgb", *more: Shape) -> Scene:
    """A ball of a medium in smooth glass, in haze that is lit by a lamp, before a floor."""
    haze = media.Homogeneous(sigma_s=0.3)
    glass = m.Dielectric(int_ior=1.4)
    one = Sphere(radius=0.5, material=glass, interior=medium, exterior=haze, name="ball")
    large = dataclasses.replace(LAMP, center=(0.2, 0.75, 0.1), radius=0.2)
    return room(haze, large, one, *more, mode=mode)


def agrees(scene: Scene, what: str, spp: int, **changes: Any) -> None:
    """Means of blocks are those of `path` alone, beside chance and 2 % of blur."""
    alone = dataclasses.replace(scene, integrator=Path(max_depth=6, light_paths=0))
    merged = dataclasses.replace(
        scene, integrator=Vcm(**{"max_depth": 6, "light_paths": 4, "radius": 0.03, **changes})
    )
    reference = blocks(exposures(alone, 12, 8 * spp, device=narrow()), 8)
    ours = blocks(exposures(merged, 12, spp, first_seed=101, device=narrow()), 8)
    assert_agree(ours, reference, what, allowed=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
@pytest.mark.parametrize("medium", BALL_OF)
def test_beside_paths(medium: str, mode: str) -> None:
    """Collisions in a ball of glass, seen through it. Grids and blends have no photons."""
    agrees(ball(BALL_OF[medium], mode), f"{medium} {mode}", 64)


@pytest.mark.slow
def test_a_camera_that_no_light_path_is_joined_to() -> None:
    """From within a medium: its rays gather from their beginning on."""
    scene = ball(FOGS["chromatic"])
    scene.camera = Spherical(to_world=tf.look_at([0, 0.3, 0.9], [0, 0, 0], [0, 1, 0]))
    agrees(scene, "spherical", 64)


@pytest.mark.slow
@pytest.mark.parametrize("light_tracing", [True, False])
def test_furnace(light_tracing: bool) -> None:
    """What scatters all light cannot be seen under the same light from everywhere: 1 %."""
    glass = m.Dielectric(int_ior=1.3)
    fog = media.Homogeneous(sigma_s=(0.5, 1.5, 3.0), phase=phases.HenyeyGreenstein(g=0.5))
    scene = Scene(
        camera=Perspective(fov=20.0, to_world=tf.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])),
        shapes=[Sphere(material=glass, interior=fog)],
        lights=[Constant(radiance=1.0)],
        film=Film(width=8, height=8, mode="rgb"),
        integrator=Vcm(max_depth=-1, rr_depth=1000, radius=0.1, light_tracing=light_tracing),
    )
    assert_mean(exposures(scene, 8, 64, device=narrow()), 1.0, 0.01)


@pytest.mark.slow
def test_bits() -> None:
    """Parts of a render make the same bits as a whole."""
    scene = ball(FOGS["chromatic"], "spectral")
    scene.integrator = Vcm(max_depth=5, radius=0.03)
    whole, parts = pictures_of_parts(scene)
    assert np.array_equal(whole, parts)
