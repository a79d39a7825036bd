"""Light of a disk at infinity: the penumbra of an edge, and every integrator's picture of it."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene import integrators as methods
from clpt.scene import materials as m
from clpt.scene.cameras import Orthographic, Perspective
from clpt.scene.lights import Directional
from clpt.scene.shapes import Rectangle, Sphere
from tests.pictures.support import assert_agree, blocks, exposures

WIDTH = 16  # pixels over 2 m
INTEGRATORS = {
    "path": methods.Path(max_depth=3),
    "light_paths": methods.Path(max_depth=3, light_paths=1),
    "particle_tracer": methods.ParticleTracer(max_depth=3),
    "vcm": methods.Vcm(max_depth=3),
}


def floor(sun: Directional, *more: Rectangle | Sphere) -> Scene:
    """A grey floor, 2 m of it in the picture, seen from below the things above it."""
    eye = tf.look_at([0, 0, 0.5], [0, 0, 0], [0, 1, 0])
    return Scene(
        camera=Orthographic(to_world=eye),
        film=Film(width=WIDTH, height=4, mode="rgb"),
        shapes=[Rectangle(to_world=tf.scale(3.0), material=m.Diffuse(reflectance=0.5)), *more],
        lights=[sun],
        integrator=methods.Path(max_depth=2),
    )


def seen_share(x: np.ndarray, half: float) -> np.ndarray:
    """The share of a disk's irradiance on the floor at x from below an edge 1 m above it.

    half: of the angle of the disk [rad], which is in the zenith. Directions are even over its solid
    angle. What lies on the side of negative x is covered.
    """
    cosines = 1.0 - (np.arange(400) + 0.5) / 400 * (1.0 - math.cos(half))
    phi = 2.0 * math.pi * (np.arange(800) + 0.5) / 800
    slope = np.sqrt(1.0 / cosines**2 - 1.0)[:, None] * np.cos(phi)
    weight = np.broadcast_to(cosines[:, None], slope.shape)
    return np.array([(weight * (at + slope > 0.0)).sum() / weight.sum() for at in x])


@pytest.mark.parametrize("angle", [0.0, 20.0, 60.0])
def test_the_penumbra_of_an_edge(angle: float) -> None:
    """Within 4 standard errors of the columns' means; the floor in full light has E albedo / pi."""
    edge = Rectangle(
        to_world=tf.translate([-2.0, 0.0, 1.0]) @ tf.scale([2.0, 4.0, 1.0]),
        material=m.Diffuse(reflectance=0.0),
    )
    sun = Directional(direction=(0.0, 0.0, -1.0), irradiance=math.pi, angle=angle)
    picture = exposures(floor(sun, edge), 1, 1024, first_seed=3)[0, ..., 1]
    fine = (np.arange(WIDTH * 16) + 0.5) / (WIDTH * 8) - 1.0
    columns = picture.mean(axis=0)
    columns = columns if columns[-1] > columns[0] else columns[::-1]
    if angle == 0.0:
        assert columns == pytest.approx(np.where(np.arange(WIDTH) < WIDTH // 2, 0.0, 0.5), abs=1e-5)
        return
    expected = 0.5 * seen_share(fine, math.radians(angle / 2.0)).reshape(WIDTH, 16).mean(axis=1)
    error = 0.25 / math.sqrt(4 * 1024)  # at most: each sample is 0 or about .5
    assert np.abs(columns - expected).max() < 4.0 * error
    assert 0.05 < columns[WIDTH // 2] < 0.45


@pytest.mark.slow
@pytest.mark.parametrize("name", INTEGRATORS)
def test_integrators_agree(name: str) -> None:
    sun = Directional(direction=(0.3, 0.1, -1.0), irradiance=(3.0, 2.0, 1.0), angle=25.0)
    ball = Sphere(center=(0.2, 0.0, 1.5), radius=0.4, material=m.Diffuse(reflectance=0.8))
    view = Perspective(to_world=tf.look_at([0, 0, 1], [0, 0, 0], [0, 1, 0]), fov=90.0)
    scene = dataclasses.replace(floor(sun, ball), camera=view, integrator=INTEGRATORS[name])
    base = dataclasses.replace(scene, integrator=INTEGRATORS["path"])
    reference = blocks(exposures(base, 8, 256, first_seed=100))
    assert_agree(blocks(exposures(scene, 16, 512)), reference)
