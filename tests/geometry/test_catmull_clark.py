"""Catmull-Clark surfaces by what is known of them in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from clpt.geometry import catmull_clark
from clpt.geometry.catmull_clark import INFINITE, Cage

CUBE = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], float)
SIDES = np.array(
    [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
)
NO_EDGES = np.zeros((0, 2), np.int64)
CUBIC = np.array([1, 4, 1]) / 6  # of a uniform b-spline, at a knot


def cage(faces: np.ndarray, vertices: int) -> Cage:
    counts = np.full(len(faces), faces.shape[1])
    return Cage(counts, faces.ravel(), NO_EDGES, np.zeros(0), np.zeros(vertices))


def grid(size: int) -> tuple[Cage, np.ndarray]:
    """Squares over a plane, at uneven heights."""
    x, y = np.meshgrid(np.arange(size), np.arange(size))
    z = np.random.default_rng(1).random((size, size))
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(float)
    at = np.arange(size * size).reshape(size, size)
    faces = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    return cage(faces, size * size), points


@pytest.mark.parametrize("levels", [0, 1, 2, 3])
def test_corners_of_a_cube_go_half_way(levels: int) -> None:
    """(9 v + 4 e + q) / 24 of valence 3, whatever the level at which it is asked."""
    child, points = catmull_clark.refined(cage(SIDES, 8), CUBE, levels)
    assert np.allclose(catmull_clark.limits(child, points)[:8], CUBE / 2)


def test_one_level_of_a_cube() -> None:
    """Catmull and Clark 1978: a corner goes to 5/9, an edge to 3/4, a face stays."""
    child, points = catmull_clark.refined(cage(SIDES, 8), CUBE, 1)
    assert np.allclose(points[:8], CUBE * 5 / 9)
    assert np.allclose(np.abs(points[8:20]).max(axis=1), 0.75)
    assert np.allclose(np.abs(points[20:]).max(axis=1), 1.0)
    assert len(child.counts) == 24


def test_a_regular_grid_is_a_b_spline() -> None:
    whole, points = grid(6)
    heights = points[:, 2].reshape(6, 6)
    expected = [
        [CUBIC @ heights[j - 1 : j + 2, i - 1 : i + 2] @ CUBIC for i in (2, 3)] for j in (2, 3)
    ]
    for levels in (0, 2):
        child, moved = catmull_clark.refined(whole, points, levels)
        at = catmull_clark.limits(child, moved)[:36, 2].reshape(6, 6)
        assert np.allclose(at[2:4, 2:4], expected)


def test_boundaries_are_cubic_curves() -> None:
    """An edge of the grid is a b-spline of its own points; a corner stays, if corners are sharp."""
    whole, points = grid(5)
    for rule, corner in (("edgeAndCorner", 1.0), ("edgeOnly", 4 / 6)):
        child, moved = catmull_clark.refined(replace(whole, smooth=rule), points, 2)
        at = catmull_clark.limits(child, moved)
        assert np.allclose(at[2], CUBIC @ points[1:4])
        ends = points[1] + points[5]
        assert np.allclose(at[0], corner * points[0] + (1 - corner) * ends / 2)


def test_sharp_creases_and_corners_stay() -> None:
    edges = np.concatenate([SIDES[:, [i, (i + 1) % 4]] for i in range(4)])
    sharp = replace(cage(SIDES, 8), edges=edges, crease=np.full(len(edges), INFINITE))
    child, points = catmull_clark.refined(sharp, CUBE, 2)
    at = catmull_clark.limits(child, points)
    assert np.allclose(np.abs(at).max(axis=1), 1.0)
    directions, corner = catmull_clark.normals(child, at)
    assert np.allclose(np.abs(directions[corner]).max(axis=1), 1.0)  # a side's, up to its edge
    cornered = replace(cage(SIDES, 8), corner=np.array([INFINITE] + [0.0] * 7))
    child, points = catmull_clark.refined(cornered, CUBE, 2)
    assert np.allclose(catmull_clark.limits(child, points)[0], CUBE[0])


def test_a_ring_of_creases_is_a_b_spline() -> None:
    """A closed sharp chain around the top of a cube is the curve of its four points."""
    ring = SIDES[1]
    edges = np.stack([ring, np.roll(ring, -1)], axis=1)
    whole = replace(cage(SIDES, 8), edges=edges, crease=np.full(4, INFINITE))
    child, points = catmull_clark.refined(whole, CUBE, 1)
    at = catmull_clark.limits(child, points)
    for i, vertex in enumerate(ring):
        expected = CUBIC @ CUBE[[ring[i - 1], vertex, ring[(i + 1) % 4]]]
        assert np.allclose(at[vertex], expected)


def test_sharpness_wears_off_by_halves() -> None:
    """Of an edge of sharpness 1/2 the middle is between that of a smooth and a sharp edge."""
    middles = []
    for sharpness in (0.0, 0.5, 1.0):
        whole = replace(cage(SIDES, 8), edges=SIDES[:1, :2], crease=np.array([sharpness]))
        _, points = catmull_clark.refined(whole, CUBE, 1)
        edges = points[8:20]
        middles.append(edges[np.argmin(np.linalg.norm(edges - CUBE[SIDES[0, :2]].mean(0), axis=1))])
    assert np.allclose(middles[1], (middles[0] + middles[2]) / 2)
    assert np.allclose(middles[2], CUBE[SIDES[0, :2]].mean(axis=0))


def test_triangles_become_quadrilaterals_and_normals_are_unit() -> None:
    tetrahedron = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]], float)
    faces = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])
    child, points = catmull_clark.refined(cage(faces, 4), tetrahedron, 2)
    assert len(child.counts) == 12 * 4
    at = catmull_clark.limits(child, points)
    directions, corner = catmull_clark.normals(child, at)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert len(directions) == len(at)
    assert (np.einsum("ij,ij->i", directions[corner], at[child.corners]) > 0.0).all()
