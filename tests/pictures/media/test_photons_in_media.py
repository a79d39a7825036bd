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
from clpt.scene.lights import Area, Constant, Point
from clpt.scene.shapes import Cube, Shape, Sphere
from tests.pictures.media.test_fog_light import FOGS, LAMP, room
from tests.pictures.support import assert_agree, assert_mean, blocks, exposures, pictures_of_parts
from tests.pictures.transport.test_hybrid import narrow
from tests.pictures.transport.test_vcm import (
    HEIGHT,
    WATER,
    flat_pool,
    flat_pool_irradiance,
    transmitted,
)

DEEP = 2.0  # the sea [m]
SCATTERED, ABSORBED = 0.8, 0.4  # [1/m]


def sea(mode: str = "rgb", **integrator: Any) -> Scene:
    """Water that scatters, in the light of a point above: no path from the camera finds that."""
    water = media.Homogeneous(sigma_s=SCATTERED, sigma_a=ABSORBED)
    box = tf.translate([0.0, -DEEP / 2.0, 0.0]) @ tf.scale([4.0, DEEP / 2.0, 4.0])
    body = Cube(to_world=box, material=m.Dielectric(int_ior=WATER), interior=water)
    return dataclasses.replace(
        flat_pool(mode),
        shapes=[body],
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


@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_a_point_seen_in_water(mode: str) -> None:
    """Light scattered once in a sea, in by refraction and out by it: 1 %."""
    made = exposures(sea(mode, radius=0.05), 8, 64, device=narrow())
    expected = sea_radiance()
    if mode == "spectral":
        made = made[..., 1:2] / made[..., 1].mean() * expected.mean()  # the formula has no colours
    assert_mean(blocks(made, 8), expected.mean(), 0.01)
    assert_agree(blocks(made[..., :1]), blocks(expected[None, :, :, None]), mode, allowed=0.01)
