"""Shapes without what is in them and around them: neither light nor media."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from typing import Any

from clpt.scene.params import fields_of
from clpt.scene.shapes import Group, Instance, Shape

PLAIN: dict[str, Any] = {"emission": None, "interior": None, "exterior": None, "priority": 0}


def bare(shape: Shape, **more: object) -> Shape:
    """Return a shape without light and media; more: further fields that it is to have."""
    given = fields_of(shape)
    wanted = PLAIN | more
    own = {name: value for name, value in wanted.items() if given[name] is not value}
    return dataclasses.replace(shape, **own) if own else shape


def each(shapes: Iterable[Shape], change: Callable[[Shape], Shape | None]) -> list[Shape]:
    """Return the shapes as `change` makes them, without those of which it makes None.

    What several instances place is changed once.
    """
    groups: dict[int, Group] = {}
    changed: list[Shape | None] = []
    for shape in shapes:
        if isinstance(shape, Instance):
            group = shape.group
            if id(group) not in groups:
                kept = [one for one in map(change, group.shapes) if one is not None]
                groups[id(group)] = Group(shapes=tuple(kept), name=group.name)
            changed.append(dataclasses.replace(shape, group=groups[id(group)]))
        else:
            changed.append(change(shape))
    return [shape for shape in changed if shape is not None]
