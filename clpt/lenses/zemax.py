"""Sequential Zemax files (.zmx): spherical, conic and even aspheric surfaces in a row.

SURF begins a surface, STOP marks it; TYPE, CURV, CONI, PARM, DISZ, GLAS and DIAM describe it.
Surface 0 is the object, the last surface the image. Where DIAM is 0, marginal rays decide.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from pathlib import Path

from clpt.errors import SceneError
from clpt.lenses.glasses import AIR, by_name
from clpt.lenses.lines import Line, Row, assembled
from clpt.lenses.prescription import Prescription, Surface
from clpt.spectra import Spectrum

TYPES = ("STANDARD", "EVENASPH")
UNITS = {"MM": 1.0, "CM": 10.0, "IN": 25.4, "METER": 1000.0, "M": 1000.0}
TERMS = 8  # PARM 1 to 8: factors of r^2 to r^16


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


def parse(text: str, file: Path) -> Prescription:
    """Read a lens. Raises SceneError with the line."""
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
    rows = [Row(each.line, _surface(each)) for each in surfaces[1:-1]]
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


def _surface(at: _Written) -> Surface:
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
