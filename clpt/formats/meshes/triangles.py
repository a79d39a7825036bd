"""Triangles as readers of plain mesh formats return them, and their colours as attributes.

Corners of an OBJ file's faces have a uv and a normal each; `parts` makes vertices of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.errors import SceneError
from clpt.formats.meshes.obj import Contents
from clpt.geometry.polygons import smooth_normals, triangulate

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


DENSE = 8  # numbers between a mesh's first and last vertex, per corner, that a table may have


@dataclass
class Part:
    """The triangles of a material: its number, -1 for none; faces (m, 3) name the vertices.

    vertices, colours (n, 3), normals (n, 3) and uvs (n, 2); the last three are None if the file has
    none. bare: number of triangles without uvs beside others with uvs; their uvs are 0.
    """

    material: int
    vertices: NDArray[np.float32]
    faces: NDArray[np.int64]
    normals: NDArray[np.float32] | None
    uvs: NDArray[np.float32] | None
    colours: NDArray[np.float32] | None
    bare: int


def parts(contents: Contents, *, whole: bool = False) -> Iterator[Part]:
    """Yield the triangles of each material; whole: yield all together, without smoothing groups."""
    triangles, polygon = triangulate(contents.vertices, contents.counts, contents.corners[:, 0])
    if not len(triangles):
        return
    if whole:
        groups = np.zeros(len(triangles), np.int64)
        yield _part(contents, -1, contents.corners[triangles], groups)
        return
    material, groups = (contents.labels[name][polygon] for name in ("usemtl", "s"))
    if material.min() == material.max():
        yield _part(contents, int(material[0]), contents.corners[triangles], groups)
        return
    order = np.argsort(material, kind="stable")
    for members in np.split(order, np.flatnonzero(np.diff(material[order])) + 1):
        named = contents.corners[triangles[members]]
        yield _part(contents, int(material[members[0]]), named, groups[members])


def _part(
    contents: Contents, material: int, named: NDArray[np.int32], groups: NDArray[Any]
) -> Part:
    """Return a part of the mesh from its triangles.

    named: (t, 3, 3) vertex, uv and normal of each corner; groups: (t,) smoothing groups.
    """
    normals, named = _with_normals(contents, named, groups)
    corners = named.reshape(-1, 3)
    rows, faces = _unique(corners)
    lacking = named[..., 1] < 0
    uvs = None
    if not lacking.all():
        uvs = np.concatenate([contents.uvs, np.zeros((1, 2), np.float32)])[rows[:, 1]]
    return Part(
        material=material,
        vertices=contents.vertices[rows[:, 0]],
        faces=faces.reshape(-1, 3),
        normals=None if normals is None else normals[rows[:, 2]],
        uvs=uvs,
        colours=None if contents.colours is None else contents.colours[rows[:, 0]],
        bare=0 if uvs is None else int(lacking.any(axis=1).sum()),
    )


def _with_normals(
    contents: Contents, named: NDArray[np.int32], groups: NDArray[Any]
) -> tuple[NDArray[np.float32] | None, NDArray[np.int32]]:
    """Return normals and corners that name them; None where all triangles are flat.

    Corners that name no normal get their smoothing group's, or else their triangle's.
    """
    lacking = named[..., 2] < 0
    if not lacking.any():
        return contents.normals, named
    smooth = lacking.any(axis=1) & (groups > 0)
    if lacking.all() and not smooth.any():
        return None, named
    named, normals = named.copy(), [contents.normals]
    first = len(contents.normals)
    if smooth.any():
        vertex = named[smooth][..., 0].astype(np.int64)
        keys = np.unique(groups[smooth], return_inverse=True)[1].reshape(-1, 1)
        keys = keys * len(contents.vertices) + vertex
        _, kept, ids = np.unique(keys, return_index=True, return_inverse=True)
        ids = ids.reshape(-1, 3)
        normals.append(smooth_normals(contents.vertices[vertex.reshape(-1)[kept]], ids))
        named[smooth, :, 2] = np.where(lacking[smooth], first + ids, named[smooth][..., 2])
        first += len(normals[-1])
    flat = np.flatnonzero(lacking.any(axis=1) & ~smooth)
    a, b, c = (contents.vertices[named[flat, i, 0]].astype(np.float64) for i in range(3))
    normals.append(np.cross(b - a, c - a).astype(np.float32))
    flat_normals = first + np.arange(len(flat))[:, None]
    named[flat, :, 2] = np.where(lacking[flat], flat_normals, named[flat][..., 2])
    return np.concatenate(normals), named


def _unique(corners: NDArray[np.int32]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
    """Return the corners (k, 3) that differ, and of each corner the number of its like."""
    vertex = corners[:, 0].astype(np.int64)
    low = int(vertex.min())
    if int(vertex.max()) - low > DENSE * len(vertex):
        vertex = np.unique(vertex, return_inverse=True)[1].reshape(-1)
    else:
        vertex -= low
    # Most vertices have a single uv and normal: a table finds them without sorting.
    table = np.full(int(vertex.max()) + 1, -1, np.int64)
    table[vertex] = np.arange(len(vertex))
    like = table[vertex]
    same = (corners[like, 1] == corners[:, 1]) & (corners[like, 2] == corners[:, 2])
    used = table >= 0
    numbers = (np.cumsum(used) - 1)[vertex]
    rows = corners[table[used]]
    if same.all():
        return rows, numbers
    others = np.flatnonzero(~same)
    uv, normal = (corners[others, i].astype(np.int64) + 1 for i in (1, 2))
    pairs = np.unique(vertex[others] * (uv.max() + 1) + uv, return_inverse=True)[1].reshape(-1)
    _, first, like = np.unique(
        pairs * (normal.max() + 1) + normal, return_index=True, return_inverse=True
    )
    numbers[others] = len(rows) + like.reshape(-1)
    return np.concatenate([rows, corners[others[first]]]), numbers
