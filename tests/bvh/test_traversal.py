"""Every layout against a float64 reference, closed surfaces, and rays that are no rays."""

import numpy as np
import pytest
import trimesh

from clpt import bvh
from clpt import device as dev

MISS = 0xFFFFFFFF
LAYOUTS = [
    pytest.param("brute", 1, marks=pytest.mark.slow),
    ("brute", 8),
    pytest.param("brute", 16, marks=pytest.mark.slow),
    ("binary", 1),
    ("wide8", 1),
    ("wide8", 8),
    ("compact", 1),
]
COUNTS = [1, 2, 3, 8, 9, 50, 1000]
# brute force: each number of triangles at one number of lanes; trees: at one layout, many at all
COUNTED = [
    pytest.param(
        *(layout, lanes, count),
        marks=() if i % 3 == k or (layout != "brute" and count == 1000) else pytest.mark.slow,
    )
    for i, count in enumerate(COUNTS)
    for group in (
        [("brute", 1), ("brute", 8), ("brute", 16)],
        [("binary", 1), ("wide8", 1), ("compact", 1), ("wide8", 8)],
    )
    for k, (layout, lanes) in enumerate(group)
]


def mesh(triangles):
    n = len(triangles)
    return triangles.reshape(-1, 3), np.arange(3 * n, dtype=np.uint32).reshape(n, 3)


def soup(rng, n, size):
    """Triangles (n, 3, 3) about points of a cube; a few of them are all about its middle."""
    centres = 0.5 + (rng.random((n, 1, 3)) - 0.5) * (n > 3)
    return (centres + size * rng.normal(0, 1, (n, 3, 3))).astype(np.float32)


def rays_at(rng, points, tmin=1e-4, tmax=np.inf):
    """Rays (n, 8) from around the unit cube toward points (n, 3)."""
    o = 0.5 + rng.normal(0, 1.0, points.shape)
    d = points - o
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    ends = [np.full((len(o), 1), end) for end in (tmin, tmax)]
    return np.concatenate([o, ends[0], d, ends[1]], 1).astype(np.float32)


@pytest.mark.parametrize(("layout", "lanes", "count"), COUNTED)
def test_agrees_with_reference(device, trace, reference, layout, lanes, count):
    rng = np.random.default_rng(count)
    triangles = soup(rng, count, 0.4 / count ** (1 / 3))
    rays = rays_at(rng, 0.25 + 0.5 * rng.random((1003, 3)))
    tags = rng.integers(0, 2**32, count, dtype=np.uint32)
    hits, occluded = trace(bvh.build(device, *mesh(triangles), tags, layout), rays, lanes)
    t, margin = reference(triangles, rays)
    nearest, best = t.min(1), t.argmin(1)
    sure = np.abs(margin).min(1) > 1e-5  # no triangle's edge is near the ray
    assert sure.mean() > 0.9
    met = np.isfinite(nearest)
    assert met.sum() > 10
    assert ((hits["prim"] != MISS) == met)[sure].all()
    assert (occluded == met)[sure].all()
    both = sure & met
    np.testing.assert_allclose(hits["t"][both], nearest[both], rtol=1e-4)
    same = both & (hits["prim"] == best)
    assert same.sum() > 0.999 * both.sum()
    np.testing.assert_array_equal(hits["tag"][same], tags[best[same]])
    corners = triangles.astype(np.float64)[best[same]]
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    n = np.cross(e1, e2)
    np.testing.assert_allclose(hits["n"][same], n, atol=1e-5 * np.abs(n).max())
    u, v = hits["u"][same, None], hits["v"][same, None]
    points = rays[same, :3] + nearest[same, None] * rays[same, 4:7]
    np.testing.assert_allclose(corners[:, 0] + u * e1 + v * e2, points, atol=5e-4)


@pytest.mark.parametrize(("layout", "lanes"), [("wide8", 1), ("wide8", 8), ("compact", 1)])
def test_the_deepest_trees(device, trace, layout, lanes):
    """Triangles that shrink by .6: trees of the least cost have up to 41 levels."""
    sizes = (0.6 ** (np.arange(2000) % 200))[:, None, None]
    corners = np.array([[1, 1, 1], [1.2, 1, 1], [1, 1.2, 1]])
    triangles = (sizes * corners).astype(np.float32)
    tree = bvh.build(device, *mesh(triangles), layout=layout, quality="fast")
    rng = np.random.default_rng(5)
    size = sizes[rng.integers(0, 40, 4000), 0]
    points = size * ([1, 1, 1] + [0.25, 0.25, 0] * (rng.random((4000, 3)) - 0.2))
    d = size * ([0.3, 0.2, 1.0] + 0.2 * rng.random((4000, 3)))
    ends = np.zeros((4000, 1)), np.full((4000, 1), 1.5)
    rays = np.concatenate([points - d, ends[0], d, ends[1]], 1).astype(np.float32)
    hits, occluded = trace(tree, rays, lanes)
    truth, _ = trace(bvh.build(device, *mesh(triangles), layout="brute"), rays)
    met = truth["prim"] != MISS
    assert 0.1 < met.mean() < 0.9
    np.testing.assert_array_equal(occluded, met)
    np.testing.assert_allclose(hits["t"], truth["t"], rtol=1e-5)


@pytest.mark.parametrize(("layout", "lanes"), LAYOUTS)
def test_any_hit_is_the_existence_of_a_closest(device, trace, layout, lanes):
    rng = np.random.default_rng(11)
    count = 100 if layout == "brute" else 20_000
    triangles = soup(rng, count, 0.5 / count ** (1 / 2))
    rays = rays_at(rng, rng.random((50_000, 3)), tmax=1.5)
    hits, occluded = trace(bvh.build(device, *mesh(triangles), layout=layout), rays, lanes)
    assert 0.02 < occluded.mean() < 0.98
    np.testing.assert_array_equal(occluded, hits["prim"] != MISS)
    np.testing.assert_array_equal(hits["t"][~occluded], np.float32(1.5))


@pytest.mark.parametrize(("layout", "lanes"), LAYOUTS)
def test_a_hit_is_strictly_between_tmin_and_tmax(device, trace, layout, lanes):
    triangle = np.array([[[-4, -4, 2], [4, -4, 2], [0, 8, 2]]], np.float32)
    ends = [(0, 4), (0, 2), (2, 4), (1.999, 2.001), (2.001, 4), (0, 1.999), (-4, -1), (4, 0)]
    rays = np.array([[0, 0, 0, tmin, 0, 0, 1, tmax] for tmin, tmax in ends], np.float32)
    hits, occluded = trace(bvh.build(device, *mesh(triangle), layout=layout), rays, lanes)
    expected = [True, False, False, True, False, False, False, False]
    np.testing.assert_array_equal(hits["prim"] != MISS, expected)
    np.testing.assert_array_equal(occluded, expected)
    behind = np.array([[0, 0, 4, -9, 0, 0, 1, 0]], np.float32)  # tmin may be negative
    assert trace(bvh.build(device, *mesh(triangle), layout=layout), behind, lanes)[1].all()


@pytest.mark.parametrize(("layout", "lanes"), LAYOUTS)
def test_rays_that_are_no_rays_meet_nothing(device, trace, layout, lanes):
    triangles = soup(np.random.default_rng(12), 200, 0.3)
    tree = bvh.build(device, *mesh(triangles), layout=layout)
    good = np.array([0.5, 0.5, -3, 0, 0, 0, 1, np.inf], np.float32)
    rays = np.repeat(good[None], 30, 0)
    for i, (at, bad) in enumerate(
        (at, bad) for at in range(8) for bad in (np.nan, -np.inf, np.inf)
    ):
        rays[i, at] = bad
    rays[24:28, 4:7] = 0  # no direction
    hits, occluded = trace(tree, rays, lanes)
    broken = ~np.isfinite(rays[:, [0, 1, 2, 4, 5, 6]]).all(1) | np.isnan(rays[:, [3, 7]]).any(1)
    broken |= (rays[:, 4:7] == 0).all(1)
    assert (hits["prim"][broken] == MISS).all() and not occluded[broken].any()
    assert occluded[-2:].all()


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("layout", "lanes"), LAYOUTS)
def test_rays_along_an_axis(device, trace, layout, lanes, axis):
    """Zero components of a direction, and origins in the very planes of boxes."""
    box = trimesh.creation.box()
    tree = bvh.build(device, box.vertices, box.faces, layout=layout)
    side = np.linspace(-0.5, 0.5, 5)
    grid = np.stack(np.meshgrid(side, side, indexing="ij"), -1).reshape(-1, 2)
    o = np.insert(grid, axis, -2, axis=1)
    d = np.tile(np.eye(3)[axis], (len(o), 1))
    for sign in (1, -1):
        rays = np.concatenate([sign * o, np.zeros((25, 1)), sign * d, np.full((25, 1), 9)], 1)
        hits, occluded = trace(tree, rays.astype(np.float32), lanes)
        assert occluded.all()
        np.testing.assert_allclose(hits["t"], 1.5, rtol=1e-6)


@pytest.mark.parametrize(
    ("layout", "lanes", "level", "count"),
    [
        ("brute", 8, 1, 200_000),
        pytest.param("brute", 16, 1, 200_000, marks=pytest.mark.slow),
        ("binary", 1, 5, 500_000),
        ("wide8", 1, 5, 500_000),
        pytest.param("wide8", 1, 5, 2_000_000, marks=pytest.mark.slow),
        ("compact", 1, 5, 500_000),
    ],
)
def test_nothing_escapes_from_a_closed_surface(device, trace, layout, lanes, level, count):
    """Rays from inside a sphere of triangles, a third of them aimed at its edges and corners."""
    rng = np.random.default_rng(13)
    sphere = trimesh.creation.icosphere(level)
    vertices = sphere.vertices.astype(np.float32)
    o = rng.normal(0, 1, (count, 3))
    o *= 0.5 * rng.random((count, 1)) ** (1 / 3) / np.linalg.norm(o, axis=1, keepdims=True)
    d = rng.normal(0, 1, (count, 3))
    ends = vertices[sphere.edges[rng.integers(0, len(sphere.edges), count // 3)]]
    along = rng.random((count // 3, 1)) * (rng.random((count // 3, 1)) > 0.2)
    d[: count // 3] = ends[:, 0] + along * (ends[:, 1] - ends[:, 0]) - o[: count // 3]
    rays = np.concatenate([o, np.zeros((count, 1)), d, np.full((count, 1), np.inf)], 1)
    tree = bvh.build(device, vertices, sphere.faces, layout=layout)
    hits, occluded = trace(tree, rays.astype(np.float32), lanes)
    escaped = (hits["prim"] == MISS).sum(), (~occluded).sum()
    assert escaped == (0, 0)


@pytest.mark.parametrize("layout", bvh.TREES)
def test_nothing_slips_through_from_afar(device, trace, layout):
    """A small sphere on a vast ground, seen from a thousand times its size away."""
    rng = np.random.default_rng(14)
    sphere = trimesh.creation.icosphere(5)
    ground = 1e4 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) - [0, 0, 1]
    vertices = np.concatenate([sphere.vertices, ground])
    first = len(sphere.vertices)
    faces = np.concatenate([sphere.faces, first + np.array([[0, 1, 2], [0, 2, 3]])])
    tree = bvh.build(device, vertices, faces, layout=layout)
    at = rng.normal(0, 1, (200_000, 3))
    at *= 0.8 * rng.random((len(at), 1)) ** (1 / 3) / np.linalg.norm(at, axis=1, keepdims=True)
    o = rng.normal(0, 1, at.shape)
    o *= 1000 / np.linalg.norm(o, axis=1, keepdims=True)
    o[:, 2] = np.abs(o[:, 2]) + 1
    ends = [np.full((len(o), 1), end) for end in (0, np.inf)]
    rays = np.concatenate([o, ends[0], at - o, ends[1]], 1).astype(np.float32)
    hits, occluded = trace(tree, rays)
    assert occluded.all()
    assert (hits["prim"] < len(sphere.faces)).all()


SPHERES = """
typedef global const float4 *ShapeTable;
inline int shape_intersect(ShapeTable table, uint prim, float3 o, float3 d, float tmin, float *t)
{{
    float3 s = o - table[prim].xyz;
    float a = dot(d, d), b = dot(d, s);
    float c = dot(s, s) - table[prim].w * table[prim].w;
    float discriminant = b * b - a * c;
    if (discriminant < 0.0f) return 0;
    float at = (-b - sqrt(discriminant)) / a;
    if (!(at > tmin && at < *t)) return 0;
    *t = at;
    return 1;
}}
#include "bvh/shapes.cl#{step}"
kernel void closest(global const float *nodes, global const uint *indices, ShapeTable table,
                    global const float8 *rays, global float2 *hits, global int *met)
{{
    uint i = get_global_id(0);
    float8 r = rays[i];
    float t = r.s7;
    uint prim = shapes_trace(nodes, indices, table, r.s012, r.s456, r.s3, &t, 0);
    hits[i] = (float2)(t, as_float(prim));
    t = r.s7;
    met[i] = shapes_trace(nodes, indices, table, r.s012, r.s456, r.s3, &t, 1) != BVH_MISS;
}}
"""


@pytest.mark.parametrize("layout", ["shapes_binary", "shapes_wide8"])
@pytest.mark.parametrize("count", [0, 1, 2, 700])
def test_tree_over_shapes(device, count, layout):
    rng = np.random.default_rng(count)
    spheres = np.concatenate(
        [rng.random((max(count, 1), 3)), 0.02 + 0.05 * rng.random((max(count, 1), 1))], 1
    ).astype(np.float32)
    centre, radius = spheres[:count, None, :3], spheres[:count, None, 3:]
    tree = bvh.build_boxes(device, np.concatenate([centre - radius, centre + radius], 1), layout)
    rays = rays_at(rng, spheres[rng.integers(0, max(count, 1), 2000), :3] + 0.02)
    s = rays[:, None, :3].astype(np.float64) - spheres[None, :count, :3]
    b, c = (s * rays[:, None, 4:7]).sum(-1), (s**2).sum(-1) - spheres[:count, 3] ** 2.0
    with np.errstate(invalid="ignore"):
        t = -b - np.sqrt(b**2 - c)
    t = np.where(t > 1e-4, t, np.inf)
    nearest = t.min(1, initial=np.inf)
    sure = (np.abs(b**2 - c) > 1e-5).all(1) & (np.abs(t - 1e-4) > 1e-4).all(1)

    text = SPHERES.format(step=layout.removeprefix("shapes_"))
    program = dev.build(device, dev.assemble("test", {"test": text}))
    kernel = program.kernel("closest")
    hits, met = np.zeros((2000, 2), np.float32), np.zeros(2000, np.int32)
    upload, download = _buffers(device)
    buffers = {"table": upload(spheres), "rays": upload(rays), "hits": upload(hits)}
    buffers["met"] = upload(met)
    kernel.bind(**tree.buffers, **buffers).enqueue(device.queue, (2000,), (1,))
    download(hits, buffers["hits"])
    download(met, buffers["met"])
    found = hits[:, 1].view(np.uint32) != MISS
    np.testing.assert_array_equal(found[sure], np.isfinite(nearest)[sure])
    np.testing.assert_array_equal(met[sure] != 0, found[sure])
    both = sure & found
    np.testing.assert_allclose(hits[both, 0], nearest[both], atol=1e-3)
    if count:
        assert both.sum() > 100


def _buffers(device):
    import pyopencl as cl

    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    return (
        lambda array: cl.Buffer(device.context, flags, hostbuf=array),
        lambda array, buffer: cl.enqueue_copy(device.queue, array, buffer),
    )
