"""The equal-area octahedral mapping against what defines it, and its resampling."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import transforms
from clpt.formats.pbrt import lights


def directions(count, seed=1):
    d = np.random.default_rng(seed).normal(size=(count, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def test_there_and_back():
    d = directions(20000)
    assert lights.to_sphere(lights.to_square(d)) == pytest.approx(d, abs=1e-7)


def test_landmarks():
    """Faces of the octahedron are triangles of the square (Clarberg 2008, figure 4)."""
    on_axes = np.concatenate([np.eye(3), -np.eye(3)[:2]])
    wanted = [[1.0, 0.5], [0.5, 1.0], [0.5, 0.5], [0.0, 0.5], [0.5, 0.0]]
    assert lights.to_square(on_axes) == pytest.approx(np.array(wanted))
    corners = lights.to_sphere([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    assert corners == pytest.approx(np.tile([0.0, 0.0, -1.0], (4, 1)))


def test_equal_areas():
    """Even directions fill an 8x8 grid evenly: chi-square, 63 degrees, significance 1e-4."""
    at = (lights.to_square(directions(64000)) * 8).astype(int).clip(0, 7)
    counts = np.bincount(at[:, 0] * 8 + at[:, 1], minlength=64)
    assert ((counts - 1000.0) ** 2 / 1000.0).sum() < 113.5


def weights(height):
    """Solid angle of the pixels of an image whose first and last rows lie on the poles."""
    edges = np.clip(np.arange(height + 1) - 0.5, 0, height - 1) * np.pi / (height - 1)
    return np.repeat(-np.diff(np.cos(edges))[:, None], 2 * height, 1) * np.pi / height


def seen(image, d):
    """What an Envmap shows in a direction (3,): the nearest pixel; +y up, +z in the middle."""
    height, width, _ = image.shape
    row = round(np.arccos(np.clip(d[1], -1, 1)) / np.pi * (height - 1))
    return image[row, int(np.arctan2(d[0], -d[2]) / (2 * np.pi) % 1.0 * width)]


@pytest.mark.parametrize("mirrored", [False, True])
def test_images_are_turned_into_the_world(mirrored):
    """An image of smooth colours shows in each direction of the world what it did in its own."""
    to_world = transforms.rotate([1.0, 2.0, 0.5], 70.0) @ transforms.scale(
        [-2.0 if mirrored else 2.0, 2.0, 2.0]
    )
    centres = (np.arange(64) + 0.5) / 64
    own = lights.to_sphere(np.stack(np.meshgrid(centres, centres), axis=-1))
    image = (0.5 + 0.5 * own).astype(np.float32)
    made = lights.lat_long(image, np.linalg.inv(to_world[:3, :3]))
    assert made.shape == (64, 128, 3)
    for d in directions(200, seed=3):
        world = transforms.transform_vectors(to_world, d)
        assert seen(made, world / 2.0) == pytest.approx(0.5 + 0.5 * d, abs=0.06)


def test_suns_keep_their_light():
    image = np.full((32, 32, 3), 0.1, np.float32)
    image[9, 20], image[0, 0] = [3000.0, 2000.0, 1000.0], 500.0
    turned = transforms.rotate([0.3, -1.0, 0.2], 40.0)[:3, :3]
    made = lights.lat_long(image, turned)
    light = (made * weights(len(made))[..., None]).sum(axis=(0, 1))
    wanted = image.mean(axis=(0, 1), dtype=np.float64) * 4.0 * np.pi
    assert light == pytest.approx(wanted, rel=5e-3)
    d = turned.T @ lights.to_sphere([20.5 / 32, 9.5 / 32])
    assert seen(made, d)[0] > 300.0
