"""Fluorescence in scene.json: a measured matrix from a file or in numbers, or a dye."""

from __future__ import annotations

from typing import Any

from clpt import spectra
from clpt.formats.native import spectra as json_spectra
from clpt.formats.native.cursor import Cursor
from clpt.formats.native.spectra import find_file, kind_name
from clpt.scene.roles import REFLECTANCE
from clpt.spectra import Constant, Donaldson, Fluorophore, Reradiation, Spectrum

RERADIATIONS: dict[str, type[Reradiation]] = {"fluorophore": Fluorophore, "donaldson": Donaldson}


def read(cursor: Cursor) -> Reradiation | None:
    """Return a re-radiation matrix; null is none."""
    if cursor.value is None:
        return None
    if "file" in cursor.expect(dict):
        cursor.check_keys("re-radiation", ("file",))
        path = find_file(cursor.at("file"))
        with cursor.locating():
            return spectra.read_reradiation(path)
    if kind_name(cursor, "re-radiation", RERADIATIONS) == "donaldson":
        fields = ("out", "into", "rows")
        cursor.check_keys("re-radiation", ("type", *fields), fields)
        out, into = (tuple(cursor.at(name).numbers()) for name in ("out", "into"))
        rows = tuple(tuple(row.numbers(len(into))) for row in cursor.at("rows").entries())
        with cursor.locating():
            return Donaldson(out, into, rows)
    shapes = ("absorption", "emission")
    cursor.check_keys("re-radiation", ("type", *shapes, "quantum_yield"), shapes)
    absorption, emission = (_spectrum(cursor.at(name)) for name in shapes)
    share = cursor.at("quantum_yield").number() if "quantum_yield" in cursor.value else 1.0
    with cursor.locating():
        return Fluorophore(absorption, emission, share)


def _spectrum(cursor: Cursor) -> Spectrum:
    value = json_spectra.read(cursor, REFLECTANCE)
    return Constant(value) if isinstance(value, float) else value


def write(value: Reradiation | None) -> Any:
    """Return what stands for a matrix in JSON, such that `read` gives it back."""
    if isinstance(value, Fluorophore):
        return {
            "type": "fluorophore",
            "absorption": json_spectra.write(value.absorption, REFLECTANCE),
            "emission": json_spectra.write(value.emission, REFLECTANCE),
            "quantum_yield": value.quantum_yield,
        }
    if isinstance(value, Donaldson):
        rows = [list(row) for row in value.rows]
        return {"type": "donaldson", "out": value.out, "into": value.into, "rows": rows}
    return None
