"""Warps of the unit square that take uniform points to a bilinear density.

A table is (..., rows, columns): x goes over the columns, y over the rows. Its leading axes are
parameters; density and warp are linear in them (Dupuy and Jakob 2018, section 4.2).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats


@dataclass(frozen=True)
class Warp:
    """A density of integral 1, values (..., rows, columns), and its integrals.

    across: (..., rows, columns), integrals along a row up to each column, in steps of columns;
    down: (..., rows), integrals over the rows before; the last is 1.
    """

    values: Floats
    across: Floats
    down: Floats


def warp(values: ArrayLike) -> Warp:
    """Return the warp of values from 0 up; a table of zeros becomes uniform."""
    density = np.asarray(values, np.float64)
    density = np.where((density > 0.0).any(axis=(-2, -1), keepdims=True), density, 1.0)
    across = _running(density)
    down = _running(across[..., -1])
    whole = down[..., -1:]
    return Warp(density / whole[..., None], across / whole[..., None], down / whole)


def _running(values: Floats) -> Floats:
    steps = np.cumsum(0.5 * (values[..., 1:] + values[..., :-1]), axis=-1)
    return np.concatenate([np.zeros_like(values[..., :1]), steps], axis=-1)


def bilinear(table: Floats, x: Floats, y: Floats) -> Floats:
    """Return values (..., n) of a table (..., rows, columns) at points (n,) of the unit square."""
    (column, s), (row, t) = _cell(x, table.shape[-1]), _cell(y, table.shape[-2])
    upper = table[..., row, column] * (1.0 - s) + table[..., row, column + 1] * s
    lower = table[..., row + 1, column] * (1.0 - s) + table[..., row + 1, column + 1] * s
    return upper * (1.0 - t) + lower * t


def _cell(x: Floats, nodes: int) -> tuple[NDArray[np.int64], Floats]:
    at = np.clip(x, 0.0, 1.0) * (nodes - 1)
    cell = np.minimum(at.astype(np.int64), nodes - 2)
    return cell, at - cell


def sample(of: Warp, u: Floats, v: Floats) -> tuple[Floats, Floats, Floats]:
    """Warp points (n,) of the unit square by a single table; return x, y and their density."""
    rows, columns = of.values.shape
    row = np.clip(np.searchsorted(of.down, v, "right") - 1, 0, rows - 2)
    ends = of.across[row, -1], of.across[row + 1, -1]
    t = _linear((v - of.down[row]) / _above(of.down[row + 1] - of.down[row]), *ends)
    sums = of.across[row] * (1.0 - t)[:, None] + of.across[row + 1] * t[:, None]
    left = u * sums[:, -1]
    column = np.clip((sums <= left[:, None]).sum(axis=1) - 1, 0, columns - 2)
    pick = np.arange(len(row))
    near = of.values[row] * (1.0 - t)[:, None] + of.values[row + 1] * t[:, None]
    below, above = sums[pick, column], sums[pick, column + 1]
    a, b = near[pick, column], near[pick, column + 1]
    s = _linear((left - below) / _above(above - below), a, b)
    density = (a + s * (b - a)) * (rows - 1) * (columns - 1)
    return (column + s) / (columns - 1), (row + t) / (rows - 1), density


def _linear(u: Floats, a: Floats, b: Floats) -> Floats:
    """Return x with density proportional to a (1 - x) + b x."""
    u = np.clip(u, 0.0, 1.0)
    root = np.sqrt(a * a + u * (b * b - a * a))
    return np.where(a + root > 0.0, u * (a + b) / _above(a + root), u)


def _above(x: Floats) -> Floats:
    return np.maximum(x, 1e-300)
