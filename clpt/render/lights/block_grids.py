"""Grids to choose directions by, in blocks: by weight times the cosine to a receiver's normal.

A grid of cells is cut into blocks, in bands of rows and in strips of columns. For each of many sets
of normals (parts of the octahedron) there are the chances of all blocks: their weight times the
cosine. Within a block cells are chosen by weight alone. See kernels/core/grid.cl."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Array, Floats
from clpt.records import GRID_SIZES
from clpt.render.materials.encoder import Encoder

Directions = Callable[[ArrayLike, ArrayLike], Floats]  # unit (..., 3) of rows and columns 0 to 1

SIDE = GRID_SIZES["side"]  # of the square of parts of the octahedron
DOWN, ACROSS = 8, 16  # blocks of a grid, at most; of several grids a fourth of a face's side each
FINER = 4  # parts of a block's side; each has a cosine
NORMALS = 5  # of a part, along each axis
DULL, LEAST = 0.5, 0.05  # see `_beyond`
ROWS = 256  # of an image that are worked on at a time


class BlockGrid(NamedTuple):
    """Tables to choose a block of cells of a grid, and then a cell in it.

    marginal (strips, rows): cumulative sums over the rows of each block; conditional (rows,
    columns): over its columns; blocks (parts + 1, words): chances for each set of normals, the last
    row by weight alone; block_rows, block_columns: cells of a block; total: sum of all weights.
    """

    marginal: NDArray[np.float32]
    conditional: NDArray[np.float32]
    blocks: NDArray[np.float32]
    block_rows: int
    block_columns: int
    total: float


def of(
    corners: NDArray[Any],
    directions: Directions,
    angles: tuple[float, float] | None = None,
    even: NDArray[Any] | None = None,
) -> BlockGrid:
    """Return the blocks of k grids (k, r + 1, c + 1) of weights at corners, stacked vertically.

    angles: of a row and of a column [rad]; by default as of a sphere, or of a cube's faces. even:
    the weights of a light of radiance 1: with them, blocks are chosen for the light `_beyond`.
    """
    grids, per, columns = corners.shape[0], corners.shape[1] - 1, corners.shape[2] - 1
    rows = grids * per
    down, across = (DOWN, ACROSS) if grids == 1 else (4, 4)
    block_rows, block_columns = -(-per // down), -(-columns // across)
    bands, strips = -(-rows // block_rows), -(-columns // block_columns)
    fine_rows, fine_columns = (np.arange(0, n, max(b // FINER, 1)) for n, b in (
        (rows, block_rows), (columns, block_columns)))  # fmt: skip
    conditional = np.empty((rows, columns), np.float32)
    sums, fine = np.empty((rows, strips)), np.empty((rows, len(fine_columns)))
    for first in range(0, rows, ROWS):
        part = slice(first, min(first + ROWS, rows))
        cells = _cells(corners, np.arange(part.start, part.stop))
        fine[part] = np.add.reduceat(cells, fine_columns, axis=1)
        for strip, start in enumerate(range(0, columns, block_columns)):
            inside = slice(start, start + block_columns)
            conditional[part, inside], sums[part, strip] = _cumulative(cells[:, inside])
    marginal, weights = _in_bands(sums, block_rows)
    fine = np.add.reduceat(fine, fine_rows, axis=0).ravel()
    places = [(at + np.append(at[1:], n)) / (2.0 * n) for at, n in (
        (fine_rows, rows), (fine_columns, columns))]  # fmt: skip
    toward = directions(*np.meshgrid(*places, indexing="ij")).reshape(-1, 3)
    owner = (fine_rows // block_rows)[:, None] * strips + fine_columns // block_columns
    sphere = (np.pi / per, 2.0 * np.pi / columns)
    row, column = angles or (sphere if grids == 1 else (np.pi / 2.0 / per,) * 2)
    step = max(block_rows // FINER, 1) * row, max(block_columns // FINER, 1) * column
    area = None if even is None else _in_parts(even, fine_rows, fine_columns)
    lit = _lit(toward, owner.ravel(), fine, weights, math.hypot(*step), area)
    blocks = np.stack([_chances(each.reshape(bands, strips), weights) for each in lit])
    return BlockGrid(marginal, conditional, blocks, block_rows, block_columns, float(weights.sum()))


def _lit(
    toward: Floats, owner: Array, fine: Floats, weights: Floats, step: float, area: Floats | None
) -> Floats:
    """Return the light of each block on surfaces of each normal, and in the last row on all space.

    toward (n, 3), owner, fine (n,): direction, block and weight of each part of a block; step: size
    of a part [rad]; area (n,): weights if the radiance were 1; None: blocks are chosen for all
    their light.
    """
    lit = np.empty((SIDE * SIDE + 1, weights.size))
    for index in range(SIDE * SIDE):
        cosine = _cosines(index, toward, 0.5 * step)
        sent = fine if area is None else _beyond(fine, area, cosine)
        lit[index] = np.bincount(owner, sent * cosine, weights.size)
    lit[-1] = weights.ravel()
    return lit


def _beyond(fine: Floats, area: Floats, cosine: Floats) -> Floats:
    """Return the weights of parts beyond DULL of the mean that a surface receives, (n,).

    Directions sampled by the material find the remaining light (Karlik et al. 2019, "MIS
    Compensation"). Each part keeps LEAST of its weight, so that no light is lost where only the
    light is sampled.
    """
    mean = float(fine @ cosine) / max(float(area @ cosine), 1e-300)
    return np.maximum(fine - DULL * mean * area, LEAST * fine)


def _in_bands(sums: Floats, block_rows: int) -> tuple[NDArray[np.float32], Floats]:
    """Return cumulative sums (strips, rows) within each band of rows, and the bands' sums."""
    firsts = range(0, len(sums), block_rows)
    bands = [_cumulative(sums[first : first + block_rows].T) for first in firsts]
    return np.hstack([rising for rising, _ in bands]), np.stack([total for _, total in bands])


def _in_parts(corners: NDArray[Any], rows: Array, columns: Array) -> Floats:
    """Return sums of cells (n,) over parts that begin at these rows and columns."""
    cells = _cells(corners, np.arange(len(corners) * (corners.shape[1] - 1)))
    return np.add.reduceat(np.add.reduceat(cells, columns, axis=1), rows, axis=0).ravel()


def _cells(corners: NDArray[Any], rows: NDArray[np.int64]) -> Floats:
    """Return the mean weights (n, c) of the cells of n rows."""
    grid, row = np.divmod(rows, corners.shape[1] - 1)
    wide = corners[grid, row].astype(np.float64) + corners[grid, row + 1]
    return 0.25 * (wide[:, 1:] + wide[:, :-1])


def _cumulative(weights: Floats) -> tuple[NDArray[np.float32], Floats]:
    """Return cumulative sums along the last axis, normalised to end at 1, and the totals."""
    sums = np.cumsum(weights, axis=-1)
    total = sums[..., -1].copy()
    sums /= np.where(total > 0.0, total, 1.0)[..., None]
    sums[..., -1] = 1.0
    return sums.astype(np.float32), total


def _cosines(index: int, toward: Floats, radius: float) -> Floats:
    """Return cosines (n,) between a part's normals and directions (n, 3) of a radius [rad].

    Half is the mean over the normals and half is the largest, so that each direction stays likely
    enough for every normal of the part.
    """
    at = np.linspace(0.0, 1.0, NORMALS)
    u, v = np.meshgrid((index % SIDE + at) / SIDE, (index // SIDE + at) / SIDE)
    normals = _octahedral(2.0 * u.ravel() - 1.0, 2.0 * v.ravel() - 1.0)
    cosine = np.clip(toward @ normals.T, -1.0, 1.0)
    radius = min(radius, 0.5 * np.pi)
    nearer = cosine * math.cos(radius) + np.sqrt(1.0 - cosine**2) * math.sin(radius)
    cosine = np.where(cosine > math.cos(radius), 1.0, np.maximum(nearer, 0.0))
    return 0.5 * (cosine.mean(axis=1) + cosine.max(axis=1))


def _octahedral(u: Floats, v: Floats) -> Floats:
    """Unit vectors (n, 3) of points of the square [-1, 1]^2 (Meyer et al. 2010)."""
    z = 1.0 - np.abs(u) - np.abs(v)
    fold = np.maximum(-z, 0.0)
    n = np.stack([u - np.copysign(fold, u), v - np.copysign(fold, v), z], axis=1)
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def _chances(lit: Floats, weights: Floats) -> NDArray[np.float32]:
    """Return sums over bands, sums over each band's strips, and chances over those by weight alone.

    The chances follow the sums as rounded to float32. Where nothing is lit, weights alone count.
    """
    lit = lit if lit.sum() > 0.0 else weights
    if not lit.sum() > 0.0:
        lit = np.ones_like(weights)
    across, each = _cumulative(lit)
    down, _ = _cumulative(each)
    chance = np.diff(down.astype(np.float64), prepend=0.0)[:, None] * np.diff(
        across.astype(np.float64), axis=1, prepend=0.0
    )
    alone = weights / max(weights.sum(), 1e-300)
    ratio = np.divide(chance, alone, out=np.zeros_like(chance), where=alone > 0.0)
    return np.concatenate([down, across.ravel(), ratio.ravel().astype(np.float32)])


def grid_members(corners: NDArray[Any], grid: BlockGrid, encoder: Encoder) -> dict[str, ArrayLike]:
    """Put a grid and the weights at its corners into the tables; return the members of a record.

    A power of two scales the largest weight to about 1, so that squares of weights fit float32.
    """
    append = partial(encoder.store.append_floats, "distributions")
    unit = 2.0 ** math.frexp(float(corners.max()))[1]
    return {
        "corners": append(corners / unit),
        "marginal": append(grid.marginal),
        "conditional": append(grid.conditional),
        "blocks": append(grid.blocks),
        "block_rows": grid.block_rows,
        "block_columns": grid.block_columns,
        "norm": unit / grid.total if grid.total > 0.0 else 0.0,
    }
