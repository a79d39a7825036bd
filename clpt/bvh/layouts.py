"""The layouts: what each traversal of kernels/bvh wants in its buffers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pyopencl as cl

from . import tree
from .building import Building

_COLLAPSE = "bvh/collapse.cl"
_BINARY_LEAF = 4  # triangles of a leaf, at most
_BLOCK = 8


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
    n, built = mesh.count, _binary_tree(building, mesh, _BLOCK)
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
    n_nodes, n_blocks, depth = (int(word) for word in words[:3])

    wide, blocks = building.allocate(256 * n_nodes), building.allocate(352 * n_blocks)
    building.run_each(_COLLAPSE, "collapse_nodes", n_nodes, wide=wide, **numbers, **below)
    source = {"vertices": mesh.vertices, "faces": mesh.faces, "tags": mesh.tags}
    leaves = {"nodes": built.nodes, "items": built.items, "leaf_roots": leaf_roots}
    building.run_each(_COLLAPSE, "collapse_blocks", n_blocks, blocks=blocks, **leaves, **source)
    cost = float(words[3:].view(np.float32)[0])
    stats = {"nodes": n_nodes, "leaves": n_blocks, "depth": depth, "cost": cost}
    return Packed({"nodes": wide, "leaves": blocks}, stats)


LAYOUTS: dict[str, Callable[[Building, Mesh], Packed]] = {
    "brute": brute,
    "binary": binary,
    "wide8": wide8,
}


def _binary_tree(building: Building, mesh: Mesh, leaf_size: int) -> tree.Tree:
    items, parts = tree.items_of_triangles(building, mesh.count, mesh.vertices, mesh.faces)
    return tree.over(building, mesh.count, items, parts, leaf_size)
