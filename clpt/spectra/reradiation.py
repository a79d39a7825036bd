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
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats, Matrix
from clpt.errors import SceneError
from clpt.files import input_files as text_files
from clpt.spectra import cie
from clpt.spectra.files import fields_of
from clpt.spectra.spectrum import Spectrum, Tabulated, _floats, d65, extremes, gridded

STEP = 5.0  # [nm] between a tabulated matrix's wavelengths
GRID = np.arange(250.0, 900.0 + STEP, STEP)  # [nm], those of a Fluorophore
LEAST_REST = 1e-3  # least share of an emission above `in`; below it, nothing is emitted
NOISE = 2.0  # a value below this many standard deviations counts as 0
QUIET = 40.0  # [nm] below the exciting wavelength, where a measured value is noise


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


def read_bispectral(path: str | Path) -> tuple[Tabulated, Donaldson]:
    """Read reflectance and re-radiation from a matrix of a Labsphere BFC-450, by its `.BFC` text.

    A row is a wavelength out, a column a wavelength in, and a value the share of energy per band
    of the instrument. Reflectance and fluorescence are separated as follows. Values at a longer
    wavelength in than out are noise; a value below two standard deviations of this noise, taken
    40 nm off, counts as 0. The diagonal is reflectance, less half of its neighbour on the side of
    fluorescence. Fluorescence falls to zero within two bands of its last value. Below the first
    row the reflectance holds. Raises SceneError.
    """
    out, into, values = _matrix(path)
    gap = into - out[:, None]
    level = NOISE * float(values[gap >= QUIET].std()) if (gap >= QUIET).any() else 0.0
    glow = np.where((gap < 0.0) & (values > level), values, 0.0)
    diagonal = []
    for i, wavelength in enumerate(out):
        j = int(np.argmin(np.abs(into - wavelength)))
        if into[j] != wavelength:
            raise SceneError(f"the matrix has no column for {wavelength:g} nm", file=path)
        glow[i, j] = 0.5 * glow[i, j - 1] if j else 0.0
        diagonal.append(min(max(values[i, j] - glow[i, j], 0.0), 1.0))
    band = float(out[1] - out[0])
    return Tabulated(out, diagonal, "hold"), _donaldson(path, out, into, glow / band)


def read_reradiation(path: str | Path) -> Donaldson:
    """Read a re-radiation matrix: a `.BFC` file, or a table of values [1/nm] as text.

    The table's first line is a label and the wavelengths in; every other line a wavelength out and
    its row. Blanks, commas or semicolons separate fields; `#` starts a comment. Raises SceneError.
    """
    if Path(path).suffix.lower() == ".bfc":
        return read_bispectral(path)[1]
    lines = _lines(path)
    head, rows = lines[0], lines[1:]
    into = _numbers(head[1][1:], path, head[0])
    table = [_numbers(fields, path, number) for number, fields in rows]
    return _donaldson(path, [row[0] for row in table], into, [row[1:] for row in table])


def _matrix(path: str | Path) -> tuple[Floats, Floats, Floats]:
    """Return a BFC file's wavelengths of rows and of columns [nm], and its values."""
    lines = _lines(path)
    start = next((i for i, (_, f) in enumerate(lines) if f[0].lower().startswith("r:c")), None)
    if start is None:
        raise SceneError("no line 'r:c:' with the wavelengths in, so not a BFC matrix", file=path)
    into = _numbers(lines[start][1][1:], path, lines[start][0])
    table = [_numbers(f, path, n) for n, f in lines[start + 1 :] if f[0] != "EOD"]
    if len(table) < 2 or any(len(row) != len(into) + 1 for row in table):
        raise SceneError(f"needs two or more rows of {len(into) + 1} numbers", file=path)
    values = np.array(table)
    return values[:, 0], np.array(into), values[:, 1:]


def _lines(path: str | Path) -> list[tuple[int, list[str]]]:
    """Return number and fields of each line that is not empty; `;` begins a comment line."""
    numbered_fields = []
    for number, line in enumerate(text_files.read(path).splitlines(), 1):
        fields = [] if line.startswith(";") else fields_of(line, path, number)
        if fields:
            numbered_fields.append((number, fields))
    if len(numbered_fields) < 3:
        raise SceneError("holds no matrix of two rows or more", file=path)
    return numbered_fields


def _numbers(fields: list[str], path: str | Path, line: int) -> list[float]:
    try:
        return [float(field) for field in fields]
    except ValueError:
        shown = " ".join(fields)[:40]
        raise SceneError(f"expected numbers, found {shown!r}", file=path, line=line) from None


def _donaldson(path: str | Path, out: Any, into: Any, rows: Any) -> Donaldson:
    """Return the matrix; an error names the file."""
    try:
        return Donaldson(_floats(out), _floats(into), tuple(_floats(row) for row in rows))
    except SceneError as error:
        raise SceneError(error.message, file=path) from None
