"""Refitted trees against trees that are built anew, and vertices that are no numbers."""

import numpy as np
import pyopencl as cl
import pytest
import trimesh

from clpt import bvh
from clpt.testing.probe import contracts

MISS = 0xFFFFFFFF
LAYOUTS = [*bvh.LAYOUTS]
COUNT = 700


@pytest.fixture(scope="module")
def building(device) -> bvh.Building:
    return bvh.Building(device)


def mesh(triangles):
    n = len(triangles)
    return triangles.reshape(-1, 3), np.arange(3 * n, dtype=np.uint32).reshape(n, 3)


def triangles(rng, count=COUNT):
    size = 0.1 * rng.normal(0, 1, (count, 3, 3))
    return (rng.random((count, 1, 3)) + size).astype(np.float32)


def rays_at(rng, points):
    d = rng.normal(0, 1, points.shape)
    o = points - 3 * np.ptp(points, 0).max() * d
    ends = np.broadcast_to([[0.0, np.inf]], (len(points), 2))
    return np.concatenate([o, ends[:, :1], d, ends[:, 1:]], 1).astype(np.float32)


def on_device(device, array):
    return cl.Buffer(
        device.context, cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=array
    )


def content(device, tree):
    return {name: read(device, buffer).tobytes() for name, buffer in tree.buffers.items()}


def read(device, buffer, dtype=np.float32):
    array = np.empty(buffer.size // 4, dtype)
    cl.enqueue_copy(device.queue, array, buffer)
    return array


MOVES = {
    "a little": lambda rng, t: t + 0.01 * rng.normal(0, 1, t.shape),
    "mixed up": lambda rng, t: t[rng.permutation(len(t))],
    "far away": lambda rng, t: 1e5 + 1e-2 * t,
    "huge": lambda rng, t: 1e9 * t * rng.random((len(t), 1, 1)),
    "flat": lambda rng, t: t * [1, 0, 1],
}


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("move", MOVES)
def test_hits_are_those_of_a_new_tree(device, building, trace, layout, move):
    rng = np.random.default_rng(3)
    before = triangles(rng)
    after = MOVES[move](rng, before).astype(np.float32)
    rays = rays_at(rng, after.mean(1)[rng.integers(0, COUNT, 2000)])
    tree = bvh.build(device, *mesh(before), layout=layout)
    vertices, faces = mesh(after)
    bvh.refit(building, tree, on_device(device, vertices), on_device(device, faces))
    building.stream.wait()
    hits, occluded = trace(tree, rays)
    for other in (layout, "brute"):
        fresh, blocked = trace(bvh.build(device, vertices, faces, layout=other), rays)
        met = (hits["prim"] != MISS) & (fresh["prim"] != MISS)
        assert ((hits["prim"] != MISS) == (fresh["prim"] != MISS)).mean() > 0.999
        assert (occluded == blocked).mean() > 0.999
        near = np.ptp(rays[:, :3])
        np.testing.assert_allclose(hits["t"][met], fresh["t"][met], rtol=1e-3, atol=1e-4 * near)
        assert move == "flat" or met.mean() > 0.5


@pytest.mark.parametrize("layout", bvh.TREES)  # a host makes brute's records
def test_a_tree_that_did_not_move_is_the_same_to_the_bit(device, building, layout):
    rng = np.random.default_rng(4)
    vertices, faces = mesh(triangles(rng))
    vertices[::7] = 0.0  # trifles by which boxes are larger matter there
    tree = bvh.build(device, vertices, faces, layout=layout)
    before = content(device, tree)
    for points in (1e3 * vertices + 5, vertices):
        buffers = on_device(device, points.astype(np.float32)), on_device(device, faces)
        bvh.refit(building, tree, *buffers)
    building.stream.wait()
    assert content(device, tree) == before


@pytest.mark.parametrize("layout", LAYOUTS)
def test_what_is_no_number_is_met_by_nothing_and_may_come_back(device, building, trace, layout):
    rng = np.random.default_rng(5)
    good = triangles(rng)
    vertices, faces = mesh(good)
    tree = bvh.build(device, vertices, faces, layout=layout)
    before = content(device, tree)
    rays = rays_at(rng, good.mean(1))
    bad = vertices.copy().reshape(-1, 9)
    broken = np.arange(COUNT) % 3 > 0
    bad[broken, rng.integers(0, 9, broken.sum())] = rng.choice(
        [np.nan, np.inf, -np.inf, 1e13], broken.sum()
    )
    for points, left in ((bad, ~broken), (np.full_like(bad, np.nan), broken & ~broken)):
        bvh.refit(building, tree, on_device(device, points), on_device(device, faces))
        building.stream.wait()
        hits, occluded = trace(tree, rays)
        assert (occluded == (hits["prim"] != MISS)).all()
        assert left[hits["prim"][occluded]].all()
        if left.any():
            same = trace(bvh.build(device, vertices, faces[left], layout=layout), rays)[1]
            assert (occluded == same).mean() > 0.999
    bvh.refit(building, tree, on_device(device, vertices), on_device(device, faces))
    building.stream.wait()
    again = content(device, tree)
    if layout == "brute" and contracts(device):  # a host made the records, and rounds otherwise
        found, made = (np.frombuffer(c["tris"], np.float32) for c in (again, before))
        np.testing.assert_allclose(found, made, rtol=0, atol=1e-6)
    else:
        assert again == before


@pytest.mark.parametrize("layout", bvh.TREES)
def test_nothing_escapes_from_a_closed_surface_that_has_moved(device, building, trace, layout):
    rng = np.random.default_rng(8)
    sphere = trimesh.creation.icosphere(4)
    faces = sphere.faces.astype(np.uint32)
    bumpy = (sphere.vertices * rng.uniform(0.6, 3.0, (len(sphere.vertices), 1))).astype(np.float32)
    tree = bvh.build(device, sphere.vertices, faces, layout=layout)
    bvh.refit(building, tree, on_device(device, bumpy), on_device(device, faces))
    building.stream.wait()
    ends = bumpy[sphere.edges[rng.integers(0, len(sphere.edges), 100_000)]]
    along = rng.random((len(ends), 1)) * (rng.random((len(ends), 1)) > 0.2)
    d = ends[:, 0] + along * (ends[:, 1] - ends[:, 0])
    rays = np.zeros((len(d), 8), np.float32)
    rays[:, 4:7], rays[:, 7] = d, np.inf
    hits, occluded = trace(tree, rays)
    assert (hits["prim"] != MISS).all() and occluded.all()


@pytest.mark.parametrize("layout", bvh.TREES)
def test_one_of_several_trees_moves(device, building, layout):
    rng = np.random.default_rng(6)
    counts, tags = [300, 5, 200], np.zeros(505, np.uint32)
    vertices, faces = mesh(triangles(rng, 505))
    moved = vertices.copy()
    moved[900:] += rng.normal(0, 1, moved[900:].shape).astype(np.float32)
    tree, begins = bvh.build_parts(
        bvh.Building(device), vertices, faces, tags, bvh.Runs(counts), layout
    )
    before = content(device, tree)
    bvh.refit(building, tree, on_device(device, moved), on_device(device, faces), parts=[1, 2])
    building.stream.wait()
    after = content(device, tree)
    for name, begin in zip(("nodes", "leaves"), 32 * begins[1].astype(int), strict=True):
        assert before[name][:begin] == after[name][:begin]
        assert before[name][begin:] != after[name][begin:]
    bvh.refit(building, tree, on_device(device, vertices), on_device(device, faces))
    building.stream.wait()
    assert content(device, tree) == before


@pytest.mark.parametrize("layout", ["shapes_binary", "shapes_wide8", *bvh.TREES])
@pytest.mark.parametrize("count", [0, 1, 300])
def test_a_tree_over_boxes_follows_them(device, building, layout, count):
    """Every box is inside of all that stands above it, but for those that are none."""
    if not count and layout in ("wide8", "compact"):
        pytest.skip("no such tree")
    rng = np.random.default_rng(7)
    low = rng.random((2, count, 3))
    first, second = np.stack([low, low + 0.3 * rng.random((2, count, 3))], 2).astype(np.float32)
    second[::5, 1] = np.nan
    tree = bvh.build_boxes(device, first, layout)
    before = content(device, tree)
    if count:
        bvh.refit_boxes(building, tree, on_device(device, second))
        building.stream.wait()
        assert holds(device, tree, second) == set(range(count)) - set(range(0, count, 5))
        bvh.refit_boxes(building, tree, on_device(device, first))
    building.stream.wait()
    assert content(device, tree) == before
    if count:
        assert holds(device, tree, first) == set(range(count))


def holds(device, tree, boxes):
    """The boxes that are inside of their leaf and of all nodes above it."""
    indices = read(device, tree.buffers["indices"], np.uint32)
    rows = read(device, tree.buffers["nodes"])
    met, waiting = set(), [(0, np.full(3, -np.inf), np.full(3, np.inf))]
    while waiting:
        at, above, below = waiting.pop()
        for low, high, items, children in children_of(rows, at, tree.layout):
            low, high = np.maximum(low, above), np.minimum(high, below)
            waiting += [(child, low, high) for child in children]
            for item in indices[items]:
                box = boxes[item]
                if (low <= box[0]).all() and (high >= box[1]).all():
                    met.add(int(item))
    return met


def children_of(rows, at, layout):
    """Low, high corner, items and child nodes of what stands in a node."""
    if layout == "compact":
        yield from compact_children(rows, at)
    elif layout.endswith("wide8"):
        node = rows.reshape(-1, 8, 8)[at]
        for slot in np.flatnonzero(node[7]):
            word = int(node[6, slot].view(np.uint32))
            leaf = word >= 1 << 31
            items, children = ([word - (1 << 31)], []) if leaf else ([], [word])
            yield node[0:6:2, slot], node[1:6:2, slot], items, children
    else:
        node = rows.reshape(-1, 2, 4)[at]
        link, count = (int(word) for word in node[:, 3].view(np.uint32))
        leaf = link >= 1 << 31
        items = range(link - (1 << 31), link - (1 << 31) + count) if leaf else []
        yield node[0, :3], node[1, :3], list(items), [] if leaf else [link, link + 1]


def compact_children(rows, at):
    """The same of a compressed node, as kernels/bvh/compact.cl has it."""
    words = rows.view(np.uint32)[20 * at : 20 * at + 20]
    p, data = words[:3].view(np.float32).astype(np.float64), words.view(np.uint8)
    step, mask, child = 2.0 ** (data[12:15].astype(float) - 127), data[15], int(words[4])
    for slot, meta in enumerate(data[24:32].tolist()):
        low, high = (p + step * data[begin + slot : begin + slot + 24 : 8] for begin in (32, 56))
        children = [child] if mask >> slot & 1 else []
        child += len(children)
        assert not children or meta == 32 + 24 + slot
        first = int(words[5]) + (meta & 31)
        items = [first + i for i in range(3) if meta >> 5 + i & 1 and not children]
        if meta:
            yield low, high, items, children
