"""Readers of measured fluorescence: BFC-450 matrices, and a table of our own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.files import text as text_files
from clpt.spectra.files import fields_of
from clpt.spectra.reradiation import Donaldson
from clpt.spectra.spectrum import Tabulated, _floats

NOISE = 2.0  # standard deviations below which a measured value counts as none
QUIET = 40.0  # [nm] on the short side of what excites it, where nothing can be but noise


def read_bispectral(path: str | Path) -> tuple[Tabulated, Donaldson]:
    """Read reflectance and re-radiation from a matrix of a Labsphere BFC-450, by its `.BFC` text.

    A row is a wavelength out, a column one in, and a value the share of energy per band of the
    instrument. The two are told apart as follows. Values at a longer wavelength in than out are
    noise, and so is all below two standard deviations of what lies 40 nm off there. The diagonal is
    reflectance, less half of its neighbour on the side of fluorescence: where that ends, it falls
    to zero within two bands. Below the first row the reflectance holds. Raises SceneError.
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

    The table's first line is a label and the wavelengths in; every other one a wavelength out and
    its row; separated by blanks, commas or semicolons; `#` starts a comment. Raises SceneError.
    """
    if Path(path).suffix.lower() == ".bfc":
        return read_bispectral(path)[1]
    lines = _lines(path)
    head, rows = lines[0], lines[1:]
    into = _numbers(head[1][1:], path, head[0])
    table = [_numbers(fields, path, number) for number, fields in rows]
    return _donaldson(path, [row[0] for row in table], into, [row[1:] for row in table])


def _matrix(path: str | Path) -> tuple[Floats, Floats, Floats]:
    """The wavelengths of the rows and of the columns, and the values, of a BFC file."""
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
    """Line numbers and fields of the lines that hold any; `;` begins a line of remarks."""
    found = []
    for number, line in enumerate(text_files.read(path).splitlines(), 1):
        fields = [] if line.startswith(";") else fields_of(line, path, number)
        if fields:
            found.append((number, fields))
    if len(found) < 3:
        raise SceneError("holds no matrix of two rows or more", file=path)
    return found


def _numbers(fields: list[str], path: str | Path, line: int) -> list[float]:
    try:
        return [float(field) for field in fields]
    except ValueError:
        shown = " ".join(fields)[:40]
        raise SceneError(f"expected numbers, found {shown!r}", file=path, line=line) from None


def _donaldson(path: str | Path, out: Any, into: Any, rows: Any) -> Donaldson:
    """A matrix, whose complaints name the file."""
    try:
        return Donaldson(_floats(out), _floats(into), tuple(_floats(row) for row in rows))
    except SceneError as error:
        raise SceneError(error.message, file=path) from None
