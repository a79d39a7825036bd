"""Keys of motions and shutters in scene.json."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from clpt import transforms
from clpt.errors import UnknownKindError
from clpt.files import numpy_files, output_files
from clpt.formats.native.cursor import Cursor, ReadCursor
from clpt.formats.native.json_schema import NUMBER, NUMBERS, STRING, Schema, object_of, ref
from clpt.formats.native.spectra import find_file
from clpt.scene.motion import SHAPES, Deformation, Keys, Shutter

MEMBERS = ("open", "close", "shape", "readout")


def _keys_schema(name: str, **properties: Schema) -> Schema:
    """A list of keys, each with a time and at least the property `name`."""
    time = {**NUMBER, "description": "[s]; they ascend"}
    key = object_of({"time": time, **properties}, ["time", name])
    return {"type": "array", "minItems": 1, "items": key}


KEYS_SCHEMA = _keys_schema("transform", transform=ref("transform"))
LIST: Schema = {"type": "array", "items": NUMBERS}
POINTS = ("points", "normals")
DEFORMATION_SCHEMA: Schema = {
    "anyOf": [
        object_of(
            {"file": {**STRING, "description": "name of a .npz of times, points, normals"}},
            ["file"],
        ),
        _keys_schema("points", points=LIST, normals=LIST),
    ]
}
SHUTTER_SCHEMA: Schema = {
    "type": "object",
    "properties": {
        "open": {**NUMBER, "description": "[s]"},
        "close": {**NUMBER, "description": "[s]"},
        "shape": {"anyOf": [{"enum": [*SHAPES]}, {**NUMBERS, "minItems": 2}]},
        "readout": {**NUMBER, "description": "from the first row to the last [s]", "minimum": 0},
    },
    "additionalProperties": False,
}


def keys(cursor: Cursor) -> Keys | None:
    """Return the keys of a motion, None for null. Raises SceneError."""
    if cursor.value is None:
        return None
    times: list[float] = []
    matrices = []
    for entry in cursor.entries():
        entry.check_keys("key", ("time", "transform"), ("time", "transform"))
        times.append(entry.at("time").number())
        matrices.append(matrix(entry.at("transform"), 4))
        if len(times) > 1 and not times[-1] > times[-2]:
            message = f"must be later than {times[-2]:g} s, the key before"
            raise entry.at("time").error(message)
    with cursor.locating():
        return Keys(times, np.array(matrices))


def write_keys(value: Keys) -> list[dict[str, Any]]:
    """Return what stands for keys in JSON."""
    return [
        {"time": time, "transform": rows.tolist()}
        for time, rows in zip(value.times, value.transforms, strict=True)
    ]


def deformation(cursor: Cursor) -> Deformation | None:
    """Return the keys of points, None for null. Raises SceneError."""
    if cursor.value is None:
        return None
    if isinstance(cursor.value, dict):
        cursor.check_keys("deformation", ("file",), ("file",))
        return _from_file(cursor.at("file"))
    times: list[float] = []
    points, normals = [], []
    for entry in cursor.entries():
        entry.check_keys("key", ("time", *POINTS), ("time", "points"))
        _add_time(entry.at("time"), times)
        points.append([row.numbers() for row in entry.at("points").entries()])
        if len(points[-1]) != len(points[0]):
            message = f"has {len(points[-1])} points where the first key has {len(points[0])}"
            raise entry.at("points").error(message)
        if "normals" in entry.value:
            normals.append([row.numbers(3) for row in entry.at("normals").entries()])
        if normals and len(normals) != len(times):
            raise entry.error("needs normals at every key, or at none")
    with cursor.locating():
        return Deformation(times, points, normals or None)


def _add_time(cursor: Cursor, times: list[float]) -> None:
    times.append(cursor.number())
    if len(times) > 1 and not times[-1] > times[-2]:
        raise cursor.error(f"must be later than {times[-2]:g} s, the key before")


def _from_file(cursor: Cursor) -> Deformation:
    """Return the keys of points in a .npz file."""
    path = find_file(cursor)
    with cursor.locating():
        arrays: dict[str, Any] = numpy_files.arrays(path, ("times", *POINTS))
    for name in ("times", "points"):
        if name not in arrays:
            raise cursor.error(f"has no array {name!r}")
    with cursor.locating():
        return Deformation(**arrays)


def write_deformation(value: Deformation, path: Path) -> None:
    """Write keys of points as a .npz file."""
    held = {"times": np.asarray(value.times), "points": value.points}
    if value.normals is not None:
        held["normals"] = value.normals
    file = io.BytesIO()
    np.savez_compressed(file, **held)
    output_files.write(path, file.getvalue())


def shutter(cursor: Cursor) -> Shutter | None:
    """Return a shutter, None for null. Raises SceneError."""
    if cursor.value is None:
        return None
    cursor.expect(dict)
    cursor.check_keys("shutter", MEMBERS)
    fields: dict[str, Any] = {}
    for name, child in cursor.items():
        listed = isinstance(child.value, list)
        shape = child.numbers() if listed else child.expect(str) if name == "shape" else None
        fields[name] = shape if name == "shape" else child.number()
    fields.setdefault("close", fields.get("open", 0.0))
    with cursor.locating():
        return Shutter(**fields)


def write_shutter(value: Shutter) -> dict[str, Any]:
    """Return what stands for a shutter in JSON."""
    shape = value.shape if isinstance(value.shape, str) else [float(v) for v in value.shape]
    rolling = {"readout": value.readout} if value.readout else {}
    return {"open": value.open, "close": value.close, "shape": shape, **rolling}


STEPS: dict[str, ReadCursor] = {
    "translate": lambda c: transforms.translate(c.numbers(3)),
    "scale": lambda c: transforms.scale(c.numbers(3) if isinstance(c.value, list) else c.number()),
    "rotate": lambda c: transforms.rotate(
        *_fields(c, axis=lambda a: a.numbers(3), angle=Cursor.number)
    ),
    "look_at": lambda c: transforms.look_at(
        *_fields(c, **dict.fromkeys(("origin", "target", "up"), lambda v: v.numbers(3)))
    ),
}

FIELDS: dict[str, dict[str, Any]] = {  # what steps of several values have, with examples
    "rotate": {"axis": [1, 0, 0], "angle": 90},
    "look_at": {"origin": [0, 0, 4], "target": [0, 0, 0], "up": [0, 1, 0]},
}


def matrix(cursor: Cursor, size: int) -> transforms.Matrix:
    """Return a transform, (size, size) float64; 3x3 acts on (u, v, 1)."""
    value = cursor.value
    if isinstance(value, list) and all(isinstance(row, list) for row in value):
        rows = np.array([row.numbers(size) for row in cursor.entries(size)])
        return _regular(cursor, rows) if size == 4 else rows
    steps = [cursor] if isinstance(value, dict) else cursor.entries()
    product = np.eye(4)
    for step in steps:
        for name, child in step.items():
            if len(step.value) != 1:
                raise step.error(_one_step(step.value))
            if name not in STEPS:
                raise UnknownKindError("transform", name, STEPS, **child.location())
            with child.locating():
                product = STEPS[name](child) @ product
    return _regular(cursor, product) if size == 4 else product[np.ix_([0, 1, 3], [0, 1, 3])]


def _one_step(value: dict[str, Any]) -> str:
    """Return the error message for a step without a single name."""
    names = [name for name in value if name in STEPS]
    inside = [name for name in value if name not in STEPS]
    for name in names:
        if inside and set(inside) <= set(FIELDS.get(name, {})):
            written = json.dumps({name: FIELDS[name]})
            return f"{' and '.join(map(repr, inside))} stands inside of {name!r}, as {written}"
    if len(names) == len(value) > 1:
        written = ", ".join(f'{{"{name}": ..}}' for name in names)
        return f"several steps are a list, in which the first is applied first: [{written}]"
    return f"a step is one of {', '.join(STEPS)}, alone: {json.dumps({'translate': [0, 1, 0]})}"


def _regular(cursor: Cursor, product: transforms.Matrix) -> transforms.Matrix:
    if transforms.is_singular(product):
        raise cursor.error("the transform cannot be inverted: it flattens space or is not finite")
    return product


def _fields(cursor: Cursor, **readers: ReadCursor) -> list[Any]:
    """Return the values of an object that must have exactly these keys."""
    name = str(cursor.path[-1])
    if not isinstance(cursor.value, dict):
        written = json.dumps({name: FIELDS[name]})
        raise cursor.error(f"must be an object, as {written}, not {json.dumps(cursor.value)}")
    cursor.check_keys(name, readers, readers)
    return [read(cursor.at(key)) for key, read in readers.items()]
