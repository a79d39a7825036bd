"""Trees: what they hold, how deep they are, and input that trees break on."""

import dataclasses
from typing import get_args

import numpy as np
import pyopencl as cl
import pytest
import trimesh

from clpt import bvh
from clpt import device as dev
from clpt.bvh import layouts
from clpt.errors import MemoryBudgetError, SceneError
from tests.rotation import rotating

LEAF = 0x80000000
MISS = 0xFFFFFFFF
QUALITIES = get_args(bvh.Quality)
DEPTH, LEVELS = 48, 16  # BVH_DEPTH and BVH_LEVELS of kernels/bvh/node.cl
LAYOUTS = [
    pytest.param("brute", 1, marks=pytest.mark.slow),
    ("brute", 8),
    pytest.param("brute", 16, marks=pytest.mark.slow),
    ("binary", 1),
    ("wide8", 1),
    ("compact", 1),
]


def mesh(triangles):
    n = len(triangles)
    return triangles.reshape(-1, 3), np.arange(3 * n, dtype=np.uint32).reshape(n, 3)


def random_triangles(rng, n, size):
    return (rng.random((n, 1, 3)) + size * rng.normal(0, 1, (n, 3, 3))).astype(np.float32)


def ray(o, d, tmin=0.0, tmax=np.inf):
    return np.array([[*o, tmin, *d, tmax]], np.float32)


def read(device, buffer, dtype):
    array = np.empty(buffer.size // np.dtype(dtype).itemsize, dtype)
    cl.enqueue_copy(device.queue, array, buffer)
    return array


def geometric(n, share=0.5, sizes=60):
    """Triangles that shrink toward the origin: unbalanced for every plane."""
    at = (share ** (np.arange(n) % sizes))[:, None, None]
    return (at * np.array([[1, 1, 1], [1.2, 1, 1], [1, 1.2, 1]])).astype(np.float32)


SHAPES = {
    "soup": lambda rng: random_triangles(rng, 5000, 0.02),
    "identical": lambda rng: np.repeat(random_triangles(rng, 1, 0.5), 1000, 0),
    "same centroid": lambda rng: np.concatenate(
        [s * np.array([[[1, 0, 0], [0, 1, 0], [-1, -1, 0]]]) for s in np.linspace(0.1, 9, 500)]
    ).astype(np.float32),
    "points": lambda rng: np.repeat(rng.random((700, 1, 3)), 3, 1).astype(np.float32),
    "one line": lambda rng: (rng.random((300, 3, 1)) * [1, 2, 3]).astype(np.float32),
    "geometric": lambda rng: geometric(20000),
    "deep": lambda rng: geometric(2000, 0.6, 200),
    "far away": lambda rng: random_triangles(rng, 3000, 0.02) + np.float32(1e6),
    "huge": lambda rng: random_triangles(rng, 3000, 0.02) * np.float32(1e11),
    "tiny": lambda rng: random_triangles(rng, 3000, 0.02) * np.float32(1e-12),
}


@rotating("shape, quality", tuple(SHAPES), QUALITIES)
def test_binary_tree_holds_everything_once(device, shape, quality):
    triangles = SHAPES[shape](np.random.default_rng(3))
    tree = bvh.build(device, *mesh(triangles), layout="binary", quality=quality)
    nodes = read(device, tree.buffers["nodes"], np.float32).reshape(-1, 2, 4)
    words = nodes.view(np.uint32)
    prims = read(device, tree.buffers["leaves"], np.uint32).reshape(-1, 16)[:, 12]
    level, seen, deepest = [0], [], 0
    while level:
        link, count = words[level, 0, 3], words[level, 1, 3]
        leaf = link >= LEAF
        for i in np.nonzero(leaf)[0]:
            below = prims[link[i] - LEAF : link[i] - LEAF + count[i]]
            assert len(below) <= 4
            seen.append(below)
            assert (triangles[below].min((0, 1)) >= nodes[level[i], 0, :3]).all()
            assert (triangles[below].max((0, 1)) <= nodes[level[i], 1, :3]).all()
        inner = link[~leaf]
        parents = nodes[np.array(level)[~leaf]]
        for child in (inner, inner + 1):
            assert (nodes[child, 0, :3] >= parents[:, 0, :3]).all()
            assert (nodes[child, 1, :3] <= parents[:, 1, :3]).all()
        level = [*inner, *(inner + 1)]
        deepest += bool(level)
    np.testing.assert_array_equal(np.sort(np.concatenate(seen)), np.arange(len(triangles)))
    assert deepest <= DEPTH


@pytest.fixture
def reinserting(monkeypatch):
    """Small trees have their nodes reinserted too."""
    monkeypatch.setattr(layouts, "REINSERT_LIMIT", 1)


@rotating("shape, quality", tuple(SHAPES), QUALITIES, turn=1)
def test_wide_tree_holds_everything_once(device, shape, quality, reinserting):
    triangles = SHAPES[shape](np.random.default_rng(3))
    tree = bvh.build(device, *mesh(triangles), layout="wide8", quality=quality)
    nodes = read(device, tree.buffers["nodes"], np.float32).reshape(-1, 8, 8)
    words = nodes.view(np.uint32)[:, 6]
    blocks = read(device, tree.buffers["leaves"], np.float32).reshape(-1, 11, 8)
    prims = blocks[:, 9].view(np.uint32)
    used = nodes[:, 0] <= nodes[:, 1]  # empty slots are inside out
    leaf = used & (words >= LEAF)
    np.testing.assert_array_equal(np.sort(words[leaf] - LEAF), np.arange(len(blocks)))
    np.testing.assert_array_equal(np.sort(words[used & ~leaf]), np.arange(1, len(nodes)))
    np.testing.assert_array_equal(np.sort(prims[prims != MISS]), np.arange(len(triangles)))
    node, slot = np.nonzero(leaf)
    for axis in range(3):
        corners = triangles[np.where(prims == MISS, prims[:, :1], prims), :, axis]
        corners = corners[words[node, slot] - LEAF]
        assert (corners.min((1, 2)) >= nodes[node, 2 * axis, slot]).all()
        assert (corners.max((1, 2)) <= nodes[node, 2 * axis + 1, slot]).all()
    assert tree.stats["depth"] < LEVELS
    assert tree.bytes == nodes.nbytes + blocks.nbytes


@pytest.mark.parametrize("spread", [1.0, 2.0])
def test_reinsertion_makes_a_tree_cheaper(device, trace, monkeypatch, spread):
    """Sizes are lognormal: large triangles among small ones are what a plane divides badly."""
    if not device.info.is_cpu:
        pytest.skip("only trees by planes have nodes reinserted")
    rng = np.random.default_rng(5)
    triangles = random_triangles(rng, 5000, 0.02 * rng.lognormal(0.0, spread, (5000, 1, 1)))
    ends = np.zeros((2000, 1)), np.full((2000, 1), np.inf)
    rays = np.concatenate([rng.random((2000, 3)), ends[0], rng.normal(0, 1, (2000, 3)), ends[1]], 1)
    costs, hits = [], []
    for limit in (len(triangles) + 1, len(triangles)):
        monkeypatch.setattr(layouts, "REINSERT_LIMIT", limit)
        tree = bvh.build(device, *mesh(triangles), layout="wide8")
        costs.append(tree.stats["cost"])
        hits.append(trace(tree, rays.astype(np.float32)))
    np.testing.assert_array_equal(hits[0][0], hits[1][0])
    np.testing.assert_array_equal(hits[0][1], hits[1][1])
    assert 0.5 < costs[1] / costs[0] < 0.97


@pytest.mark.parametrize("quality", QUALITIES)
@pytest.mark.parametrize("layout", bvh.TREES)
def test_builds_are_repeatable(device, layout, quality, reinserting):
    triangles = random_triangles(np.random.default_rng(4), 3000, 0.02)
    builds = [bvh.build(device, *mesh(triangles), layout=layout, quality=quality) for _ in range(2)]
    first, second = (read(device, tree.buffers["leaves"], np.uint32) for tree in builds)
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("layout", bvh.TREES)
def test_qualities_meet_the_same_triangles(device, trace, layout):
    """Their costs for a random line differ, but not by much."""
    rng = np.random.default_rng(9)
    triangles = random_triangles(rng, 20000, 0.01)
    ends = np.zeros((3000, 1)), np.full((3000, 1), np.inf)
    rays = np.concatenate([rng.random((3000, 3)), ends[0], rng.normal(0, 1, (3000, 3)), ends[1]], 1)
    trees = [bvh.build(device, *mesh(triangles), layout=layout, quality=q) for q in QUALITIES]
    (high, met), (fast, met_too) = (trace(tree, rays.astype(np.float32)) for tree in trees)
    np.testing.assert_array_equal(high["prim"], fast["prim"])
    np.testing.assert_array_equal(met, met_too)
    assert 0.3 < (high["prim"] != MISS).mean() < 0.6
    if "cost" in trees[0].stats:
        assert trees[1].stats["cost"] < 1.3 * trees[0].stats["cost"]


@pytest.mark.parametrize("quality", QUALITIES)
def test_what_is_not_finite_on_the_device_is_not_met(device, trace, quality, reinserting):
    """Buffers are not checked: triangles without a place must not spoil those that have one."""
    triangles = random_triangles(np.random.default_rng(10), 3000, 0.02)
    for value, at in zip((np.nan, np.inf, -np.inf, 1e30), range(4), strict=True):
        triangles[at::7] = value
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    vertices, faces = (cl.Buffer(device.context, flags, hostbuf=a) for a in mesh(triangles))
    tree = bvh.build(device, vertices, faces, layout="wide8", quality=quality)
    sound = triangles[5::7]
    o = sound.mean(1) - np.cross(sound[:, 1] - sound[:, 0], sound[:, 2] - sound[:, 0])
    limits = np.zeros((len(o), 1)), np.full((len(o), 1), np.inf)
    rays = np.concatenate([o, limits[0], sound.mean(1) - o, limits[1]], 1).astype(np.float32)
    hits, _ = trace(tree, rays)
    assert (hits["prim"] != MISS).all()
    assert not np.isin(hits["prim"] % 7, range(4)).any()


@pytest.mark.parametrize(("layout", "lanes"), LAYOUTS)
def test_no_triangles(device, trace, layout, lanes):
    tree = bvh.build(device, np.zeros((0, 3)), np.zeros((0, 3), np.uint32), layout=layout)
    assert tree.count == 0
    rays = np.concatenate([ray((0, 0, -1), (0, 0, 1)), ray((0, 0, 0), (0, 0, 1))])
    hits, occluded = trace(tree, rays, lanes)
    assert (hits["prim"] == MISS).all() and not occluded.any()


@pytest.mark.parametrize(("layout", "lanes"), LAYOUTS)
def test_triangles_without_area_are_not_hit(device, trace, layout, lanes):
    rng = np.random.default_rng(5)
    points = rng.random((700, 3)).astype(np.float32)
    doubled = np.stack([points, points, rng.random((700, 3))], 1)  # two corners are one
    triangles = np.concatenate([np.repeat(points[:, None], 3, 1), doubled]).astype(np.float32)
    o = rng.normal(0, 2, (500, 3))
    d = triangles[rng.integers(0, len(triangles), 500), 0] - o
    rays = np.concatenate([o, np.zeros((500, 1)), d, np.full((500, 1), np.inf)], 1)
    hits, _ = trace(bvh.build(device, *mesh(triangles), layout=layout), rays, lanes)
    assert (hits["prim"] == MISS).all()


def test_indices_and_coordinates_are_checked(device):
    triangles, faces = np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.uint32)
    for bad in (np.nan, np.inf, 1e13):
        with pytest.raises(SceneError, match="not finite"):
            bvh.build(device, np.full((3, 3), bad), faces)
    with pytest.raises(SceneError, match="vertex 3 of 3"):
        bvh.build(device, triangles, faces + 1)
    with pytest.raises(SceneError, match="high or fast"):
        bvh.build(device, triangles, faces, quality="low")
    with pytest.raises(SceneError, match="tags"):
        bvh.build(device, triangles, faces, np.zeros(2, np.uint32))
    with pytest.raises(SceneError, match="not finite"):
        bvh.build_boxes(device, np.full((1, 2, 3), np.nan))


@pytest.mark.parametrize("quality", QUALITIES)
@pytest.mark.parametrize("layout", bvh.TREES)
def test_memory_of_a_build(device, monkeypatch, layout, quality):
    """All that is allocated at the same time is within what `build` says."""
    sizes, most, create = [], [0], dev.Buffers._create

    def noted(buffers, what, nbytes, advice, host):
        sizes.append(nbytes)
        buffer = create(buffers, what, nbytes, advice, host)
        most.append(buffers.used)
        return buffer

    monkeypatch.setattr(dev.Buffers, "_create", noted)
    sphere = trimesh.creation.icosphere(5)
    n, flags = len(sphere.faces), cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    arrays = np.float32(sphere.vertices), np.uint32(sphere.faces), np.zeros(n, np.uint32)
    source = [cl.Buffer(device.context, flags, hostbuf=array) for array in arrays]
    bvh.build(device, *source, layout=layout, quality=quality)
    assert max(most) < 270 * n + (1 << 18)
    assert max(sizes) <= (64 if device.info.is_cpu else 80) * n  # blocks


def test_a_buffer_beyond_the_device_is_refused(device):
    small = dev.Device(
        device.context, device.queue, dataclasses.replace(device.info, max_alloc=100_000)
    )
    triangles = random_triangles(np.random.default_rng(6), 5000, 0.02)
    with pytest.raises(MemoryBudgetError):
        bvh.build(small, *mesh(triangles), layout="wide8")


def test_buffers_are_taken_as_they_are(device, trace):
    triangles = random_triangles(np.random.default_rng(7), 100, 0.1)
    flags = cl.mem_flags.READ_ONLY | cl.mem_flags.COPY_HOST_PTR
    vertices, faces = (cl.Buffer(device.context, flags, hostbuf=a) for a in mesh(triangles))
    tags = cl.Buffer(device.context, flags, hostbuf=np.arange(100, dtype=np.uint32))
    tree = bvh.build(device, vertices, faces, tags, layout="wide8")
    centre = triangles[31].mean(0)
    hits, _ = trace(tree, ray(centre - [0, 0, 9], (0, 0, 1)))
    assert tree.count == 100 and hits["tag"][0] == hits["prim"][0] != MISS


def test_layouts_are_chosen_by_size_and_device(device):
    assert bvh.choose_layout(device, 4) == "brute"
    assert bvh.choose_layout(device, 10**6) == bvh.choose_tree(device)
    for kind, vendor, layout in (
        ("cpu", "AMD", "wide8"),
        ("gpu", "NVIDIA Corporation", "wide8"),
        ("gpu", "Advanced Micro Devices, Inc.", "compact"),
        ("accelerator", "Intel(R) Corporation", "compact"),
    ):
        info = dataclasses.replace(device.info, kind=kind, vendor=vendor)
        assert bvh.choose_tree(dev.Device(device.context, device.queue, info)) == layout
    sphere = trimesh.creation.icosphere(2)
    built = bvh.build(device, sphere.vertices, sphere.faces)
    assert built.layout == bvh.choose_layout(device, len(sphere.faces))


@pytest.mark.parametrize("count", [1, 2, 9, 300])
def test_wide_tree_over_boxes(device, count):
    """Each box is in a leaf of its own, inside of all that stands above it."""
    rng = np.random.default_rng(count)
    low = rng.random((count, 3)).astype(np.float32)
    boxes = np.stack([low, low + 0.3 * rng.random((count, 3)).astype(np.float32)], 1)
    tree = bvh.build_boxes(device, boxes, "wide8")
    indices, nodes = (read(device, tree.buffers[name], np.uint32) for name in ("indices", "nodes"))
    indices = indices[:count]
    assert sorted(indices) == list(range(count))
    nodes = nodes.view(np.float32).reshape(-1, 8, 8)
    met, waiting = [], [(0, np.full(3, -np.inf), np.full(3, np.inf))]
    while waiting:
        at, above, below = waiting.pop()
        for slot in range(8):
            low, high = nodes[at, [0, 2, 4], slot], nodes[at, [1, 3, 5], slot]
            if (low > high).any():
                continue
            assert (low >= above).all() and (high <= below).all()
            word = int(nodes[at, 6, slot : slot + 1].view(np.uint32)[0])
            if word < LEAF:
                waiting.append((word, low, high))
                continue
            box = boxes[indices[word - LEAF]]
            assert (low <= box[0]).all() and (high >= box[1]).all()
            met.append(word - LEAF)
    assert sorted(met) == list(range(count))
