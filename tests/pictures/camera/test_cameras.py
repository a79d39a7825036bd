"""Cameras and pixel filters in pictures: where a small lamp appears, how an edge is blurred."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene, cameras
from clpt.scene.integrators import (
    BlackmanHarris,
    Box,
    Filter,
    Gaussian,
    Mitchell,
    Path,
    Tent,
)
from clpt.scene.lights import Area
from clpt.scene.shapes import Rectangle, Sphere
from tests.pictures.support import layers_of

WIDTH, HEIGHT = 48, 32
EYE, TARGET, LAMP = np.array([1.0, 2.0, 6.0]), np.array([0.0, 0.5, 0.0]), np.array([0.8, 1.1, -0.5])
VIEW = tf.look_at(EYE, TARGET, [0, 1, 0])
GLOW = Area(radiance=(1.0, 1.0, 1.0))


def projection(fov: float, near: float, far: float) -> np.ndarray:
    """OpenGL's perspective matrix; fov along x [degrees]."""
    f = 1.0 / np.tan(np.radians(fov) / 2.0)
    depth = near - far
    return np.array(
        [
            [f, 0, 0, 0],
            [0, f * WIDTH / HEIGHT, 0, 0],
            [0, 0, (far + near) / depth, 2 * far * near / depth],
            [0, 0, -1, 0],
        ]
    )


def pinhole(p: np.ndarray) -> tuple[float, float]:
    """Pixel of a point in camera space, 40 degrees along x."""
    half = np.tan(np.radians(20.0))
    x = 0.5 - 0.5 * p[0] / p[2] / half  # camera space has x to the left
    return x * WIDTH, (0.5 - 0.5 * p[1] / p[2] / half * WIDTH / HEIGHT) * HEIGHT


def parallel(p: np.ndarray) -> tuple[float, float]:
    x, y = p[:2] / 3.0
    return (0.5 - 0.5 * x) * WIDTH, (0.5 - 0.5 * y * WIDTH / HEIGHT) * HEIGHT


def around(p: np.ndarray) -> tuple[float, float]:
    """Pixel in a map of latitude and longitude, +z in its middle, camera's left on the left."""
    d = p / np.linalg.norm(p)
    turn = 0.5 - np.arctan2(d[0], d[2]) / (2.0 * np.pi)
    return turn * WIDTH, np.arccos(d[1]) / np.pi * HEIGHT


FLIP = np.diag([-1.0, 1.0, -1.0, 1.0])  # eye space looks along -z, with x to the right
FOCUS = float(np.linalg.norm(LAMP - EYE))
CAMERAS = {
    "perspective": (cameras.Perspective(to_world=VIEW, fov=40.0), pinhole),
    "thin_lens": (
        cameras.ThinLens(to_world=VIEW, fov=40.0, aperture_radius=0.1, focus_distance=FOCUS),
        pinhole,
    ),
    "matrix": (
        cameras.Matrix(view=FLIP @ np.linalg.inv(VIEW), projection=projection(40.0, 0.1, 50.0)),
        pinhole,
    ),
    "orthographic": (
        cameras.Orthographic(to_world=VIEW @ tf.scale([3.0, 3.0, 1.0])),
        parallel,
    ),
    "spherical": (cameras.Spherical(to_world=VIEW), around),
}


@pytest.mark.parametrize("name", CAMERAS)
def test_where_a_lamp_appears(name: str) -> None:
    """The middle of its light stands where the camera's formula puts it."""
    camera, project = CAMERAS[name]
    scene = Scene(
        camera=camera,
        shapes=[Sphere(center=LAMP, radius=0.3, emission=GLOW)],
        integrator=Path(max_depth=1),
        film=Film(width=WIDTH, height=HEIGHT, mode="rgb"),
    )
    image = clpt.render(scene, 64)[:, :, 0].astype(np.float64)
    assert image.sum() > 0.3
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH] + 0.5
    found = (columns * image).sum() / image.sum(), (rows * image).sum() / image.sum()
    expected = project((np.linalg.inv(VIEW) @ [*LAMP, 1.0])[:3])
    np.testing.assert_allclose(found, expected, atol=0.15)


EDGES = [
    Tent(), *(pytest.param(f, marks=pytest.mark.slow) for f in (Box(), Gaussian(), Mitchell())),
    pytest.param(BlackmanHarris(), marks=pytest.mark.slow),
]  # fmt: skip


@pytest.mark.parametrize("pixel_filter", EDGES)
def test_an_edge(pixel_filter: Filter) -> None:
    """A straight edge is blurred to the filter's integral: each pixel holds its part of it."""
    scene = Scene(
        camera=cameras.Orthographic(to_world=tf.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])),
        shapes=[Rectangle(to_world=tf.translate([2.0, 0, 0]) @ tf.scale([2, 9, 1]), emission=GLOW)],
        integrator=Path(max_depth=1),
        film=Film(width=12, height=64, mode="rgb", filter=pixel_filter),
    )
    profile = clpt.render(scene, 1024)[:, :, 0].astype(np.float64).mean(axis=0)
    x = np.linspace(-8.0, 8.0, 160_001)
    values = pixel_filter.profile(np.abs(x))
    reach = {"box": 0.5, "tent": 1.0, "gaussian": 2.0, "mitchell": 2.0, "blackman_harris": 1.5}
    values = np.where(np.abs(x) <= reach[pixel_filter.kind], values, 0.0)
    integral = np.cumsum(values) / values.sum()
    centres = np.arange(12) + 0.5 - 6.0  # the rectangle lies on the right
    np.testing.assert_allclose(profile, np.interp(centres, x, integral), atol=4e-3)


def test_a_crop_is_a_part_of_the_whole() -> None:
    """Positions seen through the middle of pixels."""
    ground = Rectangle(to_world=tf.scale(10.0))
    view = tf.look_at([1, 2, 5], [0, 0, 0], [0, 1, 0])
    whole = Film(width=24, height=16, filter=Box(radius=0.01), mode="rgb", layers="position")
    scene = Scene(
        camera=cameras.Perspective(to_world=view, fov=40.0, offset_x=0.1),
        shapes=[ground],
        integrator=Path(max_depth=1, light_paths=0),
        film=whole,
    )
    x, y, width, height = crop = (5, 2, 14, 9)
    part = dataclasses.replace(scene, film=dataclasses.replace(whole, crop=crop))
    seen = layers_of(scene, 4)["position"][y : y + height, x : x + width]
    found = layers_of(part, 4)["position"]
    assert found.shape == (height, width, 3)
    np.testing.assert_allclose(found, seen, atol=5e-3)
