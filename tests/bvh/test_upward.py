"""Trees from the leaves up, as GPUs get them: the same contents and hits as trees by planes."""

import dataclasses

import numpy as np
import pytest

from clpt import bvh
from clpt import device as dev
from clpt.bvh import building, curve
from tests.bvh import test_build, test_refit
from tests.bvh.test_build import SHAPES, mesh, random_triangles, read
from tests.rotation import rotating

MISS = 0xFFFFFFFF


@pytest.fixture
def gpu(device) -> dev.Device:
    """The device as if it were a GPU."""
    info = dataclasses.replace(device.info, kind="gpu")
    return dev.Device(device.context, device.queue, info)


def some_rays(triangles, n=2000):
    """Rays toward triangles from anywhere around."""
    rng = np.random.default_rng(12)
    targets = triangles[rng.integers(0, len(triangles), n)].mean(1)
    d = rng.normal(0, 1, (n, 3))
    o = targets - 2 * np.ptp(triangles, (0, 1)).max() * d
    ends = np.zeros((n, 1)), np.full((n, 1), np.inf)
    return np.concatenate([o, ends[0], d, ends[1]], 1).astype(np.float32)


def same_hits(first, second, share=1.0, bits=1):
    """Distances are equal to some units of the last place.

    Among equally near triangles the order of tests decides. share: of the rays that hit the same
    triangle, at least.
    """
    np.testing.assert_allclose(first["t"], second["t"], rtol=1.2e-7 * bits)
    np.testing.assert_array_equal(first["prim"] == MISS, second["prim"] == MISS)
    assert (first["prim"] == second["prim"]).mean() >= share


@pytest.mark.parametrize("shape", SHAPES)
def test_it_holds_everything_once(gpu, shape):
    test_build.test_binary_tree_holds_everything_once(gpu, shape, "high")
    test_build.test_wide_tree_holds_everything_once(gpu, shape, "high", None)


@rotating("shape, layout, lanes", tuple(SHAPES), bvh.TREES, (1, 8))
def test_hits_are_those_of_planes(device, gpu, trace, shape, layout, lanes):
    triangles = SHAPES[shape](np.random.default_rng(3))
    rays = some_rays(triangles)
    trees = [bvh.build(on, *mesh(triangles), layout=layout) for on in (device, gpu)]
    (planes, blocked), (upward, occluded) = (trace(tree, rays, lanes) for tree in trees)
    if shape in ("one line", "far away"):  # triangles of no or hardly any area, hit by luck
        assert (planes["t"] == upward["t"]).mean() > 0.9
        return
    close = shape in ("identical", "same centroid", "geometric", "deep")
    same_hits(planes, upward, *((0.0, 4) if close else ()))
    np.testing.assert_array_equal(blocked, occluded)
    assert shape == "points" or (planes["prim"] != MISS).mean() > 0.1


@pytest.mark.parametrize("count", [1, 2, 9, 300])
def test_trees_over_boxes(gpu, count):
    """Of instances; trees over shapes are by planes everywhere."""
    test_build.test_wide_tree_over_boxes(gpu, count)
    for layout in ("wide8", "compact"):
        test_refit.test_a_tree_over_boxes_follows_them(gpu, building.Building(gpu), layout, count)


@pytest.mark.parametrize("count", [1, 2, 3, 7, 127, 128, 129, 511, 512, 513, 2047, 2049])
def test_any_number_of_triangles(device, gpu, trace, count):
    """Tiles, groups and rounds end at each of these numbers."""
    triangles = random_triangles(np.random.default_rng(count), count, 0.1)
    rays = some_rays(triangles, 500)
    for layout in ("wide8", "compact"):
        tree, fresh = (bvh.build(on, *mesh(triangles), layout=layout) for on in (gpu, device))
        same_hits(trace(tree, rays)[0], trace(fresh, rays)[0])


@pytest.mark.parametrize("group", [1, 16, 100])
@pytest.mark.parametrize("layout", bvh.TREES)
def test_groups_of_any_size_build_the_same_tree(gpu, trace, monkeypatch, layout, group):
    """Drivers limit groups; work-items share a tile otherwise, and nothing else changes."""
    triangles = random_triangles(np.random.default_rng(4), 5000, 0.02)
    rays, hits = some_rays(triangles), []
    for size in (building.MANY.group, group):
        monkeypatch.setattr(building, "MANY", dataclasses.replace(building.MANY, group=size))
        tree = bvh.build(gpu, *mesh(triangles), layout=layout)
        leaves = read(gpu, tree.buffers["leaves"], np.uint32)
        hits.append((*trace(tree, rays), leaves, tree.stats.get("cost")))
    for first, second in zip(*hits, strict=True):
        np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("grain", [building.FEW, building.MANY])
@pytest.mark.parametrize("count", [1, 5000, 70_000])
def test_keys_are_sorted(device, monkeypatch, grain, count):
    monkeypatch.setattr(building, "FEW", grain)
    work = bvh.Building(device)
    keys = np.random.default_rng(1).integers(0, 1 << 63, count, np.uint64)
    if count > 1:
        keys[::3] = keys[0]  # whose order stays
    keys = keys >> np.uint64(31) << np.uint64(31) | np.arange(count, dtype=np.uint64)
    mask = np.uint64((1 << (31 + grain.digit * grain.passes)) - 1)
    result = curve.sorted_by_digits(work, count, work.upload(keys & mask, np.uint64))
    np.testing.assert_array_equal(work.read(result, count, np.uint64), np.sort(keys & mask))


def test_more_triangles_than_a_group_has_tiles(device, gpu, trace):
    """200,000 triangles, of sizes that no plane divides well: hits, depth and cost."""
    rng = np.random.default_rng(5)
    sizes = 0.005 * rng.lognormal(0.0, 1.5, (200_000, 1, 1))
    triangles = random_triangles(rng, 200_000, sizes)
    tree, fresh = (bvh.build(on, *mesh(triangles), layout="wide8") for on in (gpu, device))
    rays = some_rays(triangles)
    same_hits(trace(tree, rays)[0], trace(fresh, rays)[0], share=0.999)
    assert tree.stats["depth"] < test_build.LEVELS
    assert tree.stats["cost"] < 1.1 * fresh.stats["cost"]  # whose nodes were reinserted


@pytest.mark.parametrize("quality", test_build.QUALITIES)
def test_what_is_not_finite_is_not_met(gpu, trace, quality):
    test_build.test_what_is_not_finite_on_the_device_is_not_met(gpu, trace, quality, None)


@pytest.mark.parametrize("layout", bvh.TREES)
def test_refits(gpu, trace, layout):
    work = bvh.Building(gpu)
    test_refit.test_hits_are_those_of_a_new_tree(gpu, work, trace, layout, "a little")
    test_refit.test_a_tree_that_did_not_move_is_the_same_to_the_bit(gpu, work, layout)
    test_refit.test_one_of_several_trees_moves(gpu, work, layout)


@pytest.mark.parametrize("layout", bvh.TREES)
def test_memory_of_a_build(gpu, monkeypatch, layout):
    test_build.test_memory_of_a_build(gpu, monkeypatch, layout, "high")
