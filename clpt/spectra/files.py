"""Readers of measured spectra: text in columns (.spd, CSV) and refractiveindex.info's pages."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import input_files as text_files
from clpt.spectra.dispersion import MICROMETRE, from_formula
from clpt.spectra.spectrum import (
    Constant,
    Outside,
    Spectrum,
    Tabulated,
    absorption,
    check_reach,
)

PAGES = (".yml", ".yaml")
SITE_COLUMNS = (["wl", "n"], ["wl", "k"])  # titles in refractiveindex.info's CSV, in um


def read_table(path: str | Path, outside: Outside = "zero") -> Tabulated:
    """Read `wavelength [nm], value` lines, separated by blanks, commas or semicolons.

    `#` starts a comment; a line of column titles is allowed. Raises SceneError with the line.
    """
    (rows,) = _tables(path, text_files.read(path), (2,)).values()
    return _tabulated(path, rows, 1, outside)


def read_columns(path: str | Path, count: int) -> tuple[Tabulated, ...]:
    """Read rows of a wavelength [nm] and `count` values, in the form of `read_table`.

    Each column of values is a spectrum, zero outside. Raises SceneError with the line.
    """
    (rows,) = _tables(path, text_files.read(path), (1 + count,)).values()
    return tuple(_tabulated(path, rows, column, "zero") for column in range(1, 1 + count))


def read_index(path: str | Path, part: Literal["eta", "k"] = "eta") -> Spectrum:
    """Read eta or k from a file of `read_refractive_index`, or the values of a two-column table.

    Raises SceneError.
    """
    text = text_files.read(path)
    if (values := _two_columns(path, text)) is not None:
        return values
    eta, k = _read_parts(path, text)
    if part == "eta" and eta is None:
        raise SceneError("no refractive index in this file", file=path)
    return k if part == "k" or eta is None else eta


def read_absorption(path: str | Path) -> Spectrum:
    """Read a coefficient [1/m]: 4 pi k / lambda of a `read_refractive_index` file, or a table.

    A table has two columns, wavelength [nm] and coefficient. Raises SceneError.
    """
    text = text_files.read(path)
    values = _two_columns(path, text)
    return absorption(_read_parts(path, text)[1]) if values is None else values


def _two_columns(path: str | Path, text: str) -> Tabulated | None:
    """Return a plain table of wavelength and value; None if the file has another form."""
    if _is_page(path, text):
        return None
    tables = _tables(path, text, (2, 3))
    plain = list(tables) == [""] and len(tables[""][0]) == 2
    return _tabulated(path, tables[""], 1, "hold") if plain else None


def read_refractive_index(path: str | Path) -> tuple[Spectrum, Spectrum]:
    """Read eta and k; k is 0 where it is not given. Outside of a table its end values hold.

    The file is a page of refractiveindex.info's database (YAML) with a dispersion formula or tables
    of n and k, the site's CSV (columns `wl,n`, then `wl,k` [um]), or a table of wavelength [nm],
    eta and perhaps k. Raises SceneError with the line.
    """
    eta, k = _read_parts(path, text_files.read(path))
    if eta is None:
        raise SceneError("no refractive index in this file", file=path)
    return eta, k


def _is_page(path: str | Path, text: str) -> bool:
    return Path(path).suffix in PAGES or re.search("^DATA:", text, re.MULTILINE) is not None


def _read_parts(path: str | Path, text: str) -> tuple[Spectrum | None, Spectrum]:
    if _is_page(path, text):
        return _page(path, text)
    tables = _tables(path, text, (2, 3))
    parts: dict[str, Spectrum] = {"k": Constant(0.0)}
    for title, rows in tables.items():
        parts[title or "n"] = _tabulated(path, rows, 1, "hold")
        if len(rows[0]) == 3:
            parts["k"] = _tabulated(path, rows, 2, "hold")
    return parts.get("n"), parts["k"]


def _tables(path: str | Path, text: str, widths: tuple[int, ...]) -> dict[str, list[list[float]]]:
    """Return rows in nm of a text's tables by title: "", or the site's "n" and "k".

    widths: the numbers of columns that a row may have. Raises SceneError with the line.
    """
    tables: dict[str, list[list[float]]] = {}
    title, titles_allowed, factor = "", True, 1.0
    for number, line in enumerate(text.splitlines(), 1):
        fields = fields_of(line, path, number)
        if not fields:
            continue
        if 3 in widths and fields in SITE_COLUMNS and "" not in tables:
            title, factor = fields[1], MICROMETRE
            continue
        if titles_allowed and not any(_is_number(field) for field in fields):
            titles_allowed = False
            continue
        titles_allowed = False
        rows = tables.setdefault(title, [])
        if not all(map(_is_number, fields)) or len(fields) not in (
            (len(rows[0]),) if rows else widths
        ):
            known = {(2,): "a value", (2, 3): "eta and perhaps k"}
            columns = known.get(widths, f"{widths[0] - 1} values")
            message = f"expected a wavelength in nm and {columns}, found {line.strip()!r}"
            raise SceneError(message, file=path, line=number)
        row = [float(fields[0]) * factor, *map(float, fields[1:])]
        if rows and row[0] <= rows[-1][0]:
            message = f"wavelengths must ascend, but {row[0]:g} follows {rows[-1][0]:g}"
            raise SceneError(message, file=path, line=number)
        rows.append(row)
    if not tables:
        raise SceneError("no wavelengths in this file", file=path)
    return tables


def fields_of(line: str, path: str | Path, number: int) -> list[str]:
    """Split a line at blanks, commas or semicolons; `#` starts a comment.

    Raises SceneError for a decimal comma: it would begin another field.
    """
    text = line.split("#")[0]
    comma = text_files.comma_message(text)
    if comma and re.search(r";|[^\s,;]\s+[^\s,;]", text.strip()):
        raise SceneError(comma, file=path, line=number)
    return [f for f in re.split(r"[\s,;]+", text) if f]


def _tabulated(
    path: str | Path, rows: list[list[float]], column: int, outside: Outside
) -> Tabulated:
    try:
        return Tabulated([row[0] for row in rows], [row[column] for row in rows], outside)
    except SceneError as error:
        raise SceneError(error.message, file=path) from None


def _page(path: str | Path, text: str) -> tuple[Spectrum | None, Spectrum]:
    """Return eta, or None, and k from a page of the database."""
    page = _yaml(path, text)
    parts = page.get("DATA") if isinstance(page, dict) else None
    if not isinstance(parts, list) or not all(isinstance(part, dict) for part in parts):
        raise SceneError("no list DATA, so not a page of refractiveindex.info", file=path)
    eta: Spectrum | None = None
    k: Spectrum = Constant(0.0)
    for part in parts:
        kind = str(part.get("type", ""))
        try:
            if kind.startswith("formula"):
                ends = _numbers(part, "wavelength_range")
                check_reach(ends[0] * MICROMETRE, ends[-1] * MICROMETRE)
                name = kind.removeprefix("formula").strip()
                eta = from_formula(name, _numbers(part, "coefficients"), ends)
            elif kind in ("tabulated n", "tabulated k", "tabulated nk"):
                columns = _page_columns(part, 3 if kind.endswith("nk") else 2)
                if "n" in kind.split()[1]:
                    eta = Tabulated(columns[0] * MICROMETRE, columns[1], "hold")
                if "k" in kind.split()[1]:
                    k = Tabulated(columns[0] * MICROMETRE, columns[-1], "hold")
            else:
                raise SceneError(f"unknown type of data {kind!r}")
        except SceneError as error:
            line = _line_of(text, error.where or kind)
            raise SceneError(error.message, file=path, line=line) from None
    return eta, k


def _yaml(path: str | Path, text: str) -> Any:
    """Return a page as texts, lists and dictionaries; aliases, which can grow endlessly, raise."""
    import yaml  # takes as long to import as all of clpt.spectra

    class Loader(yaml.BaseLoader):
        def compose_node(self, parent: Any, index: Any) -> Any:
            if self.check_event(yaml.AliasEvent):
                event: Any = self.peek_event()  # type: ignore[no-untyped-call]
                raise yaml.MarkedYAMLError(
                    None, None, "references (*name) are not read", event.start_mark
                )
            return super().compose_node(parent, index)

    try:
        return yaml.load(text, Loader)
    except yaml.YAMLError as error:
        mark, problem = getattr(error, "problem_mark", None), getattr(error, "problem", None)
        line = mark.line + 1 if mark else None
        raise SceneError(f"not YAML: {problem or error}", file=path, line=line) from None
    except RecursionError:
        raise SceneError("not a page: its YAML is nested too deeply", file=path) from None


def _page_columns(part: dict[str, Any], count: int) -> NDArray[np.float64]:
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
