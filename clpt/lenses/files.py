"""Readers of lens files by suffix, and the library of lenses that ships with clpt.

Optical Bench: `[lens data]` has a row for each surface: its number, radius (`AS` the stop, `FS` a
field stop, `Infinity` a plane), thickness or a name, index, diameter, Abbe number, glass.
`[aspherical data]` has number, radius, conic constant and factors of r^4, r^6, ... `[variable
distances]` has a value for each state of a zoom or focus; the first is read. `[coating]`, an
extension of clpt: a surface's number and pairs of index and thickness [nm], from the front on.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from clpt.errors import SceneError, UnknownKindError
from clpt.files import input_files
from clpt.lenses.prescription import AIR, Coat, Prescription, Surface, by_name, by_number, known
from clpt.spectra import Constant, Spectrum

PLANES = ("infinity", "inf", "∞", "0", "0.0", "")
STOPS, FIELD_STOPS = ("as", "stop", "aperture", "sto"), ("fs", "cg", "field stop")
ENDS = ("bf", "")  # fields for the distance to the film
TYPES = ("STANDARD", "EVENASPH")
UNITS = {"MM": 1.0, "CM": 10.0, "IN": 25.4, "METER": 1000.0, "M": 1000.0}
TERMS = 8  # PARM 1 to 8: factors of r^2 to r^16
ROOT = Path(__file__).parent / "library"
LARGEST = 1 << 22  # bytes of a file
PBRT_COLUMNS = ("a radius", "a thickness", "an index", "a diameter")


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


def _optical_bench(text: str, file: Path) -> Prescription:
    """Read text of Optical Bench (photonstophotos.net): tables, fields separated by tabs.

    Raises SceneError with the line.
    """
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
        rows[key] = Row(line, _optical_bench_surface(line, distances, wanted))
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


def _optical_bench_surface(line: Line, distances: dict[str, Line], wanted: float | None) -> Surface:
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


@dataclass
class _Written:
    """A surface as the file has it."""

    line: Line
    kind: str = "STANDARD"
    curvature: float = 0.0
    conic: float = 0.0
    thickness: float = 0.0
    glass: Spectrum = AIR
    semi_diameter: float = 0.0
    stop: bool = False
    terms: dict[int, float] = field(default_factory=dict)


def _zemax(text: str, file: Path) -> Prescription:
    """Read a sequential Zemax file: spherical, conic and even aspheric surfaces in a row.

    SURF begins a surface, STOP marks it; TYPE, CURV, CONI, PARM, DISZ, GLAS and DIAM describe it.
    Surface 0 is the object, the last surface the image. Where DIAM is 0, marginal rays decide.

    Raises SceneError with the line.
    """
    unit, name, current = 1.0, "", None
    surfaces: list[_Written] = []
    for number, written in enumerate(text.splitlines(), 1):
        words = tuple(written.split())
        if not words:
            continue
        line, key = Line(file, number, words), words[0].upper()
        if key == "MODE" and words[1:] and words[1].upper() != "SEQ":
            raise line.error(f"only sequential lenses (MODE SEQ) are read, not {words[1]}")
        if key == "UNIT":
            if words[1:] and words[1].upper() not in UNITS:
                raise line.error(f"the unit is one of {', '.join(UNITS)}, not {words[1][:20]!r}")
            unit = UNITS[words[1].upper()] if words[1:] else 1.0
        elif key == "NAME":
            name = " ".join(words[1:])
        elif key == "SURF":
            current = _Written(line)
            surfaces.append(current)
        elif current is not None:
            _describe(current, key, line)
    if len(surfaces) < 3:
        raise SceneError("has no surfaces between the object and the image", file=file)
    rows = [Row(each.line, _zemax_surface(each)) for each in surfaces[1:-1]]
    _rims(rows)
    return assembled(rows, file, name or file.stem).scaled(unit)


def _describe(at: _Written, key: str, line: Line) -> None:
    if key == "TYPE":
        at.kind = line.fields[1].upper() if len(line.fields) > 1 else ""
        if at.kind not in TYPES:
            raise line.error(f"a surface is one of {', '.join(TYPES)}, not {at.kind[:20]!r}")
    elif key == "STOP":
        at.stop = True
    elif key == "CURV":
        at.curvature = line.numeral(1, "a curvature")
    elif key == "CONI":
        at.conic = line.numeral(1, "a conic constant")
    elif key == "DISZ":
        infinite = len(line.fields) > 1 and line.fields[1].upper().startswith("INF")
        at.thickness = 0.0 if infinite else line.numeral(1, "a distance")
    elif key == "DIAM":
        at.semi_diameter = line.numeral(1, "a semi-diameter")
    elif key == "PARM" and at.kind == "EVENASPH":
        at.terms[int(line.numeral(1, "a number"))] = line.numeral(2, "a factor")
    elif key == "GLAS":
        named = line.fields[1] if len(line.fields) > 1 else ""
        if named.upper() == "MIRROR":
            raise line.error("mirrors are not supported: only lenses that light goes through")
        with_number = len(line.fields) > 5
        n = line.numeral(4, "an index") if with_number else 0.0
        abbe = line.numeral(5, "an Abbe number") if with_number else 0.0
        with line.locating():
            at.glass = by_name(named, n, abbe)


def _zemax_surface(at: _Written) -> Surface:
    unknown = [i for i, value in at.terms.items() if value and not 1 <= i <= TERMS]
    if unknown:
        raise at.line.error(f"PARM {unknown[0]} is no term of an even asphere")
    if at.terms.get(1):
        raise at.line.error("a term of r^2 is not supported: put it into the curvature")
    last = max((i for i, value in at.terms.items() if value), default=1)
    return Surface(
        0.0 if at.curvature == 0.0 else 1.0 / at.curvature,
        at.thickness,
        at.glass,
        at.semi_diameter,
        at.conic,
        tuple(at.terms.get(i, 0.0) for i in range(2, last + 1)),
        stop=at.stop,
    )


def _rims(rows: list[Row]) -> None:
    """Give surfaces without a semi-diameter the largest of the others, as far as they reach."""
    largest = max((row.surface.semi_diameter for row in rows), default=0.0) or 10.0
    for row in rows:
        surface = row.surface
        if surface.semi_diameter == 0.0:
            reach = abs(surface.radius) / math.sqrt(max(1.0 + surface.conic, 1e-9))
            most = 0.99 * reach if surface.radius and surface.conic > -1.0 else largest
            row.surface = replace(surface, semi_diameter=min(largest, most))


def _pbrt_rows(text: str, file: Path) -> Prescription:
    """Read rows of pbrt's `realistic` camera: radius, thickness, index and diameter [mm].

    The stop is the row whose radius is 0; its index is not read. `#` starts a comment.
    """
    rows, comments = [], []
    for number, written in enumerate(text.splitlines(), 1):
        values, mark, comment = written.partition("#")
        if mark and comment.strip():
            comments.append(comment.strip())
        line = Line(file, number, tuple(values.split()))
        if not line.fields:
            continue
        if len(line.fields) != len(PBRT_COLUMNS):
            raise line.error(f"a row has {len(PBRT_COLUMNS)} numbers, not {len(line.fields)}")
        radius, thickness, index, diameter = (
            line.numeral(i, name) for i, name in enumerate(PBRT_COLUMNS)
        )
        stop = radius == 0.0
        with line.locating():
            glass = AIR if stop or index == 0.0 else by_number(index)
        surface = Surface(radius, thickness, glass, 0.5 * diameter, stop=stop)
        rows.append(Row(line, surface))
    return assembled(rows, file, file.stem, comments[0] if comments else "")


READERS = {".dat": _pbrt_rows, ".zmx": _zemax, ".txt": _optical_bench}


def names() -> tuple[str, ...]:
    """Return the names of the library's lenses."""
    return tuple(sorted(path.stem for path in ROOT.glob("*.txt")))


@cache
def library(name: str) -> Prescription:
    """Return a lens of the library by its name. Raises UnknownKindError."""
    if name not in names():
        raise UnknownKindError("lens", name, names())
    return read(ROOT / f"{name}.txt")


def read(path: str | Path, aperture: float | None = None) -> Prescription:
    """Read a lens: pbrt's rows (.dat), a sequential Zemax file (.zmx) or Optical Bench text (.txt).

    aperture: diameter of the stop [mm], None: the file's. Raises SceneError with the line.
    """
    path = Path(path)
    if path.suffix.lower() not in READERS:
        raise SceneError(f"a lens file ends in {', '.join(READERS)}", file=path)
    data = input_files.read_bytes(path)
    if len(data) > LARGEST:
        raise SceneError("is too large for a lens", file=path)
    lens = READERS[path.suffix.lower()](input_files.decode(data), path)
    return lens if aperture is None else lens.with_stop(0.5 * aperture)
