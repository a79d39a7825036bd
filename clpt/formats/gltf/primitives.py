"""Primitives: their triangles and the attributes of their vertices, as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats32
from clpt.formats.gltf import draco
from clpt.formats.gltf.accessors import COMPONENTS, floats, integers, stored
from clpt.formats.gltf.document import Element
from clpt.formats.gltf.geometry import Geometry, target_types, types, warn_of_whole_numbers

POINTS, TRIANGLES, STRIP, FAN = 0, 4, 5, 6
NOT_DRAWN = {0: "points", 1: "lines", 2: "a line loop", 3: "a line strip"}


def geometry(primitive: Element) -> Geometry | None:
    """Return the triangles of a primitive, or None, and a note, if it has none.

    Raises SceneError where accessors contradict each other or name vertices that are not there.
    """
    mode = primitive.integer("mode", TRIANGLES, high=FAN)
    attributes = primitive.needed("attributes")
    if mode in NOT_DRAWN:
        primitive.warn(f"{NOT_DRAWN[mode]} left out: only triangles are rendered")
        return None
    if "POSITION" not in attributes:
        primitive.warn("left out, since it has no positions")
        return None
    compressed = primitive.extension(draco.NAME)
    made = _plain(attributes) if compressed is None else draco.attributes(primitive, compressed)
    vertices = len(made.attributes["POSITION"])
    for name, values in made.attributes.items():
        if len(values) != vertices:
            message = f"has {len(values)} elements, POSITION has {vertices}"
            raise attributes.error(message, name)
    if compressed is None:
        order = integers(primitive, "indices") if "indices" in primitive else np.arange(vertices)
        made.faces = triangles(order.astype(np.int64), mode)
    _check_indices(primitive, made.faces, vertices)
    made.targets = [_target(target, vertices) for target in primitive.children("targets")]
    return made


def triangles(order: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """Return the triangles (m, 3) that a list, strip or fan of vertices draws (glTF 3.7.2.1)."""
    if mode == TRIANGLES:
        return order[: len(order) // 3 * 3].reshape(-1, 3)
    count = max(len(order) - 2, 0)
    i = np.arange(count)
    if mode == STRIP:
        odd = i % 2
        return order[np.stack([i, i + 1 + odd, i + 2 - odd], axis=1)]
    return order[np.stack([i + 1, i + 2, np.zeros_like(i)], axis=1)]


def _plain(attributes: Element) -> Geometry:
    arrays: dict[str, NDArray[Any]] = {}
    for name in filter(types, attributes.value):
        accessor = attributes.entry(name, "accessors")
        if accessor is None:
            continue
        warn_of_whole_numbers(name, accessor)
        if name.startswith("JOINTS_"):
            if COMPONENTS.get(accessor.integer("componentType"), np.dtype("f4")).kind != "u":
                raise accessor.error("joints must be unsigned integers", "componentType")
            arrays[name] = stored(accessor, types(name))
        else:
            arrays[name] = floats(accessor, types(name))
    return Geometry(np.zeros((0, 3), np.int64), arrays)


def _check_indices(primitive: Element, faces: NDArray[np.int64], vertices: int) -> None:
    if len(faces) and faces.max() >= vertices:
        bad = int(np.argmax((faces >= vertices).any(axis=1)))
        message = f"triangle {bad} names a vertex outside of 0 to {vertices - 1}"
        raise primitive.error(message, "indices")


def _target(target: Element, vertices: int) -> dict[str, Floats32]:
    found = {}
    for name in filter(types, target.value):
        accessor = target.entry(name, "accessors")
        if accessor is None:
            continue
        found[name] = floats(accessor, target_types(name))
        if len(found[name]) != vertices:
            raise target.error(f"has {len(found[name])} elements, not {vertices}", name)
    return found
