"""The layouts: what each traversal of kernels/bvh wants in its buffers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import pyopencl as cl

from . import tree
from .building import Building

_COLLAPSE = "bvh/collapse.cl"
_BINARY_LEAF = 4  # triangles of a leaf, at most
_BLOCK = 8
_LEAF = 0x80000000  # BVH_LEAF of kernels/bvh/node.cl


@dataclass(frozen=True)
class Mesh:
    """Triangles on the device: vertices (n, 3) float32, faces (count, 3), tags (count,) uint32."""

    count: int
    vertices: cl.Buffer
    faces: cl.Buffer
    tags: cl.Buffer


@dataclass(frozen=True)
class Packed:
    """Buffers by the names of the traversal's arguments, and figures about them."""

    buffers: dict[str, cl.Buffer]
    stats: dict[str, float]


def brute(building: Building, mesh: Mesh) -> Packed:
    """Records of the triangles, on the host: so few are not worth compiling a kernel for."""
    size = mesh.vertices.size // 12
    vertices = building.read(mesh.vertices, 3 * size, np.float32).reshape(size, 3)
    faces = building.read(mesh.faces, 3 * mesh.count, np.uint32).reshape(-1, 3)
    v0, v1, v2 = vertices[faces].transpose(1, 0, 2)
    edges = [v1 - v0, v2 - v0]
    words = np.zeros((mesh.count, 4), np.uint32)
    words[:, 0] = np.arange(mesh.count)
    words[:, 1] = building.read(mesh.tags, mesh.count, np.uint32)
    records = np.concatenate([v0, *edges, np.cross(*edges), words.view(np.float32)], 1)
    return Packed({"tris": building.upload(records, np.float32)}, {})


def binary(building: Building, mesh: Mesh) -> Packed:
    """The binary tree as it was built, and records in the order of its leaves."""
    built = _binary_tree(building, mesh, _BINARY_LEAF)
    records = building.allocate(64 * mesh.count)
    source = {"vertices": mesh.vertices, "faces": mesh.faces, "tags": mesh.tags}
    packing = {"items": built.items, "records": records}
    building.run_each("bvh/pack.cl", "pack_triangles", mesh.count, **packing, **source)
    return Packed({"nodes": built.nodes, "leaves": records}, {})


def wide8(building: Building, mesh: Mesh) -> Packed:
    """The binary tree made 8 wide, and blocks of 8 triangles."""
    built = _binary_tree(building, mesh, _BLOCK)
    wide = _collapse(building, mesh.count, built)
    blocks = building.allocate(352 * wide.leaves)
    source = {"vertices": mesh.vertices, "faces": mesh.faces, "tags": mesh.tags}
    leaves = {"nodes": built.nodes, "items": built.items, "leaf_roots": wide.leaf_roots}
    building.run_each(_COLLAPSE, "collapse_blocks", wide.leaves, blocks=blocks, **leaves, **source)
    return Packed({"nodes": wide.nodes, "leaves": blocks}, wide.stats)


def binary_boxes(building: Building, count: int, boxes: cl.Buffer, leaf_size: int = 1) -> Packed:
    """The binary tree over boxes (count, 2, 3), and the boxes in the order of its leaves."""
    indices = building.allocate(4 * count)
    if count:
        items, parts = tree.items_of_boxes(building, count, boxes)
        nodes = tree.over(building, count, items, parts, leaf_size).nodes
        building.run_each("bvh/pack.cl", "pack_indices", count, items=items, indices=indices)
    else:  # a leaf with nothing in it
        nodes = building.upload(np.array([0, 0, 0, _LEAF, 0, 0, 0, 0]), np.uint32)
    return Packed({"nodes": nodes, "indices": indices}, {})


def wide8_boxes(building: Building, count: int, boxes: cl.Buffer) -> Packed:
    """The binary tree over boxes (count, 2, 3) made 8 wide, and the boxes in their order."""
    items, parts = tree.items_of_boxes(building, count, boxes)
    built = tree.over(building, count, items, parts, 1)
    wide = _collapse(building, count, built)
    indices = building.allocate(4 * count)
    leaves = {"nodes": built.nodes, "items": items, "leaf_roots": wide.leaf_roots}
    building.run_each(_COLLAPSE, "collapse_indices", count, indices=indices, **leaves)
    return Packed({"nodes": wide.nodes, "indices": indices}, wide.stats)


@dataclass(frozen=True)
class _Wide:
    """8-wide nodes, the binary nodes that their leaves were, the number of those, and figures."""

    nodes: cl.Buffer
    leaf_roots: cl.Buffer
    leaves: int
    stats: dict[str, float]


def _collapse(building: Building, n: int, built: tree.Tree) -> _Wide:
    """The inner nodes of a binary tree over n items made 8 wide."""
    costs, occlusion = building.allocate(64 * n), building.allocate(8 * n)
    below = {"nodes": built.nodes, "costs": costs, "occlusion": occlusion}
    parts = {"items": built.items, "ranges": built.ranges, **below}
    begin = (1 << built.levels) - 1
    building.run(_COLLAPSE, "collapse_subtree", 1 << built.levels, begin=begin, **parts)
    for level in reversed(range(built.levels)):
        begin = (1 << level) - 1
        building.run(_COLLAPSE, "collapse_level", 1 << level, begin=begin, **parts)

    numbers = {"roots": building.allocate(4 * n), "firsts": building.allocate(8 * n)}
    leaf_roots, totals = building.allocate(4 * n), building.allocate(16)
    places = {"leaf_roots": leaf_roots, "totals": totals, **numbers}
    building.run(_COLLAPSE, "collapse_number", 1, nodes=built.nodes, costs=costs, **places)
    words = building.read(totals, 4, np.uint32)
    n_nodes, n_leaves, depth = (int(word) for word in words[:3])

    wide = building.allocate(256 * n_nodes)
    building.run_each(_COLLAPSE, "collapse_nodes", n_nodes, wide=wide, **numbers, **below)
    cost = float(words[3:].view(np.float32)[0])
    stats = {"nodes": n_nodes, "leaves": n_leaves, "depth": depth, "cost": cost}
    return _Wide(wide, leaf_roots, n_leaves, stats)


LAYOUTS: dict[str, Callable[[Building, Mesh], Packed]] = {
    "brute": brute,
    "binary": binary,
    "wide8": wide8,
}
BOX_LAYOUTS: dict[str, Callable[[Building, int, cl.Buffer], Packed]] = {
    "shapes": partial(binary_boxes, leaf_size=2),
    "binary": binary_boxes,
    "wide8": wide8_boxes,
}


def _binary_tree(building: Building, mesh: Mesh, leaf_size: int) -> tree.Tree:
    items, parts = tree.items_of_triangles(building, mesh.count, mesh.vertices, mesh.faces)
    return tree.over(building, mesh.count, items, parts, leaf_size)
