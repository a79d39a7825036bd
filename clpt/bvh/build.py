"""Builds of acceleration structures over triangles or boxes, and refits of them.

For triangles with moving vertices the tree is built over the middle positions, and refitted to
every key: nodes and leaves have a copy for each. Copies of a record for consecutive keys are
neighbours, see kernels/bvh/keyed.cl.

A refit moves triangles or boxes, while the nodes and leaves of their tree stay. Kernels go from the
leaves up, a level at a time: no work-item waits for another. A refitted tree is correct for any
positions, but boxes overlap more and rays get slower with the distance from the build; then build
again.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, pairwise, repeat
from typing import get_args

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ..choices import Quality
from ..device import Device
from ..errors import SceneError
from ..records import TREE_BITS, TREE_REACHES
from . import tree as trees
from .building import Array, Building
from .layouts import (
    BOX_LAYOUTS,
    LAYOUTS,
    SHAPES_DEPTH,
    SHAPES_LEAF,
    Mesh,
    Packed,
    Part,
    refit_nodes,
)

WORDS = {
    "binary": (8, 16),
    "wide8": (64, 88),
    "compact": (20, 12),
}  # words of a node, and of a leaf
_FARTHEST = 1e38  # bounds of empty boxes: finite, so that a product with 0 is not NaN
_LEAF = np.uint32(TREE_BITS["leaf"])


def keyed(
    building: Building,
    vertices: NDArray[np.float32],
    faces: NDArray[np.uint32],
    tags: NDArray[np.uint32],
    keys: int,
    layout: str,
    quality: Quality = "high",
) -> Packed:
    """Build a tree over triangles whose vertices have a row for each key.

    vertices: (n, 3) float32, with consecutive rows for a vertex's keys; faces: (m, 3) uint32 first
    rows of vertices; keys: their number. The tree cannot be refitted. Raises MemoryBudgetError.
    """
    first = int(faces.min())
    used = vertices[first : int(faces.max()) + keys]
    count = len(used) - keys + 1
    lower, upper = (keys - 1) // 2, keys // 2
    middle = used.copy()
    middle[:count] = 0.5 * (used[lower : lower + count] + used[upper : upper + count])
    local = np.ascontiguousarray(faces - np.uint32(first))
    mesh = Mesh(
        len(local),
        building.upload(middle, np.float32),
        building.upload(local, np.uint32),
        building.upload(tags, np.uint32),
        quality,
    )
    packed = LAYOUTS[layout](building, mesh)
    copies = _refitted(building, packed, used, local, keys)
    node_words, leaf_words = WORDS[layout]
    keyed_nodes = _interleaved([nodes for nodes, _ in copies], node_words)
    if layout == "wide8":
        _finish_wide(keyed_nodes, keys)
    keyed_leaves = _interleaved([leaves for _, leaves in copies], leaf_words)
    buffers = {"nodes": _padded(keyed_nodes), "leaves": _padded(keyed_leaves)}
    uploaded = {name: building.upload(words, np.uint32) for name, words in buffers.items()}
    return Packed(uploaded, Part(0), packed.stats)


def _refitted(
    building: Building,
    packed: Packed,
    vertices: NDArray[np.float32],
    faces: NDArray[np.uint32],
    keys: int,
) -> list[tuple[NDArray[np.uint32], NDArray[np.uint32]]]:
    """Return the nodes and leaves of a tree at each key."""
    nodes, leaves = packed.buffers["nodes"], packed.buffers["leaves"]
    places = building.upload(vertices, np.float32)
    copies: list[tuple[NDArray[np.uint32], NDArray[np.uint32]]] = []
    for key in range(keys):
        source = {"vertices": places, "faces": building.upload(faces + np.uint32(key), np.uint32)}
        trees = {"nodes": nodes, "leaves": leaves, "boxes": None, "indices": None}
        refit_nodes(building, packed.part, **trees, **source)
        copies.append(
            (
                building.read(nodes, nodes.size // 4, np.uint32),
                building.read(leaves, leaves.size // 4, np.uint32),
            )
        )
    return copies


def _interleaved(copies: list[NDArray[np.uint32]], words: int) -> NDArray[np.uint32]:
    """Return records of `words` words of several copies, (n, copies, words)."""
    count = len(copies[0]) // words
    return np.stack([c[: count * words].reshape(count, words) for c in copies], axis=1)


def _finish_wide(nodes: NDArray[np.uint32], keys: int) -> None:
    """Multiply the links of wide nodes by the number of keys, and make boxes finite."""
    links, exists = nodes[..., 48:56], nodes[..., 56:64] != 0
    leaf = links & _LEAF
    links[...] = np.where(exists, leaf | (links ^ leaf) * np.uint32(keys), links)
    boxes = nodes[..., :48].view(np.float32)
    boxes[...] = np.clip(boxes, -_FARTHEST, _FARTHEST)


def _padded(words: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return words padded to steps of 32 bytes, the alignment of trees in shared buffers."""
    flat = words.reshape(-1)
    return np.concatenate([flat, np.zeros(-len(flat) % 8, np.uint32)])


log = logging.getLogger(__name__)

BRUTE_LIMIT = 96  # triangles: brute force is faster up to here; see bench/notes/traversal.md

USUAL_CACHE = 32 << 20  # where a driver tells 0, as PoCL does in some virtual machines
WIDE8_BYTES = 54  # of a triangle with its share of nodes, in large scenes
MOST = (2**31 - 1) // 3  # triangles or vertices: kernels count their words by an int
_REACH = TREE_REACHES["reach"]


@dataclass(frozen=True)
class Bvh:
    """An acceleration structure on a device.

    layout: the name of its traversal in kernels/bvh; count: triangles or boxes; buffers: by the
    names of the traversal's arguments; parts: the trees in the buffers, for `refit`; stats:
    seconds, and for wide8 nodes, leaves, depth and cost (expected nodes and blocks that a random
    line through the scene visits).
    """

    layout: str
    count: int
    buffers: dict[str, cl.Buffer]
    parts: tuple[Part, ...]
    stats: dict[str, float] = field(default_factory=dict)

    @property
    def bytes(self) -> int:
        """Device memory of all buffers [bytes]."""
        private = [buffer for part in self.parts for buffer in part.private]
        return sum(buffer.size for buffer in [*self.buffers.values(), *private])


def choose_layout(device: Device, n_triangles: int) -> str:
    """Return the layout that traces fastest on the device: a key of LAYOUTS."""
    if n_triangles <= BRUTE_LIMIT:
        return "brute"
    return choose_tree(device)


def choose_tree(device: Device) -> str:
    """Return the layout with a tree that traces fastest on the device.

    The choice was measured on CPUs and an NVIDIA GPU. Other GPUs get the literature's choice, since
    compilers for AMD and Intel have too few registers for wide8: see bench/notes/gpus.md.
    """
    measured = device.info.is_cpu or "nvidia" in device.info.vendor.casefold()
    return "wide8" if measured else "compact"


def outgrows_caches(device: Device, layout: str, n_triangles: int) -> bool:
    """Return whether incoherent rays wait for memory, so that interleaving pays."""
    caches = device.info.cl_device.global_mem_cache_size or USUAL_CACHE
    return device.info.is_cpu and layout == "wide8" and WIDE8_BYTES * n_triangles > caches


def build(
    device: Device,
    vertices: Array,
    faces: Array,
    tags: Array | None = None,
    layout: str | None = None,
    quality: Quality = "high",
) -> Bvh:
    """Build an acceleration structure over triangles.

    vertices: (n, 3) float32; faces: (m, 3) uint32; tags: (m,) uint32, a word for each triangle that
    its hits return (zeros if None). Buffers of these types are read in place, without checks.
    layout: a key of LAYOUTS; None calls `choose_layout`. quality: "fast" cuts leaves from a
    space-filling curve, and builds the nodes above them like "high"; brute has no tree. Other
    devices than CPUs build trees from the leaves up, and consider fewer neighbours for "fast".

    The build takes up to 270 bytes a triangle and .25 MiB on the device, in addition to its input.
    About 60 bytes a triangle stay (binary, or wide8 from the leaves up where triangles lie far
    apart: 130); no other buffer has more than 64 bytes a triangle.
    Trees are never deeper than BVH_DEPTH of kernels/bvh/node.cl: traversals cannot overflow.

    Raises SceneError for vertices that are not finite or beyond 1e12, for indices out of range and
    for more triangles than MOST, MemoryBudgetError if the device has too little memory.
    """
    return _build(Building(device), vertices, faces, tags, layout, quality)


def _build(
    building: Building,
    vertices: Array,
    faces: Array,
    tags: Array | None,
    layout: str | None,
    quality: Quality,
) -> Bvh:
    start = time.perf_counter()
    count, device = _check(vertices, faces, tags), building.device
    if count == 0:  # a degenerate triangle, which no ray hits
        vertices, faces, tags = np.zeros((1, 3)), np.zeros((1, 3)), None
    if quality not in get_args(Quality):
        raise SceneError(f"a tree's quality is high or fast, not {quality!r}")
    layout = layout or choose_layout(device, count)
    n = max(count, 1)
    mesh = Mesh(
        n,
        building.wrap_host(vertices, np.float32),
        building.wrap_host(faces, np.uint32),
        building.wrap_host(np.zeros(n, np.uint32) if tags is None else tags, np.uint32),
        quality,
    )
    packed = LAYOUTS[layout](building, mesh)
    building.stream.wait()
    stats = {**packed.stats, "seconds": time.perf_counter() - start}
    log.info("%s tree over %d triangles in %.3f s", layout, count, stats["seconds"])
    part = replace(packed.part, count=count)
    return Bvh(layout, count, packed.buffers, (part,), stats)


@dataclass(frozen=True)
class Runs:
    """Consecutive runs of triangles; triangles count from 0 in each run.

    counts: their lengths; keys: the number of rows of a vertex in each run, 1 by default,
    see `keyed`; corners: the vertices on the host, for runs with several keys.
    """

    counts: Sequence[int]
    keys: Sequence[int] = ()
    corners: NDArray | None = None

    @property
    def firsts(self) -> list[int]:
        """The first triangle of each run, and the end of the last run."""
        ends: list[int] = np.cumsum([0, *self.counts]).tolist()
        return ends


def build_parts(
    building: Building,
    vertices: Array,
    faces: NDArray,
    tags: NDArray,
    runs: Runs,
    layout: str,
    quality: Quality = "high",
) -> tuple[Bvh, NDArray[np.uint32]]:
    """Build a tree for each run of triangles, in shared buffers.

    building: for the whole. Returns the trees, and the offsets of their nodes and leaves, (n, 2)
    uint32 [32 bytes]. Other parameters and errors: see `build`.
    """
    start = time.perf_counter()
    trees = []
    for (i, j), rows in zip(pairwise(runs.firsts), chain(runs.keys, repeat(1)), strict=False):
        if rows > 1 and runs.corners is not None:
            _check_reach(runs.corners, "a vertex")
            packed = keyed(building, runs.corners, faces[i:j], tags[i:j], rows, layout, quality)
            trees.append(Bvh(layout, j - i, packed.buffers, (packed.part,), packed.stats))
            continue
        trees.append(_build(building, vertices, faces[i:j], tags[i:j], layout, quality))
    if len(trees) == 1:
        return trees[0], np.zeros((1, 2), np.uint32)
    buffers, offsets = _joined(building, trees)
    stats = {"trees": len(trees), "seconds": time.perf_counter() - start}
    parts = tuple(
        replace(tree_.parts[0], nodes=nodes, leaves=leaves, first=first)
        for tree_, (nodes, leaves), first in zip(trees, offsets.tolist(), runs.firsts, strict=False)
    )
    return Bvh(layout, runs.firsts[-1], buffers, parts, stats), offsets


def _joined(
    building: Building, trees: list[Bvh]
) -> tuple[dict[str, cl.Buffer], NDArray[np.uint32]]:
    """Copy trees into shared buffers; return the buffers, and offsets like `build_parts`."""
    sizes = np.array([[b.size for b in (t.buffers["nodes"], t.buffers["leaves"])] for t in trees])
    offsets = np.cumsum(sizes, axis=0) - sizes
    buffers = {}
    for name, starts, whole in zip(("nodes", "leaves"), offsets.T, sizes.sum(axis=0), strict=True):
        buffers[name] = building.allocate(int(whole))
        for tree_, offset in zip(trees, starts, strict=True):
            building.stream.copy(buffers[name], tree_.buffers[name], dst_offset=int(offset))
    building.stream.wait()
    return buffers, (offsets // 32).astype(np.uint32)


def build_boxes(device: Device, boxes: NDArray, layout: str = "shapes_binary") -> Bvh:
    """Build a tree over boxes, (m, 2, 3) float32 low and high corners.

    layout: a key of BOX_LAYOUTS. Leaves of "shapes_binary" hold up to two boxes; leaves of other
    layouts hold a box, with the nodes of the layout for triangles. Raises like `build`.
    """
    start = time.perf_counter()
    boxes = np.asarray(boxes, np.float32).reshape(-1, 2, 3)
    _check_reach(boxes, "a shape's box")
    building, n = Building(device), len(boxes)
    packed = BOX_LAYOUTS[layout](building, n, building.wrap_host(boxes, np.float32))
    building.stream.wait()
    stats = {**packed.stats, "seconds": time.perf_counter() - start}
    return Bvh(layout, n, packed.buffers, (packed.part,), stats)


def _check(vertices: Array, faces: Array, tags: Array | None) -> int:
    """Return the number of triangles. Raises SceneError for arrays that a tree cannot hold."""
    count = faces.size // 12 if isinstance(faces, cl.Buffer) else len(faces)
    if count > MOST:
        raise SceneError(f"{count:,} triangles are more than a tree holds, {MOST:,}")
    if isinstance(faces, np.ndarray) and count:
        top = vertices.size // 12 if isinstance(vertices, cl.Buffer) else len(vertices)
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise SceneError(f"faces are (m, 3), not {faces.shape}")
        if faces.min() < 0 or faces.max() >= top:
            face, corner = np.argwhere((faces < 0) | (faces >= top))[0]
            raise SceneError(f"face {face} names vertex {faces[face, corner]} of {top}")
    if isinstance(vertices, np.ndarray):
        _check_reach(vertices, "a vertex")
    if isinstance(tags, np.ndarray) and len(tags) != count:
        raise SceneError(f"{count} triangles have {len(tags)} tags")
    return count


def _check_reach(corners: NDArray, subject: str) -> None:
    # Python's floats hold the limit and the negated minimum of every integer type.
    if corners.size and not max(-float(corners.min()), float(corners.max())) < _REACH:
        raise SceneError(f"{subject} has a coordinate that is not finite, or beyond {_REACH:g}")


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
