"""Meshes around something with an inside, a medium or what a glass absorbs, that have a hole.

What a ray passes is told by the boundaries that it meets. Where it leaves or enters through a hole
it meets none, and what it is in from there on is not defined: paths from the camera and from lights
take it for one thing or the other, so that their pictures differ.

A hole is where edges have triangles on one side alone, or of unlike winding. Its size is the area
that its edges enclose, so that a vertex on another triangle's edge is none.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.geometry import shapes
from clpt.render.lowering.camera.surroundings import every, triangles_of
from clpt.render.lowering.device_arrays import on_device
from clpt.render.lowering.index import SceneIndex
from clpt.render.lowering.materials.material_words import CLEAR
from clpt.scene import materials as mt
from clpt.scene.shapes import Cylinder, Disk, Mesh, Shape

HOLE = 1e-4  # of a mesh's area: smaller ones are no matter
ROUND = Disk, Cylinder
NEAR = 1e-6  # of its extent: vertices of several meshes that are one


def warnings_of(index: SceneIndex, cached: Callable[..., Any] | None = None) -> list[str]:
    """Return a warning where meshes that have an inside are not closed, else none.

    cached: `LoweringCache`, which keeps what was found of a mesh.
    """
    suspects: list[tuple[Any, Mesh]] = []
    for shape in index.shapes:
        if isinstance(shape, Mesh) and not on_device(shape.vertices):
            for inside in _insides(shape):
                known = any(inside == other for other, _ in suspects)
                if not known and _own_hole(shape, cached) > HOLE:
                    suspects.append((inside, shape))
    found = [(shape, _hole(index, inside, cached)) for inside, shape in suspects]
    holes = [(shape, share) for shape, share in found if share > HOLE]
    if not holes:
        return []
    (shape, share), more = holes[0], len(holes) - 1
    others = f", and {more} other{'s' * (more > 1)}" * (more > 0)
    return [
        f"{shapes.where(shape)}{others}: not closed, a hole has {100.0 * share:.2g}% of the area, "
        "but it has an inside that absorbs or scatters; where rays go through the hole what they "
        "are in is not defined, and integrators differ. Close the mesh, and turn its triangles to "
        "one side; or leave its medium or `absorption` out"
    ]


def _insides(shape: Shape) -> Iterator[Any]:
    """What is inside of a shape: its medium, or what its materials absorb there."""
    if shape.interior is not None:
        yield shape.interior
        return
    for part in mt.parts(shape.material):
        absorbs = getattr(part, "absorption", CLEAR)
        if absorbs != CLEAR and not getattr(part, "thin", False):
            yield absorbs


def _own_hole(shape: Shape, cached: Callable[..., Any] | None) -> float:
    """The largest hole of a shape alone, over its area."""
    if cached is None:
        return largest_hole(*triangles_of(shape))
    vertices, faces = triangles_of(shape, cached)
    share: float = cached(largest_hole, vertices, faces)
    return share


def _hole(index: SceneIndex, inside: Any, cached: Callable[..., Any] | None) -> float:
    """The largest hole of all shapes around something, over their area."""
    around: list[tuple[float, Shape]] = []
    for shape in every(index.scene, lambda one: True):
        around += [(1.0, shape)] * any(inside == own for own in _insides(shape))
        around += [(-1.0, shape)] * (shape.exterior is inside)
    if len(around) == 1:
        return _own_hole(around[0][1], cached)
    if any(isinstance(shape, ROUND) for _, shape in around):
        return 0.0  # their rims are no edges
    points: list[NDArray[Any]] = []
    faces: list[NDArray[Any]] = []
    first = 0
    for sign, shape in around:
        if on_device(getattr(shape, "vertices", None)):
            return 0.0
        own, triangles = triangles_of(shape, cached)
        points.append(np.asarray(own, np.float64))
        faces.append(np.asarray(triangles, np.int64)[:, :: int(sign)] + first)
        first += len(own)
    return largest_hole(_together(np.concatenate(points)), np.concatenate(faces))


def _together(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points (n, 3), those that nearly coincide at one place of a lattice."""
    step = NEAR * float(np.ptp(points, axis=0).max(initial=0.0)) or 1.0
    return np.round(points / step) * step


def largest_hole(vertices: NDArray[Any], faces: NDArray[Any]) -> float:
    """Return the area of the largest hole in triangles, over theirs; 0 of what is closed.

    vertices (n, 3), faces (m, 3). An edge that is gone along as often one way as the other bounds
    no hole; the others are the rims, and those that touch are of one hole.
    """
    points, corners = np.asarray(vertices, np.float64), np.asarray(faces, np.int64)
    edges, balance = _unbalanced(corners)
    if not len(edges):
        return 0.0
    edges, balance = _unbalanced(_first_of_place(points)[corners])  # as files repeat vertices
    if not len(edges):
        return 0.0
    a, b, c = np.moveaxis(points[corners], 1, 0)
    whole = 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())
    rims = _joined(edges)
    start, end = np.moveaxis(points[edges] - points.mean(axis=0), 1, 0)
    swept = 0.5 * balance[:, None] * np.cross(start, end)
    areas = np.array([np.bincount(rims, swept[:, k]) for k in range(3)])
    return float(np.linalg.norm(areas, axis=0).max()) / max(whole, 1e-300)


def _first_of_place(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """The first point of those at the same place, of each (n,); told apart by a hash."""
    words = np.ascontiguousarray(points + 0.0).view(np.uint64)  # + 0: no two zeros
    name = np.zeros(len(points), np.uint64)
    for k in range(3):
        name = (name ^ words[:, k]) * np.uint64(0x9E3779B97F4A7C15)
        name ^= name >> np.uint64(29)
    _, first, same = np.unique(name, return_index=True, return_inverse=True)
    found: NDArray[np.int64] = first[same.reshape(-1)]
    return found


def _unbalanced(corners: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Edges (k, 2) that triangles go along more often one way, and by how much."""
    start, end = corners.ravel(), np.roll(corners, -1, axis=1).ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    name = low * (int(corners.max(initial=0)) + 1) + high
    order = np.argsort(name, kind="stable")
    name, way = name[order], np.sign(end - start)[order]
    first = np.flatnonzero(np.diff(name, prepend=-1))
    sums = np.add.reduceat(way, first) if len(first) else np.zeros(0)
    kept = order[first[sums != 0]]
    edges = np.column_stack([low[kept], high[kept]])
    return edges, sums[sums != 0].astype(np.float64)


def _joined(edges: NDArray[np.int64]) -> NDArray[np.int64]:
    """The number of the connected part that each edge (k, 2) is in (k,)."""
    _, ends = np.unique(edges, return_inverse=True)
    a, b = ends.reshape(-1, 2).T
    part = np.arange(ends.max() + 1)
    while True:
        least = np.minimum(part[a], part[b])
        joined = part.copy()
        np.minimum.at(joined, part[a], least)
        np.minimum.at(joined, part[b], least)
        joined = joined[joined]
        if (joined == part).all():
            return np.unique(part[a], return_inverse=True)[1].reshape(-1)
        part = joined
