"""Keys of motions and shutters in scene.json."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt.formats.native.cursor import Cursor
from clpt.formats.native.json_schema import NUMBER, NUMBERS, Schema, ref
from clpt.formats.native.transforms import matrix
from clpt.scene.motion import SHAPES, Keys, Shutter

MEMBERS = ("open", "close", "shape")
KEYS_SCHEMA: Schema = {
    "type": "array",
    "minItems": 1,
    "items": {
        "type": "object",
        "properties": {
            "time": {**NUMBER, "description": "[s]; they ascend"},
            "transform": ref("transform"),
        },
        "required": ["time", "transform"],
        "additionalProperties": False,
    },
}
SHUTTER_SCHEMA: Schema = {
    "type": "object",
    "properties": {
        "open": {**NUMBER, "description": "[s]"},
        "close": {**NUMBER, "description": "[s]"},
        "shape": {"anyOf": [{"enum": [*SHAPES]}, {**NUMBERS, "minItems": 2}]},
    },
    "additionalProperties": False,
}


def keys(cursor: Cursor) -> Keys | None:
    """Return the keys of a motion, None for null. Raises SceneError."""
    if cursor.value is None:
        return None
    times, found = [], []
    for entry in cursor.entries():
        entry.check_keys("key", ("time", "transform"), ("time", "transform"))
        times.append(entry.at("time").number())
        found.append(matrix(entry.at("transform"), 4))
        if len(times) > 1 and not times[-1] > times[-2]:
            message = f"must be later than {times[-2]:g} s, the key before"
            raise entry.at("time").error(message)
    with cursor.locating():
        return Keys(times, np.array(found))


def write_keys(value: Keys) -> list[dict[str, Any]]:
    """Return what stands for keys in JSON."""
    return [
        {"time": time, "transform": rows.tolist()}
        for time, rows in zip(value.times, value.transforms, strict=True)
    ]


def shutter(cursor: Cursor) -> Shutter | None:
    """Return a shutter, None for null. Raises SceneError."""
    if cursor.value is None:
        return None
    cursor.expect(dict)
    cursor.check_keys("shutter", MEMBERS)
    given: dict[str, Any] = {}
    for name, child in cursor.items():
        listed = isinstance(child.value, list)
        shape = child.numbers() if listed else child.expect(str) if name == "shape" else None
        given[name] = shape if name == "shape" else child.number()
    given.setdefault("close", given.get("open", 0.0))
    with cursor.locating():
        return Shutter(**given)


def write_shutter(value: Shutter) -> dict[str, Any]:
    """Return what stands for a shutter in JSON."""
    shape = value.shape if isinstance(value.shape, str) else [float(v) for v in value.shape]
    return {"open": value.open, "close": value.close, "shape": shape}
