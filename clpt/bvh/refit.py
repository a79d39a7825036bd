"""Refitting: triangles or boxes move, while the nodes and leaves of their tree stay.

Kernels go from the leaves up, a level at a time: no work-item waits for another. A refitted tree is
right wherever its triangles are, but the farther they have moved since the build, the more boxes
overlap and the slower rays get; then build anew.
"""

from __future__ import annotations

from collections.abc import Iterable

import pyopencl as cl

from . import tree as trees
from . import wide
from .build import Bvh
from .building import Building
from .layouts import SHAPES_DEPTH, SHAPES_LEAF, refit_nodes

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
        part, nodes = tree.parts[0], tree.buffers["nodes"]
        refitted = nodes if part.binary is None else part.binary
        refit_nodes(building, part, nodes=refitted, **boxed, **_NO_TRIANGLES)
        if part.binary is not None:
            source = {"binary": part.binary, "totals": part.totals}
            building.run_each(_ROOT, "refit_followers", nodes.size // 256, nodes=nodes, **source)
    return building.stream.last


def rebuild_boxes(building: Building, tree: Bvh, boxes: cl.Buffer) -> cl.Event | None:
    """Enqueue that a tree of the layout "shapes_...", in place, is built anew over its boxes.

    boxes: as of `refit_boxes`. It takes about five times as long, and up to 310 bytes a box while
    it runs; rays are then as fast as after `build_boxes`. The host waits for nothing: a wide tree
    that came out larger than there is room for is refitted instead.
    """
    if tree.count:
        own = Building(building.device, building.stream)  # with a memory count of its own
        items, extents = trees.items_of_boxes(own, tree.count, boxes)
        if tree.parts[0].binary is None:
            built = trees.over(own, tree.count, items, extents, SHAPES_LEAF, depth=SHAPES_DEPTH)
            _adopt_binary(own, tree, built)
        else:
            _adopt_wide(own, tree, trees.over(own, tree.count, items, extents, 1))
            refit_boxes(building, tree, boxes)
    return building.stream.last


def _adopt_binary(building: Building, tree: Bvh, built: trees.Tree) -> None:
    """Enqueue that a binary tree takes the place of one."""
    indices, part = tree.buffers["indices"], tree.parts[0]
    building.run_each("bvh/pack.cl", "pack_indices", tree.count, items=built.items, indices=indices)
    building.stream.copy(tree.buffers["nodes"], built.nodes)
    if part.ranges is not None:
        building.stream.copy(part.ranges, built.ranges)


def _adopt_wide(building: Building, tree: Bvh, built: trees.Tree) -> None:
    """Enqueue that a binary tree and its wide one take the place of others, if there is room."""
    part, nodes = tree.parts[0], tree.buffers["nodes"]
    chosen, indices = wide.collapse(building, built), building.allocate(4 * tree.count)
    wide.write_nodes(building, chosen, nodes)
    wide.write_indices(building, chosen, indices)
    made = [built.nodes, built.ranges, indices, chosen.totals]
    former = [part.binary, part.ranges, tree.buffers["indices"], part.totals]
    for new, old in zip(made, former, strict=True):
        words = new.size // 4
        building.run_each(
            _ROOT, "refit_adopt", -(-words // 16), totals=chosen.totals, room=nodes.size // 256,
            words=words, made=new, adopts=old,
        )  # fmt: skip
