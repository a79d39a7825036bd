"""Equal-area octahedral images, which pbrt keeps radiance and intensity around a point in.

The square [0, 1]^2 stands for the sphere such that equal areas are equal solid angles (Clarberg
2008, "Fast Equal-Area Mapping of the (Hemi)Sphere using SIMD"); its middle is +z, its corners are
-z, and u grows with x, v with y. A pixel's row 0 is at v = 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats32

TALLEST = 4096  # [rows] of an image in latitude and longitude that is made
DENSE = 1024  # [rows]: up to here each pixel takes 2 x 2 lookups, else a single lookup
CHUNK = 2**21  # directions that are looked up at once
PEAK = 8.0  # times the mean radiance: a brighter texel counts as a light source of its own
PARTS = 4  # points across a peak's texel


def to_square(directions: ArrayLike) -> NDArray[np.float64]:
    """Points (..., 2) in [0, 1]^2 of unit vectors (..., 3)."""
    d = np.asarray(directions, np.result_type(np.float32, np.asarray(directions).dtype))
    x, y, z = np.moveaxis(np.abs(d), -1, 0)
    r = np.sqrt(np.maximum(1.0 - z, 0.0))
    turn = np.arctan2(y, x) * (2.0 / np.pi)  # of a quarter
    u, v = r * (1.0 - turn), r * turn
    below = d[..., 2] < 0.0
    u, v = np.where(below, 1.0 - v, u), np.where(below, 1.0 - u, v)
    signed = np.stack([np.copysign(u, d[..., 0]), np.copysign(v, d[..., 1])], axis=-1)
    return 0.5 + 0.5 * signed


def to_sphere(points: ArrayLike) -> NDArray[np.float64]:
    """Unit vectors (..., 3) of points (..., 2) in [0, 1]^2."""
    signed = 2.0 * np.asarray(points, np.float64) - 1.0
    u, v = np.abs(np.moveaxis(signed, -1, 0))
    inside = 1.0 - (u + v)
    r = 1.0 - np.abs(inside)
    angle = (np.where(r > 0.0, (v - u) / np.where(r > 0.0, r, 1.0), 0.0) + 1.0) * (np.pi / 4.0)
    across = r * np.sqrt(np.maximum(2.0 - r * r, 0.0))
    return np.stack(
        [
            np.copysign(np.cos(angle) * across, signed[..., 0]),
            np.copysign(np.sin(angle) * across, signed[..., 1]),
            np.copysign(1.0 - r * r, inside),
        ],
        axis=-1,
    )


def lat_long(image: Floats32, from_world: ArrayLike, *, on_poles: bool = True) -> Floats32:
    """Return the image (h, 2h, c) in latitude and longitude of an octahedral image (n, n, c).

    from_world: (3, 3), from directions of the world to the octahedron; it may mirror.
    The result has +y up and +z in the middle, as clpt.scene.lights.Envmap. Its first and last rows
    lie on the poles, as there, or half a row off them, as in the image of a Goniometric. Pixels are
    means of texels; radiance above PEAK, such as a sun, is splatted by its power.
    """
    matrix = np.asarray(from_world, np.float64)
    height = min(max(len(image), 2), TALLEST)
    off = 0.0 if on_poles else 0.5
    theta = (np.arange(height) + off) * np.pi / (height - 1 + 2 * off)
    low = np.minimum(image, np.float32(PEAK * image.mean(dtype=np.float64)))
    result = np.empty((height, 2 * height, image.shape[2]), np.float32)
    strata = 2 if height <= DENSE else 1
    step = max(CHUNK // (2 * height * strata**2), 1)
    for first in range(0, height, step):
        result[first : first + step] = _gathered(low, matrix, theta, first, step, strata)
    peaks = np.argwhere((image > low).any(axis=2))
    if len(peaks):
        light = image[tuple(peaks.T)] - low[tuple(peaks.T)]
        _lay_down(result, light, peaks, len(image), matrix, theta)
    return result


def _gathered(
    image: Floats32,
    from_world: NDArray[Any],
    theta: NDArray[Any],
    first: int,
    count: int,
    strata: int,
) -> NDArray[Any]:
    """Rows of the result from `first` on, each pixel the mean of strata^2 texels in its cell."""
    size, width, channels = len(image), 2 * len(theta), image.shape[2]
    within = (np.arange(strata) + 0.5) / strata - 0.5
    t = (theta[first : first + count, None] + within * (theta[1] - theta[0])).ravel()
    p = ((np.arange(width)[:, None] + 0.5 + within) * (2.0 * np.pi / width)).ravel()
    t, p = np.clip(t, 0.0, np.pi)[:, None], p[None, :]
    axes = (np.sin(p) * np.sin(t), np.cos(t), -np.cos(p) * np.sin(t))
    inner = [sum(m * axis for m, axis in zip(row, axes, strict=True)) for row in from_world]
    d = np.stack(inner, axis=-1, dtype=np.float32)
    at = np.minimum((to_square(d / np.linalg.norm(d, axis=-1, keepdims=True)) * size), size - 1)
    at = at[..., 1].astype(np.intp) * size + at[..., 0].astype(np.intp)
    texels = image.reshape(-1, channels)[at]
    cells = texels.reshape(-1, strata, width, strata, channels)
    return cells.mean(axis=(1, 3), dtype=np.float64)


def _lay_down(
    result: Floats32,
    light: Floats32,
    texels: NDArray[Any],
    size: int,
    from_world: NDArray[Any],
    theta: NDArray[Any],
) -> None:
    """Add the radiance (m, c) of texels (m, 2), row and column, to an image that is bilinear.

    Every point of a texel gives its power to the four pixels around it, whose share of the sphere
    is the integral of their tent: sin(theta) 2 (1 - cos D) / D in theta, D^2 / 6 at a pole.
    """
    height, width, _ = result.shape
    within = (np.arange(PARTS) + 0.5) / PARTS
    rows, columns = texels[:, 0, None, None], texels[:, 1, None, None]
    points = np.broadcast_arrays(columns + within[None, None, :], rows + within[None, :, None])
    d = to_sphere(np.stack(points, axis=-1) / size) @ np.linalg.inv(from_world).T
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    apart = theta[1] - theta[0]
    area = np.sin(theta) * 2.0 * (1.0 - np.cos(apart)) / apart
    area = np.maximum(area, apart * apart / 6.0) * (2.0 * np.pi / width)
    row = np.clip(np.arccos(np.clip(d[..., 1], -1.0, 1.0)) - theta[0], 0.0, np.ptp(theta)) / apart
    column = (np.arctan2(d[..., 0], -d[..., 2]) / (2.0 * np.pi)) % 1.0 * width - 0.5
    top = np.minimum(row.astype(np.intp), height - 2)
    left = np.floor(column).astype(np.intp)
    power = light[:, None, None, :] * (4.0 * np.pi / (size * PARTS) ** 2)
    for down in (0, 1):
        for right in (0, 1):
            share = np.abs(1 - down - (row - top)) * np.abs(1 - right - (column - left))
            share /= area[top + down]
            at = (top + down, (left + right) % width)
            np.add.at(result, at, (share[..., None] * power).astype(np.float32))
