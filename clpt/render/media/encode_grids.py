"""Densities on grids as bricks of words, see kernels/media/medium_grid.cl."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Words, on_host
from clpt.render.lights.bricks import POINTS, Windows, brick_counts, parts_of, to_lattice
from clpt.render.materials.encoder import Encoder
from clpt.render.media import device_grids
from clpt.render.records.tables import as_words
from clpt.scene.media import Cloud, Grid, Lattice, Medium, Mixture
from clpt.scene.volumes import check_density, resampled
from clpt.spectra import Spectrum, uplift
from clpt.spectra.spectrum import gridded

ROUNDED = 1e-4  # by how much a mixture's density bounds more than its parts
GLOW_WORDS = 6  # behind the row of a grid, see kernels/media/medium_grid_light.cl


def row(medium: Lattice, encoder: Encoder) -> Words:
    """Return what stands in the row of a medium behind its coefficients; append its bricks.

    Raises SceneError for a density that is negative or not finite, but on a device.
    """
    counts = brick_counts(medium.size)
    if isinstance(medium, Cloud):
        density = device_grids.cloud_density(medium)
        first = device_grids.reserve(encoder.store, density, counts)
    elif isinstance(medium, Mixture):
        first = encoder.store.append("images", bricks(mixed(medium, encoder)[0]))
    elif not isinstance(medium, Grid):
        raise TypeError(medium.kind)
    elif device_grids.stays_there(medium):
        first = device_grids.reserve(encoder.store, medium.density, counts)
    else:
        words = encoder.cache(bricks, medium.density, medium.bits)
        first = encoder.store.append("images", words)
    numbers = np.concatenate([to_lattice(medium).ravel(), np.array(medium.size) + 0.5])
    bricks_at = np.array([first, *counts], np.uint32)
    return np.concatenate([bricks_at, as_words(numbers)])


def bricks(density: object, bits: int = 16) -> Words:
    """Return the bricks of a density (nx, ny, nz): two words for each, x fastest, then points.

    bits: of a point, 16 or 8.

    The points are those of the grid with one more around, as dense as the nearest. Bricks without
    any density have no points.
    """
    windows = Windows(density)
    most = windows.most
    used = np.flatnonzero(most)
    scale = (2**bits - 1) / most[used].astype(np.float64)
    whole = -(-(POINTS**3) * bits // 32) * 32 // bits
    points = np.zeros((len(used), whole), np.uint16 if bits == 16 else np.uint8)
    for some in parts_of(len(used)):
        points[some, : POINTS**3] = np.rint(windows.of(used[some]) * scale[some, None])
    packed = points.view("<u4")
    table = np.zeros((len(most), 2), np.uint32)
    table[used, 0] = 2 * len(most) + packed.shape[1] * np.arange(len(used))
    table[:, 1] = as_words(most)
    return np.concatenate([table.ravel(), packed.ravel()])


def colours(density: object, values: NDArray[Any], spectral: bool) -> Words:
    """Return the colours of the bricks that have a density: a word for each, then three a point.

    The first says where its points begin, 0 for nowhere. spectral: they are coefficients of curves.
    """
    table, points = _on_used(density, values)
    words = uplift(points) if spectral else points
    return np.concatenate([table, as_words(words.ravel())])


def _on_used(density: object, values: NDArray[Any]) -> tuple[Words, NDArray[np.float32]]:
    """Return the place of each brick's points, 0 without a density, and the values of the points.

    values: some channels at the points of the density.
    """
    used = np.flatnonzero(Windows(density).most)
    channels = [Windows(values[..., c]) for c in range(values.shape[-1])]
    points = np.stack([one.of(used) for one in channels], axis=-1)
    table = np.zeros(len(channels[0].most), np.uint32)
    table[used] = len(table) + len(channels) * POINTS**3 * np.arange(len(used))
    return table, points


def shares(medium: Mixture, encoder: Encoder, count: int) -> Words:
    """Return how dense each part of a mixture is over the density of its bricks.

    As the colours of bricks: a word for each brick, then `count` for a point, 0 beyond its parts.
    """
    density, parts = mixed(medium, encoder)
    over = parts / np.where(density > 0.0, density, 1.0)[..., None]
    beyond = count - parts.shape[-1]
    table, points = _on_used(density, np.pad(over, [(0, 0)] * 3 + [(0, beyond)]))
    return np.concatenate([table, as_words(points.ravel())])


def mixed(medium: Mixture, encoder: Encoder) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the density of a mixture (nx, ny, nz), made once, and those of its parts (..., n).

    Where the coefficients of the medium are multiplied by the former, they are at all wavelengths
    at least those of the parts together; a little more, lest rounding makes them less.
    """
    table = encoder.spectra
    return encoder.cache(_mixed, medium, table.spectral, *table.range, table.samples)


def _mixed(
    medium: Mixture, spectral: bool, low: float, high: float, samples: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    lambdas = np.linspace(low, high, samples)

    def extinction(coefficients: tuple[Spectrum, Spectrum]) -> NDArray[np.float64]:
        values = [gridded(c, lambdas) if spectral else c.to_rgb("unbounded") for c in coefficients]
        return np.asarray(values[0] + values[1], np.float64)

    whole = extinction(medium.coefficients(spectral))
    over = np.where(whole > 0.0, 1.0 / np.maximum(whole, 1e-30), 0.0)
    most = np.unique([extinction(own) * over for own in medium.of_parts(spectral)], axis=1)
    parts = np.stack([_at_points(part, medium) for part in medium.parts], axis=-1)
    rows = parts.reshape(-1, len(medium.parts))
    density = np.empty(len(rows), np.float32)
    for some in parts_of(len(rows)):
        density[some] = (rows[some] @ most).max(axis=1) * (1.0 + ROUNDED)
    return density.reshape(parts.shape[:3]), parts


def _at_points(part: Medium, medium: Mixture) -> NDArray[np.float32]:
    """The density of a part at the points of its mixture."""
    if not isinstance(part, Grid):
        return np.ones(medium.size, np.float32)
    values: NDArray[Any] = np.asarray(on_host(part.density))
    check_density(values, "grid.density")
    if values.shape != medium.size:
        values = resampled(values, np.eye(4), medium.size, np.eye(4))
    return values.astype(np.float32)
