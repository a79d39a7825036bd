"""Holes in the surface of triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

NEAR = 1e-6  # of its extent: vertices of several meshes that are one


def together(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (n, 3), those that nearly coincide at one place of a lattice."""
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
    first_points: NDArray[np.int64] = first[same.reshape(-1)]
    return first_points


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
