"""Clouds by formula: the density on the device against float64, and pictures of it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.render.textures.encode import PERMUTATION
from clpt.scene import media
from clpt.transforms import rotate, scale, translate
from tests.pictures.media.test_grids import scene_of


def noise(p: np.ndarray) -> np.ndarray:
    """Perlin's improved noise at points (n, 3), in float64."""
    cell = np.floor(p).astype(int)
    d = p - cell
    w = d**3 * (d * (d * 6.0 - 15.0) + 10.0)
    sums = np.zeros(len(p))
    for corner in np.ndindex(2, 2, 2):
        index = (cell + corner) & 255
        h = PERMUTATION[index[:, 0]].astype(int)
        h = PERMUTATION[(h + index[:, 1]) & 255].astype(int)
        h = PERMUTATION[(h + index[:, 2]) & 255].astype(int) & 15
        x, y, z = (d - corner).T
        u = np.where((h < 8) | (h == 12) | (h == 13), x, y)
        v = np.where((h < 4) | (h == 12) | (h == 13), y, z)
        gradient = np.where(h & 1, -u, u) + np.where(h & 2, -v, v)
        sums += gradient * np.where(corner, w, 1.0 - w).prod(axis=1)
    return sums


def density(cloud: media.Cloud) -> np.ndarray:
    """The density at the lattice's points, by the formula of PBRT."""
    low, high = np.asarray(cloud.low, float), np.asarray(cloud.high, float)
    axes = [
        a + (b - a) * (np.arange(n) + 0.5) / n
        for a, b, n in zip(low, high, cloud.size, strict=True)
    ]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    p, strength, finer = cloud.frequency * points, 0.05 * cloud.wispiness, 10.0
    for _ in range(2 if cloud.wispiness > 0.0 else 0):
        at = finer * p
        shifts = [(noise(at + 0.01 * axis) - noise(at)) / 0.01 for axis in np.eye(3)]
        p = p + strength * np.stack(shifts, axis=1)
        strength, finer = strength / 2.0, finer * 1.99
    d = sum(0.5 ** (i + 1) * noise(1.99**i * p) for i in range(5))
    y = points[:, 1]
    d = np.clip((1.0 - y) * 4.5 * cloud.density * d, 0.0, 1.0)
    return np.clip(d + 2.0 * np.maximum(0.0, 0.5 - y), 0.0, 1.0).reshape(cloud.size)


def test_density_and_picture() -> None:
    """A cloud is the grid of its float64 density; a change of it is seen after an update."""
    box = translate([0.1, -1.2, 0.0]) @ rotate([1, 2, 3], 30) @ scale(2.0)
    given = {"sigma_s": 2.0, "sigma_a": 0.5}
    cloud = media.Cloud(low=(-0.5, 0.2, -0.5), high=(0.5, 1.0, 0.7), frequency=3.0, resolution=21,
                        to_world=box, **given)  # fmt: skip
    assert cloud.size == (18, 14, 21)
    other = dataclasses.replace(cloud, wispiness=0.0, density=1.6)
    with clpt.Renderer(scene_of(cloud)) as renderer:
        pictures = []
        for one in (cloud, other):
            renderer.update(scene=scene_of(one))
            renderer.run(64)
            pictures.append(renderer.image())
        grids = []
        for one in (cloud, other):
            numbers = density(one)
            assert 0.1 < numbers.mean() < 0.9
            grid = media.Grid(density=numbers.astype(np.float32), to_world=one.box, **given)
            renderer.update(scene=scene_of(grid))
            renderer.run(64)
            grids.append(renderer.image())
    for made, expected in zip(pictures, grids, strict=True):
        # The numbers differ by rounding, which changes few of the paths.
        np.testing.assert_allclose(made.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), rtol=2e-3)
    assert abs(pictures[0].mean() / pictures[1].mean() - 1.0) > 0.01


def test_size() -> None:
    """The lattice is as fine as the noise, within limits."""
    assert media.Cloud().size == (157, 157, 157)
    assert media.Cloud(frequency=1.0).size == (32, 32, 32)
    assert max(media.Cloud(frequency=50.0, high=(1.0, 0.5, 1.0)).size) == 256
    assert media.Cloud(high=(1.0, 0.5, 2.0), resolution=10).size == (5, 2, 10)
    with pytest.raises(SceneError, match="flat"):
        media.Cloud(high=(1.0, 0.0, 1.0))
    with pytest.raises(SceneError, match="must be 0 to 1024"):
        media.Cloud(resolution=-1)
    with pytest.raises(SceneError, match="has no inverse"):
        media.Cloud(to_world=scale([1.0, 0.0, 1.0]))
