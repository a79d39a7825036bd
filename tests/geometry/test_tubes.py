"""Curves become tubes: lengths, areas and outlines against the curves' own formulas."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from clpt.errors import SceneError
from clpt.geometry import analytic, triangles, tubes
from clpt.scene.shapes import Curves

POINTS = np.array(
    [[0, 0, 0, 0.1], [1, 0, 0, 0.1], [2, 1, 0, 0.2], [3, 1, 0, 0.2], [4, 1, 1, 0.1]], float
)


def rings(curves: Curves) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Middles (n, 3) of the rings, their radii (n,) and v (n,)."""
    vertices, _, _, uvs = triangles.triangulate(curves)
    around = int(np.argmax(uvs[:, 0] == 1.0)) + 1
    ring = vertices.astype(float).reshape(-1, around, 3)
    middle = ring[:, :-1].mean(axis=1)
    return middle, np.linalg.norm(ring[:, 0] - middle, axis=1), uvs[::around, 1]


def test_a_spline_is_followed():
    middle, radius, v = rings(Curves(points=POINTS))
    knots = np.arange(-3.0, 6.0)
    exact = BSpline(knots, POINTS, 3)(v * 2.0)
    np.testing.assert_allclose(middle, exact[:, :3], atol=1e-6)
    np.testing.assert_allclose(radius, exact[:, 3] * (np.pi / 16) / np.sin(np.pi / 16), rtol=1e-5)
    fine = BSpline(knots, POINTS, 3)(np.linspace(0.0, 2.0, 1001))[:, :3]
    a, b = middle[:-1, None], middle[1:, None]
    t = ((fine - a) * (b - a)).sum(-1) / ((b - a) ** 2).sum(-1)
    off = np.linalg.norm(a + np.clip(t, 0.0, 1.0)[..., None] * (b - a) - fine, axis=2).min(axis=0)
    assert off.max() < tubes.ERROR * 0.1


def test_bases_agree():
    """A straight line at even steps is the same in all of them."""
    line = np.array([[0, 0, t, 0.1] for t in np.linspace(0.0, 3.0, 4)])
    lateral = 2.0 * np.pi * 0.1
    for basis, length in (("linear", 3.0), ("bezier", 3.0), ("bspline", 1.0)):
        curves = Curves(points=line, basis=basis)
        low, high = analytic.bounds(curves)
        assert analytic.area(curves) == pytest.approx(lateral * length, rel=7e-3)
        np.testing.assert_allclose(high - low, [0.2013, 0.2013, length], rtol=1e-3)


def test_tubes_face_outward_and_turn_as_in_mitsuba():
    """u runs around and v along, with the normal on the side of u x v; tapering tilts it."""
    for basis in ("linear", "bspline"):
        two = np.concatenate([POINTS, POINTS + np.array([0, 0, 3, 0])])
        curves = Curves(points=two, lengths=(5, 5), basis=basis)
        vertices, faces, normals, uvs = triangles.triangulate(curves)
        assert uvs[:, 1].min() == 0.0 and uvs[:, 1].max() == 1.0
        p, t = vertices[faces].astype(float), uvs[faces].astype(float)
        e1, e2, d1, d2 = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0], t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]
        front = np.cross(e1, e2)
        turn = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
        bridge = turn == 0.0  # at a bend of straight pieces
        assert bridge.any() == (basis == "linear") and turn.min() >= 0.0
        assert (np.einsum("ij,ikj->ik", front, normals[faces])[~bridge] > 0.0).all()
    cone = Curves(points=[[0, 0, 0, 1.0], [0, 0, 1, 0.5]], basis="linear")
    np.testing.assert_allclose(
        triangles.triangulate(cone)[2][:, 2], 0.5 / np.hypot(1.0, 0.5), atol=1e-6
    )


def test_frames_do_not_twist():
    """Along a plane curve, even through a loop, one axis stays across the plane."""
    t = np.linspace(0.0, 4.0 * np.pi, 60)
    circle = np.column_stack([np.cos(t), np.sin(t), 0.0 * t, 0.0 * t + 0.05])
    _, _, normals, uvs = triangles.triangulate(Curves(points=circle))
    for u in np.unique(uvs[:, 0]):
        assert np.ptp(normals[uvs[:, 0] == u][:, 2]) < 1e-5


def test_many_strands_get_fewer_pieces_and_sides(monkeypatch):
    rng = np.random.default_rng(1)
    points = rng.random((800, 4)) * [1.0, 1.0, 1.0, 0.01]
    curves = Curves(points=points, lengths=(8,) * 100)
    assert len(triangles.triangulate(curves)[1]) > 100 * 5 * 2 * 16 * 2
    monkeypatch.setattr(tubes, "PIECES", 500)
    monkeypatch.setattr(tubes, "TRIANGLES", 1000)
    assert len(triangles.triangulate(curves)[1]) == 100 * 5 * 2 * 4


def test_points_that_stand_still():
    """Repeated points, as at clamped ends, and a strand that is a point."""
    clamped = np.r_[POINTS[:1], POINTS[:1], POINTS, POINTS[-1:], POINTS[-1:]]
    _, faces, normals, _ = triangles.triangulate(Curves(points=clamped))
    assert np.isfinite(normals).all()
    both = np.r_[clamped, np.repeat(POINTS[:1], 4, axis=0)]
    flat: list[triangles.Flat] = []
    assert len(triangles.triangulate(Curves(points=both, lengths=(9, 4)), flat)[1]) == len(faces)
    assert not flat


BROKEN = {
    "(n, 4)": {"points": [[0, 0, 0]] * 4},
    "not numbers": {"points": None},
    "needs 4 or more": {"points": POINTS[:3]},
    "needs 4 + 3 n": {"points": POINTS, "basis": "bezier"},
    "add up": {"points": POINTS, "lengths": (4, 4)},
    "not finite": {"points": np.where(POINTS == 4, np.inf, POINTS)},
    "radius negative": {"points": -POINTS},
    "radii are zero": {"points": POINTS * [1, 1, 1, 0]},
}


@pytest.mark.parametrize("message", BROKEN)
def test_what_is_no_curve(message):
    with pytest.raises(SceneError) as found:
        triangles.triangulate(Curves(**BROKEN[message], name="fringe"))
    assert message in str(found.value) and "curves 'fringe'" in str(found.value)
