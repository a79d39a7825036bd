"""Triangles as readers of plain mesh formats return them, and their colours as attributes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.errors import SceneError

TANGENTS = "vertex tangents"  # among attributes, while a mesh is read
TANGENT_COLUMNS = ("tx", "ty", "tz", "tw")  # of a PLY file that clpt has written
COLOURS = (
    ("red", "green", "blue"),
    ("r", "g", "b"),
    ("diffuse_red", "diffuse_green", "diffuse_blue"),
)
ALPHAS = ("alpha", "a", "diffuse_alpha")
LARGEST_INDEX = 1 << 53
FULL = (255, 65535)  # largest values of colours that are whole numbers of wider types


@dataclass
class Triangles:
    """vertices (n, 3), faces (m, 3) int64, normals (n, 3) or None, uvs (n, 2) or None.

    columns: further numbers of each "vertex" and "face" by name; a polygon's are those of all its
    triangles. polygons: of a PLY, the number of the polygon of each triangle, (m,).
    textures: names of image files; where there are several, the column texnumber of "face" says
    which.
    """

    vertices: NDArray[Any]
    faces: NDArray[np.int64]
    normals: NDArray[np.float32] | None = None
    uvs: NDArray[np.float32] | None = None
    columns: dict[str, dict[str, NDArray[Any]]] = field(default_factory=dict)
    name: str = ""
    polygons: NDArray[np.int64] | None = None
    textures: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def attributes(triangles: Triangles) -> dict[str, NDArray[np.float32]]:
    """Return colours and other numbers per vertex and face, by Mitsuba's names.

    Colours are vertex_color or face_color: whole numbers are shares of the largest, decoded from
    sRGB, floats are linear. x_0, x_1, x_2 or x_r, x_g, x_b are vertex_x.
    """
    values_by_name: dict[str, NDArray[np.float32]] = {}
    for element in ("vertex", "face"):
        columns = dict(triangles.columns.get(element, {}))
        colour = next((names for names in COLOURS if all(n in columns for n in names)), ())
        if colour:
            values = np.column_stack([columns.pop(name) for name in colour])
            values_by_name[f"{element}_color"] = linear(values)
        for name, parts in _grouped(columns).items():
            values = np.column_stack(parts)
            if values.shape[1] in (1, 3) and f"{element}_{name}" not in values_by_name:
                bytes_ = values.dtype == np.uint8
                values_by_name[f"{element}_{name}"] = (
                    linear(values) if bytes_ else values.astype(np.float32)
                )
    vertex = triangles.columns.get("vertex", {})
    if all(name in vertex for name in TANGENT_COLUMNS):
        values_by_name[TANGENTS] = np.column_stack([vertex[n] for n in TANGENT_COLUMNS]).astype(
            np.float32
        )
    return values_by_name


def linear(colours: NDArray[Any]) -> NDArray[np.float32]:
    """Return stored colours as linear colours: floats are linear already.

    Whole numbers are shares of 255 if their type or their values fit a byte, else of 65535 or of
    their type's largest number.
    """
    if colours.dtype.kind not in "iu":
        return colours.astype(np.float32)
    largest = int(np.iinfo(colours.dtype).max)
    top = largest
    if colours.dtype != np.uint16 and colours.size:
        top = next(limit for limit in (*FULL, largest) if colours.max() <= limit)
    top = min(top, largest)
    shares = np.maximum(colours, 0) / np.float64(top)
    return images.srgb_to_linear(shares.astype(np.float32)).astype(np.float32)


def indices(values: NDArray[Any]) -> NDArray[np.int64]:
    """Return numbers of vertices. Raises SceneError for a number that is not whole."""
    if values.dtype.kind == "f":
        whole = np.abs(values) < LARGEST_INDEX  # false for nan
        whole[whole] = values[whole] == np.trunc(values[whole])
        if not whole.all():
            raise SceneError(f"a face names vertex {values[np.argmin(whole)]:g}")
    return values.astype(np.int64)


def see_through(columns: dict[str, NDArray[Any]]) -> bool:
    """Return whether there is an alpha that is not full everywhere."""
    for name in ALPHAS:
        if name in columns and columns[name].size:
            full = 1.0 if columns[name].dtype.kind == "f" else columns[name].max()
            full = max(full, 255) if columns[name].dtype.kind in "iu" else full
            return bool((columns[name] < full).any())
    return False


def _grouped(columns: dict[str, NDArray[Any]]) -> dict[str, list[NDArray[Any]]]:
    """Return the columns of each attribute by its name."""
    groups: dict[str, list[NDArray[Any]]] = {}
    for name, values in columns.items():
        head, _, tail = name.rpartition("_")
        letter = {"red": "r", "green": "g", "blue": "b"}.get(name, name)
        if letter in ("r", "g", "b"):
            groups.setdefault("color", []).append(values)
        elif head and tail in (*"rgbxyz", *"012"):
            groups.setdefault(head, []).append(values)
    return groups
