"""The binary tree that layouts start from, built on the device by kernels/bvh/build.cl."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pyopencl as cl

from .building import Building

_BUILD, _PACK = "bvh/build.cl", "bvh/pack.cl"
_RUN = 2048  # items whose bounds one work-item finds
_SUBTREES = 64  # for each compute unit, so that they even out


@dataclass(frozen=True)
class Tree:
    """A binary tree over items.

    items: count float8; nodes: 2 count float8; ranges: a heap of the top `levels` levels and, below
    them, of the subtrees; extents: of those ranges.
    """

    count: int
    items: cl.Buffer
    nodes: cl.Buffer
    ranges: cl.Buffer
    extents: cl.Buffer
    levels: int

    def reach(self, building: Building) -> float:
        """The largest coordinate of all items; waits for it."""
        bounds = building.read(self.extents, 8, np.float32)
        return float(np.abs(bounds[[0, 1, 2, 4, 5, 6]]).max())


def items_of_triangles(
    building: Building, count: int, vertices: cl.Buffer, faces: cl.Buffer
) -> tuple[cl.Buffer, cl.Buffer]:
    """The triangles' boxes in the caller's order, and what `over` needs beside them."""
    return _items(building, "items_of_triangles", count, vertices=vertices, faces=faces)


def items_of_boxes(building: Building, count: int, boxes: cl.Buffer) -> tuple[cl.Buffer, cl.Buffer]:
    """The same of boxes given by a low and a high corner."""
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
    building: Building, count: int, items: cl.Buffer, parts: cl.Buffer, leaf_size: int
) -> Tree:
    """Build over items, which are put in the order of the leaves."""
    wanted = _SUBTREES * building.device.info.compute_units
    levels = int(math.log2(max(1, min(wanted, count // leaf_size))))
    ranges = building.allocate(16 * (2 << levels))
    extents = building.allocate(64 * (2 << levels))
    nodes = building.allocate(64 * count)
    n_parts = -(-count // _RUN)
    heap = {"ranges": ranges, "extents": extents}
    building.run(_BUILD, "build_root", 1, parts=parts, n_parts=n_parts, count=count, **heap)
    shared = {"items": items, "nodes": nodes, "leaf_size": leaf_size, **heap}
    for level in range(levels):
        building.run(_BUILD, "build_level", 1 << level, begin=(1 << level) - 1, **shared)
    building.run(_BUILD, "build_subtree", 1 << levels, begin=(1 << levels) - 1, **shared)
    return Tree(count, items, nodes, ranges, extents, levels)
