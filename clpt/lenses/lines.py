"""Lines of lens files: numbers and errors that name the file and the line."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from clpt.errors import SceneError
from clpt.lenses.prescription import Prescription, Surface


@dataclass(frozen=True)
class Line:
    """A line's fields, with its number from 1."""

    file: Path
    number: int
    fields: tuple[str, ...]

    def error(self, message: str) -> SceneError:
        return SceneError(message, file=self.file, line=self.number)

    def numeral(self, at: int, name: str) -> float:
        """Return the finite number of a field."""
        if at >= len(self.fields):
            raise self.error(f"needs {name}")
        try:
            value = float(self.fields[at])
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise self.error(f"{name} must be a number, not {self.fields[at][:40]!r}")
        return value

    @contextmanager
    def locating(self) -> Iterator[None]:
        """Add this line to errors that name no file."""
        try:
            yield
        except SceneError as error:
            raise (self.error(error.message) if error.file is None else error) from None


@dataclass
class Row:
    """A surface of a file, and the line that describes it."""

    line: Line
    surface: Surface


def assembled(rows: list[Row], file: Path, name: str = "", source: str = "") -> Prescription:
    """Return the lens of rows; an error names the line of the wrong row."""
    for row in rows:
        with row.line.locating():
            row.surface.check()
    try:
        return Prescription(tuple(row.surface for row in rows), name, source)
    except SceneError as error:
        raise SceneError(error.message, file=file) from None
