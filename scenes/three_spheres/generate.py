"""Paints sky.png, a cloudy sky on the six faces of a cube: a cross of 4x3 squares.

    python scenes/three_spheres/generate.py

Clouds are sums of smooth noise on a plane overhead (Perlin 1985), darker away from the sun.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.render.lights.images import face_directions

Array = NDArray[np.float64]

SIZE = 256  # of a face
# column and row of the faces +x -x +y -y +z -z in the cross
PLACES = ((2, 1), (0, 1), (1, 0), (1, 2), (1, 1), (3, 1))
SUN = np.array([-0.55, 0.45, 0.7]) / np.linalg.norm([-0.55, 0.45, 0.7])
LATTICE = np.random.default_rng(11).random((256, 256))


def noise(p: Array) -> Array:
    """Smooth noise in [0, 1] at points (..., 2), one bump a unit."""
    cell = np.floor(p).astype(int)
    t = p - cell
    x, y = np.moveaxis(t * t * t * (t * (t * 6 - 15) + 10), -1, 0)
    i, j = np.moveaxis(cell, -1, 0)
    a, b = LATTICE[i % 256, j % 256], LATTICE[(i + 1) % 256, j % 256]
    c, d = LATTICE[i % 256, (j + 1) % 256], LATTICE[(i + 1) % 256, (j + 1) % 256]
    return (a * (1 - x) + b * x) * (1 - y) + (c * (1 - x) + d * x) * y


def cover(p: Array) -> Array:
    """How thick the clouds are above points (..., 2) of the plane overhead, in [0, 1]."""
    warped = p + 0.35 * np.stack([noise(p * 1.3 + 7.7), noise(p * 1.3 + 31.1)], -1)
    total = sum(noise(warped * 2.0**k + 17.0 * k) * 0.5**k for k in range(7)) / 1.98
    return np.clip((total - 0.47) / 0.3, 0, 1) ** 0.85


def sky(d: Array) -> Array:
    """Linear Rec. 709 (..., 3) seen in directions (..., 3), +y up."""
    d = d / np.linalg.norm(d, axis=-1, keepdims=True)
    up = np.maximum(d[..., 1], 0.0)
    overhead = 2.2 * d[..., [0, 2]] / (up + 0.16)[..., None] + 5.0
    toward_sun = np.clip(d @ SUN, 0, 1)
    thick = cover(overhead)
    shade = cover(overhead + 0.18 * SUN[[0, 2]])
    haze = np.exp(-up * 5.0)[..., None]
    blue = np.array([0.10, 0.26, 0.62]) * (1 - haze) + np.array([0.60, 0.72, 0.84]) * haze
    blue = blue + (0.35 * toward_sun**24 + 0.1 * toward_sun**4)[..., None] * [1.0, 0.85, 0.6]
    bright = (1.0 - 0.62 * shade)[..., None]
    white = bright * np.array([1.0, 0.97, 0.92]) + (1 - bright) * np.array([0.38, 0.44, 0.54])
    amount = (thick * np.clip(up * 9.0, 0, 1))[..., None]
    colour = blue * (1 - amount) + white * amount
    below = np.clip(-d[..., 1] * 6, 0, 1)[..., None]
    return colour * (1 - below) + np.array([0.25, 0.42, 0.44]) * below


def main() -> None:
    centers = (np.arange(SIZE) + 0.5) / SIZE * 2 - 1
    cross = np.zeros((3 * SIZE, 4 * SIZE, 3))
    faces = face_directions(centers[None, :], centers[:, None])
    for directions, (column, row) in zip(faces, PLACES, strict=True):
        there = slice(row * SIZE, (row + 1) * SIZE), slice(column * SIZE, (column + 1) * SIZE)
        cross[there] = sky(directions)
    images.write(Path(__file__).with_name("sky.png"), cross.astype(np.float32))


if __name__ == "__main__":
    main()
