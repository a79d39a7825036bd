"""Rays and curves: pieces beside spheres along the curve in float64, and closed forms."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.interpolate import BSpline

from clpt import transforms as T
from clpt.geometry import analytic, strands
from clpt.render.lights import encode as lights
from clpt.render.lights import find as sources
from clpt.render.materials.encoder import Encoder
from clpt.scene.shapes import Curves
from tests.kernels.harness import assert_lanes_agree
from tests.kernels.light_probe import Lit

MEET = """
    vec3 o = {x[0], x[1], x[2]}, d = {x[3], x[4], x[5]};
    integer first = to_integer(x[8]), count = to_integer(x[9]), best = first;
    ShapeHit h;
    h.t = x[7];
    h.n = v3(0.0f, 0.0f, 0.0f);
    h.uv.x = h.uv.y = 0.0f;
    for (int k = 0; any(count > k); k++) {
        mask there = count > k;
        integer prim = first + sel_i(there, (integer)(k), (integer)(0));
        Curve piece = curves_one(scene, (integer)(0), prim, there);
        ShapeHit one = curve_intersect(piece, o, d, x[6], h.t);
        mask nearer = there & (one.t < h.t);
        h.t = sel(nearer, one.t, h.t);
        h.n = sel3(nearer, one.n, h.n);
        h.uv.x = sel(nearer, one.uv.x, h.uv.x);
        h.uv.y = sel(nearer, one.uv.y, h.uv.y);
        best = sel_i(nearer, prim, best);
    }
    Curve q = curves_one(scene, (integer)(0), best, best >= 0);
    vec3 p = curve_onto(q, madd3(d, h.t, o));
    vec3 du = curve_dpdu(q, p, h.uv), dv = curve_dpdv(q, p, h.uv);
    r[0] = h.t; r[1] = h.n.x; r[2] = h.n.y; r[3] = h.n.z; r[4] = h.uv.x; r[5] = h.uv.y;
    r[6] = p.x; r[7] = p.y; r[8] = p.z; r[9] = du.x; r[10] = du.y; r[11] = du.z;
    r[12] = dv.x; r[13] = dv.y; r[14] = dv.z; r[15] = curve_size(q);
"""
SPLINE = np.random.default_rng(3).uniform(-1.0, 1.0, (7, 4)) * [1, 1, 1, 0.02] + [0, 0, 0, 0.06]
ARC = np.array([[np.cos(a), np.sin(a), 0.3 * a, 0.05] for a in np.linspace(0.0, 5.0, 14)])
TIP = np.outer([1, 1, 1, 1, 0, 0, 0], [0, 0, 0, 0.05])
SWALLOWED = Curves(points=[[0, 0, 0, 0.5], [0.1, 0, 0, 0.05], [0.3, 0, 0, 0.05]], basis="linear")
CURVES = {
    "spline": Curves(points=SPLINE),
    "thin": Curves(points=SPLINE * [1, 1, 1, 0.02]),
    "arc": Curves(points=ARC),
    "bezier": Curves(points=SPLINE, basis="bezier"),
    "bent": Curves(points=SPLINE, basis="linear"),
    "line": Curves(points=[[-1, 0.2, 0, 0.1], [1, -0.3, 0.4, 0.1]], basis="linear"),
    "cone": Curves(points=[[-1, 0.2, 0, 0.3], [1, -0.3, 0.4, 0.05]], basis="linear"),
    "point": Curves(points=[[0.1, 0.2, 0.3, 0.4]] * 4),
    "still": Curves(points=SPLINE[[0, 0, 0, 1, 1, 2, 3, 3, 3, 3]]),
    "tip": Curves(points=SPLINE * [1, 1, 1, 0] + TIP),
    "swallowed": SWALLOWED,
}
LEFT = 1e30


@cache
def _probe() -> tuple[Lit, dict[str, tuple[int, int]]]:
    """All curves in one table, and where the pieces of each are in it."""
    encoder, ranges, made = Encoder("rgb"), {}, []
    for name, curves in CURVES.items():
        own = strands.pieces(curves)
        ranges[name] = sum(map(len, made)), len(own)
        made.append(own)
    encoder.store.append("geometry", analytic.row(CURVES["line"]))
    encoder.store.append_floats("spheres", np.concatenate(made))
    none = lights.light_rows((), (), encoder, sources.measured((), (), 1.0, encoder.look))
    return Lit(encoder, none, ("generated/shape/curves.cl",)), ranges


def met(name: str, o, d, tmin=0.0, tmax=LEFT, lanes: int = 8) -> np.ndarray:
    probe, ranges = _probe()
    more = [np.broadcast_to(value, o.shape[1]) for value in (tmin, tmax, *ranges[name])]
    return probe(MEET, np.vstack([o, d, *more]), 16, lanes).astype(np.float64)


def along(curves: Curves, n: int) -> np.ndarray:
    """Centres and radii of a curve (n, 4) float64."""
    p = np.asarray(curves.points, np.float64).copy()
    p[:, 3] = np.maximum(p[:, 3], 1e-4 * p[:, 3].max())
    if curves.basis == "bspline":
        return BSpline(np.arange(-3.0, len(p) + 1.0), p, 3)(np.linspace(0.0, len(p) - 3.0, n))
    if curves.basis == "linear":
        at = np.linspace(0.0, len(p) - 1.0, n)
        return np.stack([np.interp(at, np.arange(len(p)), column) for column in p.T], axis=1)
    t = np.linspace(0.0, 1.0, n // (len(p) // 3))[:, None]
    cubics = [p[i : i + 4] for i in range(0, len(p) - 1, 3)]
    weights = (1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3
    return np.concatenate([sum(w * c for w, c in zip(weights, one, strict=True)) for one in cubics])


def rays(curves: Curves, n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from around a curve to points near it."""
    rng = np.random.default_rng(seed)
    on = along(curves, 1000)
    on = on[on[:, 3] > 0.05 * on[:, 3].max()]
    on = on[rng.integers(0, len(on), n)]
    goal = on[:, :3] + 1.3 * on[:, 3:] * rng.normal(size=(n, 3)) / np.sqrt(3)
    o = rng.normal(size=(n, 3))
    o = 4.0 * o / np.linalg.norm(o, axis=1, keepdims=True)
    d = goal - o
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    o, d = (v.astype(np.float32).astype(np.float64).T for v in (o, d))
    return o, d / np.linalg.norm(d, axis=0)


def reference(curves: Curves, o, d) -> tuple[np.ndarray, ...]:
    """Nearest t of spheres along a curve (LEFT: none), the normal, and by how much it is hit."""
    radius = np.asarray(curves.points)[:, 3].max()
    balls = along(curves, 40_000 if radius < 0.01 else 10_000)
    t, normal, depth = np.full(o.shape[1], LEFT), np.zeros(o.shape), np.zeros(o.shape[1])
    for i in range(o.shape[1]):
        f = balls[:, :3] - o[:, i]
        z = f @ d[:, i]
        square = balls[:, 3] ** 2 - ((f - z[:, None] * d[:, i]) ** 2).sum(1)
        depth[i] = (square / balls[:, 3] ** 2).max()
        near = np.where(square >= 0.0, z - np.sqrt(np.maximum(square, 0.0)), LEFT)
        k = int(near.argmin())
        if near[k] < LEFT:
            t[i] = near[k]
            normal[:, i] = (d[:, i] * near[k] - f[k]) / balls[k, 3]
    return t, normal, depth


@pytest.mark.parametrize("name", CURVES)
def test_rays_meet_what_spheres_along_the_curve_cover(name):
    curves = CURVES[name]
    o, d = rays(curves, 500, 1)
    t, normal, depth = reference(curves, o, d)
    result = met(name, o, d)
    hit, expected = result[0] < 1e29, t < 1e29
    clear = np.abs(depth) > (0.05 if name in ("thin", "tip") else 5e-3)  # not an outline
    assert expected.mean() > 0.15
    assert (hit != expected)[clear].mean() < 2.5e-3
    both = hit & expected & clear
    radius = np.asarray(curves.points)[:, 3].max()
    cos = np.maximum(-(normal * d).sum(0), 0.05)[both]
    off = np.abs(result[0] - t)[both]
    assert (off < 3e-6 * 4.0 / cos + 2e-3 * radius).mean() > 0.998
    if name not in ("thin", "tip"):  # there float32 knows the radius of a point to some percent
        close = off < 1e-2 * radius
        assert (
            np.abs(result[1:4] - normal)[:, both].max(0)[close] < 0.02 / cos[close]
        ).mean() > 0.995
    np.testing.assert_allclose(np.linalg.norm(result[1:4][:, hit], axis=0), 1.0, atol=1e-5)
    assert np.isfinite(result[:, hit]).all()
    assert (result[4:6, hit] >= -1e-6).all() and (result[4:6, hit] <= 1.0 + 1e-6).all()


def closed_form(a, b, ra, rb, o, d) -> np.ndarray:
    """Nearest t of a cone that touches two spheres, and of these, in float64."""

    def sphere(c, r):
        f = o - c[:, None]
        q = (f * d).sum(0)
        root = q * q - (f * f).sum(0) + r * r
        return np.where(root >= 0.0, -q - np.sqrt(np.maximum(root, 0.0)), LEFT)

    length = np.linalg.norm(b - a)
    axis, lean = (b - a) / length, (rb - ra) / length
    # p on the cone: |w|^2 - (w.axis)^2 = ((ra + lean w.axis) / k)^2 with k = sqrt(1 - lean^2)
    w = o - a[:, None]
    wa, da, k2 = axis @ w, axis @ d, 1.0 - lean * lean
    at = (d * d).sum(0) - da * da - lean * lean * da * da / k2
    bt = (w * d).sum(0) - wa * da - lean * (ra + lean * wa) * da / k2
    ct = (w * w).sum(0) - wa * wa - (ra + lean * wa) ** 2 / k2
    # the tangent cone in these coordinates has the radius (ra + lean h) / k at height h
    root = bt * bt - at * ct
    t = (-bt - np.sqrt(np.maximum(root, 0.0))) / at
    height = wa + t * da
    low, high = -lean * ra, length - lean * rb
    t = np.where((root >= 0.0) & (height >= low) & (height <= high), t, LEFT)
    return np.minimum(t, np.minimum(sphere(a, ra), sphere(b, rb)))


@pytest.mark.parametrize("name", ["line", "cone"])
def test_a_straight_curve_is_a_cone_between_two_spheres(name):
    curves = CURVES[name]
    (a, ra), (b, rb) = ((np.array(p[:3]), p[3]) for p in curves.points)
    o, d = rays(curves, 20_000, 2)
    expected, result = closed_form(a, b, ra, rb, o, d), met(name, o, d)[0]
    assert ((result < 1e29) != (expected < 1e29)).mean() < 3e-4
    both = (result < 1e29) & (expected < 1e29)
    assert both.mean() > 0.4
    off = np.abs(result - expected)[both]
    assert (off < 2e-5).mean() > 0.99 and (off < 2e-3).mean() > 0.9995


def test_frames_follow_the_curve():
    """The point is beside the hit; tangents lie in the surface, u x v is its normal, v runs on."""
    for name in ("arc", "spline", "cone"):
        o, d = rays(CURVES[name], 2000, 4)
        result = met(name, o, d)
        hit = result[0] < 1e29
        n, p, du, dv = (result[i : i + 3, hit] for i in (1, 6, 9, 12))
        assert np.abs(p - (o + d * result[0])[:, hit]).max() < 2e-4
        unit = du / np.linalg.norm(du, axis=0), dv / np.linalg.norm(dv, axis=0)
        assert np.quantile(np.abs((unit[0] * n).sum(0)), 0.97) < 0.02
        turn = np.cross(du.T, dv.T).T
        inner = (result[5, hit] > 0.02) & (result[5, hit] < 0.98)
        assert ((turn * n).sum(0)[inner] > 0.9 * np.linalg.norm(turn, axis=0)[inner]).mean() > 0.99
    v, p = result[5, hit], p
    assert np.corrcoef(v, p[0])[0, 1] > 0.99


def test_a_ray_does_not_meet_the_surface_it_starts_on():
    """Origins as shading makes them: outward a straight one is not met, inward its far side."""
    for name in ("line", "cone"):
        curves = CURVES[name]
        o, d = rays(curves, 20_000, 6)
        on = met(name, o, d)
        hit = on[0] < 1e29
        n, p, size = on[1:4, hit], on[6:9, hit], on[15, hit]
        rng = np.random.default_rng(7)
        w = rng.normal(size=p.shape)
        w /= np.linalg.norm(w, axis=0)
        cos = (w * n).sum(0)
        step = 2.0**-21 * (np.abs(p).max(0) + size)
        out = cos > 0.01
        assert (met(name, (p + n * step)[:, out], w[:, out])[0] > 1e29).mean() > 1.0 - 2e-4
        into = cos < -0.1
        t = met(name, (p - n * step)[:, into], w[:, into])[0]
        assert (t < 1e29).mean() > 0.999 and (t > 1e-3).mean() > 0.999


def test_hits_lie_between_tmin_and_tmax_and_lanes_agree():
    o, d = rays(CURVES["arc"], 1600, 9)
    result = met("arc", o, d)
    hit = result[0] < 1e29
    t = result[0, hit]
    o, d = o[:, hit], d[:, hit]
    assert (met("arc", o, d, tmin=t * 1.0001)[0] > t * 1.0001).all()
    before = (t * 0.9999).astype(np.float32)
    assert (met("arc", o, d, tmax=before)[0] == before).all()
    assert_lanes_agree(met("arc", o, d, lanes=1)[:6], met("arc", o, d, lanes=16)[:6])


def test_boxes_hold_the_pieces_and_a_transform_moves_them():
    matrix = T.translate([1.0, 2.0, 3.0]) @ T.rotate([1, 1, 0], 40.0) @ T.scale(2.0)
    plain = strands.pieces(CURVES["spline"])
    moved = strands.pieces(Curves(points=SPLINE, to_world=matrix))
    assert len(plain) == len(moved)
    balls = along(CURVES["spline"], 2000)
    centres, radii = T.transform_points(matrix, balls[:, :3]), 2.0 * balls[:, 3:]
    boxes = strands.boxes(moved).astype(np.float64)
    inside = (centres[:, None] - radii[:, None] >= boxes[:, 0] - 1e-6) & (
        centres[:, None] + radii[:, None] <= boxes[:, 1] + 1e-6
    )
    assert inside.all(axis=2).any(axis=1).all()
