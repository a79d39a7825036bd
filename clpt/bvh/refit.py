"""Refitting: triangles or boxes move, while the nodes and leaves of their tree stay.

Kernels go from the leaves up, a level at a time: no work-item waits for another. A refitted tree is
correct for any positions, but boxes overlap more and rays get slower with the distance from the
build; then build again.
"""

from __future__ import annotations

from collections.abc import Iterable

import pyopencl as cl

from . import tree as trees
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
    """Enqueue a refit of a tree over triangles to moved vertices, in place.

    building: with the stream of the kernels; vertices: (n, 3) float32; faces: (m, 3) uint32, as at
    the build; parts: the trees of `build_parts` that have moved, by default all. Returns the event
    of the last kernel; the host does not wait.

    No ray hits a triangle while a vertex is not finite, or beyond 1e12.
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
    """Enqueue a refit of a tree over moved boxes, in place; see `refit`.

    boxes: (m, 2, 3) float32 low and high corners, in the order of the build. No ray hits a box
    that is inverted or not finite.
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
    """Enqueue another build of a tree of the layout "shapes_..." over its boxes, in place.

    boxes: see `refit_boxes`. It takes about five times as long, and temporarily up to 310 bytes a
    box; rays are then as fast as after `build_boxes`. The host does not wait: a wide tree that
    exceeds the buffer's room is refitted instead.
    """
    if tree.count:
        fresh = Building(building.device, building.stream)  # counts its memory separately
        items, extents = trees.items_of_boxes(fresh, tree.count, boxes)
        if tree.parts[0].binary is None:
            built = trees.over(fresh, tree.count, items, extents, SHAPES_LEAF, depth=SHAPES_DEPTH)
            _adopt_binary(fresh, tree, built)
        else:
            _adopt_wide(fresh, tree, trees.over(fresh, tree.count, items, extents, 1))
            refit_boxes(building, tree, boxes)
    return building.stream.last


def _adopt_binary(building: Building, tree: Bvh, built: trees.Tree) -> None:
    """Enqueue copies of a new binary tree over the old tree."""
    indices, part = tree.buffers["indices"], tree.parts[0]
    building.run_each("bvh/pack.cl", "pack_indices", tree.count, items=built.items, indices=indices)
    building.stream.copy(tree.buffers["nodes"], built.nodes)
    if part.ranges is not None:
        building.stream.copy(part.ranges, built.ranges)


def _adopt_wide(building: Building, tree: Bvh, built: trees.Tree) -> None:
    """Enqueue copies of a new binary and wide tree over the old trees, if there is room."""
    part, nodes = tree.parts[0], tree.buffers["nodes"]
    chosen, indices = trees.collapse(building, built), building.allocate(4 * tree.count)
    trees.write_nodes(building, chosen, nodes)
    trees.write_indices(building, chosen, indices)
    adopted = [built.nodes, built.ranges, indices, chosen.totals]
    former = [part.binary, part.ranges, tree.buffers["indices"], part.totals]
    for new, old in zip(adopted, former, strict=True):
        words = new.size // 4
        building.run_each(
            _ROOT, "refit_adopt", -(-words // 16), totals=chosen.totals, room=nodes.size // 256,
            words=words, made=new, adopts=old,
        )  # fmt: skip
