"""The binary tree of all layouts, built on the device by kernels/bvh/build.cl.

For fast builds kernels/bvh/curve.cl cuts leaves from a space-filling curve. kernels/bvh/collapse.cl
collapses a tree to 8-wide nodes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pyopencl as cl

from ..records import TREE_SIZES
from . import curve
from .building import Building

_BUILD, _PACK, _REINSERT = "bvh/build.cl", "bvh/pack.cl", "bvh/reinsert.cl"
_COLLAPSE = "bvh/collapse.cl"
_NUMBERS = "bvh/collapse.cl#levels"
_DEPTH, _LEVELS = TREE_SIZES["depth"], TREE_SIZES["levels"]
_SUBTREES = 64  # of a compute unit, for an even load
_CPU_UNITS = 16  # of any CPU: the tree depends on this number by the order of reinsertion
_PASSES = 4  # of reinsertion; each further pass costs a build 2 % and saves rays less


@dataclass(frozen=True)
class Tree:
    """A binary tree over items.

    items: float8, in the order of the leaves; nodes: 2 count float8; extents: of the root first;
    steps: (begin, count) of each launch of a kernel, from the leaves up, of nodes or, if there is
    a heap of ranges, of its members; ranges: the heap of the top levels, whose leaves are subtrees;
    firsts: the first item of each node, if `collapse` chooses leaves of at most `leaf_size` items.
    """

    count: int
    items: cl.Buffer
    nodes: cl.Buffer
    extents: cl.Buffer
    steps: tuple[tuple[int, int], ...]
    ranges: cl.Buffer | None = None
    firsts: cl.Buffer | None = None
    leaf_size: int = 0

    @property
    def heap(self) -> tuple[cl.Buffer, int]:
        """The heap of ranges, and the number of its levels."""
        if self.ranges is None:
            raise ValueError("a tree from the leaves up has no ranges")
        return self.ranges, len(self.steps) - 1

    def reach(self, building: Building) -> float:
        """Wait and return the largest coordinate of all items."""
        bounds = building.read(self.extents, 8, np.float32)
        return float(np.abs(bounds[[0, 1, 2, 4, 5, 6]]).max())


def items_of_triangles(
    building: Building, count: int, vertices: cl.Buffer, faces: cl.Buffer
) -> tuple[cl.Buffer, cl.Buffer]:
    """Return the triangles' boxes in the caller's order, and their bounds in parts for `over`."""
    return _items(building, "items_of_triangles", count, vertices=vertices, faces=faces)


def items_of_boxes(building: Building, count: int, boxes: cl.Buffer) -> tuple[cl.Buffer, cl.Buffer]:
    """Return boxes with a low and a high corner as items, and their bounds in parts."""
    return _items(building, "items_of_boxes", count, boxes=boxes)


def _items(
    building: Building, kernel: str, count: int, **source: cl.Buffer
) -> tuple[cl.Buffer, cl.Buffer]:
    run = building.grain.stretch
    n_parts = -(-count // run)
    items, parts = building.allocate(32 * count), building.allocate(64 * n_parts)
    building.run_stretches(
        _PACK, kernel, n_parts, count=count, run=run, items=items, extents=parts, **source
    )
    return items, building.few_extents(parts)


def over(
    building: Building,
    count: int,
    items: cl.Buffer,
    parts: cl.Buffer,
    leaf_size: int,
    at_once: int = 1,
    depth: int = _DEPTH,
) -> Tree:
    """Build over items by the surface area heuristic; items move to the order of the leaves.

    leaf_size: the most items of a leaf; at_once: items that a traversal tests at once, a power of
    two; depth: the most levels below the root, enough for a balanced tree.
    """
    cut = {"leaf_size": leaf_size, "at_once": at_once.bit_length() - 1, "runs": 0, "depth": depth}
    return _divided(building, count, items, parts, cut)


def reinserted(building: Building, tree: Tree) -> Tree:
    """Reinsert large nodes where the sum of areas is least.

    The result shares all buffers except `ranges`. It is for kernels/bvh/collapse.cl: an inner
    node's count is the number of levels below it.
    """
    heap, levels = tree.heap
    subtrees = 1 << levels
    begin = subtrees - 1
    parents, targets = (building.allocate(size * tree.count) for size in (4, 8))
    ends, areas = (building.allocate(size * subtrees) for size in (4, 8))
    ranges = building.allocate(heap.size)
    building.stream.copy(ranges, heap)
    shared = {"nodes": tree.nodes, "ranges": heap, "begin": begin, "parents": parents}
    moves = {**shared, "ends": ends, "targets": targets}
    building.run(_REINSERT, "reinsert_subtree", subtrees, ends=ends, areas=areas, **shared)
    building.run(_REINSERT, "reinsert_top", 1, areas=areas, **shared)
    for _ in range(_PASSES):
        building.run(_REINSERT, "reinsert_find", 2 * subtrees - 1, areas=areas, **moves)
        building.run(_REINSERT, "reinsert_all", 1, **moves)
    building.run(_REINSERT, "reinsert_ranges", 1, nodes=tree.nodes, ranges=ranges, begin=begin)
    return replace(tree, ranges=ranges)


def over_runs(
    building: Building, count: int, items: cl.Buffer, parts: cl.Buffer, leaf_size: int
) -> Tree:
    """Build like `over`, with runs of a space-filling curve as leaves."""
    n, ordered, leaves, parts = curve.runs(building, count, items, parts, leaf_size)
    cut = {"leaf_size": 1, "at_once": 0, "runs": 1, "depth": _DEPTH}
    tree = _divided(building, n, leaves, parts, cut)
    return replace(tree, items=ordered)


def _divided(
    building: Building, count: int, items: cl.Buffer, parts: cl.Buffer, cut: dict[str, int]
) -> Tree:
    """Build over items; cut: the arguments of kernels/bvh/build.cl for splits."""
    info = building.device.info
    wanted = _SUBTREES * (_CPU_UNITS if info.is_cpu else info.compute_units)
    levels = int(math.log2(max(1, min(wanted, count // cut["leaf_size"]))))
    ranges = building.allocate(16 * (2 << levels))
    extents = building.allocate(64 * (2 << levels))
    nodes = building.allocate(64 * count)
    heap = {"ranges": ranges, "extents": extents}
    root = {"parts": parts, "n_parts": parts.size // 64, "count": count}
    building.run(_BUILD, "build_root", 1, **root, **heap)
    shared = {"items": items, "nodes": nodes, **cut, **heap}
    for level in range(levels):
        building.run(_BUILD, "build_level", 1 << level, begin=(1 << level) - 1, **shared)
    building.run(_BUILD, "build_subtree", 1 << levels, begin=(1 << levels) - 1, **shared)
    steps = tuple(((1 << level) - 1, 1 << level) for level in reversed(range(levels + 1)))
    return Tree(count, items, nodes, extents, steps, ranges)


def upward(
    building: Building,
    count: int,
    items: cl.Buffer,
    parts: cl.Buffer,
    leaf_size: int,
    radius: int,
    *,
    collapses: bool,
) -> Tree:
    """Build from the leaves up: many work-items are busy in every step.

    leaf_size: the most items of a leaf; collapses: whether `collapse` chooses the leaves; radius:
    neighbours on each side of a cluster, in the order of a space-filling curve, that it may unite
    with.
    """
    extents = curve.whole(building, count, parts)
    nodes, steps = curve.united(building, count, items, extents, radius)
    least = 1 if collapses else leaf_size
    ordered, firsts = curve.ordered(building, count, items, nodes, steps, least)
    return Tree(count, ordered, nodes, extents, steps, firsts=firsts, leaf_size=leaf_size)


@dataclass(frozen=True)
class Collapse:
    """The binary nodes that become wide nodes and leaves, on the device.

    costs, occlusion: of the binary nodes; roots: binary nodes that become wide nodes; firsts: a
    wide node's first child and first leaf; leaf_roots: binary nodes that become wide leaves;
    totals: the numbers of both, and the wide tree's figures.
    """

    built: Tree
    costs: cl.Buffer
    occlusion: cl.Buffer
    roots: cl.Buffer
    firsts: cl.Buffer
    leaf_roots: cl.Buffer
    totals: cl.Buffer


@dataclass(frozen=True)
class Figures:
    """The numbers of a wide tree's nodes and leaves.

    steps: (begin, count) of the nodes of each level, the lowest first; stats: see `Bvh`.
    """

    nodes: int
    leaves: int
    steps: tuple[tuple[int, int], ...]
    stats: dict[str, float]


def collapse(building: Building, built: Tree) -> Collapse:
    """Enqueue the choice and numbering of wide nodes; the host does not wait."""
    n = built.count
    costs, occlusion = building.allocate(64 * n), building.allocate(8 * n)
    below = {"nodes": built.nodes, "items": built.items, "costs": costs, "occlusion": occlusion}
    for i, (begin, size) in enumerate(built.steps):
        if built.ranges is None:
            few = {"leaf_size": built.leaf_size}
            building.run_each(_COLLAPSE, "collapse_pairs", size, begin=begin, **few, **below)
        else:
            kernel = "collapse_level" if i else "collapse_subtree"
            building.run(_COLLAPSE, kernel, size, begin=begin, ranges=built.ranges, **below)

    roots, firsts = building.allocate(4 * n), building.allocate(8 * n)
    leaf_roots, totals = building.allocate(4 * n), building.allocate(4 * (4 + _DEPTH))
    numbers = {"roots": roots, "firsts": firsts, "leaf_roots": leaf_roots, "totals": totals}
    chosen = Collapse(built, costs, occlusion, roots, firsts, leaf_roots, totals)
    if built.ranges is None:
        _number_levels(building, chosen)
    else:
        binary = {"nodes": built.nodes, "costs": costs, "count": 2 * n}
        building.run(_COLLAPSE, "collapse_number", 1, **binary, **numbers)
    return chosen


def _number_levels(building: Building, chosen: Collapse) -> None:
    """Number wide nodes and leaves, a level at a time; wait for the size of each level."""
    built, costs = chosen.built, chosen.costs
    starts, sizes = _levels(building, chosen)
    if len(starts) > _LEVELS:
        building.run_each(_NUMBERS, "collapse_evenly", 2 * built.count, costs=costs)
        starts, sizes = _levels(building, chosen)
    size = building.read(built.nodes, 8, np.float32).astype(float)
    x, y, z = size[4:7] - size[:3]
    area = x * y + y * z + z * x
    cost = float(building.read(costs, 1, np.float32)[0]) / area if area > 0 else 0.0
    words = np.zeros(4 + _DEPTH, np.uint32)
    words[:3] = *sizes, len(starts)
    words[3:4].view(np.float32)[0] = cost
    words[4 : 4 + len(starts)] = starts
    building.stream.write(chosen.totals, words)


def _levels(building: Building, chosen: Collapse) -> tuple[list[int], tuple[int, int]]:
    """Number wide nodes and leaves; return the first node of each level, and both totals."""
    tile = building.grain.tile
    numbers = building.allocate(8 * -(-chosen.built.count // tile) + 4)
    building.stream.fill(chosen.roots, 0, 0, 4)
    built, tree = chosen.built, {"firsts": chosen.firsts, "leaf_roots": chosen.leaf_roots}
    binary = {"nodes": built.nodes, "leaf_size": built.leaf_size}
    binary |= {"costs": chosen.costs, "roots": chosen.roots}
    tree["positions"] = built.firsts
    starts, begin, end, n_leaves = [], 0, 1, 0
    while begin < end:
        starts.append(begin)
        tiles = -(-(end - begin) // tile)
        level = {"begin": begin, "end": end, "tile": tile, "tiles": tiles, "numbers": numbers}
        level["sums"] = building.local(2)
        building.run_tiles(_NUMBERS, "collapse_count", tiles, **binary, **level)
        building.sums_before(numbers, 2 * tiles)
        first = {"first": (end, n_leaves)}
        building.run_tiles(_NUMBERS, "collapse_place", tiles, **first, **tree, **binary, **level)
        sums = building.read(numbers, 2 * tiles + 1, np.uint32)
        below, leaves = int(sums[tiles]), int(sums[-1] - sums[tiles])
        begin, end, n_leaves = end, end + below, n_leaves + leaves
    return starts, (end, n_leaves)


def figures(building: Building, chosen: Collapse) -> Figures:
    """Wait and return the figures of a wide tree."""
    words = building.read(chosen.totals, 4 + _DEPTH, np.uint32)
    n_nodes, n_leaves, levels = words[:3].tolist()
    starts = [*words[4 : 4 + levels].tolist(), n_nodes]
    steps = tuple((begin, end - begin) for begin, end in pairwise(starts))[::-1]
    cost = float(words[3:].view(np.float32)[0])
    stats = {"nodes": n_nodes, "leaves": n_leaves, "depth": levels - 1, "cost": cost}
    return Figures(n_nodes, n_leaves, steps, stats)


def write_nodes(building: Building, chosen: Collapse, nodes: cl.Buffer) -> None:
    """Enqueue writing of all wide nodes, or as many as the buffer holds."""
    building.run_each(
        _COLLAPSE, "collapse_nodes", nodes.size // 256, nodes=chosen.built.nodes,
        costs=chosen.costs, occlusion=chosen.occlusion, roots=chosen.roots, firsts=chosen.firsts,
        totals=chosen.totals, wide=nodes,
    )  # fmt: skip


def write_indices(building: Building, chosen: Collapse, indices: cl.Buffer) -> None:
    """Enqueue the boxes of leaves with a box each; binary leaves get these numbers."""
    built = chosen.built
    leaves = {"nodes": built.nodes, "items": built.items, "leaf_roots": chosen.leaf_roots}
    building.run_each(_COLLAPSE, "collapse_indices", built.count, indices=indices, **leaves)
