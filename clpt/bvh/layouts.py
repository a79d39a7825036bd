"""Layouts of trees: the buffers of each traversal in kernels/bvh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import pyopencl as cl

from ..choices import Quality
from ..records import TREE_BITS, TREE_SIZES
from . import tree
from .building import Building

REINSERT_LIMIT = 10_000  # triangles; below, the program takes longer to load than it saves

_COLLAPSE, _REFIT = "bvh/collapse.cl", "bvh/refit.cl"
_BINARY_LEAF = 4  # triangles of a leaf, at most
_BLOCK = 8
_COMPACT_LEAF = 3  # triangles of a leaf, at most; kernels/bvh/compact.cl counts them in 3 bits
SHAPES_LEAF = 2  # boxes of a leaf of "shapes_binary", at most
SHAPES_DEPTH = TREE_SIZES["shapes_depth"]
_RADIUS: dict[Quality, int] = {"high": 16, "fast": 6}  # of clusters
_LEAF = TREE_BITS["leaf"]


@dataclass(frozen=True)
class Mesh:
    """Triangles on the device: vertices (n, 3) float32, faces (count, 3), tags (count,) uint32.

    quality: of the tree over them.
    """

    count: int
    vertices: cl.Buffer
    faces: cl.Buffer
    tags: cl.Buffer
    quality: Quality = "high"


@dataclass(frozen=True)
class Part:
    """A tree in perhaps shared buffers, for refitting.

    count: triangles or boxes; reach: the largest coordinate at the build; steps: (begin, count) of
    each launch of a kernel, from the leaves up: of nodes, or of ranges in the heap `ranges` of a
    binary tree; kernel: for nodes; bounds: of the nodes of a compressed tree, in full precision;
    nodes, leaves: offsets in the buffers [32 bytes]; first: its first triangle; binary, totals: for
    a wide tree that follows a binary tree: its nodes, and the number of wide nodes on the device.
    """

    count: int
    reach: float = 0.0
    steps: tuple[tuple[int, int], ...] = ()
    kernel: str = "refit_wide8"
    ranges: cl.Buffer | None = None
    bounds: cl.Buffer | None = None
    nodes: int = 0
    leaves: int = 0
    first: int = 0
    binary: cl.Buffer | None = None
    totals: cl.Buffer | None = None

    @property
    def private(self) -> tuple[cl.Buffer, ...]:
        """The buffers that only refitting needs."""
        every = (self.ranges, self.bounds, self.binary, self.totals)
        return tuple(buffer for buffer in every if buffer is not None)


@dataclass(frozen=True)
class Packed:
    """Buffers by the names of the traversal's arguments, the part for refitting, and figures."""

    buffers: dict[str, cl.Buffer]
    part: Part
    stats: dict[str, float] = field(default_factory=dict)


def brute(building: Building, mesh: Mesh) -> Packed:
    """Compute records of few triangles on the host, which saves compiling a kernel."""
    size = mesh.vertices.size // 12
    vertices = building.read(mesh.vertices, 3 * size, np.float32).reshape(size, 3)
    faces = building.read(mesh.faces, 3 * mesh.count, np.uint32).reshape(-1, 3)
    v0, v1, v2 = vertices[faces].transpose(1, 0, 2)
    edges = [v1 - v0, v2 - v0]
    normals = np.cross(*edges)
    words = np.empty((mesh.count, 2), np.uint32)
    words[:, 0] = np.arange(mesh.count)
    words[:, 1] = building.read(mesh.tags, mesh.count, np.uint32)
    planes = np.einsum("ij,ij->i", normals, v0)
    sides = np.abs(np.concatenate(edges, 1)).max(axis=1)
    ends = np.stack([planes, sides], 1)
    records = np.concatenate([v0, *edges, normals, words.view(np.float32), ends], 1)
    buffer = building.allocate(records.nbytes)  # refitting writes to the buffer
    building.stream.write(buffer, records.astype(np.float32))
    return Packed({"tris": buffer}, Part(mesh.count))


def binary(building: Building, mesh: Mesh) -> Packed:
    """Build a binary tree, and records in the order of its leaves."""
    built = _binary_tree(building, mesh, _BINARY_LEAF, collapses=False)
    records = building.allocate(64 * mesh.count)
    source = {"vertices": mesh.vertices, "faces": mesh.faces, "tags": mesh.tags}
    packing = {"items": built.items, "records": records}
    building.run_each("bvh/pack.cl", "pack_triangles", mesh.count, **packing, **source)
    return Packed({"nodes": built.nodes, "leaves": records}, _binary_part(building, built))


def wide8(building: Building, mesh: Mesh) -> Packed:
    """Build a binary tree, collapse it to 8-wide nodes, and pack blocks of 8 triangles."""
    built = _binary_tree(building, mesh, _BLOCK, at_once=_BLOCK)
    if built.ranges and mesh.quality == "high" and mesh.count >= REINSERT_LIMIT:
        built = tree.reinserted(building, built)
    chosen = tree.collapse(building, built)
    figures = tree.figures(building, chosen)
    nodes, blocks = building.allocate(256 * figures.nodes), building.allocate(352 * figures.leaves)
    tree.write_nodes(building, chosen, nodes)
    source = {"vertices": mesh.vertices, "faces": mesh.faces, "tags": mesh.tags}
    leaves = {"nodes": built.nodes, "items": built.items, "leaf_roots": chosen.leaf_roots}
    building.run_each(
        _COLLAPSE, "collapse_blocks", figures.leaves, blocks=blocks, **leaves, **source
    )
    part = Part(mesh.count, built.reach(building), figures.steps)
    return Packed({"nodes": nodes, "leaves": blocks}, part, figures.stats)


def binary_boxes(building: Building, count: int, boxes: cl.Buffer, leaf_size: int = 1) -> Packed:
    """Build a binary tree over boxes (count, 2, 3), and indices in the order of its leaves."""
    indices = building.allocate(4 * count)
    if count:
        items, parts = tree.items_of_boxes(building, count, boxes)
        built = tree.over(building, count, items, parts, leaf_size, depth=SHAPES_DEPTH)
        building.run_each("bvh/pack.cl", "pack_indices", count, items=items, indices=indices)
        return Packed({"nodes": built.nodes, "indices": indices}, _binary_part(building, built))
    nodes = building.upload(np.array([0, 0, 0, _LEAF, 0, 0, 0, 0]), np.uint32)  # an empty tree
    return Packed({"nodes": nodes, "indices": indices}, Part(0))


def wide8_boxes(building: Building, count: int, boxes: cl.Buffer) -> Packed:
    """Build an 8-wide tree over boxes, with a box in each leaf."""
    chosen, figures, buffers = _wide_over_boxes(building, count, boxes)
    part = Part(count, chosen.built.reach(building), figures.steps)
    return Packed(buffers, part, figures.stats)


def wide8_shapes(building: Building, count: int, boxes: cl.Buffer) -> Packed:
    """Build like `wide8_boxes`, and keep the binary tree to refit the wide tree."""
    if not count:
        rows = np.repeat([np.inf, -np.inf] * 3 + [0, 0], 8).astype(np.float32)  # an empty tree
        nodes = building.upload(rows, np.float32)
        return Packed({"nodes": nodes, "indices": building.allocate(0)}, Part(0))
    chosen, figures, buffers = _wide_over_boxes(building, count, boxes, spare=True)
    binary = {"binary": chosen.built.nodes, "totals": chosen.totals}
    part = replace(_binary_part(building, chosen.built), **binary)
    return Packed(buffers, part, figures.stats)


def _wide_over_boxes(
    building: Building, count: int, boxes: cl.Buffer, spare: bool = False
) -> tuple[tree.Collapse, tree.Figures, dict[str, cl.Buffer]]:
    """Return a wide tree and its buffers; spare: leave room for later trees over the boxes."""
    chosen = tree.collapse(building, _over_boxes(building, count, boxes, heaped=spare))
    figures = tree.figures(building, chosen)
    room = figures.nodes + figures.nodes // 4 + 8 if spare else figures.nodes
    nodes, indices = building.allocate(256 * room), building.allocate(4 * count)
    tree.write_nodes(building, chosen, nodes)
    tree.write_indices(building, chosen, indices)
    return chosen, figures, {"nodes": nodes, "indices": indices}


def compact(building: Building, mesh: Mesh) -> Packed:
    """Build compressed 8-wide nodes, and records in the order of their leaves."""
    built = _binary_tree(building, mesh, _COMPACT_LEAF)
    leaves = building.allocate(_round_up(48 * mesh.count))
    nodes, part, stats = _compact_nodes(building, built, leaves, mesh.tags)
    source = {"vertices": mesh.vertices, "faces": mesh.faces, "boxes": None, "indices": None}
    refit_nodes(building, part, nodes=nodes, leaves=leaves, **source)
    return Packed({"nodes": nodes, "leaves": leaves}, part, stats)


def compact_boxes(building: Building, count: int, boxes: cl.Buffer) -> Packed:
    """Build like `wide8_boxes`, with compressed nodes."""
    built = _over_boxes(building, count, boxes, heaped=False)
    indices = building.allocate(4 * count)
    nodes, part, stats = _compact_nodes(building, built, indices, None)
    source = {"vertices": None, "faces": None, "boxes": boxes, "indices": indices}
    refit_nodes(building, part, nodes=nodes, leaves=None, **source)
    return Packed({"nodes": nodes, "indices": indices}, part, stats)


def _compact_nodes(
    building: Building, built: tree.Tree, leaves: cl.Buffer, tags: cl.Buffer | None
) -> tuple[cl.Buffer, Part, dict[str, float]]:
    """Fill in leaves, and return compressed nodes without boxes, for `refit_nodes`."""
    chosen = tree.collapse(building, built)
    figures = tree.figures(building, chosen)
    nodes = building.allocate(_round_up(80 * figures.nodes))
    common = {"places": building.allocate(8 * figures.nodes), "compact": nodes, "tags": tags}
    common |= {"nodes": built.nodes, "items": built.items, "leaves": leaves}
    common |= {"costs": chosen.costs, "roots": chosen.roots, "firsts": chosen.firsts}
    for begin, count in reversed(figures.steps):
        building.run_each("bvh/collapse.cl#compact", "compact_nodes", count, begin=begin, **common)
    bounds = building.allocate(32 * figures.nodes)
    part = Part(built.count, built.reach(building), figures.steps, "refit_compact", bounds=bounds)
    return nodes, part, figures.stats


def refit_nodes(building: Building, part: Part, **buffers: cl.Buffer | None) -> None:
    """Enqueue a refit of a tree's boxes to its contents, from the leaves up.

    buffers: of the tree, and either vertices and faces or boxes and indices, the others None.
    """
    common = {
        "nodes_begin": part.nodes,
        "leaves_begin": part.leaves,
        "faces_begin": part.first,
        "reach": part.reach,
        **buffers,
    }
    extra = {} if part.bounds is None else {"bounds": part.bounds}
    for i, (begin, count) in enumerate(part.steps):
        if part.ranges is None:
            building.run_each(_REFIT, part.kernel, count, begin=begin, **extra, **common)
        else:
            kernel = "refit_level" if i else "refit_subtree"
            building.run(_REFIT, kernel, count, begin=begin, ranges=part.ranges, **common)


LAYOUTS: dict[str, Callable[[Building, Mesh], Packed]] = {
    "brute": brute,
    "binary": binary,
    "wide8": wide8,
    "compact": compact,
}
BOX_LAYOUTS: dict[str, Callable[[Building, int, cl.Buffer], Packed]] = {
    "shapes_binary": partial(binary_boxes, leaf_size=SHAPES_LEAF),
    "shapes_wide8": wide8_shapes,
    "binary": binary_boxes,
    "wide8": wide8_boxes,
    "compact": compact_boxes,
}

# Kernel files that replace others on devices without vectors.
ALONE: dict[str, tuple[str, ...]] = {
    "bvh/mask8.cl": ("bvh/mask8.cl#bits",),
    "bvh/wide8_stack.cl": ("bvh/wide8_stack.cl#levels",),
}

TREES = tuple(name for name in LAYOUTS if name in BOX_LAYOUTS)  # all but brute force


def shapes_layout(layout: str) -> str:
    """Return the layout of BOX_LAYOUTS for shapes, for triangles in `layout`."""
    return "shapes_wide8" if layout == "wide8" else "shapes_binary"


def traversal_text(layout: str, all_hits: bool = False) -> str:
    """Return the text of a layout's traversal: LAYOUT(closest) and LAYOUT(occluded).

    all_hits: the traversal that finds all triangles that a ray meets instead, LAYOUT(all_hits).
    """
    file = f"bvh/{layout}.cl{'#all_hits' * all_hits}"
    return f'#include "{file}"\n#define LAYOUT(verb) {layout}_##verb\n'


def _binary_part(building: Building, built: tree.Tree) -> Part:
    """The refitting of a binary tree."""
    reach, kernel = built.reach(building), "refit_pairs"
    return Part(built.count, reach, built.steps, kernel=kernel, ranges=built.ranges)


def _binary_tree(
    building: Building, mesh: Mesh, leaf_size: int, at_once: int = 1, *, collapses: bool = True
) -> tree.Tree:
    items, parts = tree.items_of_triangles(building, mesh.count, mesh.vertices, mesh.faces)
    if building.grain.upward:
        radius = _RADIUS[mesh.quality]
        return tree.upward(
            building, mesh.count, items, parts, leaf_size, radius, collapses=collapses
        )
    if mesh.quality == "fast":
        return tree.over_runs(building, mesh.count, items, parts, leaf_size)
    return tree.over(building, mesh.count, items, parts, leaf_size, at_once)


def _over_boxes(building: Building, count: int, boxes: cl.Buffer, heaped: bool) -> tree.Tree:
    """Return a tree to collapse; heaped: it will be refitted by its heap of ranges."""
    items, parts = tree.items_of_boxes(building, count, boxes)
    if building.grain.upward and not heaped:
        return tree.upward(building, count, items, parts, 1, _RADIUS["high"], collapses=True)
    return tree.over(building, count, items, parts, 1)


def _round_up(nbytes: int) -> int:
    """Return a size rounded up to 32 bytes, the alignment of trees in shared buffers."""
    return -(-nbytes // 32) * 32
