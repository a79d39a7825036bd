"""Polygons as triangles: areas by formula, and every outline that files hold."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.geometry.polygons import triangulate

U = [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)]


def outline(points, seed=0):
    """Points (n, 2) as (n, 3), turned in space."""
    turn = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return np.column_stack([np.asarray(points, float), np.zeros(len(points))]) @ turn.T


def of(*polygons):
    """Triangulate polygons of corners (n, 3): the triangles' corners (t, 3, 3), and polygons."""
    vertices = np.concatenate(polygons)
    triangles, polygon = triangulate(
        vertices, np.array([len(p) for p in polygons]), np.arange(len(vertices))
    )
    assert triangles.dtype == polygon.dtype == np.int32
    return vertices[triangles], polygon


def vectors(triangles):
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2


def areas(triangles):
    return np.linalg.norm(vectors(triangles), axis=1)


def shoelace(points):
    x, y = np.asarray(points, float).T
    return (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2


def star(count, inner, seed):
    """The outline of a star (count, 2), its points at random distances: not convex, simple."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * np.arange(count) / count
    radius = rng.uniform(inner, 1, count)
    return np.column_stack([np.cos(angle), np.sin(angle)]) * radius[:, None]


@pytest.mark.parametrize("first", range(len(U)))
@pytest.mark.parametrize("way", [1, -1])
def test_the_letter_u(first, way):
    """From any corner, both ways round: area 7, in triangles that all turn as the outline does."""
    given = np.roll(U, -first, axis=0)[::way]
    made, _ = of(outline(given))
    assert len(made) == 6
    assert areas(made).sum() == pytest.approx(7)
    assert np.linalg.norm(vectors(made).sum(axis=0)) == pytest.approx(7)


@pytest.mark.parametrize("dent", range(4))
def test_quadrilaterals_that_are_not_convex(dent):
    arrow = np.roll([(0, 0), (2, 0), (0.5, 0.5), (0, 2)], dent, axis=0)
    made, polygon = of(outline(arrow), outline([(0, 0), (1, 0), (1, 1), (0, 1)], 1))
    assert polygon.tolist() == [0, 0, 1, 1]
    assert areas(made)[:2].sum() == pytest.approx(1.0)
    assert areas(made)[2:].sum() == pytest.approx(1.0)


def test_convex_ones_are_fans():
    """Whatever else is in the list; also with corners in a straight line, in float32."""
    ring = star(9, 1, 0)
    ring = np.stack([ring, (ring + np.roll(ring, -1, 0)) / 2], axis=1).reshape(-1, 2)
    turned = outline(ring, 3).astype(np.float32)
    vertices = np.concatenate([outline(U), turned])
    corners = np.r_[0:8, 8:26, 2, 1, 0, 0, 1]
    triangles, polygon = triangulate(vertices, np.array([8, 18, 3, 2]), corners)
    fan = [[8, 8 + i, 9 + i] for i in range(1, 17)]
    assert triangles[6:22].tolist() == fan
    assert triangles[22:].tolist() == [[26, 27, 28]]
    assert polygon.tolist() == [0] * 6 + [1] * 16 + [2]


@pytest.mark.parametrize("count", [5, 8, 41, 300, 2000])
def test_stars_keep_their_area(count):
    given = [star(count, 0.2, seed) for seed in range(4)]
    made, polygon = of(*(outline(points, 7 + i) for i, points in enumerate(given)))
    for i, points in enumerate(given):
        own = vectors(made[polygon == i])
        assert np.linalg.norm(own, axis=1).sum() == pytest.approx(shoelace(points))
        assert np.linalg.norm(own.sum(axis=0)) == pytest.approx(shoelace(points))


@pytest.mark.parametrize("scale", [1e-18, 1e-3, 1e6, 1e18])
def test_any_size_and_place(scale):
    made, _ = of(outline(np.array(U) * scale) + 1e5 * scale)
    assert areas(made).sum() == pytest.approx(7 * scale**2)


def test_corners_in_a_line_stay():
    """A neighbour that has them meets the polygon at them: every corner is one of a triangle."""
    notched = [(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (3, 2), (2, 2), (1.5, 1), (1, 2), (0, 2)]
    for first in range(len(notched)):
        points = np.roll(notched, first, axis=0)
        vertices = np.column_stack([points, np.zeros(10)])
        triangles, _ = triangulate(vertices, np.array([10]), np.arange(10))
        assert set(triangles.ravel().tolist()) == set(range(10)), first
        assert areas(vertices[triangles]).sum() == pytest.approx(shoelace(notched))


def test_a_hole_with_a_bridge():
    """The outline goes into the hole and back by one edge: corners and edge are repeated."""
    ring = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0)]
    hole = [(1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
    made, _ = of(outline(ring + hole))
    assert areas(made).sum() == pytest.approx(12)


def test_not_flat():
    """A U whose corners lie up to a fifth off its plane: seen from above its area is 7."""
    points = np.column_stack([U, np.random.default_rng(5).uniform(-0.2, 0.2, 8)])
    made, _ = of(points)
    assert np.abs(vectors(made)[:, 2]).sum() == pytest.approx(7, rel=0.05)
    assert np.isin(made.reshape(-1, 3), points).all()


@pytest.mark.parametrize(
    "points",
    [
        [(0, 0)] * 6,
        [(0, 0), (1, 0), (2, 0), (3, 0), (1.5, 0)],
        [(0, 0), (2, 2), (2, 0), (0, 2)],
        [(0, 0), (2, 2), (2, 0), (0, 2), (-1, 1)],
        [(np.cos(4 * np.pi * i / 5), np.sin(4 * np.pi * i / 5)) for i in range(5)],
        [(0, 0), (4, 0), (4, 0), (4, 1), (2, 1), (2, 9), (2, 1), (1, 1), (1, 3), (0, 3)],
        [(0, 0), (np.nan, 0), (2, 1), (1, 0.1), (0, 2)],
        [(0, 0), (1e200, 0), (1e200, 1e200), (1e180, 1e150), (0, 1e200)],
    ],
    ids=["point", "line", "bow tie", "crossed", "pentagram", "spike", "nan", "huge"],
)
def test_odd_outlines(points):
    """Nothing fails; as many triangles as always."""
    vertices = np.column_stack([np.array(points, float), np.zeros(len(points))])
    triangles, _ = triangulate(vertices, np.array([len(points)]), np.arange(len(points)))
    assert len(triangles) == len(points) - 2
    assert triangles.min() >= 0 and triangles.max() < len(points)


def test_a_spike_and_repeated_corners_keep_the_area():
    points = [(0, 0), (4, 0), (4, 0), (4, 1), (2, 1), (2, 9), (2, 1), (1, 1), (1, 3), (0, 3)]
    made, _ = of(outline(points))
    assert areas(made).sum() == pytest.approx(shoelace(points)) == 6


def test_corners_that_name_no_vertex_are_fans():
    """Who reads a file refuses them; nothing fails here."""
    vertices = outline(U)
    for bad in (-1, 8, 2**40):
        corners = np.arange(8)
        corners[3] = bad
        triangles, _ = triangulate(vertices, np.array([8]), corners)
        assert triangles.tolist() == [[0, i, i + 1] for i in range(1, 7)]
    triangles, polygon = triangulate(np.zeros((0, 3)), np.zeros(0, int), np.zeros(0, int))
    assert triangles.shape == (0, 3) and polygon.shape == (0,)


def test_many_at_once():
    """More corners than are tested at a time."""
    count = 40_000
    points = np.tile(outline([*U[:4], (1.5, 2.5)]), (count, 1))
    made, polygon = of(*np.split(points, count))
    assert (np.bincount(polygon) == 3).all()
    assert areas(made).sum() == pytest.approx(count * shoelace([*U[:4], (1.5, 2.5)]))
