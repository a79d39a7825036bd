"""Items in the order of a space-filling curve: leaves cut from it, and trees from the leaves up.

See kernels/bvh/curve.cl, sort.cl and clusters.cl.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ..records import CURVE_KEYS
from .building import Building

_BUILD, _CURVE, _SORT = "bvh/build.cl", "bvh/curve.cl", "bvh/sort.cl"
_INDEX = CURVE_KEYS["index"]
_CLUSTERS = "bvh/clusters.cl"
_ROUNDS = 128  # CLUSTERS_ROUNDS of the kernels
_AT_ONCE = 8  # rounds; then the host reads how many clusters are left
_TILES = 4  # of a compute unit, if the sort has few

Steps: TypeAlias = tuple[tuple[int, int], ...]  # (begin, count) of nodes, the lowest first


def runs(
    building: Building, count: int, items: cl.Buffer, parts: cl.Buffer, leaf_size: int
) -> tuple[int, cl.Buffer, cl.Buffer, cl.Buffer]:
    """Cut items into leaves of at most `leaf_size` <= 8; wait for the number of leaves.

    Returns it, the items in the leaves' order, an item for each leaf, and their extents.
    """
    keys = sorted_keys(building, count, items, whole(building, count, parts))
    run = building.grain.stretch
    stretches = -(-count // run)
    ordered, lengths = building.allocate(32 * count), building.allocate(count)
    numbers = building.allocate(4 * (stretches + 1))
    curve = {"count": count, "run": run, "sorted": ordered, "lengths": lengths}
    cut = {"items": items, "keys": keys, "leaf_size": leaf_size, "numbers": numbers}
    building.run_stretches(_CURVE, "curve_cut", stretches, **curve, **cut)
    building.sums_before(numbers, stretches)
    n = int(building.read(numbers, stretches + 1, np.uint32)[-1])
    leaves, extents = building.allocate(32 * n), building.allocate(64 * stretches)
    output = {"numbers": numbers, "runs": leaves, "extents": extents}
    building.run_stretches(_CURVE, "curve_runs", stretches, **curve, **output)
    return n, ordered, leaves, building.few_extents(extents)


def whole(building: Building, count: int, parts: cl.Buffer) -> cl.Buffer:
    """Return the extent of all items. parts: the extents of groups of items."""
    extent, unused = building.allocate(64), building.allocate(16)
    root = {"parts": parts, "n_parts": parts.size // 64, "ranges": unused, "extents": extent}
    building.run(_BUILD, "build_root", 1, count=count, **root)
    return extent


def sorted_keys(building: Building, count: int, items: cl.Buffer, extents: cl.Buffer) -> cl.Buffer:
    """Return the items' keys in ascending order; extents: of all items."""
    grain, keys = building.grain, building.allocate(8 * count)
    span = building.read(extents, 16, np.float32)[8:]
    cells = _cells(span, grain.digit * grain.passes)
    cells["tables"] = building.upload(cells["tables"], np.uint64)
    building.run_each(_CURVE, "curve_keys", count, items=items, keys=keys, **cells)
    return sorted_by_digits(building, count, keys)


def sorted_by_digits(building: Building, count: int, keys: cl.Buffer) -> cl.Buffer:
    """Return keys in ascending order of all digits above the index; the others stay in order."""
    grain, others = building.grain, building.allocate(8 * count)
    tile = grain.keys or -(-count // (_TILES * building.device.info.compute_units))
    tiles = -(-count // tile)
    numbers = building.allocate(4 * ((tiles << grain.digit) + 1))
    counters = building.local(1 << grain.digit)
    tiled = {"count": count, "tile": tile, "tiles": tiles, "bits": grain.digit}
    tiled |= {"numbers": numbers, "counters": counters}
    for number in range(grain.passes):
        shift = {"shift": _INDEX + grain.digit * number}
        building.run_tiles(_SORT, "sort_count", tiles, keys=keys, **shift, **tiled)
        building.sums_before(numbers, tiles << grain.digit)
        building.run_tiles(_SORT, "sort_move", tiles, keys=keys, sorted=others, **shift, **tiled)
        keys, others = others, keys
    return keys


def united(
    building: Building, count: int, items: cl.Buffer, extents: cl.Buffer, radius: int
) -> tuple[cl.Buffer, Steps]:
    """Unite items to a root; return the nodes, and the steps of the rounds and of the root.

    extents: of the scene; radius: see `clpt.bvh.tree.upward`. Wait for the number of rounds.
    """
    keys = sorted_keys(building, count, items, extents)
    rows, spare, nodes = (building.allocate(size * count) for size in (32, 32, 64))
    levels, tile = building.allocate(8 * (_ROUNDS + 1)), building.grain.tile
    building.stream.fill(levels, 0, 0, levels.size)
    begin = {"items": items, "keys": keys, "extents": extents, "nodes": nodes, "levels": levels}
    building.run_each(_CLUSTERS, "clusters_begin", count, clusters=rows, **begin)
    nearest, counts = building.allocate(4 * count), building.allocate(4 * count)
    numbers = building.allocate(8 * -(-count // tile) + 4)
    near = {"levels": levels, "nearest": nearest}
    tree = {"nodes": nodes, "counts": counts, "sums": building.local(2), **near}
    left, number = count, 0
    while left > tile and number < _ROUNDS:
        tiles = -(-left // tile)
        tiled = {"tile": tile, "tiles": tiles, "numbers": numbers}
        for _ in range(_AT_ONCE):
            at = {"round": number}
            building.run_each(
                _CLUSTERS, "clusters_find", left, clusters=rows, radius=radius, **at, **near
            )
            counted = {"sums": tree["sums"], **tiled, **near, **at}
            building.run_tiles(_CLUSTERS, "clusters_count", tiles, **counted)
            building.sums_before(numbers, 2 * tiles)
            moved = {"clusters": rows, "next": spare, **tiled, **at}
            building.run_tiles(_CLUSTERS, "clusters_round", tiles, **moved, **tree)
            rows, spare, number = spare, rows, number + 1
        left = int(building.read(levels, 2 * number + 1, np.uint32)[-1])
    final = {"clusters": rows, "next": spare, "round": number, "radius": radius}
    building.run_tiles(_CLUSTERS, "clusters_finish", 1, **final, **tree)
    sizes = building.read(levels, 2 * (_ROUNDS + 1), np.uint32)[::2].tolist()
    pairs = ((2 * after, 2 * (before - after)) for before, after in pairwise(sizes) if after)
    return nodes, (*(pair for pair in pairs if pair[1]), (0, 1))


def ordered(
    building: Building,
    count: int,
    items: cl.Buffer,
    nodes: cl.Buffer,
    steps: Steps,
    leaf_size: int,
) -> tuple[cl.Buffer, cl.Buffer]:
    """Return items in the order of the leaves, and the first item of each node.

    Nodes with at most `leaf_size` items become leaves.
    """
    into, positions = building.allocate(32 * count), building.allocate(8 * count)
    tree = {"nodes": nodes, "positions": positions, "leaf_size": leaf_size}
    for begin, size in reversed(steps):
        building.run_each(
            _CLUSTERS, "clusters_order", size, begin=begin, items=items, ordered=into, **tree
        )
    return into, positions


def _cells(span: NDArray[np.float32], code: int) -> dict[str, Any]:
    """Return the arguments of `curve_keys`, which encodes doubled centroids.

    span: low corner and negated high corner of the doubled centroids, (8,); code: its bits. Each
    step halves a cell's longest side; the first step is the code's highest bit (Vinkler, Bittner
    and Havran 2017, "Extended Morton codes").
    """
    low = span[:3].astype(float)
    size = np.maximum(-span[4:7].astype(float) - low, 0.0)
    left, bits = size.copy(), np.zeros(3, int)
    tables = np.zeros((3, 2, 256), np.uint64)
    halved = []
    for _ in range(code):
        axis = int(np.argmax(np.where(bits < 16, left, -1.0)))
        left[axis] /= 2
        bits[axis] += 1
        halved.append((axis, bits[axis]))
    for position, (axis, nth) in enumerate(reversed(halved)):
        byte, bit = divmod(int(bits[axis] - nth), 8)
        tables[axis, byte] |= (np.arange(256, dtype=np.uint64) >> bit & 1) << position
    scale = 0.999999 * 2.0**bits / np.maximum(size, 1e-30)  # finite as a float32
    return {"low": (*low, 0.0), "scale": (*scale, 0.0), "tables": tables}
