"""The binary tree of all layouts, built on the device by kernels/bvh/build.cl."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pyopencl as cl

from ..records import TREE_SIZES
from . import curve
from .building import Building

_BUILD, _PACK, _REINSERT = "bvh/build.cl", "bvh/pack.cl", "bvh/reinsert.cl"
_DEPTH = TREE_SIZES["depth"]
_RUN = 2048  # items that a work-item bounds
_SUBTREES = 64  # of a compute unit, for an even load
_CPU_UNITS = 16  # of any CPU: the tree depends on this number by the order of reinsertion
_PASSES = 4  # of reinsertion; each further pass costs a build 2 % and saves rays less


@dataclass(frozen=True)
class Tree:
    """A binary tree over items.

    items: float8, in the order of the leaves; nodes: 2 count float8; ranges: a heap of the top
    `levels` levels, whose leaves are subtrees; extents: of the ranges.
    """

    count: int
    items: cl.Buffer
    nodes: cl.Buffer
    ranges: cl.Buffer
    extents: cl.Buffer
    levels: int

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
    n_parts = -(-count // _RUN)
    items, parts = building.allocate(32 * count), building.allocate(64 * n_parts)
    building.run(
        _PACK, kernel, n_parts, count=count, run=_RUN, items=items, extents=parts, **source
    )
    return items, parts


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
    subtrees = 1 << tree.levels
    begin = subtrees - 1
    parents, targets = (building.allocate(size * tree.count) for size in (4, 8))
    ends, areas = (building.allocate(size * subtrees) for size in (4, 8))
    ranges = building.allocate(tree.ranges.size)
    building.stream.copy(ranges, tree.ranges)
    shared = {"nodes": tree.nodes, "ranges": tree.ranges, "begin": begin, "parents": parents}
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
    n, ordered, runs, parts = curve.runs(building, count, items, parts, leaf_size)
    cut = {"leaf_size": 1, "at_once": 0, "runs": 1, "depth": _DEPTH}
    tree = _divided(building, n, runs, parts, cut)
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
    return Tree(count, items, nodes, ranges, extents, levels)
