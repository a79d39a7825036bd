"""Loop subdivision (Loop 1987) of triangle meshes, with vertices and normals of the limit surface.

Rules and limit masks of Hoppe et al. 1994: inside a mesh by valence, along a border as the cubic
B-spline that it is.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Floats, Integers
from clpt.errors import SceneError
from clpt.files import budget

PER_TRIANGLE = 512  # bytes of memory for each of the finest triangles during subdivision


def loop(points: Floats, faces: Integers, levels: int) -> tuple[Floats, Integers, Floats]:
    """Subdivide `levels` times; return limit points (n, 3), faces (m, 3) and limit normals (n, 3).

    Raises SceneError for an edge of more than two triangles, and for a mesh that becomes too large.
    """
    budget.check(PER_TRIANGLE * len(faces) * 4**levels, f"{levels} levels of subdivision")
    for _ in range(levels):
        budget.check_time()
        points, faces = _finer(points, faces)
    edges = _Edges(faces, len(points))
    return _limit(points, edges), faces, _normals(points, faces, edges)


class _Edges:
    """The edges of a mesh: their ends (e, 2), the vertices across, and which are borders."""

    def __init__(self, faces: Integers, count: int):
        halves = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        across = np.concatenate([faces[:, 2], faces[:, 0], faces[:, 1]])
        low, high = halves.min(axis=1), halves.max(axis=1)
        keys, inverse, uses = np.unique(low * count + high, return_inverse=True, return_counts=True)
        if (uses > 2).any():
            raise SceneError("an edge has more than two triangles, so nothing smooth goes through")
        self.of_halves = inverse.reshape(3, -1)  # from each corner to the next
        self.ends = np.stack([keys // count, keys % count], axis=1)
        self.border = uses == 1
        order = np.argsort(inverse, kind="stable")
        first = np.searchsorted(inverse[order], np.arange(len(keys)))
        last = first + uses - 1
        self.across = np.stack([across[order[first]], across[order[last]]], axis=1)
        self.count = count
        a, b = self.ends.T
        self.valence = np.bincount(a, minlength=count) + np.bincount(b, minlength=count)
        self.on_border = np.zeros(count, bool)
        self.on_border[self.ends[self.border].reshape(-1)] = True

    def ring(self, points: Floats, borders: bool = False) -> Floats:
        """Return the sum of each vertex's neighbours, or of its neighbours along the border."""
        ends = self.ends[self.border] if borders else self.ends
        total = np.zeros((self.count, points.shape[1]))
        for near, other in ((0, 1), (1, 0)):
            for axis in range(points.shape[1]):
                weights = points[ends[:, other], axis]
                total[:, axis] += np.bincount(ends[:, near], weights, self.count)
        return total


def _beta(valence: Any) -> Any:
    """The weight of a neighbour, 3/16 for three of them, else 3/(8 n) (Warren 1995)."""
    return np.where(valence == 3, 3.0 / 16.0, 3.0 / (8.0 * np.maximum(valence, 1)))


def _finer(points: Floats, faces: Integers) -> tuple[Floats, Integers]:
    edges = _Edges(faces, len(points))
    beta = _beta(edges.valence)[:, None]
    inside = (1.0 - edges.valence[:, None] * beta) * points + beta * edges.ring(points)
    border = 0.75 * points + 0.125 * edges.ring(points, borders=True)
    even = np.where(edges.on_border[:, None], border, inside)
    ends = points[edges.ends].sum(axis=1)
    odd = np.where(
        edges.border[:, None], 0.5 * ends, 0.375 * ends + 0.125 * points[edges.across].sum(axis=1)
    )
    a, b, c = faces.T
    ab, bc, ca = edges.of_halves + len(points)
    four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    finer = np.stack([np.stack(corners, axis=1) for corners in four], axis=1)
    return np.concatenate([even, odd]), finer.reshape(-1, 3)


def _limit(points: Floats, edges: _Edges) -> Floats:
    """Return the limit positions of vertices."""
    gamma = 1.0 / (edges.valence + 3.0 / (8.0 * _beta(edges.valence)))
    gamma = gamma[:, None]
    inside = (1.0 - edges.valence[:, None] * gamma) * points + gamma * edges.ring(points)
    border = (4.0 * points + edges.ring(points, borders=True)) / 6.0
    return np.where(edges.on_border[:, None], border, inside)


def _normals(points: Floats, faces: Integers, edges: _Edges) -> Floats:
    """Limit normals: the product of two tangents from the ring around each vertex."""
    start, onward = _rings(faces, edges)
    s, t = np.zeros_like(points), np.zeros_like(points)
    at, vertex = start, np.arange(len(points))
    for position in range(int(edges.valence.max(initial=0))):
        across, along = _tangent_weights(edges, position)
        s += across[:, None] * points[at]
        t += along[:, None] * points[at]
        at = onward(vertex, at)
    weight = np.select(
        [edges.valence == 2, edges.valence == 3, edges.valence == 4], [-2.0, -1.0, -2.0]
    )
    s += np.where(edges.on_border, weight, 0.0)[:, None] * points
    normals, flat = np.cross(s, t), vertex_normals(points, faces)
    weak = np.linalg.norm(normals, axis=1) < 1e-12
    normals[weak] = flat[weak]
    normals[np.einsum("ij,ij->i", normals, flat) < 0.0] *= -1.0
    return transforms.unit_vectors(normals)


def _rings(faces: Integers, edges: _Edges) -> tuple[NDArray[np.int64], Any]:
    """A neighbour (n,) that each vertex's ring begins with, and how to go on from there."""
    vertex = faces.reshape(-1)
    after, before = np.roll(faces, -1, axis=1).reshape(-1), np.roll(faces, 1, axis=1).reshape(-1)
    keys = vertex * edges.count + after
    order = np.argsort(keys)
    keys, targets = keys[order], before[order]

    def onward(vertex: Any, neighbour: Any) -> Any:
        key = vertex * edges.count + neighbour
        index = np.minimum(np.searchsorted(keys, key), len(keys) - 1)
        return np.where(keys[index] == key, targets[index], neighbour)

    start = np.zeros(edges.count, np.int64)
    start[vertex] = after
    first = ~np.isin(vertex * edges.count + after, vertex * edges.count + before)
    start[vertex[first]] = after[first]
    return start, onward


def _tangent_weights(edges: _Edges, position: int) -> tuple[Floats, Floats]:
    """Weights (n,) of the neighbour at a position of its vertex's ring, for two tangents."""
    n = edges.valence
    angle = 2.0 * np.pi * position / np.maximum(n, 1)
    step = np.pi / np.maximum(n - 1, 1)
    end = (position == 0) | (position == n - 1)
    general = np.where(end, -np.sin(step), (2.0 - 2.0 * np.cos(step)) * np.sin(position * step))
    four = np.where(end, -1.0, 2.0)
    three = np.where(position == 1, 1.0, 0.0)
    across = np.select([n == 2, n == 3, n == 4], [np.ones(len(n)), three, four], general)
    along = np.where(position == 0, -1.0, 0.0) + np.where(position == n - 1, 1.0, 0.0)
    valid = position < n
    return (
        np.where(valid, np.where(edges.on_border, across, np.cos(angle)), 0.0),
        np.where(valid, np.where(edges.on_border, along, np.sin(angle)), 0.0),
    )


def vertex_normals(points: Floats, faces: NDArray[Any]) -> Floats:
    """Return the sum (n, 3) of the normals of the triangles around each vertex, by their areas."""
    crosses = transforms.edge_crosses(points, faces)
    total = np.zeros_like(points)
    for corner in faces.T:
        for axis in range(3):
            total[:, axis] += np.bincount(corner, crosses[:, axis], len(points))
    return total
