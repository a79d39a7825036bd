"""Transforms in scene.json: the rows of a matrix, or steps of which the first is applied first."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np

from clpt import transforms
from clpt.errors import UnknownKindError
from clpt.formats.native.cursor import Cursor

STEPS: dict[str, Callable[[Cursor], transforms.Matrix]] = {
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
    """Return a transform, (size, size) float64; one of 3x3 acts on (u, v, 1)."""
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
    """Return what to say of a step that does not have one name."""
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


def _fields(cursor: Cursor, **readers: Callable[[Cursor], Any]) -> list[Any]:
    """Return the values of an object that must have exactly these keys."""
    name = str(cursor.path[-1])
    if not isinstance(cursor.value, dict):
        written = json.dumps({name: FIELDS[name]})
        raise cursor.error(f"must be an object, as {written}, not {json.dumps(cursor.value)}")
    cursor.check_keys(name, readers, readers)
    return [read(cursor.at(key)) for key, read in readers.items()]
