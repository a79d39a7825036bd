"""Fluorescence: light absorbed at a wavelength and emitted at a longer wavelength.

A re-radiation matrix Phi(out, in) [1/nm] (Donaldson 1954) is the share of the energy that arrives
at `in` and leaves again per nm at `out`. It holds fluorescence alone; light that keeps its
wavelength belongs to the reflectance. Light never leaves at a shorter wavelength than it had
(Stokes 1852), but for the step of a table: energy absorbed between two wavelengths of the table
may leave between the same two.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Matrix
from clpt.errors import SceneError
from clpt.spectra import cie
from clpt.spectra.spectrum import Spectrum, Tabulated, d65, extremes, gridded

STEP = 5.0  # [nm] between a tabulated matrix's wavelengths
GRID = np.arange(250.0, 900.0 + STEP, STEP)  # [nm], those of a Fluorophore
LEAST_REST = 1e-3  # least share of an emission above `in`; below it, nothing is emitted


class Reradiation(ABC):
    """A re-radiation matrix: bilinear between the wavelengths of a table, zero outside."""

    @property
    @abstractmethod
    def table(self) -> tuple[Matrix, Matrix, Matrix]:
        """Wavelengths out (m,) and in (n,) [nm], ascending, and Phi (m, n) [1/nm], float64."""

    def sample(self, out: ArrayLike, into: ArrayLike) -> Matrix:
        """Phi [1/nm] where light arrives at `into` and leaves at `out` [nm], broadcast together."""
        rows, columns, values = self.table
        out, into = np.broadcast_arrays(np.asarray(out, float), np.asarray(into, float))
        (i, s, inside), (j, t, among) = _cells(rows, out), _cells(columns, into)
        near = values[i, j] * (1.0 - t) + values[i, j + 1] * t
        far = values[i + 1, j] * (1.0 - t) + values[i + 1, j + 1] * t
        return np.where(inside & among, near * (1.0 - s) + far * s, 0.0)

    def on_nodes(self, nodes: Matrix) -> Matrix:
        """Phi (n, n) [1/nm] at even wavelengths (n,) [nm]; the energy in between is kept.

        Rows are wavelengths out. See `clpt.spectra.spectrum.gridded`.
        """
        rows, columns, values = self.table
        out = np.stack([gridded(Tabulated(rows, column), nodes) for column in values.T], axis=-1)
        return np.stack([gridded(Tabulated(columns, row), nodes) for row in out])

    def emitted(self, into: ArrayLike) -> Matrix:
        """Share of the energy arriving at `into` [nm] that is re-emitted, at any wavelength."""
        rows, columns, values = self.table
        sums = _weights(rows) @ values
        return np.asarray(np.interp(np.asarray(into, float), columns, sums, 0.0, 0.0))

    def to_rgb(self, low: float = cie.LAMBDA_MIN, high: float = cie.LAMBDA_MAX) -> Matrix:
        """Linear Rec.709 (3,) of the light re-emitted under D65 that is limited to [low, high] nm.

        White paper has (1, 1, 1); a bright pigment may exceed it, and lie outside of the gamut.
        """
        light = np.arange(low, high + 0.5)
        arriving = d65().sample(light) * _weights(light)
        glow = self.sample(cie.GRID[:, None], light) @ arriving
        return cie.xyz_to_rgb(cie.spectrum_to_xyz(glow))


@dataclass(frozen=True)
class Donaldson(Reradiation):
    """A measured matrix: a row [1/nm] for each wavelength `out`, a column for each `into`.

    Raises SceneError where the wavelengths do not ascend, or a value is missing or below zero.
    """

    out: tuple[float, ...]
    into: tuple[float, ...]
    rows: tuple[tuple[float, ...], ...]

    def __post_init__(self) -> None:
        for name, lambdas in (("out", self.out), ("into", self.into)):
            if len(lambdas) < 2 or not (np.diff(lambdas) > 0.0).all():
                raise SceneError(f"the wavelengths {name!r} of a matrix must be two or more, and"
                                 " ascend")  # fmt: skip
        if [len(row) for row in self.rows] != [len(self.into)] * len(self.out):
            raise SceneError(
                f"a re-radiation matrix needs {len(self.out)} rows of {len(self.into)} values"
            )
        values = np.array([*self.out, *self.into, *(v for row in self.rows for v in row)])
        if not np.isfinite(values).all() or (values < 0.0).any():
            raise SceneError("a re-radiation matrix has a value that is negative or not finite")

    @cached_property
    def table(self) -> tuple[Matrix, Matrix, Matrix]:
        return np.array(self.out), np.array(self.into), np.array(self.rows)


@dataclass(frozen=True)
class Fluorophore(Reradiation):
    """A dye: its absorption, the shape of its emission, and its yield of photons.

    Phi(out, in) = quantum_yield absorption(in) in emission(out) / sum of (l emission(l) dl): a
    photon's energy falls with its wavelength, so energy is lost where `out` is longer than `in`.
    absorption: share of the light in [0, 1]; emission: relative radiance per nm, of any scale. The
    emission's shape does not depend on `in` (Vavilov 1927; Kasha 1950), but for its part below
    `in`: this is cut off, and the part above is scaled up so that the yield holds. Both are
    averaged around wavelengths 5 nm apart, from 250 to 900 nm; narrow lines keep their area.
    Raises SceneError for numbers outside their limits.
    """

    absorption: Spectrum
    emission: Spectrum
    quantum_yield: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.quantum_yield <= 1.0:
            raise SceneError(f"a quantum yield lies in [0, 1], not {self.quantum_yield}")
        (least, _), (most, _) = extremes(self.absorption)
        if not (least >= 0.0 and most <= 1.0 + 1e-6):
            raise SceneError("an absorption must lie in [0, 1]")
        (least, _), _ = extremes(self.emission)
        if not least >= 0.0 or not gridded(self.emission, GRID).any():
            raise SceneError(
                f"an emission must not be negative, nor zero from {GRID[0]:g} to {GRID[-1]:g} nm"
            )

    @cached_property
    def table(self) -> tuple[Matrix, Matrix, Matrix]:
        return GRID, GRID, self._matrix(GRID)

    def on_nodes(self, nodes: Matrix) -> Matrix:
        """Phi (n, n) [1/nm] at even wavelengths (n,) [nm]; the yield counts what leaves beyond."""
        step = nodes[1] - nodes[0]
        before = max(int(np.ceil((nodes[0] - GRID[0]) / step)), 0)
        after = max(int(np.ceil((GRID[-1] - nodes[-1]) / step)), 0)
        grid = nodes[0] + step * np.arange(-before, len(nodes) + after)
        inside = slice(before, before + len(nodes))
        return self._matrix(grid)[inside, inside]

    def _matrix(self, grid: Matrix) -> Matrix:
        """Return Phi (n, n) at even wavelengths that cover GRID; it is 0 outside of GRID."""
        known = (grid >= GRID[0]) & (grid <= GRID[-1])
        absorbed, emitted = (
            np.where(known, gridded(part, grid), 0.0) for part in (self.absorption, self.emission)
        )
        stokes = np.where(grid[:, None] > grid, emitted[:, None], 0.0)
        photons = (_weights(grid) * grid) @ stokes
        enough = photons > LEAST_REST * ((_weights(grid) * grid) @ emitted)
        scale = np.divide(grid, photons, out=np.zeros(grid.shape), where=enough)
        return self.quantum_yield * absorbed * scale * stokes


def _weights(nodes: Matrix) -> Matrix:
    """Return the weights of the trapezoid rule."""
    half = 0.5 * np.diff(nodes)
    return np.append(half, 0.0) + np.append(0.0, half)


def _cells(nodes: Matrix, at: Matrix) -> tuple[NDArray[np.intp], Matrix, NDArray[np.bool_]]:
    """Return each wavelength's cell between nodes, its fraction of the cell, whether inside."""
    cell = np.clip(np.searchsorted(nodes, at, "right") - 1, 0, len(nodes) - 2)
    along = (at - nodes[cell]) / (nodes[cell + 1] - nodes[cell])
    return cell, along, (at >= nodes[0]) & (at <= nodes[-1])
