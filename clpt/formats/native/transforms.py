"""Transforms in scene.json: the rows of a matrix, or steps of which the first is applied first."""

from __future__ import annotations

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
            if name not in STEPS or len(step.value) != 1:
                raise UnknownKindError("transform", name, STEPS, **child.location())
            with child.locating():
                product = STEPS[name](child) @ product
    return _regular(cursor, product) if size == 4 else product[np.ix_([0, 1, 3], [0, 1, 3])]


def _regular(cursor: Cursor, product: transforms.Matrix) -> transforms.Matrix:
    if transforms.is_singular(product):
        raise cursor.error("the transform cannot be inverted: it flattens space or is not finite")
    return product


def _fields(cursor: Cursor, **readers: Callable[[Cursor], Any]) -> list[Any]:
    """Return the values of an object that must have exactly these keys."""
    cursor.check_keys(str(cursor.path[-1]), readers, readers)
    return [read(cursor.at(key)) for key, read in readers.items()]
