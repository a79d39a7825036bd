"""Corners of faces, each with a uv and a normal of its own, as vertices of triangles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.formats.meshes.obj import Contents
from clpt.geometry.polygons import smooth_normals, triangulate

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
    material, groups = (contents.labels[name][polygon] for name in ("usemtl", "s"))
    if whole:
        material, groups = np.full_like(material, -1), np.zeros_like(groups)
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
