"""The nearest hits of the host's tree are those of all triangles."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from clpt.geometry.casting import LARGE, LEAF, Caster


def nearest(triangles: NDArray[np.float64], o: NDArray, d: NDArray) -> NDArray[np.float64]:
    """Distances (k,) of rays by Cramer's rule in float64, inf where they miss."""
    a, ab, ac = (
        triangles[:, 0],
        triangles[:, 1] - triangles[:, 0],
        triangles[:, 2] - triangles[:, 0],
    )
    matrix = np.stack(np.broadcast_arrays(ab, ac, -d[:, None]), axis=-1)
    t = np.full((len(o), len(triangles)), np.inf)
    proper = np.abs(np.linalg.det(matrix)) > 1e-14
    u, v, away = np.moveaxis(
        np.linalg.solve(matrix[proper], (o[:, None] - a)[proper][..., None])[..., 0], -1, 0
    )
    t[proper] = np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (away > 0), away, np.inf)
    return t.min(axis=1)


@pytest.mark.parametrize("count", [1, LEAF, LARGE, LARGE + 1, LARGE + LEAF + 1, 1000])
def test_the_same_hits_as_by_all_triangles(count: int) -> None:
    random = np.random.default_rng(count)
    triangles = random.uniform(-1, 1, (count, 1, 3)) + random.normal(0, 0.2, (count, 3, 3))
    o, d = random.uniform(-1, 1, (500, 3)), random.normal(size=(500, 3))
    triangle, t = Caster(triangles).nearest(o, d)
    expected = nearest(triangles, o, d)
    met = np.isfinite(expected)
    assert (met == (triangle >= 0)).mean() > 0.99  # rays at edges
    both = met & (triangle >= 0)
    close = np.abs(t[both] / expected[both] - 1.0) < 1e-3
    assert close.sum() >= 0.99 * both.sum()  # others pass an edge in front


def test_triangles_without_area_are_never_met() -> None:
    flat = np.zeros((200, 3, 3))
    flat[:, 1, 0] = np.linspace(0.0, 1.0, 200)
    triangle, t = Caster(flat).nearest(np.array([[0.2, 0.0, 1.0]]), np.array([[0.0, 0.0, -1.0]]))
    assert triangle.tolist() == [-1]
    assert np.isinf(t).all()


def test_rays_along_axes() -> None:
    wall = np.array([[[2.0, -1, -1], [2, 3, -1], [2, -1, 3]]])
    origins = np.array([[0.0, 0, 0], [0, 0, 0], [3, 0, 0]])
    directions = np.array([[1.0, 0, 0], [-1, 0, 0], [1, 0, 0]])
    triangle, t = Caster(wall).nearest(origins, directions)
    assert triangle.tolist() == [0, -1, -1]
    assert t[0] == pytest.approx(2.0)
