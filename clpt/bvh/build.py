"""Building acceleration structures: triangles or boxes in, buffers for traversal out."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyopencl as cl

from .. import device as dev
from ..errors import SceneError
from . import tree

BRUTE_LIMIT = 32
_LEAF = 0x80000000  # BVH_LEAF of kernels/bvh/node.cl
_REACH = 1e12  # products of three coordinates stay inside a float


@dataclass(frozen=True)
class Bvh:
    """An acceleration structure on a device.

    layout: the name of its traversal in kernels/bvh; count: triangles or boxes;
    buffers: by the names of that traversal's arguments; stats: nodes, leaves, depth, cost (SAH, in
    node visits of a random line through the scene), seconds; what a layout does not have is missing.
    """

    layout: str
    count: int
    buffers: dict[str, cl.Buffer]
    stats: dict[str, float] = field(default_factory=dict)

    @property
    def bytes(self) -> int:
        """Device memory of the buffers."""
        return sum(buffer.size for buffer in self.buffers.values())


@dataclass(frozen=True)
class _Mesh:
    """Triangles on the device: (n, 3) float32, (count, 3) uint32, (count,) uint32."""

    count: int
    vertices: cl.Buffer
    faces: cl.Buffer
    tags: cl.Buffer


def _brute(device: dev.Device, mesh: _Mesh) -> tuple[dict[str, cl.Buffer], dict[str, float]]:
    items = tree.items_only(device, mesh.count, mesh.vertices, mesh.faces)
    return {"tris": _records(device, mesh, items, with_edges=1)}, {}


def _binary(device: dev.Device, mesh: _Mesh) -> tuple[dict[str, cl.Buffer], dict[str, float]]:
    built = tree.over_triangles(device, mesh.count, mesh.vertices, mesh.faces)
    return {"nodes": built.nodes, "leaves": _records(device, mesh, built.items, with_edges=0)}, {}


def _records(device: dev.Device, mesh: _Mesh, items: cl.Buffer, with_edges: int) -> cl.Buffer:
    records = tree.allocate(device, 64 * mesh.count)
    tree.run_each(device, "bvh/pack.cl", "pack_triangles", mesh.count, items=items,
                  records=records, vertices=mesh.vertices, faces=mesh.faces,
                  tags=mesh.tags, with_edges=with_edges)  # fmt: skip
    return records


def _wide8(device: dev.Device, mesh: _Mesh) -> tuple[dict[str, cl.Buffer], dict[str, float]]:
    built = tree.over_triangles(device, mesh.count, mesh.vertices, mesh.faces)
    n, root = mesh.count, "bvh/collapse.cl"
    costs, occlusion = tree.allocate(device, 64 * n), tree.allocate(device, 8 * n)
    shared: dict[str, Any] = dict(nodes=built.nodes, items=built.items, ranges=built.ranges,
                                  costs=costs, occlusion=occlusion)  # fmt: skip
    begin = 2**built.levels - 1
    tree.run(device, root, "collapse_subtree", 2**built.levels, begin=begin, **shared)
    for level in reversed(range(built.levels)):
        tree.run(device, root, "collapse_level", 2**level, begin=2**level - 1, **shared)
    roots, firsts = tree.allocate(device, 4 * n), tree.allocate(device, 8 * n)
    leaf_roots, totals = tree.allocate(device, 4 * n), tree.allocate(device, 16)
    tree.run(device, root, "collapse_number", 1, nodes=built.nodes, costs=costs, roots=roots,
             firsts=firsts, leaf_roots=leaf_roots, totals=totals)  # fmt: skip
    n_nodes, n_blocks, depth = (int(x) for x in _read(device, totals, np.uint32)[:3])
    wide, blocks = tree.allocate(device, 256 * n_nodes), tree.allocate(device, 352 * n_blocks)
    tree.run_each(device, root, "collapse_nodes", n_nodes, nodes=built.nodes, costs=costs,
                  occlusion=occlusion, roots=roots, firsts=firsts, wide=wide)  # fmt: skip
    tree.run_each(device, root, "collapse_blocks", n_blocks, nodes=built.nodes, items=built.items,
                  leaf_roots=leaf_roots, vertices=mesh.vertices, faces=mesh.faces,
                  tags=mesh.tags, blocks=blocks)  # fmt: skip
    stats = {"nodes": n_nodes, "leaves": n_blocks, "depth": depth}
    return {"nodes": wide, "leaves": blocks}, stats


LAYOUTS: dict[str, Callable[[dev.Device, _Mesh], tuple[dict[str, cl.Buffer], dict[str, float]]]] = {
    "brute": _brute,
    "binary": _binary,
    "wide8": _wide8,
}


def choose_layout(device: dev.Device, n_triangles: int) -> str:
    """The layout that traces fastest on the device: a key of LAYOUTS."""
    if n_triangles <= BRUTE_LIMIT:
        return "brute"
    return "wide8" if device.info.is_cpu else "binary"


def build(
    device: dev.Device,
    vertices: np.ndarray | cl.Buffer,
    faces: np.ndarray | cl.Buffer,
    tags: np.ndarray | cl.Buffer | None = None,
    layout: str | None = None,
) -> Bvh:
    """An acceleration structure over triangles.

    vertices: (n, 3) float32; faces: (m, 3) uint32; tags: (m,) uint32, a word for each triangle that
    comes back in its hits (zeros if None). Buffers of these types are read in place and not checked.
    layout: a key of LAYOUTS; None asks `choose_layout`.

    Depth is bounded (kernels/bvh/node.cl), so no traversal overflows its stack.

    Raises SceneError for vertices that are not finite or beyond 1e12 and for indices out of range,
    MemoryBudgetError where a buffer would be larger than the device allows.
    """
    start = time.perf_counter()
    count = _check(vertices, faces, tags)
    if count == 0:  # one triangle that is a point: nothing hits it
        vertices, faces, tags = np.zeros((1, 3)), np.zeros((1, 3)), None
    layout = layout or choose_layout(device, count)
    n = max(count, 1)
    mesh = _Mesh(
        n,
        tree.upload(device, vertices, np.float32),
        tree.upload(device, faces, np.uint32),
        tree.upload(device, np.zeros(n) if tags is None else tags, np.uint32),
    )
    buffers, stats = LAYOUTS[layout](device, mesh)
    device.queue.finish()
    return Bvh(layout, count, buffers, {**stats, "seconds": time.perf_counter() - start})


def build_boxes(device: dev.Device, boxes: np.ndarray) -> Bvh:
    """A tree over boxes, (m, 2, 3) float32 low and high corners, for kernels/bvh/shapes.cl.

    Raises as `build` does.
    """
    start = time.perf_counter()
    boxes = np.asarray(boxes, np.float32).reshape(-1, 2, 3)
    _check_reach(boxes, "a shape's box")
    n = len(boxes)
    indices = tree.allocate(device, 4 * n)
    if n:
        built = tree.over_boxes(device, n, tree.upload(device, boxes, np.float32))
        nodes = built.nodes
        tree.run_each(device, "bvh/pack.cl", "pack_indices", n, items=built.items, indices=indices)
    else:
        nodes = tree.upload(device, np.array([0, 0, 0, _LEAF, 0, 0, 0, 0]), np.uint32)
    device.queue.finish()
    buffers = {"nodes": nodes, "indices": indices}
    return Bvh("shapes", n, buffers, {"seconds": time.perf_counter() - start})


def _read(device: dev.Device, buffer: cl.Buffer, dtype: type) -> np.ndarray:
    array = np.empty(buffer.size // np.dtype(dtype).itemsize, dtype)
    cl.enqueue_copy(device.queue, array, buffer)
    return array


def _check(vertices: Any, faces: Any, tags: Any) -> int:
    """The number of triangles, after looking at arrays for what a tree cannot hold."""
    count = faces.size // 12 if isinstance(faces, cl.Buffer) else len(faces)
    if isinstance(faces, np.ndarray) and count:
        top = vertices.size // 12 if isinstance(vertices, cl.Buffer) else len(vertices)
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise SceneError(f"faces are (m, 3), not {faces.shape}")
        if faces.min() < 0 or faces.max() >= top:
            raise SceneError(f"a face names vertex {faces.max()} of {top}")
    if isinstance(vertices, np.ndarray):
        _check_reach(vertices, "a vertex")
    if isinstance(tags, np.ndarray) and len(tags) != count:
        raise SceneError(f"{count} triangles have {len(tags)} tags")
    return count


def _check_reach(corners: np.ndarray, what: str) -> None:
    if corners.size and not (np.abs(corners).max() < _REACH):  # NaN fails the comparison
        raise SceneError(f"{what} has a coordinate that is not finite, or beyond {_REACH:g}")
