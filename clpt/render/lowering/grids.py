"""Densities on grids as bricks of words, see kernels/optics/medium_grid.cl."""

from __future__ import annotations

import numpy as np

from clpt.render.lowering import device_grids
from clpt.render.lowering.device_arrays import on_host
from clpt.render.lowering.encoder import Encoder
from clpt.render.lowering.tables import Words, as_words
from clpt.scene.media import Grid, check_density

CELLS = 8  # of a brick, along an axis
POINTS = CELLS + 1
MOST = 0xFFFF  # what a point has of the highest density of its brick


def row(medium: Grid, encoder: Encoder) -> Words:
    """Return what stands in the row of a medium behind its coefficients; append its bricks."""
    if device_grids.stays_there(medium.density):
        around = _brick_counts(medium.density.shape)
        first = device_grids.reserve(encoder.store, medium.density, around)
    else:
        first = encoder.store.append("images", encoder.cache(bricks, medium.density))
    size = np.array(medium.density.shape)
    to_lattice = np.linalg.inv(np.asarray(medium.to_world, float))
    lattice = size[:, None] * to_lattice[:3] + np.array([0.0, 0.0, 0.0, 0.5])
    numbers = np.concatenate([lattice.ravel(), size + 0.5])
    counts = np.array([first, *_brick_counts(medium.density.shape)], np.uint32)
    return np.concatenate([counts, as_words(numbers)])


def bricks(density: object) -> Words:
    """Return the bricks of a density (nx, ny, nz): two words for each, x fastest, then points.

    The points are those of the grid with one more around, as dense as the nearest. Bricks without
    any density have no points.
    """
    values = np.asarray(on_host(density))
    check_density(values, "grid.density")
    counts = _brick_counts(values.shape)
    room = [(1, CELLS * n + 1 - size - 1) for n, size in zip(counts, values.shape, strict=True)]
    around = np.pad(values.astype(np.float32), room, "edge")
    steps = np.array(around.strides)
    windows = np.lib.stride_tricks.as_strided(
        around, (*counts, *[POINTS] * 3), (*(CELLS * steps), *steps), writeable=False
    )
    windows = windows.transpose(2, 1, 0, 5, 4, 3)  # z, y, x of bricks and of their points
    most = windows.max(axis=(3, 4, 5)).ravel()
    used = np.flatnonzero(most)
    z, y, x = np.unravel_index(used, counts[::-1])
    scale = MOST / most[used].astype(np.float64)
    chosen = windows[z, y, x].reshape(-1, POINTS**3)
    points = np.zeros((len(used), POINTS**3 + 1), np.uint16)
    points[:, :-1] = np.rint(chosen * scale[:, None])
    packed = points.view("<u4")
    table = np.zeros((len(most), 2), np.uint32)
    table[used, 0] = 2 * len(most) + packed.shape[1] * np.arange(len(used))
    table[:, 1] = as_words(most)
    return np.concatenate([table.ravel(), packed.ravel()])


def _brick_counts(shape: tuple[int, ...]) -> tuple[int, ...]:
    """The number of bricks along each axis: there is a cell more than points of the density."""
    return tuple(-(-(size + 1) // CELLS) for size in shape)
