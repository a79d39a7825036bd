"""Trees from the leaves up, for devices with many work-items: kernels/bvh/clusters.cl."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pyopencl as cl

from . import curve
from .building import Building

_ROOT = "bvh/clusters.cl"
_ROUNDS = 128  # CLUSTERS_ROUNDS of the kernels
_AT_ONCE = 8  # rounds; then the host reads how many clusters are left

Steps = tuple[tuple[int, int], ...]  # (begin, count) of nodes, each after the nodes below them


def united(
    building: Building, count: int, items: cl.Buffer, extents: cl.Buffer, radius: int
) -> tuple[cl.Buffer, Steps]:
    """Unite items to a root; return the nodes, and the steps of the rounds and of the root.

    extents: of the scene; radius: see `clpt.bvh.tree.upward`. Wait for the number of rounds.
    """
    keys = curve.sorted_keys(building, count, items, extents)
    rows, spare, nodes = (building.allocate(size * count) for size in (32, 32, 64))
    levels, tile = building.allocate(8 * (_ROUNDS + 1)), building.grain.tile
    building.stream.fill(levels, 0, 0, levels.size)
    begin = {"items": items, "keys": keys, "extents": extents, "nodes": nodes, "levels": levels}
    building.run_each(_ROOT, "clusters_begin", count, clusters=rows, **begin)
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
                _ROOT, "clusters_find", left, clusters=rows, radius=radius, **at, **near
            )
            counted = {"sums": tree["sums"], **tiled, **near, **at}
            building.run_tiles(_ROOT, "clusters_count", tiles, **counted)
            building.sums_before(numbers, 2 * tiles)
            moved = {"clusters": rows, "next": spare, **tiled, **at}
            building.run_tiles(_ROOT, "clusters_round", tiles, **moved, **tree)
            rows, spare, number = spare, rows, number + 1
        left = int(building.read(levels, 2 * number + 1, np.uint32)[-1])
    final = {"clusters": rows, "next": spare, "round": number, "radius": radius}
    building.run_tiles(_ROOT, "clusters_finish", 1, **final, **tree)
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
            _ROOT, "clusters_order", size, begin=begin, items=items, ordered=into, **tree
        )
    return into, positions
