"""Spectra in scene.json, read and written.

A number is constant; [r, g, b] is a linear colour, "#rrggbb" a colour in sRGB; as emission each
means that multiple of D65. A name is a glass as an index, and an illuminant as emission; an object
has a `type` from SPECTRA and its fields, or `values` [[nm, value], ...], or a `file`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from typing import Any

from clpt import spectra
from clpt.arrays import is_number
from clpt.errors import UnknownKindError
from clpt.files import input_files
from clpt.formats.native.cursor import Cursor
from clpt.formats.reading import colour
from clpt.images.colour import from_hex
from clpt.scene.integrators import NO_AOV
from clpt.scene.roles import COEFFICIENT, EMISSION, INDEX, REFLECTANCE, Spectral
from clpt.spectra import Constant, Donaldson, Fluorophore, Reradiation, Spectrum
from clpt.spectra.spectrum import Outside

SPECTRA: dict[str, type[Spectrum]] = {
    "constant": spectra.Constant,
    "tabulated": spectra.Tabulated,
    "illuminant": spectra.Illuminant,
    "blackbody": spectra.Blackbody,
    "lines": spectra.Lines,
    "led": spectra.LED,
    "rgb": spectra.RGB,
    "rgb_unbounded": spectra.RGBUnbounded,
    "rgb_illuminant": spectra.RGBIlluminant,
    "sellmeier": spectra.Sellmeier,
    "cauchy": spectra.Cauchy,
}


def read(cursor: Cursor, role: Spectral) -> Any:
    """Return the value of a parameter of a role; the name of a glass stays a name."""
    with cursor.locating():
        return _read(cursor, role)


def _read(cursor: Cursor, role: Spectral) -> Any:
    value = cursor.value
    if isinstance(value, str) and value.startswith("#") and role.codes:
        return colour(role, from_hex(value))
    if isinstance(value, str) and role is INDEX:
        if value.lower() not in spectra.glasses():
            raise UnknownKindError("glass", value, spectra.glasses(), **cursor.location())
        return value
    if isinstance(value, str) and role is EMISSION:
        return spectra.illuminant(value)
    if isinstance(value, list) and role.colour is not None:
        return colour(role, cursor.numbers(3))
    if is_number(value):
        return cursor.number()
    cursor.expect(dict, "a number, [r, g, b] or a spectrum")
    outside: Outside = "hold" if role.measured else "zero"
    if "file" in value:
        return _from_file(cursor, role, outside)
    if "values" in value and "type" not in value:
        cursor.check_keys("spectrum", ("values",))
        rows = [row.numbers(2) for row in cursor.at("values").entries()]
        if not rows:
            raise cursor.error("a spectrum needs at least one [nm, value]")
        lambdas, samples = zip(*rows, strict=True)
        return spectra.Tabulated(lambdas, samples, outside)
    return _typed(cursor)


def _from_file(cursor: Cursor, role: Spectral, outside: Outside) -> Spectrum:
    cursor.check_keys("spectrum", ("file",))
    path = find_file(cursor.at("file"))
    if role is INDEX:
        name = str(cursor.path[-1])  # of the parameter: eta, k, ext_k, ...
        return spectra.read_index(path, "k" if name.split("_")[-1] == "k" else "eta")
    if role is COEFFICIENT:
        return spectra.read_absorption(path)
    if path.suffix.lower() == ".bfc":
        return spectra.read_bispectral(path)[0]
    return spectra.read_table(path, outside)


def _typed(cursor: Cursor) -> Spectrum:
    cls = SPECTRA[kind_name(cursor, "spectrum", SPECTRA)]
    fields = {field.name: field for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
    needed = [name for name, field in fields.items() if field.default is dataclasses.MISSING]
    cursor.check_keys(cursor.value["type"], ("type", *fields), needed)
    values: dict[str, Any] = {}
    for name, child in cursor.items():
        if name == "type":
            continue
        if isinstance(child.value, list):
            values[name] = tuple(child.numbers())
        elif fields[name].type == "bool":
            values[name] = child.expect(bool)
        else:
            values[name] = child.value if isinstance(child.value, str) else child.number()
    try:
        return cls(**values)
    except (TypeError, ValueError) as error:
        raise cursor.error(f"does not make a spectrum: {error}") from None


def write(spectrum: Spectrum | str, role: Spectral) -> Any:
    """Return what stands for a spectrum in JSON, such that `read` gives it back."""
    if isinstance(spectrum, str):
        return spectrum
    if isinstance(spectrum, spectra.Constant) and role is not EMISSION:
        return spectrum.value
    fields = dataclasses.asdict(spectrum)  # type: ignore[call-overload]
    if type(spectrum) is role.colour:
        return list(fields.values())
    kind = next(name for name, cls in SPECTRA.items() if type(spectrum) is cls)
    return {"type": kind, **fields}


def kind_name(cursor: Cursor, category: str, known: Collection[str]) -> str:
    """Return the `type` of an object. Raises SceneError, UnknownKindError."""
    if "type" not in cursor.expect(dict):
        raise cursor.error("needs the key 'type'")
    child = cursor.at("type")
    if child.expect(str) not in known:
        if (category, child.value) == ("integrator", "aov"):
            raise child.error(NO_AOV)
        raise UnknownKindError(category, child.value, known, **child.location())
    return child.value


def find_file(cursor: Cursor, name: str | None = None) -> Any:
    """Return the path of an existing file; names are relative to the JSON file's folder.

    name: of the file, None where it is all that stands there.
    """
    name = cursor.expect(str) if name is None else name
    if cursor.file is None:
        raise cursor.error("names a file, which cannot be done here")
    path = cursor.file.parent / name
    if cursor.confined and path.name != name:
        raise cursor.error(f"{name!r} is not in the folder of this file")
    try:
        exists = path.is_file()
    except (OSError, ValueError):
        exists = False
    if exists:
        with cursor.locating():
            return input_files.named("json", cursor.file.parent, path)
    raise cursor.error(f"there is no file {name!r}")


def read_metal(cursor: Cursor) -> tuple[Spectrum, Spectrum]:
    """Read eta and k of a metal, by its name or from a file."""
    if isinstance(cursor.value, dict):
        if list(cursor.value) != ["file"]:
            raise cursor.error("a metal is a name, or an object with the key 'file' alone")
        path = find_file(cursor.at("file"))
        with cursor.locating():
            return spectra.read_refractive_index(path)
    name = cursor.expect(str)
    if name not in spectra.metals():
        raise UnknownKindError("metal", name, spectra.metals(), **cursor.location())
    return spectra.metal(name)


RERADIATIONS: dict[str, type[Reradiation]] = {"fluorophore": Fluorophore, "donaldson": Donaldson}


def read_reradiation(cursor: Cursor) -> Reradiation | None:
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
    absorption, emission = (_shape(cursor.at(name)) for name in shapes)
    share = cursor.at("quantum_yield").number() if "quantum_yield" in cursor.value else 1.0
    with cursor.locating():
        return Fluorophore(absorption, emission, share)


def _shape(cursor: Cursor) -> Spectrum:
    value = read(cursor, REFLECTANCE)
    return Constant(value) if isinstance(value, float) else value


def write_reradiation(value: Reradiation | None) -> Any:
    """Return what stands for a matrix in JSON, such that `read` gives it back."""
    if isinstance(value, Fluorophore):
        return {
            "type": "fluorophore",
            "absorption": write(value.absorption, REFLECTANCE),
            "emission": write(value.emission, REFLECTANCE),
            "quantum_yield": value.quantum_yield,
        }
    if isinstance(value, Donaldson):
        rows = [list(row) for row in value.rows]
        return {"type": "donaldson", "out": value.out, "into": value.into, "rows": rows}
    return None
