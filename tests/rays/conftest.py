"""Triangles, rays, and the float64 reference that hits are held against."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pyopencl as cl
import pytest

import clpt
from clpt import device as dev

COUNT = 300


@pytest.fixture(scope="session")
def queue() -> cl.CommandQueue:
    return dev.choose().queue


@pytest.fixture(scope="session")
def soup() -> tuple[np.ndarray, np.ndarray]:
    """vertices (900, 3), faces (300, 3) of triangles in the unit cube, in mixed order."""
    rng = np.random.default_rng(5)
    corners = rng.random((COUNT, 1, 3)) + 0.1 * rng.normal(size=(COUNT, 3, 3))
    order = rng.permutation(3 * COUNT)
    vertices = np.empty((3 * COUNT, 3), np.float32)
    vertices[order] = corners.reshape(-1, 3)
    return vertices, order.reshape(-1, 3).astype(np.uint32)


@pytest.fixture(scope="session")
def rays() -> tuple[np.ndarray, np.ndarray]:
    """origins and directions (1000, 3) float32 through a cube, directions of many lengths."""
    rng = np.random.default_rng(6)
    o = (0.5 + rng.normal(size=(1000, 3))).astype(np.float32)
    d = rng.random((1000, 3)) - o
    return o, (d * 10 ** rng.uniform(-3, 3, (1000, 1))).astype(np.float32)


@pytest.fixture(scope="session")
def accel(queue, soup) -> clpt.Accel:
    return clpt.Accel(queue, *soup)


@pytest.fixture(scope="session")
def reference() -> Callable:
    """All hits in float64: t (n, m), inf where there is none, and barycentrics (n, m, 2)."""

    def intersect(vertices, faces, o, d):
        v = vertices.astype(np.float64)[faces][None]
        o, d = o.astype(np.float64)[:, None], d.astype(np.float64)[:, None]
        e1, e2, s = v[:, :, 1] - v[:, :, 0], v[:, :, 2] - v[:, :, 0], v[:, :, 0] - o
        n, w = np.cross(e1, e2), np.cross(s, d)
        det = (n * d).sum(-1)
        t, u, b = (n * s).sum(-1) / det, (e2 * w).sum(-1) / det, -(e1 * w).sum(-1) / det
        inside = (u >= 0) & (b >= 0) & (u + b <= 1) & (t > 0)
        return np.where(inside, t, np.inf), np.stack([u, b], -1)

    return intersect
