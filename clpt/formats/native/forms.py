"""Forms of parameters in scene.json: how each is read, written, and described.

FORMS has an entry for each role (`clpt.scene.roles`), by its name.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from clpt import spectra
from clpt.choices import AUTO
from clpt.formats.native import cameras, json_schema, motion
from clpt.formats.native import spectra as json_spectra
from clpt.formats.native.cursor import Cursor, ReadCursor
from clpt.formats.native.json_schema import NUMBER, NUMBERS, STRING, TRIPLE, Schema, ref
from clpt.formats.native.motion import matrix
from clpt.formats.native.spectra import kind_name
from clpt.measured import Measurement, MerlTable
from clpt.scene import kinds
from clpt.scene.materials import Layer, Material
from clpt.scene.media import Medium
from clpt.scene.motion import Deformation
from clpt.scene.params import Kind
from clpt.scene.roles import FACTOR, ORDERS, REFLECTANCE, SPECTRA, Param, Spectral
from clpt.scene.shapes import SMOOTH, Group
from clpt.scene.textures import ATTRIBUTES, Texture
from clpt.spectra.spaces import TEMPERATURES


class Reader(Protocol):
    """A reader of the parts of a scene that a parameter can hold or refer to."""

    def kind(self, cursor: Cursor, category: str) -> Any: ...
    def layer(self, cursor: Cursor) -> Any: ...
    def material(self, cursor: Cursor) -> Any: ...
    def medium(self, cursor: Cursor) -> Any: ...
    def area_light(self, cursor: Cursor) -> Any: ...
    def group(self, cursor: Cursor) -> Any: ...
    def image(self, cursor: Cursor) -> Any: ...
    def volume(self, cursor: Cursor, colours: bool = False) -> Any: ...
    def measurement(self, cursor: Cursor) -> Any: ...
    def merl(self, cursor: Cursor) -> Any: ...


class Writer(Protocol):
    """A writer of the parts of a scene that a parameter can hold or refer to."""

    def kind(self, value: Kind) -> Any: ...
    def layer(self, value: Layer) -> Any: ...
    def material(self, value: Material) -> Any: ...
    def deformation(self, value: Deformation) -> Any: ...
    def medium(self, value: Medium) -> Any: ...
    def group(self, value: Group) -> Any: ...
    def image(self, value: object) -> Any: ...
    def volume(self, value: object) -> Any: ...
    def measurement(self, value: Measurement) -> Any: ...
    def merl(self, value: MerlTable) -> Any: ...


def plain(value: object) -> Any:
    """Return numbers, names, tuples and arrays as JSON has them."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return list(value) if isinstance(value, tuple) else value


@dataclass(frozen=True)
class Form:
    """A form of parameters: its description, its schema, its reader and its writer.

    The schema and the words may depend on the parameter. A value of None is written as null.
    """

    words: str | Callable[[Param], str]
    schema: Schema | Callable[[Param], Schema]
    read: Callable[[Cursor, Reader], Any]
    write: Callable[[Any, Writer], Any] = lambda value, _: plain(value)


def form_of(param: Param) -> Form:
    """Return the form of a parameter."""
    return FORMS[param.role.name]


def read(cursor: Cursor, param: Param, reader: Reader) -> Any:
    """Return the value of a parameter. Raises SceneError."""
    if param.textured and isinstance(cursor.value, dict) and "type" in cursor.value:
        known = {**kinds("texture"), **json_spectra.SPECTRA}
        if kind_name(cursor, "texture or spectrum", known) in kinds("texture"):
            return reader.kind(cursor, "texture")
    return form_of(param).read(cursor, reader)


def write(value: object, param: Param, writer: Writer) -> Any:
    """Return what stands for a parameter's value in JSON, such that `read` gives it back."""
    if value is None:
        return None
    if isinstance(value, Texture):
        return writer.kind(value)
    return form_of(param).write(value, writer)


def schema(param: Param) -> Schema:
    """Return the JSON Schema of a parameter's values."""
    form = form_of(param).schema
    form_schema = form(param) if callable(form) else form
    return {"anyOf": [form_schema, ref("texture")]} if param.textured else form_schema


def words(param: Param) -> str:
    """Return what a parameter accepts, for the reference."""
    form = form_of(param).words
    return (form(param) if callable(form) else form) + (" or texture" if param.textured else "")


def _of_cursor(words: str, schema: Schema | Callable[[Param], Schema], read: ReadCursor) -> Form:
    """A form that refers to nothing else, and whose values are plain."""
    return Form(words, schema, lambda cursor, _: read(cursor))


def _spectrum(role: Spectral) -> Form:
    return Form(
        role.name,
        lambda param: ref(f"spectrum_{_limits_of(param)}"),
        lambda cursor, _: json_spectra.read(cursor, role),
        # a default may be given as a number or three
        lambda value, _: (
            plain(value)
            if isinstance(value, (int, float, tuple))
            else json_spectra.write(value, role)
        ),
    )


def _limits_of(param: Param) -> str:
    """The role whose limits a spectrum has."""
    limited = param.role is not REFLECTANCE or math.isfinite(param.high)
    return (param.role if limited else FACTOR).name


def _rows(width: int, item: str = "number") -> Form:
    dtype = np.uint32 if item == "integer" else np.float32
    return _of_cursor(
        f"rows of {width} {item}s",
        json_schema.rows(width, item),
        lambda cursor: array(cursor, width, dtype),
    )


def array(cursor: Cursor, width: int, dtype: type) -> np.ndarray | None:
    """Return rows of numbers (n, width), or None for null."""
    if cursor.value is None:
        return None
    entries = cursor.expect(list)
    try:
        values = np.asarray(entries, np.float64).reshape(-1, width)
        valid = len(values) == len(entries) and not any(
            isinstance(v, (int, float)) for v in entries
        )
    except (ValueError, TypeError, OverflowError):
        valid = False
    if not valid:
        raise cursor.error(f"must be a list of rows of {width} numbers")
    if dtype is np.uint32 and not ((values >= 0) & (values < 2**31) & (values % 1 == 0)).all():
        raise cursor.error("must be whole numbers from zero")
    return values.astype(dtype)


def _normals(cursor: Cursor) -> Any:
    return SMOOTH if cursor.value == SMOOTH else array(cursor, 3, np.float32)


def _attributes(cursor: Cursor) -> dict[str, np.ndarray]:
    """Rows of 1 or 3 numbers by their attribute's name."""
    arrays = {}
    for name, child in cursor.items():
        if not name.startswith(ATTRIBUTES):
            raise child.error(f"the name must begin with {' or '.join(ATTRIBUTES)}")
        rows = child.expect(list)
        width = len(rows[0]) if rows and isinstance(rows[0], list) else 3
        arrays[name] = array(child, 1 if width == 1 else 3, np.float32)
    return {name: values for name, values in arrays.items() if values is not None}


def _integers(cursor: Cursor) -> tuple[int, ...]:
    return tuple(entry.integer() for entry in cursor.entries())


def _numbers(cursor: Cursor) -> tuple[float, ...]:
    return tuple(cursor.numbers())


def _angular(cursor: Cursor) -> Any:
    entries = cursor.expect(list)
    rows = any(isinstance(entry, list) for entry in entries)
    return [row.numbers() for row in cursor.entries()] if rows else cursor.numbers()


def _number_or_list(cursor: Cursor) -> Any:
    return cursor.numbers() if isinstance(cursor.value, list) else cursor.number()


def _number_or_auto(cursor: Cursor) -> float | str:
    return AUTO if cursor.value == AUTO else cursor.number()


def _cube_images(cursor: Cursor, reader: Reader) -> Any:
    if isinstance(cursor.value, list):
        return [reader.image(entry) for entry in cursor.entries(6)]
    return reader.image(cursor)


def _write_cube_images(value: Any, writer: Writer) -> Any:
    six = isinstance(value, (list, tuple))
    return [writer.image(face) for face in value] if six else writer.image(value)


def _white_balance(cursor: Cursor) -> Any:
    return tuple(cursor.numbers(2)) if isinstance(cursor.value, list) else cursor.value


def _not_in_files(cursor: Cursor) -> Any:
    raise cursor.error("cannot be given in a file")


def _choice_words(param: Param) -> str:
    return ", ".join([f"`{c}`" for c in param.choices] + ["none"] * param.optional)


def _number_words(param: Param) -> str:
    low, high = math.isfinite(param.low), math.isfinite(param.high)
    if low and high:
        return f"number {param.low:g} to {param.high:g}"
    return f"number from {param.low:g}" if low else "number"


def _grid(cursor: Cursor) -> np.ndarray:
    """Numbers (nx, ny, nz)."""
    rows = [[row.numbers() for row in slab.entries()] for slab in cursor.entries()]
    sizes = {len(slab) for slab in rows}, {len(row) for slab in rows for row in slab}
    if any(len(size) != 1 for size in sizes):
        raise cursor.error("must be as many rows of as many numbers in each")
    return np.array(rows, np.float32)


def _number_schema(param: Param) -> Schema:
    limits = {"minimum": param.low, "maximum": param.high}
    return {**NUMBER, **{key: value for key, value in limits.items() if math.isfinite(value)}}


def _white_balance_schema() -> Schema:
    low, high = TEMPERATURES
    kelvin = {**NUMBER, "minimum": low, "maximum": high, "description": "[K]"}
    names = {"enum": ["none", *spectra.illuminants()]}
    return {"anyOf": [names, kelvin, {**NUMBERS, "minItems": 2, "maxItems": 2}]}


BOOLEAN: Schema = {"type": "boolean"}
WHOLE: Schema = {"type": "integer", "minimum": 0}
NAME_OF_MEDIUM: Schema = {**STRING, "description": "a name in the scene's media"}
NAME_OF_MATERIAL: Schema = {**STRING, "description": "a name in the scene's materials"}

FORMS: dict[str, Form] = {
    # roles
    **{role.name: _spectrum(role) for role in SPECTRA},
    "flag": _of_cursor("true or false", BOOLEAN, lambda cursor: cursor.value),
    "choice": Form(
        _choice_words,
        lambda param: {"enum": [*param.choices, *([None] if param.optional else [])]},
        lambda cursor, _: cursor.value,
    ),
    "real": Form(_number_words, _number_schema, lambda cursor, _: cursor.number()),
    "reradiation": Form(
        "[re-radiation](#re-radiation)",
        ref("reradiation"),
        lambda cursor, _: json_spectra.read_reradiation(cursor),
        lambda value, _: json_spectra.write_reradiation(value),
    ),
    "orders": _of_cursor(
        "list of numbers", {**NUMBERS, "minItems": 1, "maxItems": 2 * ORDERS + 1}, _numbers
    ),
    "layers": Form(
        "list of [layers](#layers)",
        {"type": "array", "items": ref("layer")},
        lambda cursor, reader: [reader.layer(entry) for entry in cursor.entries()],
        lambda value, writer: [writer.layer(layer) for layer in value],
    ),
    "angular": _of_cursor(
        "list of numbers, or of rows of them",
        {"anyOf": [NUMBERS, {"type": "array", "items": NUMBERS}]},
        _angular,
    ),
    "host": _of_cursor("nothing", {"not": {}}, _not_in_files),
    # forms of a host parameter: plain values
    "boolean": _of_cursor("true or false", BOOLEAN, lambda cursor: cursor.expect(bool)),
    "integer": _of_cursor("whole number", {"type": "integer"}, Cursor.integer),
    "number": _of_cursor("number", NUMBER, Cursor.number),
    "text": _of_cursor("text", STRING, lambda cursor: cursor.expect(str)),
    "names": _of_cursor(
        "list of names",
        {"type": "array", "items": STRING},
        lambda cursor: tuple(entry.expect(str) for entry in cursor.entries()),
    ),
    "numbers": _of_cursor("list of numbers", NUMBERS, _numbers),
    **dict.fromkeys(
        ("vector", "direction"),
        _of_cursor("three numbers", TRIPLE, lambda cursor: tuple(cursor.numbers(3))),
    ),
    "matrix3": _of_cursor("transform", ref("transform"), lambda cursor: matrix(cursor, 3)),
    "matrix4": _of_cursor("transform", ref("transform"), lambda cursor: matrix(cursor, 4)),
    "number_or_list": _of_cursor(
        "number, or a list of them", {"anyOf": [NUMBER, NUMBERS]}, _number_or_list
    ),
    "lengths": _of_cursor(
        "whole numbers", {"type": "array", "items": {**WHOLE, "minimum": 2}}, _integers
    ),
    "crop": _of_cursor(
        "four whole numbers",
        {"type": "array", "items": WHOLE, "minItems": 4, "maxItems": 4},
        _integers,
    ),
    "number_or_auto": _of_cursor(
        f"number, or `{AUTO}`", {"anyOf": [NUMBER, {"const": AUTO}]}, _number_or_auto
    ),
    "grid": _of_cursor(
        "rows of rows of numbers",
        {"type": "array", "items": {"type": "array", "items": NUMBERS}},
        _grid,
    ),
    "rows2": _rows(2),
    "rows3": _rows(3),
    "rows4": _rows(4),
    "normals": _of_cursor(
        f"rows of 3 numbers, or `{SMOOTH}`",
        {"anyOf": [json_schema.rows(3), {"const": SMOOTH}]},
        _normals,
    ),
    "triangles": _rows(3, "integer"),
    "attributes": _of_cursor(
        "object of rows of 1 or 3 numbers by name",
        {
            "type": "object",
            "propertyNames": {"pattern": f"^({'|'.join(ATTRIBUTES)})"},
            "additionalProperties": {"anyOf": [json_schema.rows(1), json_schema.rows(3)]},
        },
        _attributes,
    ),
    "white_balance": _of_cursor(
        "`none`, an illuminant, a number [K] or `[x, y]`", _white_balance_schema(), _white_balance
    ),
    # forms of a host parameter: files and other parts of the scene
    "image": Form(
        "name of an image file",
        STRING,
        lambda cursor, reader: reader.image(cursor),
        lambda value, writer: writer.image(value),
    ),
    "volume": Form(
        "name of a `.npy`, `.vol`, `.nvdb` or `.vdb` file; with `#name` behind it that grid",
        {"type": ["string", "null"]},
        lambda cursor, reader: None if cursor.value is None else reader.volume(cursor),
        lambda value, writer: writer.volume(value),
    ),
    "colour_volume": Form(
        "name of a `.npy` file of an array (nx, ny, nz, 3), or of a `.vol` file of colours",
        {"type": ["string", "null"]},
        lambda cursor, reader: None if cursor.value is None else reader.volume(cursor, True),
        lambda value, writer: writer.volume(value),
    ),
    "measurement": Form(
        "name of a `.bsdf` file",
        STRING,
        lambda cursor, reader: reader.measurement(cursor),
        lambda value, writer: writer.measurement(value),
    ),
    "merl": Form(
        "name of a `.binary` file",
        STRING,
        lambda cursor, reader: reader.merl(cursor),
        lambda value, writer: writer.merl(value),
    ),
    "cube_images": Form(
        "name of an image file, or a list of six",
        {"anyOf": [STRING, {"type": "array", "items": STRING, "minItems": 6, "maxItems": 6}]},
        _cube_images,
        _write_cube_images,
    ),
    "sensor": Form(
        cameras.SENSOR_WORDS,
        cameras.SENSOR_SCHEMA,
        lambda cursor, _: cameras.read_sensor(cursor),
        lambda value, _: cameras.write_sensor(value),
    ),
    "lens": Form(
        cameras.LENS_WORDS,
        cameras.LENS_SCHEMA,
        lambda cursor, _: cameras.read_lens(cursor),
        lambda value, _: cameras.write_lens(value),
    ),
    "material": Form(
        "material, or its name",
        {"anyOf": [ref("material"), NAME_OF_MATERIAL]},
        lambda cursor, reader: reader.material(cursor),
        lambda value, writer: writer.material(value),
    ),
    "medium": Form(
        "medium, or its name; or none",
        {"anyOf": [ref("medium"), NAME_OF_MEDIUM, {"type": "null"}]},
        lambda cursor, reader: reader.medium(cursor),
        lambda value, writer: writer.medium(value),
    ),
    "media": Form(
        "list of media, or of their names",
        {"type": "array", "items": {"anyOf": [ref("medium"), NAME_OF_MEDIUM]}, "minItems": 1},
        lambda cursor, reader: tuple(reader.medium(entry) for entry in cursor.entries()),
        lambda value, writer: [writer.medium(medium) for medium in value],
    ),
    "phase": Form(
        "phase function",
        ref("phase"),
        lambda cursor, reader: reader.kind(cursor, "phase"),
        lambda value, writer: writer.kind(value),
    ),
    "texture": Form(
        "texture",
        ref("texture"),
        lambda cursor, reader: reader.kind(cursor, "texture"),
        lambda value, writer: writer.kind(value),
    ),
    "textures": Form(
        "list of textures",
        {"type": "array", "items": ref("texture")},
        lambda cursor, reader: [reader.kind(entry, "texture") for entry in cursor.entries()],
        lambda value, writer: [writer.kind(texture) for texture in value],
    ),
    "nodes": Form(
        "[nodes](graphs.md) by their names",
        {"type": "object", "additionalProperties": json_schema.NODES},
        lambda cursor, _: {name: node.expect(dict) for name, node in cursor.items()},
        lambda value, _: {name: {k: plain(v) for k, v in n.items()} for name, n in value.items()},
    ),
    "filter": Form(
        "object with a `type`",
        ref("filter"),
        lambda cursor, reader: reader.kind(cursor, "filter"),
        lambda value, writer: writer.kind(value),
    ),
    "optional_number": Form(
        lambda param: f"{_number_words(param)}, or none",
        lambda param: {"anyOf": [_number_schema(param), {"type": "null"}]},
        lambda cursor, _: None if cursor.value is None else cursor.number(),
    ),
    "metal": Form(
        "name of a metal, or a file",
        {"anyOf": [{"enum": list(spectra.metals())}, json_schema.INDEX_FILE_OBJECT]},
        lambda cursor, _: json_spectra.read_metal(cursor),
    ),
    "size": Form(
        "two whole numbers",
        {"type": "array", "items": WHOLE, "minItems": 2, "maxItems": 2},
        lambda cursor, _: tuple(entry.integer() for entry in cursor.entries(2)),
    ),
    "keys": Form(
        "list of [keys](motion.md#keys), or none",
        {"anyOf": [ref("keys"), {"type": "null"}]},
        lambda cursor, _: motion.keys(cursor),
        lambda value, _: motion.write_keys(value),
    ),
    "deformation": Form(
        "[deformation](motion.md#points-that-move-by-themselves), or none",
        {"anyOf": [ref("deformation"), {"type": "null"}]},
        lambda cursor, _: motion.deformation(cursor),
        lambda value, writer: writer.deformation(value),
    ),
    "shutter": Form(
        "[shutter](motion.md#the-shutter)",
        {"anyOf": [ref("shutter"), {"type": "null"}]},
        lambda cursor, _: motion.shutter(cursor),
        lambda value, _: motion.write_shutter(value),
    ),
    "area_light": Form(
        "`area` or `directional_area` light",
        {"anyOf": [ref("light"), {"type": "null"}]},
        lambda cursor, reader: reader.area_light(cursor),
        lambda value, writer: writer.kind(value),
    ),
    "group": Form(
        "a name in `groups`",
        STRING,
        lambda cursor, reader: reader.group(cursor),
        lambda value, writer: writer.group(value),
    ),
}
