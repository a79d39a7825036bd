"""Readers of measured spectra: two-column text (.spd, CSV) and refractiveindex.info's YAML."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.spectra.spectrum import Cauchy, Constant, Outside, Sellmeier, Spectrum, Tabulated

MICROMETRE = 1000.0  # [nm]
FORMULA_POINTS = 2001  # at which a formula without a class of its own is tabulated


def read_table(path: str | Path, outside: Outside = "zero") -> Tabulated:
    """Read `wavelength [nm], value` lines, separated by blanks, commas or semicolons.

    `#` starts a comment; one line of column titles is allowed. Raises SceneError with the line.
    """
    rows: list[tuple[float, float]] = []
    titles_allowed = True
    for number, line in enumerate(_text(path).splitlines(), 1):
        fields = [f for f in re.split(r"[\s,;]+", line.split("#")[0]) if f]
        if not fields:
            continue
        try:
            wavelength, value = (float(field) for field in fields)
        except ValueError:
            if titles_allowed and not any(_is_number(field) for field in fields):
                titles_allowed = False
                continue
            raise SceneError(
                f"expected a wavelength in nm and a value, found {line.strip()!r}",
                file=path,
                line=number,
            ) from None
        if rows and wavelength <= rows[-1][0]:
            raise SceneError(
                f"wavelengths must ascend, but {wavelength:g} follows {rows[-1][0]:g}",
                file=path,
                line=number,
            )
        rows.append((wavelength, value))
        titles_allowed = False
    if not rows:
        raise SceneError("no wavelengths in this file", file=path)
    lambdas, values = zip(*rows, strict=True)
    try:
        return Tabulated(lambdas, values, outside)
    except SceneError as error:
        raise SceneError(error.message, file=path) from None


def read_refractive_index(path: str | Path) -> tuple[Spectrum, Spectrum]:
    """Read eta and k from a page of refractiveindex.info's database (YAML); k is 0 where not given.

    Tables hold their end values; the dispersion formulas 1 to 6 are known. Raises SceneError.
    """
    text = _text(path)
    try:
        page = yaml.safe_load(text)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        line = mark.line + 1 if mark else None
        raise SceneError(f"not YAML: {error}", file=path, line=line) from None
    parts = page.get("DATA") if isinstance(page, dict) else None
    if not isinstance(parts, list) or not all(isinstance(part, dict) for part in parts):
        raise SceneError("no list DATA, so not a page of refractiveindex.info", file=path)
    eta: Spectrum | None = None
    k: Spectrum = Constant(0.0)
    for part in parts:
        kind = str(part.get("type", ""))
        try:
            if kind.startswith("formula"):
                eta = _formula(kind.removeprefix("formula").strip(), part)
            elif kind in ("tabulated n", "tabulated k", "tabulated nk"):
                columns = _columns(part, 3 if kind.endswith("nk") else 2)
                if "n" in kind.split()[1]:
                    eta = Tabulated(columns[0] * MICROMETRE, columns[1], "hold")
                if "k" in kind.split()[1]:
                    k = Tabulated(columns[0] * MICROMETRE, columns[-1], "hold")
            else:
                raise SceneError(f"unknown type of data {kind!r}")
        except SceneError as error:
            line = _line_of(text, error.where or kind)
            raise SceneError(error.message, file=path, line=line) from None
    if eta is None:
        raise SceneError("no refractive index in this file", file=path)
    return eta, k


def _formula(name: str, part: dict[str, Any]) -> Spectrum:
    """Dispersion formula of refractiveindex.info, by its number; wavelengths in um."""
    if name not in ("1", "2", "3", "4", "5", "6"):
        raise SceneError(f"dispersion formula {name!r} is not known; 1 to 6 are")
    number, c = int(name), _numbers(part, "coefficients")
    if number != 4 and len(c) % 2 == 0:
        raise SceneError(f"formula {number} takes an odd number of coefficients, found {len(c)}")
    pairs = list(zip(c[1::2], c[2::2], strict=False))
    if number in (1, 2):
        b = tuple(pair[0] for pair in pairs)
        squares = tuple(pair[1] ** (3 - number) for pair in pairs)
        return Sellmeier(b, squares, 1.0 + c[0])
    if number == 5 and [p for _, p in pairs] in ([-2.0], [-2.0, -4.0]):
        return Cauchy(c[0], *(b for b, _ in pairs))
    ends = _numbers(part, "wavelength_range")
    um = np.linspace(ends[0], ends[-1], FORMULA_POINTS)
    if number in (3, 5):
        total = sum((b * um**p for b, p in pairs), np.full(um.shape, c[0]))
        index = np.sqrt(total) if number == 3 else total
    elif number == 4:
        c = c + [0.0] * (9 - len(c))
        total = c[0] + c[1] * um ** c[2] / (um**2 - c[3] ** c[4])
        total = total + c[5] * um ** c[6] / (um**2 - c[7] ** c[8])
        rest = c[9:]
        powers = zip(rest[::2], rest[1::2], strict=False)
        index = np.sqrt(sum((b * um**p for b, p in powers), total))
    else:
        index = sum((b / (s - um**-2.0) for b, s in pairs), np.full(um.shape, 1.0 + c[0]))
    return Tabulated(um * MICROMETRE, index, "hold")


def _columns(part: dict[str, Any], count: int) -> NDArray[np.float64]:
    lines = str(part.get("data", "")).strip().splitlines()
    rows = [line.split() for line in lines]
    for line, row in zip(lines, rows, strict=True):
        if len(row) != count or not all(_is_number(field) for field in row):
            message = f"expected {count} numbers a line, found {line.strip()!r}"
            raise SceneError(message, where=line.strip())
    if not rows:
        raise SceneError("a table without rows")
    columns = np.array(rows, np.float64).T
    # Curves read off figures repeat a wavelength now and then; its first row counts.
    return columns[:, np.unique(columns[0], return_index=True)[1]]


def _numbers(part: dict[str, Any], name: str) -> list[float]:
    fields = str(part.get(name, "")).split()
    if not fields or not all(_is_number(field) for field in fields):
        raise SceneError(f"expected numbers in {name}, found {part.get(name)!r}")
    return [float(field) for field in fields]


def _line_of(text: str, part: str) -> int | None:
    lines = text.splitlines()
    return next((i for i, line in enumerate(lines, 1) if part and part in line), None)


def _is_number(field: str) -> bool:
    try:
        float(field)
    except ValueError:
        return False
    return True


def _text(path: str | Path) -> str:
    try:
        return Path(path).read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise SceneError(f"cannot be read: {error}", file=path) from None
