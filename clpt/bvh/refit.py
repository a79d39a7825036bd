"""Refitting: triangles or boxes move, while the nodes and leaves of their tree stay.

Kernels go from the leaves up, a level at a time: no work-item waits for another. A refitted tree is
right wherever its triangles are, but the farther they have moved since the build, the more boxes
overlap and the slower rays get; then build anew.
"""

from __future__ import annotations

from collections.abc import Iterable

import pyopencl as cl

from . import tree as trees
from .build import Bvh
from .building import Building
from .layouts import SHAPES_LEAF, refit_nodes

_ROOT = "bvh/refit.cl"
_NO_TRIANGLES = {"vertices": None, "faces": None, "leaves": None}
_NO_BOXES = {"boxes": None, "indices": None}


def refit(
    building: Building,
    tree: Bvh,
    vertices: cl.Buffer,
    faces: cl.Buffer,
    parts: Iterable[int] | None = None,
) -> cl.Event | None:
    """Enqueue that a tree over triangles, in place, follows its vertices.

    building: with the stream of the kernels; vertices: (n, 3) float32; faces: (m, 3) uint32, those
    that the tree was built of; parts: the trees of `build_parts` that have moved, all by default.
    Returns the event of the last kernel; the host waits for nothing.

    No ray meets a triangle while it has a vertex that is not finite, or beyond 1e12.
    """
    numbers = range(len(tree.parts)) if parts is None else parts
    if tree.layout == "brute":
        if tree.count:
            records = {"records": tree.buffers["tris"]}
            source = {"vertices": vertices, "faces": faces}
            building.run_each(_ROOT, "refit_brute", tree.count, **records, **source)
        return building.stream.last
    triangles = {"vertices": vertices, "faces": faces, "leaves": tree.buffers["leaves"]}
    for part in (tree.parts[number] for number in numbers):
        if part.count:
            refit_nodes(building, part, nodes=tree.buffers["nodes"], **triangles, **_NO_BOXES)
    return building.stream.last


def refit_boxes(building: Building, tree: Bvh, boxes: cl.Buffer) -> cl.Event | None:
    """Enqueue that a tree over boxes, in place, follows them.

    boxes: (m, 2, 3) float32 low and high corners, in the order of the build. No ray meets a box
    that is inside out or not finite. For the rest see `refit`.
    """
    boxed = {"boxes": boxes, "indices": tree.buffers["indices"]}
    if tree.count:
        nodes = tree.buffers["nodes"]
        refit_nodes(building, tree.parts[0], nodes=nodes, **boxed, **_NO_TRIANGLES)
    return building.stream.last


def rebuild_boxes(building: Building, tree: Bvh, boxes: cl.Buffer) -> cl.Event | None:
    """Enqueue that a tree of the layout "shapes", in place, is built anew over its boxes.

    boxes: as of `refit_boxes`. It takes about five times as long, and 160 bytes a box while it
    runs; rays are then as fast as after `build_boxes`. The host waits for nothing.
    """
    part = tree.parts[0]
    if tree.count:
        own = Building(building.device, building.stream)  # with a memory count of its own
        items, extents = trees.items_of_boxes(own, tree.count, boxes)
        built = trees.over(own, tree.count, items, extents, SHAPES_LEAF)
        indices = tree.buffers["indices"]
        own.run_each("bvh/pack.cl", "pack_indices", tree.count, items=items, indices=indices)
        building.stream.copy(tree.buffers["nodes"], built.nodes)
        if part.ranges is not None:
            building.stream.copy(part.ranges, built.ranges)
    return building.stream.last
