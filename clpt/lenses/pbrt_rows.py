"""Lens files of pbrt's `realistic` camera: rows of radius, thickness, index and diameter [mm].

The stop is the row whose radius is 0; its index is not read. `#` starts a comment.
"""

from __future__ import annotations

from pathlib import Path

from clpt.lenses.glasses import AIR, by_number
from clpt.lenses.lines import Line, Row, assembled
from clpt.lenses.prescription import Prescription, Surface

COLUMNS = ("a radius", "a thickness", "an index", "a diameter")


def parse(text: str, file: Path) -> Prescription:
    """Read a lens. Raises SceneError with the line."""
    rows, comments = [], []
    for number, written in enumerate(text.splitlines(), 1):
        values, mark, comment = written.partition("#")
        if mark and comment.strip():
            comments.append(comment.strip())
        line = Line(file, number, tuple(values.split()))
        if not line.fields:
            continue
        if len(line.fields) != len(COLUMNS):
            raise line.error(f"a row has {len(COLUMNS)} numbers, not {len(line.fields)}")
        radius, thickness, index, diameter = (
            line.numeral(i, what) for i, what in enumerate(COLUMNS)
        )
        stop = radius == 0.0
        with line.locating():
            glass = AIR if stop or index == 0.0 else by_number(index)
        surface = Surface(radius, thickness, glass, 0.5 * diameter, stop=stop)
        rows.append(Row(line, surface))
    return assembled(rows, file, file.stem, comments[0] if comments else "")
