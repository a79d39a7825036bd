"""Geometry of a primitive: its triangles, and the attributes of its vertices."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats32
from clpt.formats.gltf.accessors import normalised
from clpt.formats.gltf.document import Element

TYPES = {  # of the accessors of an attribute, by what its name begins with
    "POSITION": ("VEC3",), "NORMAL": ("VEC3",), "TANGENT": ("VEC4",), "TEXCOORD": ("VEC2",),
    "COLOR": ("VEC3", "VEC4"), "JOINTS": ("VEC4",), "WEIGHTS": ("VEC4",),
}  # fmt: skip
FLOAT = 5126
SHARES = ("COLOR_", "WEIGHTS_")  # attributes between 0 and 1


@dataclass
class Geometry:
    """A primitive's triangles (m, 3), and by attribute, such as TEXCOORD_0, arrays (n, width).

    targets: for each morph target, displacements by attribute.
    """

    faces: NDArray[np.int64]
    attributes: dict[str, NDArray[Any]]
    targets: list[dict[str, Floats32]] = field(default_factory=list)


def types(name: str) -> tuple[str, ...]:
    """Return the accessor types that an attribute may have; none if it is not read."""
    return TYPES.get(name.partition("_")[0], ())


def target_types(name: str) -> tuple[str, ...]:
    """Return the accessor types of a morph target's attribute: of a tangent, without its side."""
    return ("VEC3",) if name == "TANGENT" else types(name)


def attribute(name: str, values: NDArray[Any], accessor: Element) -> NDArray[Any]:
    """Return an attribute's stored values as floats; joints stay whole numbers."""
    return values if name.startswith("JOINTS_") else normalised(values, accessor)


def warn_of_whole_numbers(name: str, accessor: Element) -> None:
    """Warn of colours and weights that are whole numbers, and not normalized (glTF 3.7.2.1)."""
    whole = name.startswith(SHARES) and accessor.integer("componentType") != FLOAT
    if whole and not accessor.flag("normalized"):
        accessor.warn(f"{name} of whole numbers must be normalized; taken as it is")
