"""Spectra in scene.json, read and written.

A number is constant; [r, g, b] is a colour, which as emission means that multiple of D65; a name is
a glass as an index, and an illuminant as emission; an object has a `type` from SPECTRA and its
fields, or `values` [[nm, value], ...], or a `file`.
"""

from __future__ import annotations

import dataclasses
from typing import Any

from clpt import spectra
from clpt.errors import SceneError, UnknownKindError, UnusedParameterError
from clpt.formats.colour import COLOURS, colour
from clpt.formats.native.cursor import Cursor, placed
from clpt.spectra import Sensor, Spectrum
from clpt.spectra import read_sensor as read_sensor_file

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


def read(cursor: Cursor, role: str, name: str) -> Any:
    """Return what stands for the parameter `name` of a role; a glass stays a name."""
    try:
        return _read(cursor, role, name)
    except SceneError as error:
        if error.file is not None:
            raise
        raise cursor.error(error.message) from None


def _read(cursor: Cursor, role: str, name: str) -> Any:
    value = cursor.value
    if isinstance(value, str) and role == "index":
        if value.lower() not in spectra.glasses():
            raise UnknownKindError("glass", value, spectra.glasses(), **cursor.place())
        return value
    if isinstance(value, str) and role == "emission":
        return spectra.illuminant(value)
    if isinstance(value, list):
        return colour(role, cursor.numbers(3))
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return cursor.number()
    cursor.expect(dict, "a number, [r, g, b] or a spectrum")
    outside: Any = "hold" if role in ("index", "coefficient") else "zero"
    if "file" in value:
        return _from_file(cursor, role, outside, name)
    if "values" in value and "type" not in value:
        _refuse(cursor, "spectrum", ("values",))
        rows = [row.numbers(2) for row in cursor.at("values").entries()]
        if not rows:
            raise cursor.error("a spectrum needs at least one [nm, value]")
        lambdas, samples = zip(*rows, strict=True)
        return spectra.Tabulated(lambdas, samples, outside)
    return _typed(cursor)


def _from_file(cursor: Cursor, role: str, outside: Any, name: str) -> Spectrum:
    _refuse(cursor, "spectrum", ("file",))
    path = find_file(cursor.at("file"))
    if role == "index":
        return spectra.read_index(path, "k" if name.split("_")[-1] == "k" else "eta")
    if role == "coefficient":
        return spectra.read_absorption(path)
    if path.suffix.lower() == ".bfc":
        return spectra.read_bispectral(path)[0]
    return spectra.read_table(path, outside)


def _typed(cursor: Cursor) -> Spectrum:
    cls = SPECTRA[kind_name(cursor, "spectrum", SPECTRA)]
    fields = {field.name: field for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
    _refuse(cursor, cursor.value["type"], ("type", *fields))
    given: dict[str, Any] = {}
    for name in fields:
        if name in cursor.value:
            child = cursor.at(name)
            if isinstance(child.value, list):
                given[name] = tuple(child.numbers())
            elif fields[name].type == "bool":
                given[name] = child.expect(bool)
            else:
                given[name] = child.value if isinstance(child.value, str) else child.number()
        elif fields[name].default is dataclasses.MISSING:
            raise cursor.error(f"needs the parameter {name!r}")
    try:
        return cls(**given)
    except (TypeError, ValueError) as error:
        raise cursor.error(f"does not make a spectrum: {error}") from None


def read_sensor(cursor: Cursor) -> Any:
    """Return a film's sensor: a name, a file of its curves, or `curves` and perhaps a `matrix`."""
    if isinstance(cursor.value, str):
        return cursor.value
    cursor.expect(dict, "a name or a sensor")
    _refuse(cursor, "sensor", ("file", "curves", "matrix"))
    if ("file" in cursor.value) == ("curves" in cursor.value):
        raise cursor.error("a sensor has either a 'file' or 'curves'")
    if "file" in cursor.value:
        sensor = read_sensor_file(find_file(cursor.at("file")))
        curves = sensor.curves
    else:
        entries = cursor.at("curves").entries(3)
        red, green, blue = (_curve(read(entry, "curve", "curves")) for entry in entries)
        curves = (red, green, blue)
    matrix = None
    if "matrix" in cursor.value:
        matrix = tuple(tuple(row.numbers(3)) for row in cursor.at("matrix").entries(3))
    return placed(cursor, lambda: Sensor(curves, matrix))


def _curve(value: Any) -> Spectrum:
    return value if isinstance(value, Spectrum) else spectra.Constant(value)


def write_sensor(sensor: Sensor | str) -> Any:
    """Return what stands for a film's sensor in JSON, such that `read_sensor` gives it back."""
    if isinstance(sensor, str):
        return sensor
    written: dict[str, Any] = {"curves": [write(curve, "curve") for curve in sensor.curves]}
    return written if sensor.matrix is None else {**written, "matrix": sensor.matrix}


def write(spectrum: Spectrum | str, role: str) -> Any:
    """Return what stands for a spectrum in JSON, such that `read` gives it back."""
    if isinstance(spectrum, str):
        return spectrum
    if isinstance(spectrum, spectra.Constant):
        return spectrum.value
    fields = dataclasses.asdict(spectrum)  # type: ignore[call-overload]
    if type(spectrum) is COLOURS.get(role):
        return list(fields.values())
    kind = next(name for name, cls in SPECTRA.items() if type(spectrum) is cls)
    return {"type": kind, **fields}


def kind_name(cursor: Cursor, category: str, known: Any) -> str:
    """Return the `type` of an object. Raises SceneError where there is none, UnknownKindError."""
    if "type" not in cursor.expect(dict):
        raise cursor.error("needs the key 'type'")
    child = cursor.at("type")
    if child.expect(str) not in known:
        raise UnknownKindError(category, child.value, known, **child.place())
    return child.value


def find_file(cursor: Cursor) -> Any:
    """Return the path of an existing file; names are relative to the JSON file's folder."""
    path = cursor.file.parent / cursor.expect(str)
    try:
        if path.is_file():
            return path
    except (OSError, ValueError):
        pass
    raise cursor.error(f"there is no file {cursor.value!r}")


def _refuse(cursor: Cursor, kind: str, known: Any) -> None:
    for key in cursor.expect(dict):
        if key not in known:
            raise UnusedParameterError(kind, key, known, **cursor.at(key).place())
