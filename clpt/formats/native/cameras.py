"""Lenses of cameras and sensors of films in scene.json: names, files, or numbers."""

from __future__ import annotations

from typing import Any

from clpt import lenses, spectra
from clpt.formats.native import spectra as json_spectra
from clpt.formats.native.cursor import Cursor
from clpt.formats.native.json_schema import NUMBER, NUMBERS, STRING, Schema, object_of, ref, rows
from clpt.formats.native.spectra import find_file
from clpt.lenses import Coat, Prescription, Surface
from clpt.lenses.prescription import by_number
from clpt.scene.roles import INDEX, Spectral
from clpt.spectra import Constant, Sensor, Spectrum
from clpt.spectra.sensors import OBSERVERS

SENSOR_WORDS = (
    '`cie1931`, `cie1964`, `{"file": name}` or `{"curves": [three spectra]}`,'
    " the latter two perhaps with a `matrix`"
)


def read_sensor(cursor: Cursor) -> Any:
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


def write_sensor(sensor: Sensor | str) -> Any:
    """Return what stands for a film's sensor in JSON, such that `read` gives it back."""
    if isinstance(sensor, str):
        return sensor
    written: dict[str, Any] = {
        "curves": [json_spectra.write(curve, CURVE) for curve in sensor.curves]
    }
    return written if sensor.matrix is None else {**written, "matrix": sensor.matrix}


def _sensor_schema() -> Schema:
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


SENSOR_SCHEMA = _sensor_schema()


LENS_WORDS = (
    "a name of the library, the name of a `.dat`, `.zmx` or `.txt` file, or"
    ' `{"surfaces": [...]}`, see [lenses](lenses.md)'
)
LENGTHS = ("radius", "thickness", "semi_diameter", "conic")


def read_lens(cursor: Cursor) -> Prescription | str:
    """Return a lens: its name in the library, or what it is made of. Raises SceneError."""
    if isinstance(cursor.value, str):
        if cursor.value in lenses.names():
            return cursor.value
        if "." not in cursor.value:
            with cursor.locating():
                lenses.library(cursor.value)
        path = find_file(cursor)
        with cursor.locating():
            return lenses.read(path)
    cursor.expect(dict, "a name or a lens")
    cursor.check_keys("lens", ("surfaces", "name", "source"), ("surfaces",))
    surfaces = []
    for entry in cursor.at("surfaces").entries():
        surfaces.append(_surface(entry))
    texts = {k: cursor.at(k).expect(str) for k in ("name", "source") if k in cursor.value}
    with cursor.locating():
        return Prescription(tuple(surfaces), **texts)


def _surface(cursor: Cursor) -> Surface:
    cursor.check_keys(
        "surface", (*LENGTHS, "glass", "aspheric", "coating", "stop"), ("semi_diameter",)
    )
    fields: dict[str, Any] = {k: cursor.at(k).number() for k in LENGTHS if k in cursor.value}
    if "glass" in cursor.value:
        fields["glass"] = _glass(cursor.at("glass"))
    if "aspheric" in cursor.value:
        fields["aspheric"] = tuple(cursor.at("aspheric").numbers())
    if "coating" in cursor.value:
        fields["coating"] = tuple(_coat(each) for each in cursor.at("coating").entries())
    if "stop" in cursor.value:
        fields["stop"] = cursor.at("stop").expect(bool)
    surface = Surface(**{"radius": 0.0, "thickness": 0.0, **fields})
    with cursor.locating():
        surface.check()
    return surface


def _glass(cursor: Cursor) -> Spectrum:
    """An index as elsewhere, or its number at the line d and an Abbe number."""
    if isinstance(cursor.value, list) and len(cursor.value) == 2:
        with cursor.locating():
            return by_number(*cursor.numbers(2))
    index = json_spectra.read(cursor, INDEX)
    return Constant(index) if isinstance(index, (int, float)) else spectra.index(index)


def _coat(cursor: Cursor) -> Coat:
    cursor.check_keys("film", ("index", "thickness"), ("index", "thickness"))
    read = json_spectra.read(cursor.at("index"), INDEX)
    index = Constant(read) if isinstance(read, (int, float)) else spectra.index(read)
    return Coat(index, cursor.at("thickness").number())


def write_lens(lens: Prescription | str) -> Any:
    """Return what stands for a lens in JSON, such that `read` gives it back."""
    if isinstance(lens, str):
        return lens
    texts = {"name": lens.name, "source": lens.source}
    labels = {key: text for key, text in texts.items() if text}
    return {**labels, "surfaces": [_written(surface) for surface in lens.surfaces]}


def _written(surface: Surface) -> dict[str, Any]:
    fields: dict[str, Any] = {k: getattr(surface, k) for k in LENGTHS}
    fields["glass"] = json_spectra.write(surface.glass, INDEX)
    if surface.aspheric:
        fields["aspheric"] = list(surface.aspheric)
    if surface.coating:
        fields["coating"] = [
            {"index": json_spectra.write(film.index, INDEX), "thickness": film.thickness}
            for film in surface.coating
        ]
    if surface.stop:
        fields["stop"] = True
    return fields


def _lens_schema() -> Schema:
    index = {"anyOf": [ref("spectrum_index"), {**NUMBERS, "minItems": 2, "maxItems": 2}]}
    film = object_of(
        {"index": ref("spectrum_index"), "thickness": {**NUMBER, "description": "[nm]"}},
        ["index", "thickness"],
    )
    surface = object_of(
        {
            "radius": {**NUMBER, "description": "[mm]; 0: a plane"},
            "thickness": {**NUMBER, "description": "to the next surface [mm]"},
            "semi_diameter": {**NUMBER, "description": "[mm]"},
            "conic": {**NUMBER, "description": "0: a sphere, -1: a parabola"},
            "glass": {**index, "description": "behind it; two numbers: n_d and V_d"},
            "aspheric": {**NUMBERS, "description": "of r^4, r^6, ... in mm"},
            "coating": {"type": "array", "items": film, "description": "from the front on"},
            "stop": {"type": "boolean"},
        },
        ["semi_diameter"],
    )
    whole = object_of(
        {"name": STRING, "source": STRING, "surfaces": {"type": "array", "items": surface}},
        ["surfaces"],
    )
    return {"anyOf": [{**STRING, "description": "of the library, or a file"}, whole]}


LENS_SCHEMA = _lens_schema()
