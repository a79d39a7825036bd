"""Shapes: triangles, rows and bounds; sampling, intersection, normals and uv in the kernels."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

import clpt
from clpt import transforms as T
from clpt.errors import SceneError
from clpt.geometry import analytic, shapes, triangles
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path
from clpt.scene.lights import Constant
from clpt.scene.materials import Diffuse
from clpt.scene.shapes import Cube, Cylinder, Disk, Mesh, Rectangle, Sphere
from tests.kernels.light_probe import shape_probe

PLACED = T.translate([0.3, -0.2, 0.5]) @ T.rotate([1, 2, 3], 40.0) @ T.scale(0.7)
STRETCHED = PLACED @ T.scale([1.5, 0.5, 1.0])
SHAPES = {
    "sphere": Sphere(center=(0.2, 0.1, -0.3), radius=0.8, to_world=PLACED),
    "disk": Disk(to_world=PLACED),
    "ellipse": Disk(to_world=STRETCHED),
    "cylinder": Cylinder(p0=(0.1, 0.2, -0.4), p1=(-0.2, 0.5, 0.9), radius=0.6, to_world=PLACED),
    "rectangle": Rectangle(to_world=STRETCHED),
}
ANALYTIC = [name for name, shape in SHAPES.items() if shape.kind in shapes.ANALYTIC]
OUTSIDE, FAR_OFF = (2.0, 1.5, -1.0), (30.0, -60.0, 80.0)
NEAR = (0.4, -0.22, 0.73)  # inside of the closed shapes
# Chance that any one chi-square test of this file fails where all is right: 1e-3 (Sidak).
SIGNIFICANCE = 1.0 - (1.0 - 1e-3) ** (1.0 / (3 * len(SHAPES)))

SAMPLE = """
    {T} q = {k}_row(scene.geometry, (integer)(0));
    vec3 p = v3(x[0], x[1], x[2]);
    vec2 u = {{x[3], x[4]}};
    ShapeSample s = {k}_sample(q, p, u);
    r[0] = s.wi.x; r[1] = s.wi.y; r[2] = s.wi.z; r[3] = s.t;
    r[4] = s.n.x; r[5] = s.n.y; r[6] = s.n.z;
    r[7] = s.uv.x; r[8] = s.uv.y; r[9] = s.pdf; r[10] = {k}_pdf(q, p, s.wi, s.t, s.n);
"""
PDF = """
    {T} q = {k}_row(scene.geometry, (integer)(0));
    r[0] = {k}_pdf(q, v3(x[0], x[1], x[2]), v3(x[3], x[4], x[5]), x[6], v3(x[7], x[8], x[9]));
"""
MEET = """
    {T} q = {k}_row(scene.geometry, (integer)(0));
    vec3 o = v3(x[0], x[1], x[2]), d = v3(x[3], x[4], x[5]);
    ShapeHit h = {k}_intersect(q, o, d, x[6], x[7]);
    vec3 du = {k}_dpdu(q, madd3(d, h.t, o), h.uv);
    r[0] = h.t; r[1] = h.n.x; r[2] = h.n.y; r[3] = h.n.z; r[4] = h.uv.x; r[5] = h.uv.y;
    r[6] = du.x; r[7] = du.y; r[8] = du.z;
"""


def call(shape, body: str, given: np.ndarray, results: int, lanes: int = 8) -> np.ndarray:
    record = shapes.RECORDS[shape.kind]
    text = body.format(T=record.name, k=shape.kind)
    return shape_probe(shape)(text, given, results, lanes).astype(np.float64)


def sampled(shape, p, n: int, seed: int = 1, lanes: int = 8) -> np.ndarray:
    u = np.random.default_rng(seed).random((2, n))
    return call(shape, SAMPLE, np.vstack([np.tile(np.array(p)[:, None], n), u]), 11, lanes)


def met(shape, o, d, tmin=0.0, tmax=1e30, lanes: int = 8) -> np.ndarray:
    limits = np.stack([np.broadcast_to(limit, o.shape[1]) for limit in (tmin, tmax)])
    return call(shape, MEET, np.vstack([o, d, limits]), 9, lanes)


def reference(shape, o, d) -> list[tuple[np.ndarray, np.ndarray]]:
    """The crossings of lines with a shape in float64: (t, normal) each, t nan where none is."""
    row = analytic.members_of(shape)
    if shape.kind in ("disk", "rectangle"):
        n = row["n"][:, None]
        t = ((row["center"][:, None] - o) * n).sum(0) / (d * n).sum(0)
        at = o + t * d - row["center"][:, None]
        x, y = np.linalg.lstsq(np.stack([row["s"], row["t"]], 1), at, rcond=None)[0]
        inside = x * x + y * y <= 1 if shape.kind == "disk" else np.maximum(abs(x), abs(y)) <= 1
        return [(np.where(inside, t, np.nan), np.broadcast_to(n, d.shape))]
    start = row["center" if shape.kind == "sphere" else "p0"][:, None]
    f, axis = o - start, row.get("axis", np.zeros(3))[:, None]
    across = np.eye(3) - axis @ axis.T / max(float((axis**2).sum()), 1e-30)
    fa, da = across @ f, across @ d
    a, b, c = (da * da).sum(0), (fa * da).sum(0), (fa * fa).sum(0) - row["radius"] ** 2
    with np.errstate(invalid="ignore"):
        root = np.sqrt(b * b - a * c)
    found = []
    for t in ((-b - root) / a, (-b + root) / a):
        v = ((f + t * d) * axis).sum(0) / max(float((axis**2).sum()), 1e-30)
        n = row["side"] * (across @ (f + t * d)) / row["radius"]
        found.append((np.where((v >= 0.0) & (v <= 1.0), t, np.nan), n))
    return found


def directions(n: int, seed: int) -> np.ndarray:
    d = np.random.default_rng(seed).normal(size=(3, n))
    return (d / np.linalg.norm(d, axis=0)).astype(np.float32).astype(np.float64)


# ---- sampling


@pytest.mark.parametrize("p", [OUTSIDE, NEAR, FAR_OFF], ids=["outside", "near", "far"])
@pytest.mark.parametrize("name", SHAPES)
def test_samples_follow_the_pdf(name, p):
    shape, n, bins, fine = SHAPES[name], 40_000, 24, 16
    wi = sampled(shape, p, n)[:3]
    # A box of directions around the samples, in a frame whose pole is far from them.
    mean = wi.mean(axis=1)
    whole = np.linalg.norm(mean) < 0.8
    axis = np.array([0.0, 0.0, 1.0]) if whole else mean / np.linalg.norm(mean)
    s, t = analytic.across(axis)
    frame = np.stack([axis, s, t])
    local = frame @ wi
    z, phi = local[2], np.arctan2(local[1], local[0])
    box = [(-1.0, 1.0), (-np.pi, np.pi)]
    if not whole:
        box = [(c.min() - 0.01 * np.ptp(c), c.max() + 0.01 * np.ptp(c)) for c in (z, phi)]
        box[0] = (max(box[0][0], -1.0), min(box[0][1], 1.0))
    (z0, z1), (p0, p1) = box
    counts = np.histogram2d(z, phi, bins=bins, range=box)[0]
    zs = z0 + (z1 - z0) * (np.arange(bins * fine) + 0.5) / (bins * fine)
    ps = p0 + (p1 - p0) * (np.arange(bins * fine) + 0.5) / (bins * fine)
    zs, ps = (g.ravel() for g in np.meshgrid(zs, ps, indexing="ij"))
    r = np.sqrt(1.0 - zs * zs)
    d = frame.T @ np.stack([r * np.cos(ps), r * np.sin(ps), zs])
    o = np.tile(np.array(p)[:, None], d.shape[1])
    density = np.zeros(d.shape[1])
    crossings = reference(shape, o, d)
    if shape.kind == "sphere" and p is not NEAR:
        crossings = crossings[:1]
    for distance, normal in crossings:
        hit = distance > 0.0
        given = np.vstack([o, d, np.where(hit, distance, 1.0), normal])[:, hit]
        density[hit] += call(shape, PDF, given, 1)[0] if hit.any() else 0.0
    cell = (z1 - z0) * (p1 - p0) / (bins * fine) ** 2
    expected = density.reshape(bins, fine, bins, fine).sum(axis=(1, 3)) * cell * n
    assert expected.sum() == pytest.approx(n, rel=0.01)
    # Bins that the outline crosses are known to a few percent only: leave out where that is seen.
    inner = (density.reshape(bins, fine, bins, fine) > 0).all(axis=(1, 3)) & (expected > 10)
    statistic = ((counts - expected)[inner] ** 2 / expected[inner]).sum()
    assert inner.sum() > 60
    assert chi2.sf(statistic, inner.sum()) > SIGNIFICANCE
    assert counts[expected == 0.0].sum() < 0.002 * n


@pytest.mark.parametrize("p", [OUTSIDE, NEAR, FAR_OFF], ids=["outside", "near", "far"])
@pytest.mark.parametrize("name", SHAPES)
def test_samples_lie_on_the_shape(name, p):
    shape = SHAPES[name]
    r = sampled(shape, p, 4000, seed=2)
    wi, t, n, pdf, again = r[:3], r[3], r[4:7], r[9], r[10]
    np.testing.assert_allclose(np.linalg.norm(wi, axis=0), 1.0, atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(n, axis=0), 1.0, atol=1e-6)
    np.testing.assert_allclose(pdf, again, rtol=1e-4)
    cos = np.abs((wi * n).sum(0))
    found = reference(shape, np.array(p)[:, None] + 0.0 * wi, wi)
    nearest = np.min([np.nan_to_num(np.abs(f - t), nan=np.inf) for f, _ in found], axis=0)
    steep = (cos > 0.05) & np.isfinite(nearest)  # at the outline a direction in float32 may miss
    assert steep.mean() > 0.8
    assert (nearest[steep] <= 2e-5 * (t[steep] + 1.0) / cos[steep]).all()
    if shape.kind != "sphere" or p is NEAR:
        exact = t * t / (analytic.area(shape) * cos)
        np.testing.assert_allclose(pdf[steep], exact[steep], rtol=1e-3)


def test_a_small_far_sphere_is_sampled_as_a_disk():
    """The cone's pdf is t^2 / (pi r^2) in the limit; 1 - cos in float32 would be all noise."""
    shape, p = Sphere(center=(0.0, 0.0, 2e4), radius=1.0), (0.0, 0.0, 0.0)
    r = sampled(shape, p, 2000)
    np.testing.assert_allclose(r[9], 4e8 / np.pi, rtol=1e-4)
    assert (r[3] > 2e4 - 1.01).all() and (r[3] < 2e4 + 0.01).all()
    spread = np.hypot(r[0], r[1]) * 2e4
    assert spread.max() < 1.001
    assert np.mean(spread**2) == pytest.approx(0.5, abs=0.03)


# ---- intersection


@pytest.mark.parametrize("name", ANALYTIC)
def test_intersection_agrees_with_float64(name):
    shape, n = SHAPES[name], 20_000
    rng = np.random.default_rng(5)
    lo, hi = (np.array(b, np.float64) for b in analytic.bounds(shape))
    o = (rng.random((3, n)) * 6.0 - 3.0).astype(np.float32).astype(np.float64)
    d = lo[:, None] + rng.random((3, n)) * (hi - lo)[:, None] - o
    d = (d / np.linalg.norm(d, axis=0)).astype(np.float32).astype(np.float64)
    result = met(shape, o, d)
    first, normal = np.full(n, 1e30), np.zeros((3, n))
    for t, m in reference(shape, o, d):
        nearer = (t > 0.0) & (t < first)
        first, normal = np.where(nearer, t, first), np.where(nearer, m, normal)
    hit, expected = result[0] < 1e29, first < 1e29
    assert expected.mean() > 0.2
    assert (hit != expected).mean() < 3e-4  # outlines
    both = hit & expected & (np.abs(result[0] - first) < 0.05)
    assert both.sum() > 0.998 * expected.sum()
    cos = np.maximum(np.abs((normal * d).sum(0)), 0.02)[both]
    assert (np.abs(result[0] - first)[both] <= 4e-6 * (first[both] + 1.0) / cos).all()
    assert (np.abs(result[1:4] - normal)[:, both].max(0) <= 2e-5 / cos).all()


@pytest.mark.parametrize("name", ANALYTIC)
def test_a_ray_does_not_meet_the_surface_it_starts_on(name):
    """At tmin = 0: a ray that leaves a convex side meets nothing, one that enters the far side."""
    shape, n = SHAPES[name], 20_000
    on = sampled(shape, NEAR, n, seed=8)
    p = np.array(NEAR)[:, None] + on[3] * on[:3]
    # In float64 onto the surface, and then as near as float32 comes.
    row = analytic.members_of(shape)
    if shape.kind == "disk":
        p -= row["n"][:, None] * (row["n"] @ (p - row["center"][:, None]))
    else:
        start = row["center" if shape.kind == "sphere" else "p0"][:, None]
        axis = row.get("axis", np.zeros(3))
        along = np.outer(axis, axis) @ (p - start) / max(float(axis @ axis), 1e-30)
        across = p - start - along
        p = start + along + across * row["radius"] / np.linalg.norm(across, axis=0)
    p = p.astype(np.float32).astype(np.float64)
    d = directions(n, 9)
    leaving = (d * on[4:7]).sum(0) > 0.01
    t = met(shape, p, d)[0]
    assert (t[leaving] > 1e29).all()
    entering = (d * on[4:7]).sum(0) < -0.05
    assert (t[entering] > 0.02).all()


@pytest.mark.parametrize("name", ANALYTIC)
def test_hits_lie_between_tmin_and_tmax(name):
    shape = SHAPES[name]
    center = np.mean(analytic.bounds(shape), axis=0)[:, None]
    d = directions(4000, 4)
    o = center - 5.0 * d + 0.2 * directions(4000, 6)
    t = met(shape, o, d)[0]
    hit = t < 1e29
    assert hit.sum() > 100
    beyond = met(shape, o[:, hit], d[:, hit], tmin=t[hit] * 1.0001)[0]
    assert (beyond > t[hit] * 1.0001).all()
    assert (met(shape, o[:, hit], d[:, hit], tmax=t[hit] * 0.9999)[0] > 1e29).all()


@pytest.mark.parametrize("name", SHAPES)
def test_lanes_agree(name):
    one, wide = (sampled(SHAPES[name], OUTSIDE, 333, lanes=k) for k in (1, 16))
    np.testing.assert_allclose(one, wide, rtol=2e-5, atol=2e-6)
    if name in ANALYTIC:
        d, o = directions(333, 3), np.tile([[0.3], [-0.2], [0.5]], 333)
        one, wide = (met(SHAPES[name], o, d, lanes=k) for k in (1, 16))
        hit = one[0] < 1e29
        np.testing.assert_array_equal(hit, wide[0] < 1e29)
        np.testing.assert_allclose(one[:, hit], wide[:, hit], rtol=1e-4, atol=1e-5)


# ---- against Mitsuba


def mitsuba_shape(mi, shape):
    place = mi.ScalarTransform4f(np.asarray(shape.to_world))
    made = {"type": shape.kind, "to_world": place, "flip_normals": shape.flip_normals}
    for name in ("center", "radius", "p0", "p1"):
        if hasattr(shape, name) and shape.kind in ("sphere", "cylinder"):
            value = getattr(shape, name)
            made[name] = list(value) if np.ndim(value) else float(value)
    return mi.load_dict({"type": "scene", "shape": made})


@pytest.mark.peers
@pytest.mark.parametrize("flip", [False, True], ids=["", "flipped"])
@pytest.mark.parametrize("name", ["sphere", "disk", "ellipse", "cylinder"])
def test_normals_and_uv_are_mitsuba_s(name, flip):
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    base = SHAPES[name]
    placement = {k: getattr(base, k) for k in ("center", "radius", "p0", "p1") if hasattr(base, k)}
    shape = type(base)(to_world=base.to_world, flip_normals=flip, **placement)
    scene = mitsuba_shape(mi, shape)
    d = directions(400, 21)
    o = np.mean(analytic.bounds(shape), axis=0)[:, None] - 4.0 * d + 0.5 * directions(400, 22)
    ours, count = met(shape, o, d), 0
    for i in range(o.shape[1]):
        si = scene.ray_intersect(mi.Ray3f(list(map(float, o[:, i])), list(map(float, d[:, i]))))
        if not si.is_valid() or ours[0, i] > 1e29 or abs(ours[1:4, i] @ d[:, i]) < 0.05:
            continue
        count += 1
        assert ours[0, i] == pytest.approx(si.t, abs=1e-4)
        np.testing.assert_allclose(ours[1:4, i], np.array(si.n).ravel(), atol=1e-4)
        uv, theirs = ours[4:6, i], np.array(si.uv).ravel()
        turn = np.abs(uv - theirs)
        assert np.minimum(turn, 1.0 - turn).max() < 2e-4
        scale = np.linalg.norm(np.array(si.dp_du))
        if name != "ellipse":  # Mitsuba's derivatives hold for circles
            np.testing.assert_allclose(ours[6:9, i], np.array(si.dp_du).ravel(), atol=5e-3 * scale)
    assert count > 60


@pytest.mark.peers
@pytest.mark.parametrize("cls", [Rectangle, Cube], ids=["rectangle", "cube"])
def test_triangles_have_mitsuba_s_normals_and_uv(cls):
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    shape = cls(to_world=STRETCHED)
    scene = mitsuba_shape(mi, shape)
    vertices, faces, _, uvs = triangles.triangulate(shape)
    rng = np.random.default_rng(3)
    for face in faces:
        b = rng.dirichlet(np.ones(3))
        p, uv = b @ vertices[face], b @ uvs[face]
        n = np.cross(vertices[face[1]] - vertices[face[0]], vertices[face[2]] - vertices[face[0]])
        n = n / np.linalg.norm(n)
        si = scene.ray_intersect(mi.Ray3f((p + n).tolist(), (-n).tolist()))
        assert si.is_valid() and si.t == pytest.approx(1.0, abs=1e-4)
        np.testing.assert_allclose(np.array(si.n).ravel(), n, atol=1e-4)
        np.testing.assert_allclose(np.array(si.uv).ravel(), uv, atol=1e-4)


# ---- the host side


def crosses(vertices, faces):
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    return np.cross(b - a, c - a)


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_the_front_stays_the_front(mirror, flip):
    """A mirror does not turn a shape inside out, `flip_normals` does."""
    place = T.translate([1, 2, 3]) @ T.rotate([1, 1, 0], 30) @ T.scale([mirror, 2.0, 1.0])
    front = 1.0 if not flip else -1.0
    vertices, faces, _, _ = triangles.triangulate(Cube(to_world=place, flip_normals=flip))
    outward = vertices[faces].mean(axis=1) - vertices.mean(axis=0)
    assert ((crosses(vertices, faces) * outward).sum(axis=1) * front > 0.0).all()
    shape = Rectangle(to_world=place, flip_normals=flip)
    normal = T.transform_normals(place, [0, 0, front])
    vertices, faces, _, _ = triangles.triangulate(shape)
    assert (crosses(vertices, faces) @ normal > 0.0).all()
    np.testing.assert_allclose(analytic.members_of(shape)["n"], normal, atol=1e-6)


def test_normals_turn_with_the_mesh():
    mesh = Mesh(
        vertices=np.eye(3, dtype=np.float32), faces=np.array([[0, 1, 2]]),
        normals=np.full((3, 3), 3**-0.5, np.float32), to_world=T.scale([1.0, 1.0, 4.0]),
    )  # fmt: skip
    _, _, normals, uvs = triangles.triangulate(mesh)
    expected = np.array([1.0, 1.0, 0.25]) / np.linalg.norm([1.0, 1.0, 0.25])
    np.testing.assert_allclose(normals, np.tile(expected, (3, 1)), atol=1e-6)
    assert uvs is None


@pytest.mark.parametrize("name", SHAPES)
def test_bounds_and_area(name):
    shape, p = SHAPES[name], np.array(NEAR)
    r = sampled(shape, NEAR, 20_000, seed=12)
    points = p + (r[:3] * r[3]).T
    lo, hi = analytic.bounds(shape)
    assert (points >= lo - 1e-6).all() and (points <= hi + 1e-6).all()
    assert (points.min(0) - lo < 0.03).all() and (hi - points.max(0) < 0.03).all()
    known = {
        "sphere": 4 * np.pi * 0.56**2,
        "disk": np.pi * 0.49,
        "ellipse": np.pi * 0.49 * 0.75,
        "rectangle": 4 * 0.49 * 0.75,
        "cylinder": 2 * np.pi * 0.42 * 0.7 * np.linalg.norm([-0.3, 0.3, 1.3]),
    }
    assert analytic.area(shape) == pytest.approx(known[name], rel=1e-5)


def test_triangles_without_an_area_are_left_out():
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0]], np.float32)
    flat: list[triangles.Flat] = []
    mesh = Mesh(vertices=vertices, faces=np.array([[0, 1, 2], [0, 1, 3], [1, 1, 2]]), name="leaf")
    _, faces, _, _ = triangles.triangulate(mesh, flat)
    assert faces.tolist() == [[0, 1, 2]]
    assert triangles.warnings_of([]) == []
    assert triangles.warnings_of(flat) == ["mesh 'leaf': 2 of 3 triangles have no area, left out"]
    more = [*flat, triangles.Flat("mesh", 1200, 9000), triangles.Flat("mesh", 1, 2)]
    assert triangles.warnings_of(more)[0].endswith(
        "left out; with those of 2 more shapes 1,203 in all"
    )


GOOD = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
FACE = np.array([[0, 1, 2]])


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        (Mesh(vertices=GOOD, faces=np.zeros((0, 3), int)), "empty"),
        (Mesh(vertices=np.zeros((0, 3)), faces=FACE), "empty"),
        (Mesh(vertices=GOOD, faces=FACE.astype(float)), "whole numbers"),
        (Mesh(vertices=GOOD * np.nan, faces=FACE), "vertices[0] is not finite"),
        (Mesh(vertices=GOOD, faces=FACE, normals=np.full((3, 3), np.inf)), "normals[0]"),
        (Mesh(vertices=GOOD, faces=FACE, uvs=np.zeros((2, 2))), "uvs must be (3, 2)"),
        (Mesh(vertices=None, faces=FACE), "vertices and faces"),
        (Rectangle(to_world=np.diag([1.0, 0.0, 1.0, 1.0])), "singular"),
        (Cube(to_world=np.full((4, 4), np.nan)), "singular"),
        (Sphere(to_world=T.scale([1, 2, 1])), "use a mesh"),
        (Cylinder(p0=(1, 1, 1), p1=(1, 1, 1)), "coincide"),
        (Cylinder(to_world=T.scale([1, 2, 1])), "use a mesh"),
    ],
)
def test_bad_shapes_are_named(shape, words):
    with pytest.raises(SceneError) as caught:
        analytic.bounds(shape)
    assert words in str(caught.value)
    assert str(caught.value).startswith(shape.kind)


LARGE = 6.371e6
BESIDE = {  # a shape, and how far its surface is from the world's origin, downwards [m]
    "a planet": (Sphere(center=(0, -LARGE, 0), radius=LARGE), 2.0),
    "a ball, from its scale's rounding": (Sphere(center=(0, -1e3, 0), radius=1e3), 1e-4),
    "a tiny ball": (Sphere(center=(0, -1e-6, 0), radius=1e-6), 1e-12),
    "a huge ball": (Sphere(center=(0, -1e12, 0), radius=1e12), 1e3),
    "a tube": (Cylinder(p0=(-1e5, -1e5, 0), p1=(1e5, -1e5, 0), radius=1e5), 0.05),
    "a disk, from far off its middle": (
        Disk(to_world=T.translate([5e6, 0, 0]) @ T.rotate([1, 0, 0], -90) @ T.scale(6e6)),
        2.0,
    ),
}


@pytest.mark.parametrize("lanes", [1, 8])
@pytest.mark.parametrize("what", BESIDE)
def test_the_near_side_is_met_from_just_beside_it(what: str, lanes: int) -> None:
    """An eye over a large shape sees the ground below; one that leaves the ground meets nothing."""
    shape, height = BESIDE[what]
    n = 2000
    d = directions(n, 3)
    d[1] = -np.abs(d[1])
    steep = d[1] < -0.2
    o = np.tile([[0.0], [height], [0.0]], n).astype(np.float32).astype(np.float64)
    down = met(shape, o, d, lanes=lanes)
    # The ground is flat there, but for what the shape bends within the ray's length.
    flat = o[1] / -d[1]
    size = shape.radius if shape.kind != "disk" else 1e30
    np.testing.assert_allclose(down[0][steep], flat[steep], rtol=1e-5 + 30 * height / size)
    assert (down[2][steep] > 0.999).all() if shape.kind != "cylinder" else True
    up = met(shape, o, d * [[1.0], [-1.0], [1.0]], lanes=lanes)
    assert (up[0] > 1e29).all()


ONTO = """
    {T} q = {k}_row(scene.geometry, (integer)(0));
    vec3 p = v3(x[0], x[1], x[2]), on = {k}_onto(q, p);
    r[0] = on.x; r[1] = on.y; r[2] = on.z; r[3] = {k}_size(q);
"""


@pytest.mark.parametrize("what", BESIDE)
def test_points_are_put_onto_large_shapes_by_their_own_digits(what: str) -> None:
    """Where a surface goes through the world's origin a point of it is exact, however large it is,
    so that rays may leave from just beside it."""
    shape, height = BESIDE[what]
    rng = np.random.default_rng(4)
    p = (rng.random((3, 2000)) - 0.5) * 20.0 * height * np.array([[1.0], [1e-3], [1.0]])
    r = call(shape, ONTO, p.astype(np.float32).astype(np.float64), 4)
    size = shape.radius if shape.kind != "disk" else 1e30
    sag = (r[0] ** 2 + r[2] ** 2) / (2.0 * size)
    if shape.kind == "cylinder":
        sag = r[2] ** 2 / (2.0 * size)
    off = np.abs(r[1] + sag)
    step = (np.abs(r[:3]).max(axis=0) + r[3]) * 2.0**-21  # by which rays leave it
    assert (off < 0.25 * step).all()
    assert step.max() < 0.02 * height


def test_a_ball_that_lies_on_a_planet_has_its_shadow() -> None:
    """The lower half of a ball and its contact shadow are those on a ball of 100 km. Both pictures
    have the same random numbers; the error is three times what 64 samples leave."""

    def seen(radius: float) -> np.ndarray:
        white = Diffuse(reflectance=0.8)
        balls = [Sphere(center=c, radius=r, material=white)
                 for c, r in (((0, 1, 0), 1.0), ((0, -radius, 0), radius))]  # fmt: skip
        camera = Perspective(origin=(0, 12, 20), target=(0, 1, 0), fov=8)
        image = clpt.render(
            Scene(camera=camera, shapes=balls, lights=[Constant(radiance=1.0)],
                  film=Film(width=17, height=17, mode="rgb"),
                  integrator=Path(max_depth=12, light_paths=0)), 64)  # fmt: skip
        return np.array([image[10:12, 7:10].mean(), image[14:, 1:4].mean()])

    np.testing.assert_allclose(seen(LARGE), seen(1e5), atol=0.03)
