"""Makes the density of a cumulus, in 8 bits: balls that grow on balls, frayed by noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SIZE = (112, 80, 80)  # cells along x, y and z, of 1/40 each


def noise(points: Array, seed: int) -> Array:
    """Smooth noise in [-1, 1]: random numbers on a lattice, interpolated."""
    lattice = np.random.default_rng(seed).uniform(-1.0, 1.0, (16, 16, 16))
    low = np.floor(points).astype(int)
    share = points - low
    share = share * share * (3.0 - 2.0 * share)
    value = np.zeros(points.shape[:-1])
    for corner in np.ndindex(2, 2, 2):
        index = np.moveaxis((low + corner) % 16, -1, 0)
        value += lattice[tuple(index)] * np.where(corner, share, 1.0 - share).prod(axis=-1)
    return value


def cumulus() -> Array:
    """The density (nx, ny, nz), from 0 to 1."""
    axes = [(np.arange(n) + 0.5 - 0.5 * n) / 40.0 for n in SIZE]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    rng = np.random.default_rng(4)
    balls = [(np.array([x, y, z]), r) for x, y, z, r in (
        (-0.8, -0.62, 0.0, 0.3), (-0.3, -0.5, 0.1, 0.44), (0.2, -0.4, -0.1, 0.52),
        (0.35, 0.1, 0.0, 0.4), (0.85, -0.6, 0.1, 0.3), (-0.25, -0.1, -0.1, 0.34),
    )]  # fmt: skip
    for center, radius in [*balls]:
        for _ in range(14):
            way = rng.normal(size=3)
            way[1] = abs(way[1])
            way /= np.linalg.norm(way)
            balls.append((center + 0.92 * radius * way, radius * rng.uniform(0.22, 0.5)))
    frayed = points + 0.035 * np.stack([noise(points * 6.0, seed) for seed in (1, 2, 3)], axis=-1)
    depth = np.full(SIZE, -1.0)
    for center, radius in balls:
        depth = np.maximum(depth, radius - np.linalg.norm(frayed - center, axis=-1))
    detail = sum(noise(points * 7.0 * 2.1**k, 10 + k) * 0.55**k for k in range(4))
    flat = np.clip(
        (points[..., 1] + 0.72) * 14.0, 0.0, 1.0
    )  # clouds of one kind begin at one height
    density = np.clip((depth + 0.04 * detail) * 20.0, 0.0, 1.0) * flat
    for axis in range(3):  # nothing at the ends of the box
        np.moveaxis(density, axis, 0)[[0, -1]] = 0.0
    return density


def cropped(density: Array) -> tuple[Array, Array, Array]:
    """What is there, with a layer of nothing around, and the corners of its box."""
    there = np.argwhere(np.rint(255.0 * density) > 0.0)
    low, high = there.min(axis=0) - 1, there.max(axis=0) + 2
    corners = (np.array([low, high]) - 0.5 * np.array(SIZE)) / 40.0
    return density[tuple(map(slice, low, high))], *corners


if __name__ == "__main__":
    made, low, high = cropped(cumulus())
    np.save(Path(__file__).parent / "density.npy", np.rint(255.0 * made).astype(np.uint8))
    print("the box of scene.json is from", low, "to", high)
