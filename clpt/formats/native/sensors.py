"""A film's sensor in scene.json: a name, a file of its curves, or the curves."""

from __future__ import annotations

from typing import Any

from clpt import spectra
from clpt.formats.native import spectra as json_spectra
from clpt.formats.native.cursor import Cursor
from clpt.formats.native.json_schema import NUMBER, STRING, Schema, object_of, ref, rows
from clpt.formats.native.spectra import find_file
from clpt.scene.roles import Spectral
from clpt.spectra import Sensor, Spectrum
from clpt.spectra.sensors import OBSERVERS

WORDS = (
    '`cie1931`, `cie1964`, `{"file": name}` or `{"curves": [three spectra]}`,'
    " the latter two perhaps with a `matrix`"
)


def read(cursor: Cursor) -> Any:
    """Return a film's sensor: a name, or a Sensor. Raises SceneError."""
    if isinstance(cursor.value, str):
        return cursor.value
    cursor.expect(dict, "a name or a sensor")
    cursor.check_keys("sensor", ("file", "curves", "matrix"))
    if ("file" in cursor.value) == ("curves" in cursor.value):
        raise cursor.error("a sensor has either a 'file' or 'curves'")
    if "file" in cursor.value:
        curves = spectra.read_sensor(find_file(cursor.at("file"))).curves
    else:
        red, green, blue = (_curve(entry) for entry in cursor.at("curves").entries(3))
        curves = (red, green, blue)
    matrix = None
    if "matrix" in cursor.value:
        matrix = tuple(tuple(row.numbers(3)) for row in cursor.at("matrix").entries(3))
    with cursor.locating():
        return Sensor(curves, matrix)


CURVE = Spectral("curve", colour=None)  # of a sensor, over the wavelength


def _curve(cursor: Cursor) -> Spectrum:
    value = json_spectra.read(cursor, CURVE)
    return value if isinstance(value, Spectrum) else spectra.Constant(value)


def write(sensor: Sensor | str) -> Any:
    """Return what stands for a film's sensor in JSON, such that `read` gives it back."""
    if isinstance(sensor, str):
        return sensor
    written: dict[str, Any] = {
        "curves": [json_spectra.write(curve, CURVE) for curve in sensor.curves]
    }
    return written if sensor.matrix is None else {**written, "matrix": sensor.matrix}


def _schema() -> Schema:
    curve = {"anyOf": [NUMBER, ref("spectrum")]}
    curves = {"type": "array", "items": curve, "minItems": 3, "maxItems": 3}
    matrix = {**rows(3, count=3), "description": "from responses to XYZ; fitted if not given"}
    file = {**STRING, "description": "wavelengths [nm] and three values a row"}
    return {
        "anyOf": [
            {"enum": list(OBSERVERS)},
            {
                "anyOf": [
                    object_of({"file": file, "matrix": matrix}, ["file"]),
                    object_of({"curves": curves, "matrix": matrix}, ["curves"]),
                ]
            },
        ]
    }


SCHEMA = _schema()
