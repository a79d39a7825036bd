"""Catmull-Clark surfaces: refined polygons with creases and corners, at their limit positions.

Rules: Catmull and Clark 1978; of sharp edges DeRose, Kass and Truong 1998, with the fractional
sharpness between two levels as OpenSubdiv has it; limits: Halstead, Kass and DeRose 1993.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, Integers
from clpt.geometry.polygons import smooth_normals

INFINITE = 10.0  # sharpness that no level wears off
LINKS = 64  # most rounds of the search for corners around a vertex


@dataclass(frozen=True)
class Cage:
    """Polygons of a surface: counts (f,) and vertex of each corner (c,), with its creases.

    edges (e, 2), crease (e,): vertices and sharpness of creases. corner (n,): that of vertices.
    smooth: rule for boundary edges: "edgeOnly" makes them curves, "edgeAndCorner" curves that stop
    at corners of a single face, "linear" straight lines. "bilinear": nothing is smooth.
    """

    counts: Integers
    corners: Integers
    edges: Integers
    crease: Floats
    corner: Floats
    smooth: str = "edgeAndCorner"


@dataclass(frozen=True)
class _Edges:
    """The distinct edges of a cage.

    ends (m, 2): vertices; of (c,): the edge from each corner to the next; faces (m,): how many;
    sharp (m,): sharpness, INFINITE of edges that have not two faces.
    """

    ends: Integers
    of: Integers
    faces: Integers
    sharp: Floats


def refined(cage: Cage, values: Floats, levels: int) -> tuple[Cage, Floats]:
    """Return a cage of quadrilaterals, each face cut `levels` times, and its values (n, width).

    The first vertices are those of the cage. A face's quadrilaterals lie beside each other, in the
    order of faces; the first of each is at the face's first corner.
    """
    for _ in range(levels):
        cage, values = _once(cage, values)
    return cage, values


def limits(cage: Cage, values: Floats) -> Floats:
    """Return the limit values of vertices of a cage of quadrilaterals, (n, width)."""
    edges = _edges(cage)
    count, sharp = len(values), edges.sharp > 0.0
    valence = np.bincount(edges.ends.ravel(), minlength=count)
    ends = _added(count, edges.ends.ravel(), values[edges.ends[:, ::-1].ravel()])
    quads = cage.corners.reshape(-1, 4)
    across = _added(count, quads.ravel(), values[np.roll(quads, 2, axis=1).ravel()])
    n = np.maximum(valence, 1)[:, None]
    smooth = (n * n * values + 4.0 * ends + across) / (n * (n + 5.0))
    creased = (4.0 * values + _added_ends(count, edges, values, sharp)) / 6.0
    rank = _ranks(cage, edges, edges.sharp, cage.corner)[:, None]
    return np.where(
        rank < 2, smooth, np.where((rank == 2) & (valence > 0)[:, None], creased, values)
    )


def normals(cage: Cage, points: Floats) -> tuple[Floats, Integers]:
    """Return unit normals (k, 3), and of each corner (c,) its own: edges that stay sharp are edges.

    points: (n, 3) of a cage of quadrilaterals.
    """
    edges, quads = _edges(cage), cage.corners.reshape(-1, 4)
    if not ((edges.sharp >= 1.0) & (edges.faces == 2)).any():
        return _smooth(points, quads), cage.corners
    label = np.arange(len(cage.corners))
    following = np.roll(label.reshape(-1, 4), -1, axis=1).ravel()
    order = np.argsort(edges.of, kind="stable")
    soft = (edges.sharp < 1.0) & (edges.faces == 2)
    pairs = order[np.repeat(soft, edges.faces)].reshape(-1, 2)
    same = cage.corners[pairs[:, 0]] == cage.corners[pairs[:, 1]]
    first, second = pairs.T
    links = np.concatenate(
        [
            np.stack([first, np.where(same, second, following[second])], axis=1),
            np.stack([following[first], np.where(same, following[second], second)], axis=1),
        ]
    )
    for _ in range(LINKS):
        least = np.minimum(label[links[:, 0]], label[links[:, 1]])
        before = label.copy()
        np.minimum.at(label, links[:, 0], least)
        np.minimum.at(label, links[:, 1], least)
        if np.array_equal(before, label):
            break
    _, corner = np.unique(label, return_inverse=True)
    corner = corner.reshape(-1)
    at = np.zeros((int(corner.max()) + 1, 3))
    at[corner] = points[cage.corners]
    return _smooth(at, corner.reshape(quads.shape)), corner


def _smooth(points: Floats, quads: Integers) -> Floats:
    """Return smooth normals of the vertices of quadrilaterals, (n, 3)."""
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return smooth_normals(points, triangles).astype(np.float64)


def _edges(cage: Cage) -> _Edges:
    """Return the distinct edges of a cage."""
    starts = np.cumsum(cage.counts) - cage.counts
    following = np.arange(1, len(cage.corners) + 1)
    following[starts + cage.counts - 1] = starts
    ends = np.sort(np.stack([cage.corners, cage.corners[following]], axis=1), axis=1)
    size = len(cage.corner)
    keys, of, faces = np.unique(
        ends[:, 0] * size + ends[:, 1], return_inverse=True, return_counts=True
    )
    sharp = np.where(faces == 2, 0.0, INFINITE)
    if len(cage.edges):
        creases = np.sort(cage.edges, axis=1)
        at = np.searchsorted(keys, creases[:, 0] * size + creases[:, 1])
        at = np.minimum(at, len(keys) - 1)
        known = keys[at] == creases[:, 0] * size + creases[:, 1]
        np.maximum.at(sharp, at[known], cage.crease[known])
    return _Edges(np.stack([keys // size, keys % size], axis=1), of.reshape(-1), faces, sharp)


def _once(cage: Cage, values: Floats) -> tuple[Cage, Floats]:
    """Return a cage and its values after a level of subdivision."""
    edges, count = _edges(cage), len(values)
    face = np.repeat(np.arange(len(cage.counts)), cage.counts)
    middles = _added(len(cage.counts), face, values[cage.corners]) / cage.counts[:, None]
    halves = values[edges.ends].mean(axis=1)
    around = _added(len(halves), edges.of, middles[face])
    share = np.minimum(edges.sharp, 1.0)[:, None]
    soft = 0.5 * halves + 0.25 * around
    points = np.where(edges.faces[:, None] == 2, soft + share * (halves - soft), halves)
    if cage.smooth == "bilinear":
        whole = np.concatenate([values, halves, middles])
    else:
        whole = np.concatenate([_vertices(cage, edges, values, middles), points, middles])
    # Quadrilaterals: a vertex, the edge after it, the face, the edge before it.
    before = np.arange(len(cage.corners)) - 1
    before[np.cumsum(cage.counts) - cage.counts] += cage.counts
    first = count + len(halves)
    quads = np.stack(
        [cage.corners, count + edges.of, first + face, count + edges.of[before]], axis=1
    )
    sharp = np.flatnonzero(edges.sharp > 1.0)
    left = np.where(edges.sharp >= INFINITE, INFINITE, edges.sharp - 1.0)[sharp]
    halved = np.stack([edges.ends[sharp], np.stack([count + sharp] * 2, axis=1)], axis=2)
    corner = np.zeros(len(whole))
    corner[:count] = np.where(cage.corner >= INFINITE, INFINITE, np.maximum(cage.corner - 1.0, 0.0))
    child = replace(
        cage, counts=np.full(len(quads), 4), corners=quads.ravel(), edges=halved.reshape(-1, 2),
        crease=np.repeat(left, 2), corner=corner,
    )  # fmt: skip
    return child, whole


def _vertices(cage: Cage, edges: _Edges, values: Floats, middles: Floats) -> Floats:
    """Return the positions of a cage's vertices after a level of subdivision."""
    count = len(values)
    face = np.repeat(np.arange(len(cage.counts)), cage.counts)
    valence = np.bincount(edges.ends.ravel(), minlength=count)[:, None]
    n = np.maximum(valence, 1)
    ends = _added(count, edges.ends.ravel(), values[edges.ends[:, ::-1].ravel()])
    faces = _added(count, cage.corners, middles[face])
    smooth = (n - 2.0) / n * values + (ends + faces) / (n * n)
    later = np.where(edges.sharp >= INFINITE, INFINITE, np.maximum(edges.sharp - 1.0, 0.0))
    kept = np.maximum(cage.corner - 1.0, 0.0)
    kept[cage.corner >= INFINITE] = INFINITE
    ranks = [_ranks(cage, edges, edges.sharp, cage.corner), _ranks(cage, edges, later, kept)]
    rules = []
    for rank, sharp in zip(ranks, (edges.sharp, later), strict=True):
        creased = 0.75 * values + _added_ends(count, edges, values, sharp > 0.0) / 8.0
        held = np.where((rank == 2)[:, None], creased, values)
        rules.append(np.where((rank < 2)[:, None], smooth, held))
    # Between two rules, by the mean of the sharpness that wears off in this level.
    fading = (edges.sharp > 0.0) & (later == 0.0)
    weight = np.zeros(count)
    number = np.zeros(count)
    np.add.at(weight, edges.ends[fading].ravel(), np.repeat(edges.sharp[fading], 2))
    np.add.at(number, edges.ends[fading].ravel(), 1.0)
    worn = (cage.corner > 0.0) & (kept == 0.0)
    weight, number = weight + np.where(worn, cage.corner, 0.0), number + worn
    share = np.where(number > 0.0, weight / np.maximum(number, 1.0), 1.0)[:, None]
    moved = share * rules[0] + (1.0 - share) * rules[1]
    return np.where(valence > 0, moved, values)


def _ranks(cage: Cage, edges: _Edges, sharp: Floats, corner: Floats) -> Integers:
    """Return how many sharp edges each vertex has, (n,); 3 for a vertex that stays."""
    count = len(cage.corner)
    rank = np.bincount(edges.ends[sharp > 0.0].ravel(), minlength=count)
    faces = np.bincount(cage.corners, minlength=count)
    stays = corner > 0.0
    on_border = np.bincount(edges.ends[edges.faces == 1].ravel(), minlength=count) > 0
    if cage.smooth == "linear":
        stays |= on_border
    elif cage.smooth == "edgeAndCorner":
        stays |= on_border & (faces == 1)
    return np.where(stays, 3, rank)


def _added_ends(count: int, edges: _Edges, values: Floats, chosen: NDArray[np.bool_]) -> Floats:
    """Return for each vertex the sum of the other ends of its chosen edges."""
    ends = edges.ends[chosen]
    return _added(count, ends.ravel(), values[ends[:, ::-1].ravel()])


def _added(count: int, rows: Integers, values: NDArray[Any]) -> Floats:
    """Return sums of values (k, width) by row, (count, width)."""
    columns = [np.bincount(rows, values[:, i], count) for i in range(values.shape[1])]
    return np.stack(columns, axis=1)
