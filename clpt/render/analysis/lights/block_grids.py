"""Grids to choose directions by, in blocks: by weight times the cosine to a receiver's normal.

A grid of cells is cut into blocks, in bands of rows and in strips of columns. For each of many sets
of normals (parts of the octahedron) there are the chances of all blocks: their weight times the
cosine. Within a block cells are chosen by weight alone. See kernels/core/grid.cl.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Array, Floats

Directions = Callable[[ArrayLike, ArrayLike], Floats]  # unit (..., 3) of rows and columns 0 to 1

SIDE = 8  # of the square of parts of the octahedron, GRID_SIDE
DOWN, ACROSS = 8, 16  # blocks of a grid, at most; of several grids a fourth of a face's side each
FINER = 4  # parts of a block's side, of each of which the cosine is taken
NORMALS = 5  # of a part, along each axis
ROWS = 256  # of an image that are worked on at a time


class BlockGrid(NamedTuple):
    """Tables to choose a block of cells of a grid, and then a cell in it.

    marginal (strips, rows): sums over the rows of each block; conditional (rows, columns): over
    its columns; blocks (parts + 1, words): chances, of the last one by weight alone; block_rows,
    block_columns: cells of a block; total: sum of all weights.
    """

    marginal: NDArray[np.float32]
    conditional: NDArray[np.float32]
    blocks: NDArray[np.float32]
    block_rows: int
    block_columns: int
    total: float


def of(
    corners: NDArray[Any], directions: Directions, angles: tuple[float, float] | None = None
) -> BlockGrid:
    """Return the blocks of grids (k, r + 1, c + 1) of weights at corners, one below the other.

    angles: of a row and of a column [rad]; by default those of a sphere, or of a cube's faces.
    """
    grids, per, columns = corners.shape[0], corners.shape[1] - 1, corners.shape[2] - 1
    rows = grids * per
    down, across = (DOWN, ACROSS) if grids == 1 else (4, 4)
    block_rows, block_columns = -(-per // down), -(-columns // across)
    bands, strips = -(-rows // block_rows), -(-columns // block_columns)
    fine_rows, fine_columns = (np.arange(0, n, max(b // FINER, 1)) for n, b in (
        (rows, block_rows), (columns, block_columns)))  # fmt: skip
    starts = np.arange(0, columns, block_columns)
    conditional = np.empty((rows, columns), np.float32)
    sums, fine = np.empty((rows, strips)), np.empty((rows, len(fine_columns)))
    for first in range(0, rows, ROWS):
        part = slice(first, min(first + ROWS, rows))
        cells = _cells(corners, np.arange(part.start, part.stop))
        fine[part] = np.add.reduceat(cells, fine_columns, axis=1)
        for strip, start in enumerate(starts):
            conditional[part, start : start + block_columns], sums[part, strip] = _cumulative(
                cells[:, start : start + block_columns]
            )
    marginal, weights = np.empty((strips, rows), np.float32), np.empty((bands, strips))
    for band in range(bands):
        own = slice(band * block_rows, (band + 1) * block_rows)
        marginal[:, own], weights[band] = _cumulative(sums[own].T)
    fine = np.add.reduceat(fine, fine_rows, axis=0)
    places = [(at + np.append(at[1:], n)) / (2.0 * n) for at, n in (
        (fine_rows, rows), (fine_columns, columns))]  # fmt: skip
    toward = directions(*np.meshgrid(*places, indexing="ij"))
    owner = (fine_rows // block_rows)[:, None] * strips + fine_columns // block_columns
    sphere = (np.pi / per, 2.0 * np.pi / columns)
    row, column = angles or (sphere if grids == 1 else (np.pi / 2.0 / per,) * 2)
    step = max(block_rows // FINER, 1) * row, max(block_columns // FINER, 1) * column
    lit = _lit(toward.reshape(-1, 3), owner.ravel(), fine.ravel(), weights, math.hypot(*step))
    blocks = np.stack([_chances(each.reshape(bands, strips), weights) for each in lit])
    return BlockGrid(marginal, conditional, blocks, block_rows, block_columns, float(weights.sum()))


def _lit(toward: Floats, owner: Array, fine: Floats, weights: Floats, step: float) -> Floats:
    """Return what each block sends to surfaces of each normal, and at last to all of space.

    toward (n, 3), owner and fine (n,): of parts of blocks, where they are, in which block, and how
    much they send; step: their size [rad].
    """
    lit = np.empty((SIDE * SIDE + 1, weights.size))
    for index in range(SIDE * SIDE):
        cosine = _cosines(index, toward, 0.5 * step)
        lit[index] = np.bincount(owner, fine * cosine, weights.size)
    lit[-1] = weights.ravel()
    return lit


def _cells(corners: NDArray[Any], rows: NDArray[np.int64]) -> Floats:
    """The mean weights of rows of cells (n, c)."""
    grid, row = np.divmod(rows, corners.shape[1] - 1)
    wide = corners[grid, row].astype(np.float64) + corners[grid, row + 1]
    return 0.25 * (wide[:, 1:] + wide[:, :-1])


def _cumulative(weights: Floats) -> tuple[NDArray[np.float32], Floats]:
    """Sums along the last axis up to 1, and what they were divided by."""
    sums = np.cumsum(weights, axis=-1)
    total = sums[..., -1].copy()
    sums /= np.where(total > 0.0, total, 1.0)[..., None]
    sums[..., -1] = 1.0
    return sums.astype(np.float32), total


def _cosines(index: int, toward: Floats, radius: float) -> Floats:
    """Cosines (n,) of a part's normals to directions (n, 3), each perhaps `radius` [rad] nearer.

    Half their mean and half the largest, so that no direction is much rarer than it matters for any
    of the normals.
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
    """Sums over bands, sums over the strips of each, and chances over those by weight alone.

    The chances are those of the sums as float32 has them. Where nothing is lit weights alone count.
    """
    lit = lit if lit.sum() > 0.0 else weights
    if not lit.sum() > 0.0:
        lit = np.ones_like(weights)
    across, each = _cumulative(lit)
    down, _ = _cumulative(each)
    chance = np.diff(down.astype(np.float64), prepend=0.0)[:, None] * np.diff(
        across.astype(np.float64), axis=1, prepend=0.0
    )
    own = weights / max(weights.sum(), 1e-300)
    ratio = np.divide(chance, own, out=np.zeros_like(chance), where=own > 0.0)
    return np.concatenate([down, across.ravel(), ratio.ravel().astype(np.float32)])
