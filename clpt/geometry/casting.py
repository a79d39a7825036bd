"""Rays against many triangles on the host, by numpy: for a few thousand rays before a render."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, Floats32

LEAF = 4  # triangles
LARGE = 64  # triangles that stand outside of the tree: their boxes would be met by most rays
MORTON_BITS = 10  # for each axis
BIAS = np.float32(1e-12)  # of a direction's components, whose inverse must be finite


def sphere(random: np.random.Generator, count: int) -> Floats:
    """Return directions at random (count, 3)."""
    directions = random.normal(size=(count, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def cone(axis: Floats, least: float, count: int) -> Floats:
    """Return directions (count, 3) of a spiral, evenly in a cone; least: its lowest cosine."""
    middle = np.arange(count) + 0.5
    z, turn = 1.0 - (1.0 - least) * middle / count, np.pi * (1.0 + math.sqrt(5.0)) * middle
    level = np.sqrt(1.0 - z * z)
    right = np.cross(np.eye(3)[np.abs(axis).argmin()], axis)
    right /= np.linalg.norm(right)
    up = np.cross(axis, right)
    return np.stack([level * np.cos(turn), level * np.sin(turn), z], axis=1) @ [right, up, axis]


class Caster:
    """The nearest hits of rays on triangles.

    The largest triangles are tested one by one. Others are in a complete tree, whose leaves hold
    LEAF triangles in Morton order (Lauterbach et al. 2009, "Fast BVH Construction on GPUs").

    triangles: corners (n, 3, 3) [m].
    """

    def __init__(self, triangles: NDArray[np.floating]):
        a, b, c = (triangles[:, k] for k in range(3))
        low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
        across = np.cross(b - a, c - a)
        area = np.einsum("ij,ij->i", across, across)
        proper = np.flatnonzero(area > 0.0)
        large = min(LARGE, len(proper))
        split = proper[np.argpartition(area[proper], len(proper) - large)] if large else proper
        self._large, small = split[len(split) - large :], split[: len(split) - large]
        self._large_edges = _edges(triangles[self._large])
        self._levels: list[Floats32] = []
        if not len(small):
            return
        middle = (low[small] + high[small]) * 0.5
        start, size = middle.min(axis=0), np.maximum(np.ptp(middle, axis=0), 1e-30)
        cells = ((middle - start) * (((1 << MORTON_BITS) - 1) / size)).astype(np.uint32)
        order = np.argsort(sum(_spread(cells[:, k]) << np.uint32(k) for k in range(3)))
        leaves = 1 << max(-(-len(order) // LEAF) - 1, 0).bit_length()
        self._order = np.resize(small[order], leaves * LEAF)  # the first ones fill the last leaves
        self._small_edges = _edges(triangles[self._order])
        bounds = np.concatenate([low[self._order].T, -high[self._order].T]).astype(np.float32)
        self._levels = [bounds.reshape(6, leaves, LEAF).min(axis=2)]
        while self._levels[0].shape[1] > 1:
            self._levels.insert(0, self._levels[0].reshape(6, -1, 2).min(axis=2))

    def nearest(
        self, origins: NDArray[np.floating], directions: NDArray[np.floating]
    ) -> tuple[NDArray[np.intp], Floats32]:
        """Return the triangle that each ray meets first, -1 for none, and its distance.

        origins, directions: (k, 3); distances are in lengths of the directions, inf for none.
        """
        o, d = (np.array(array.T, np.float32, order="C") for array in (origins, directions))
        count = len(origins)
        triangles, distances = np.full(count, -1, np.intp), np.full(count, np.inf, np.float32)
        if len(self._large):
            t = _distances(self._large_edges[:, :, None], o[:, :, None], d[:, :, None])
            first = t.argmin(axis=1)
            distances = np.take_along_axis(t, first[:, None], axis=1)[:, 0]
            triangles = np.where(np.isfinite(distances), self._large[first], -1)
        if self._levels:
            rays, places = self._leaves(o, d, distances)
            t = _distances(self._small_edges[:, :, places], o[:, rays], d[:, rays])
            nearer = t < distances[rays]
            rays, places, t = rays[nearer], places[nearer], t[nearer]
            first = np.argsort(-t)
            distances[rays[first]] = t[first]  # the nearest is written last
            triangles[rays[first]] = self._order[places[first]]
        return triangles, distances

    def _leaves(
        self, o: Floats32, d: Floats32, ends: Floats32
    ) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return pairs of a ray and a place of a triangle, whose leaf it meets before its end."""
        inverse = 1.0 / np.where(np.abs(d) < BIAS, BIAS, d)
        rays, nodes = np.arange(len(ends)), np.zeros(len(ends), np.intp)
        for depth, boxes in enumerate(self._levels):
            if depth:
                rays, nodes = np.repeat(rays, 2), np.repeat(2 * nodes, 2)
                nodes[1::2] += 1
            near, far = np.zeros(len(rays), np.float32), ends[rays]
            for k in range(3):
                from_, per = o[k][rays], inverse[k][rays]
                one, other = (boxes[k][nodes] - from_) * per, (-boxes[k + 3][nodes] - from_) * per
                np.maximum(near, np.minimum(one, other), out=near)
                np.minimum(far, np.maximum(one, other), out=far)
            met = near <= far
            rays, nodes = rays[met], nodes[met]
        places = (nodes[:, None] * LEAF + np.arange(LEAF)).ravel()
        return np.repeat(rays, LEAF), places


def _edges(triangles: NDArray[np.floating]) -> Floats32:
    """Return a corner of triangles and the two edges from there, (3, 3, n): by kind, then axis."""
    a, b, c = (triangles[:, k].T for k in range(3))
    return np.stack([a, b - a, c - a]).astype(np.float32)


def _distances(edges: Floats32, o: Floats32, d: Floats32) -> Floats32:
    """Return the distances of rays from triangles, inf where they miss (Moeller and Trumbore 1997).

    Arrays (3, ...) are by axis, and are broadcast.
    """
    a, ab, ac = edges
    away, across = o - a, _cross(d, ac)
    turned = _cross(away, ab)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1.0 / _dot(ab, across)
        u, v, t = _dot(away, across) * scale, _dot(d, turned) * scale, _dot(ac, turned) * scale
    return np.where((u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t > 0.0), t, np.float32(np.inf))


def _cross(a: Floats32, b: Floats32) -> Floats32:
    rows = [a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1))]
    return np.stack(np.broadcast_arrays(*rows))


def _dot(a: Floats32, b: Floats32) -> Floats32:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _spread(bits: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return numbers of MORTON_BITS bits with two zeros before each bit."""
    for shift, mask in ((16, 0x30000FF), (8, 0x300F00F), (4, 0x30C30C3), (2, 0x9249249)):
        bits = (bits | bits << np.uint32(shift)) & np.uint32(mask)
    return bits
