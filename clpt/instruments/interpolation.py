"""Maps with few measured points; other points are interpolated where the map is smooth.

A cell is a rectangle of the map between four measured corners. The middles of its sides and of the
cell are measured too, and compared with the bilinear interpolation of the corners. Where all agree,
the quarters of the cell are interpolated; where one differs, the quarters become cells. As by the
irradiance cache of Ward, Rubinstein and Clear (1988), an edge between measured points may be lost.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, Integers

TOLERANCE = 0.01  # of a value: smaller differences are smooth
SIGNIFICANT = 3.0  # standard errors: smaller differences are noise
BENT = 0.05  # of a cell's diagonal: middles that lie farther away belong to another surface
TURNED = 0.99  # least cosine between normals of a cell

Look = Callable[[Integers, Integers], tuple[Floats, Floats]]


@dataclass(frozen=True)
class Surface:
    """Points of a map [m] and their unit normals (h, w, 3); covered (h, w): where points are."""

    points: Floats
    normals: Floats
    covered: NDArray[np.bool_]


def interpolated(
    surface: Surface, look: Look, step: int, tolerance: float = TOLERANCE
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Return values and standard errors (h, w, k), and which points were measured (h, w).

    look: measures points, by rows and columns (n,); returns values and standard errors (n, k).
    step: points of the map between corners at first. Errors of interpolated points are those of the
    corners, and the differences at middles that noise does not explain. NaN where no point is.
    """
    known = _Known(surface, look)
    cells = _first_cells(surface.covered.shape, step)
    smooth: list[tuple[Integers, Floats]] = []
    known.add(np.concatenate([_corners(cells), _middles(cells)], axis=1))
    while len(cells):
        known.add(_middles(cells))
        agree, excess = known.compared(cells, tolerance)
        parts = _quarters(cells)
        if agree.any():
            smooth.append((parts[agree].reshape(-1, 4), np.repeat(excess, 4, axis=0)))
        cells = parts[~agree].reshape(-1, 4)
        cells = cells[((cells[:, 1] - cells[:, 0]) > 1) | ((cells[:, 3] - cells[:, 2]) > 1)]
    measured = known.has.reshape(surface.covered.shape).copy()
    for parts, excess in smooth:
        known.fill(parts, excess)
    form = (*surface.covered.shape, -1)
    return known.values.reshape(form), known.errors.reshape(form), measured


def _first_cells(shape: tuple[int, ...], step: int) -> Integers:
    """Return cells (n, 4): first and last row, first and last column."""
    spans = []
    for length in shape:
        lines = np.unique(np.append(np.arange(0, length, step), length - 1))
        spans.append(np.column_stack([lines[:-1], lines[1:]]) if length > 1 else np.zeros((1, 2)))
    rows, columns = spans
    down, across = len(rows), len(columns)
    return np.hstack([np.repeat(rows, across, axis=0), np.tile(columns, (down, 1))]).astype(int)


def _corners(cells: Integers) -> Integers:
    """Return rows and columns (n, 4, 2) of the corners."""
    top, bottom, left, right = cells.T
    return np.stack([top, left, top, right, bottom, left, bottom, right], 1).reshape(-1, 4, 2)


def _lines(cells: Integers) -> tuple[Integers, Integers]:
    """Return three rows and three columns of each cell (n, 3)."""
    top, bottom, left, right = cells.T
    return (
        np.stack([top, (top + bottom) // 2, bottom], 1),
        np.stack([left, (left + right) // 2, right], 1),
    )


def _middles(cells: Integers) -> Integers:
    """Return rows and columns (n, 5, 2) of the middles of four sides, and of the cell."""
    rows, columns = _lines(cells)
    places = [[0, 1], [2, 1], [1, 0], [1, 2], [1, 1]]
    return np.stack([np.stack([rows[:, i], columns[:, j]], 1) for i, j in places], 1)


def _quarters(cells: Integers) -> Integers:
    """Return the quarters (n, 4, 4) of cells."""
    rows, columns = _lines(cells)
    return np.stack(
        [
            np.column_stack([rows[:, i : i + 2], columns[:, j : j + 2]])
            for i in range(2)
            for j in range(2)
        ],
        axis=1,
    )


def _weights(cells: Integers, places: Integers) -> Floats:
    """Return the weights (n, m, 4) of the corners of cells at places (n, m, 2) in them."""
    low = cells[:, None, ::2]
    size = np.maximum(cells[:, None, 1::2] - low, 1)
    down, across = np.moveaxis((places - low) / size, -1, 0)
    up, back = 1.0 - down, 1.0 - across
    return np.stack([up * back, up * across, down * back, down * across], axis=-1)


class _Known:
    """The points of a map that are known so far."""

    def __init__(self, surface: Surface, look: Look):
        self.surface, self.look = surface, look
        self.width = surface.covered.shape[1]
        self.covered = surface.covered.ravel()
        self.has = np.zeros(len(self.covered), bool)
        self.values = self.errors = np.zeros((0, 1))

    def flat(self, places: Integers) -> Integers:
        """Return numbers of points by rows and columns (..., 2)."""
        return places[..., 0] * self.width + places[..., 1]

    def add(self, places: Integers) -> None:
        """Measure points that are not known."""
        flat = np.unique(self.flat(places))
        flat = flat[self.covered[flat] & ~self.has[flat]]
        if not len(flat):
            return
        values, errors = self.look(flat // self.width, flat % self.width)
        if not self.has.any():
            self.values = np.full((len(self.has), values.shape[1]), np.nan)
            self.errors = self.values.copy()
        self.values[flat], self.errors[flat], self.has[flat] = values, errors, True

    def compared(self, cells: Integers, tolerance: float) -> tuple[NDArray[np.bool_], Floats]:
        """Return which cells are smooth, and the variance of interpolation (m, k) of these."""
        corners, middles = self.flat(_corners(cells)), self.flat(_middles(cells))
        weights = _weights(cells, _middles(cells))
        expected = np.einsum("nmc,nck->nmk", weights, self.values[corners])
        noise = np.einsum("nmc,nck->nmk", weights**2, self.errors[corners] ** 2)
        noise += self.errors[middles] ** 2
        squares = (self.values[middles] - expected) ** 2
        least = np.maximum(tolerance * np.abs(expected), SIGNIFICANT * np.sqrt(noise))
        agree = (squares <= least**2).all(axis=(1, 2)) & self._is_even(corners, middles, weights)
        excess, level = ((each[agree]).mean(axis=1) for each in (squares - noise, expected**2))
        lit = level > 0.0
        common = (excess[lit] / level[lit]).mean() if lit.any() else 0.0  # of a value's square
        return agree, np.maximum(excess, max(common, 0.0) * level)

    def _is_even(self, corners: Integers, middles: Integers, weights: Floats) -> NDArray[np.bool_]:
        """Return which cells are a nearly flat part of a single surface, all of it covered."""
        points, normals = self.surface.points.reshape(-1, 3), self.surface.normals.reshape(-1, 3)
        whole = self.covered[corners].all(axis=1) & self.covered[middles].all(axis=1)
        away = np.linalg.norm(weights @ points[corners] - points[middles], axis=-1).max(axis=1)
        diagonal = np.linalg.norm(points[corners[:, 0]] - points[corners[:, 3]], axis=-1)
        turned = np.einsum("nmi,ni->nm", normals[corners], normals[middles[:, 4]]).min(axis=1)
        return whole & (away <= BENT * diagonal) & (turned >= TURNED)

    def fill(self, cells: Integers, excess: Floats) -> None:
        """Interpolate the points of cells that are not known; excess: variance (n, k) of it."""
        sizes = cells[:, 1::2] - cells[:, ::2]
        for size in np.unique(sizes, axis=0):
            chosen = (sizes == size).all(axis=1)
            self._fill_alike(cells[chosen], excess[chosen], size)

    def _fill_alike(self, cells: Integers, excess: Floats, size: Integers) -> None:
        """Interpolate in cells of the same size."""
        corners = self.flat(_corners(cells))
        values, variances = self.values[corners], self.errors[corners] ** 2
        for down, across in np.ndindex(*(size + 1)):
            place = cells[:, None, ::2] + [down, across]
            flat = self.flat(place[:, 0])
            new = ~self.has[flat] & self.covered[flat]
            weights = _weights(cells[:1], place[:1])[0, 0]
            self.values[flat[new]] = weights @ values[new]
            self.errors[flat[new]] = np.sqrt(weights**2 @ variances[new] + excess[new])
