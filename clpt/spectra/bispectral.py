"""Readers of measured fluorescence: BFC-450 matrices, and plain tables."""

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

NOISE = 2.0  # a value below this many standard deviations counts as 0
QUIET = 40.0  # [nm] below the exciting wavelength, where a measured value is noise


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
