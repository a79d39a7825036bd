"""Text of Optical Bench (photonstophotos.net): tables of a lens, fields separated by tabs.

`[lens data]` has a row for each surface: its number, radius (`AS` the stop, `FS` a field stop,
`Infinity` a plane), thickness or a name, index, diameter, Abbe number, glass. `[aspherical data]`
has number, radius, conic constant and factors of r^4, r^6, ... `[variable distances]` has a value
for each state of a zoom or focus; the first is read.
`[coating]`, ours: a surface's number and pairs of index and thickness [nm], from the front on.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from clpt.errors import SceneError
from clpt.lenses.glasses import AIR, by_name, by_number, known
from clpt.lenses.lines import Line, Row, assembled
from clpt.lenses.prescription import Coat, Prescription, Surface
from clpt.spectra import Constant, Spectrum

PLANES = ("infinity", "inf", "∞", "0", "0.0", "")
STOPS, FIELD_STOPS = ("as", "stop", "aperture", "sto"), ("fs", "cg", "field stop")
ENDS = ("bf", "")  # fields for the distance to the film


def parse(text: str, file: Path) -> Prescription:
    """Read a lens. Raises SceneError with the line."""
    tables = _tables(text, file)
    if "lens data" not in tables:
        raise SceneError("has no table [lens data]", file=file)
    distances = {line.fields[0].lower(): line for line in tables.get("variable distances", [])}
    wanted = _number_of(distances.get("aperture diameter"))
    rows: dict[str, Row] = {}
    for line in tables["lens data"]:
        key = line.fields[0]
        if key in rows:
            raise line.error(f"the surface {key!r} is given twice")
        rows[key] = Row(line, _surface(line, distances, wanted))
    for line in tables.get("aspherical data", []):
        row = _row_of(line, rows)
        values = [line.numeral(i, "a factor") for i in range(2, len(line.fields)) if line.fields[i]]
        conic, factors = (values[0], values[1:]) if values else (0.0, [])
        with line.locating():
            row.surface = replace(row.surface, conic=conic, aspheric=tuple(factors))
            row.surface.check()
    for line in tables.get("coating", []):
        row = _row_of(line, rows)
        values = [line.numeral(i, "a film") for i in range(1, len(line.fields))]
        if len(values) % 2:
            raise line.error("a coating is pairs of an index and a thickness [nm]")
        pairs = zip(values[::2], values[1::2], strict=True)
        coating = tuple(Coat(Constant(index), thickness) for index, thickness in pairs)
        row.surface = replace(row.surface, coating=coating)
    described = {line.fields[0].lower(): line for line in tables.get("descriptive data", [])}
    texts = (
        " ".join(described[k].fields[1:]) if k in described else "" for k in ("title", "source")
    )
    title, source = texts
    return assembled(list(rows.values()), file, title, source)


def _tables(text: str, file: Path) -> dict[str, list[Line]]:
    """Return the lines of each table, by its name in small letters."""
    tables: dict[str, list[Line]] = {}
    current: list[Line] | None = None
    for number, written in enumerate(text.splitlines(), 1):
        stripped = written.strip()
        if stripped.startswith("["):
            current = tables.setdefault(stripped.strip("[]").strip().lower(), [])
        elif stripped and not stripped.startswith("#") and current is not None:
            fields = tuple(field.strip() for field in written.rstrip().split("\t"))
            current.append(Line(file, number, fields))
    return tables


def _row_of(line: Line, rows: dict[str, Row]) -> Row:
    if line.fields[0] not in rows:
        raise line.error(f"there is no surface {line.fields[0]!r} in [lens data]")
    return rows[line.fields[0]]


def _number_of(line: Line | None) -> float | None:
    """Return the first value of a line in [variable distances]."""
    if line is None or len(line.fields) < 2:
        return None
    try:
        value = float(line.fields[1])
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _surface(line: Line, distances: dict[str, Line], wanted: float | None) -> Surface:
    fields = line.fields + ("",) * 7
    shape = fields[1].lower()
    stop = shape in STOPS
    plane = stop or shape in FIELD_STOPS or shape in PLANES
    radius = 0.0 if plane else line.numeral(1, "a radius")
    diameter = wanted if stop and not fields[4] and wanted else line.numeral(4, "a diameter")
    with line.locating():
        glass: Spectrum = AIR
        if fields[6] and known(fields[6]) is not None:
            glass = by_name(fields[6])
        elif fields[3]:
            abbe = line.numeral(5, "an Abbe number") if fields[5] else 0.0
            glass = by_number(line.numeral(3, "an index"), abbe)
    return Surface(radius, _thickness(line, fields[2], distances), glass, 0.5 * diameter, stop=stop)


def _thickness(line: Line, field: str, distances: dict[str, Line]) -> float:
    if field.lower() in ENDS:
        return 0.0
    if field.lower() in distances:
        value = _number_of(distances[field.lower()])
        if value is None:
            raise distances[field.lower()].error(f"{field!r} has no distance here")
        return value
    return line.numeral(2, "a thickness")
