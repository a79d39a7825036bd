"""Triangle meshes from PLY files, also gzip's.

Polygons and strips become triangles; corners of faces may have texture coordinates of their own, as
photogrammetry has them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget, text
from clpt.formats.meshes.ply_tables import Columns, Header, read_tables
from clpt.formats.meshes.triangles import Triangles, indices, see_through
from clpt.formats.reading import read_bytes
from clpt.geometry.polygons import triangulate

NORMAL = ("nx", "ny", "nz")
UVS = (("u", "v"), ("s", "t"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
CORNERS = ("vertex_indices", "vertex_index")
ELEMENTS = ("vertex", "face", "tristrips")
RESTART = -1  # between the strips of a list
LEFT_OUT = ("material_index", "ambient_red", "specular_red", "specular_power")
PER_BYTE = 8  # bytes of memory for each of the file, while it is read
MOST_CORNERS = 1 << 16  # of a polygon


def read(path: Path) -> Triangles:
    """Read a file. Raises SceneError if it is broken, or has no vertices or faces."""
    data = text.plain(read_bytes(path))
    budget.check(PER_BYTE * len(data), "its tables", path)
    try:
        return _triangles(*read_tables(data))
    except SceneError as error:
        message = f"cannot be read as a .ply mesh: {error.message}"
        raise SceneError(message, file=path, line=error.line) from None


def _triangles(header: Header, tables: Columns) -> Triangles:
    vertex, face = _plain(tables.get("vertex", {})), tables.get("face", {})
    if not all(name in vertex for name in "xyz"):
        raise SceneError("it holds no triangles: it has no vertices with x, y and z")
    uvs = next((pair for pair in UVS if all(name in vertex for name in pair)), None)
    normals = NORMAL if all(name in vertex for name in NORMAL) else None
    known = {*"xyz", *(normals or ()), *(uvs or ())}
    counts, corners = _corners(face)
    vertices = _columns(vertex, "xyz")
    triangles, polygon = triangulate(vertices, counts, corners)
    strips = _strips(tables.get("tristrips", {}))
    if not (len(strips) or any(name in face for name in CORNERS)):
        held = ", ".join(repr(element.name[:40]) for element in header.elements[:5])
        raise SceneError(f"it holds no triangles: its elements are {held}")
    rows = np.r_[polygon, np.full(len(strips), len(counts))]
    mesh = Triangles(
        vertices=vertices,
        faces=np.concatenate([corners[triangles], strips]),
        normals=None if normals is None else _columns(vertex, normals),
        uvs=None if uvs is None else _columns(vertex, uvs),
        columns={
            "vertex": {name: values for name, values in vertex.items() if name not in known},
            "face": {name: _of_faces(values)[rows] for name, values in _plain(face).items()},
        },
        polygons=np.r_[polygon, len(counts) + np.arange(len(strips))],
        textures=header.textures,
        warnings=_left_out(tables),
    )
    if "texcoord" in face and (uvs is None or header.textures):
        _with_corner_uvs(mesh, counts, face["texcoord"], triangles, len(strips))
    return mesh


def _of_faces(values: NDArray[Any]) -> NDArray[Any]:
    """Return a column of polygons with a zero more, which is that of strips."""
    return np.append(values, np.zeros(1, values.dtype))


def _corners(face: dict[str, Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return how many corners each polygon has, and the vertices of all."""
    lists = next((face[name] for name in CORNERS if name in face), None)
    if not isinstance(lists, tuple):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    counts = lists[0].astype(np.int64)
    if len(counts) and counts.max() > MOST_CORNERS:
        raise SceneError(f"a polygon has {counts.max()} corners, more than {MOST_CORNERS}")
    return counts, indices(lists[1])


def _strips(table: dict[str, Any]) -> NDArray[np.int64]:
    """Return the triangles (m, 3) of lists of strips: of each vertex with the two before it.

    -1 begins another strip; triangles that name a vertex twice only join two parts.
    """
    lists = next((table[name] for name in CORNERS if name in table), None)
    if not isinstance(lists, tuple) or not len(lists[1]):
        return np.zeros((0, 3), np.int64)
    values = indices(lists[1])
    begins = np.zeros(len(values), np.bool_)
    begins[(np.cumsum(lists[0]) - lists[0]).astype(np.int64)[lists[0] > 0]] = True
    begins[1:] |= values[:-1] == RESTART
    at = np.arange(len(values))
    place = at - np.maximum.accumulate(np.where(begins, at, 0))  # in the strip
    last = np.flatnonzero((place >= 2) & (values != RESTART))
    odd = place[last] % 2 == 1
    a, b, c = values[last - 2], values[last - 1], values[last]
    corners = np.stack([np.where(odd, b, a), np.where(odd, a, b), c], axis=1)
    return corners[(a != b) & (b != c) & (c != a)]


def _with_corner_uvs(
    mesh: Triangles,
    counts: NDArray[np.int64],
    texcoord: Any,
    triangles: NDArray[np.int32],
    strips: int,
) -> None:
    """Give a mesh the uvs that its faces list for their corners; split vertices with several."""
    lengths, values = texcoord
    complete = (lengths == 2 * counts) & (counts > 0)
    if (~complete & (counts > 2)).any() or strips:
        mesh.warnings.append("faces without texture coordinates have those of one point")
    if not complete.any():
        return
    uvs = np.zeros((int(counts.sum()), 2), np.float32)
    with np.errstate(over="ignore", invalid="ignore"):
        face_uvs = values[np.repeat(complete, lengths)].reshape(-1, 2).astype(np.float32)
    uvs[np.repeat(complete, counts)] = face_uvs
    uvs = np.concatenate([uvs[triangles.reshape(-1)], np.zeros((3 * strips, 2), np.float32)])
    _, uv = np.unique(np.ascontiguousarray(uvs).view(np.uint64), return_inverse=True)
    vertex = mesh.faces.reshape(-1)
    if len(vertex) and (vertex.min() < 0 or vertex.max() >= len(mesh.vertices)):
        return  # refused later, by its number
    _, first, faces = np.unique(
        vertex * (uv.max(initial=0) + 1) + uv.reshape(-1), return_index=True, return_inverse=True
    )
    named = vertex[first]
    mesh.vertices, mesh.faces, mesh.uvs = mesh.vertices[named], faces.reshape(-1, 3), uvs[first]
    mesh.normals = None if mesh.normals is None else mesh.normals[named]
    mesh.columns["vertex"] = {n: column[named] for n, column in mesh.columns["vertex"].items()}


def _left_out(tables: Columns) -> list[str]:
    """Return warnings of a file's visible properties that are not read."""
    messages = [f"element {name[:40]!r} left out" for name in tables if name not in ELEMENTS]
    for element in ("vertex", "face"):
        columns = _plain(tables.get(element, {}))
        messages += [f"{element} {name} left out" for name in LEFT_OUT if name in columns]
        if see_through(columns):
            messages.append(f"{element} alpha left out")
    return messages


def _plain(table: dict[str, Any]) -> dict[str, NDArray[Any]]:
    """Return the columns that are no lists."""
    return {name: values for name, values in table.items() if isinstance(values, np.ndarray)}


def _columns(table: dict[str, Any], names: Sequence[str]) -> NDArray[np.float32]:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.stack([np.asarray(table[name], np.float32) for name in names], axis=1)
