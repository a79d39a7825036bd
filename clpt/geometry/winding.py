"""Insides of shapes: how often a shape winds around a point; boxes, areas and volumes.

The solid angle of a closed boundary is 4 pi around a point inside, and 0 around a point outside.
cached: keeps results of functions by their arguments, such as the triangles of a shape; None:
nothing is kept.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.geometry import analytic, shapes
from clpt.geometry.analytic import keeps_its_kind, tessellate
from clpt.geometry.triangles import counted, triangulate
from clpt.scene.shapes import Cylinder, Disk, Mesh, Shape, Sphere, Spheres

Cache = Callable[..., Any]  # calls a function, or returns its earlier result
Triangles = tuple[NDArray[np.float32], NDArray[np.uint32]]
AROUND = 96  # corners of a disk's polygon
CHUNK = 1 << 18  # triangles that are summed at a time


def box(shape: Shape, cached: Cache | None) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the lowest and the highest corner of a shape's box."""
    if isinstance(shape, Sphere) and keeps_its_kind(shape):
        return analytic.bounds(shape)
    if isinstance(shape, Spheres):
        centers, radii = balls(shape)
        return (centers - radii[:, None]).min(axis=0), (centers + radii[:, None]).max(axis=0)
    vertices, faces = triangles_of(shape, cached)
    if not len(faces):
        return np.full(3, np.inf), np.full(3, -np.inf)
    return vertices.min(axis=0), vertices.max(axis=0)


def winding(shape: Shape, p: NDArray[np.float64], cached: Cache | None) -> float:
    """Return how often a shape winds around a point.

    It is 1 inside of a shape that is closed and faces outward.
    """
    side = -1.0 if shape.flip_normals else 1.0
    if isinstance(shape, Sphere) and keeps_its_kind(shape):
        members = analytic.members_of(shape)
        return side * float(np.linalg.norm(p - members["center"]) < members["radius"])
    if isinstance(shape, Spheres):
        centers, radii = balls(shape)
        return side * float((np.linalg.norm(p - centers, axis=1) < radii).sum())
    return winding_number(*triangles_of(shape, cached), p)


def areas(
    shape: Shape, cached: Cache | None, to_world: NDArray[np.float64] | None = None
) -> NDArray[np.float64]:
    """Return the sum of a shape's areas along their normals, and of the areas alone (4,) [m^2].

    to_world: what takes it where it is meant, after its own transform; None: nothing does.
    """
    if isinstance(shape, Spheres):
        return np.array([0.0, 0.0, 0.0, 4.0 * np.pi * float((balls(shape)[1] ** 2).sum())])
    vertices, faces = triangles_of(shape, cached)
    points = np.asarray(vertices, np.float64)
    if to_world is not None:
        points = transforms.transform_points(to_world, points)
    n = transforms.edge_crosses(points, faces) / 2.0
    return np.array([*n.sum(axis=0), np.linalg.norm(n, axis=1).sum()])


def volume(shape: Shape, cached: Cache | None) -> float:
    """Return the volume of a shape [m^3], below 0 if it faces inward."""
    if isinstance(shape, Spheres):
        return (-1.0 if shape.flip_normals else 1.0) * 4.2 * float((balls(shape)[1] ** 3).sum())
    vertices, faces = triangles_of(shape, cached)
    a, b, c = np.moveaxis(np.asarray(vertices, np.float64)[faces], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def winding_number(vertices: NDArray[Any], faces: NDArray[Any], p: NDArray[np.float64]) -> float:
    """Return how often triangles wind around a point; those that face away count as 1 in all.

    vertices (n, 3), faces (m, 3), p (3,). Van Oosterom and Strackee 1983, equation 8.
    """
    total = 0.0
    corners = np.asarray(vertices, np.float64) - p
    for first in range(0, len(faces), CHUNK):
        a, b, c = np.moveaxis(corners[faces[first : first + CHUNK]], 1, 0)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        dots = (np.einsum("ij,ij->i", *pair) for pair in ((a, b), (b, c), (c, a)))
        ab, bc, ca = dots
        total += 2.0 * float(np.arctan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb).sum())
    return total / (4.0 * np.pi)


def balls(shape: Spheres) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return centres and radii of many spheres, in the world."""
    rows = np.asarray(analytic.balls(shape), np.float64)
    return rows[:, :3], np.abs(rows[:, 3])


def triangles_of(shape: Shape, cached: Cache | None = None) -> Triangles:
    """Return the triangles of a shape in the world, or those that stand for it."""
    if isinstance(shape, Disk):
        shape = _fan(shape)
    elif isinstance(shape, Cylinder | Sphere):
        shape = tessellate(shape)
    elif cached is not None:
        vertices, faces, *_ = cached(counted, shape, by=shapes.geometry(shape))
        return vertices, faces
    vertices, faces, *_ = triangulate(shape)
    return vertices, faces


def _fan(disk: Disk) -> Mesh:
    """A disk as triangles about its middle."""
    angle = 2.0 * np.pi * np.arange(AROUND) / AROUND
    rim = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(AROUND)])
    i = np.arange(AROUND)
    faces = np.column_stack([np.zeros(AROUND, int), 1 + i, 1 + (i + 1) % AROUND])
    return Mesh(
        vertices=np.concatenate([np.zeros((1, 3)), rim]).astype(np.float32),
        faces=faces.astype(np.uint32),
        to_world=disk.to_world,
        flip_normals=disk.flip_normals,
    )


NEAR = 1e-6  # of the extent: largest distance of vertices of several meshes that coincide


def snapped(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (n, 3) on a lattice, so that nearly coincident points are equal."""
    step = NEAR * float(np.ptp(points, axis=0).max(initial=0.0)) or 1.0
    return np.round(points / step) * step


def largest_hole(vertices: NDArray[Any], faces: NDArray[Any]) -> float:
    """Return the area of the largest hole in triangles, over their area; 0 if they are closed.

    vertices (n, 3), faces (m, 3). An edge bounds no hole if as many triangles traverse it in both
    directions; connected other edges are the rim of a hole.
    """
    points, corners = np.asarray(vertices, np.float64), np.asarray(faces, np.int64)
    edges, balance = _unbalanced(corners)
    if not len(edges):
        return 0.0
    edges, balance = _unbalanced(_first_of_place(points)[corners])  # as files repeat vertices
    if not len(edges):
        return 0.0
    crosses = transforms.edge_crosses(points, corners)
    whole = 0.5 * float(np.linalg.norm(crosses, axis=1).sum())
    rims = _joined(edges)
    start, end = np.moveaxis(points[edges] - points.mean(axis=0), 1, 0)
    swept = 0.5 * balance[:, None] * np.cross(start, end)
    areas = np.array([np.bincount(rims, swept[:, k]) for k in range(3)])
    return float(np.linalg.norm(areas, axis=0).max()) / max(whole, 1e-300)


def _first_of_place(points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return for each point the first equal point, (n,), by a hash."""
    words = np.ascontiguousarray(points + 0.0).view(np.uint64)  # + 0: no two zeros
    name = np.zeros(len(points), np.uint64)
    for k in range(3):
        name = (name ^ words[:, k]) * np.uint64(0x9E3779B97F4A7C15)
        name ^= name >> np.uint64(29)
    _, first, same = np.unique(name, return_index=True, return_inverse=True)
    first_points: NDArray[np.int64] = first[same.reshape(-1)]
    return first_points


def _unbalanced(corners: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return edges (k, 2) that triangles traverse more often in a direction; the excess (k,)."""
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
