"""The binary tree of all layouts, built on the device by kernels/bvh/build.cl.

For fast builds kernels/bvh/curve.cl cuts leaves from a space-filling curve. kernels/bvh/collapse.cl
collapses a tree to 8-wide nodes. `Building` is the state of a build: device, memory, kernels.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
import pyopencl as cl
from numpy.typing import DTypeLike, NDArray

from ..device import Buffers, Device, Program, Source, Stream, assemble, host_buffer
from ..device import build as build_program
from ..records import CURVE_KEYS, TREE_SIZES

Array: TypeAlias = NDArray | cl.Buffer

_ZERO_COPY = 1 << 16  # [bytes] arrays from this size on are read in place
_GROUP = 8  # work-items of a group, each with a triangle or node
_ADVICE = "use fewer triangles, or a device with more memory"


@functools.cache
def _source(root: str) -> Source:
    return assemble(root)


class Building:
    """A build on a device. Programs and kernels are created once a context.

    stream: for all commands, by default a new stream of the device's queue.
    """

    def __init__(self, device: Device, stream: Stream | None = None):
        self.device = device
        self.buffers = Buffers(device)
        self.stream: Stream = stream or Stream(device.queue)
        self._programs: dict[str, Program] = {}

    def run(self, root: str, kernel: str, n: int, **arguments: object) -> None:
        """Enqueue n work-items of a kernel of the program at `root`, in groups of 1."""
        self._enqueue(root, kernel, n, 1, arguments)

    def run_each(self, root: str, kernel: str, n: int, **arguments: object) -> None:
        """Enqueue like `run`, in larger groups, for kernels with an argument `count`, set to n."""
        self._enqueue(root, kernel, n, _GROUP, {"count": n, **arguments})

    def allocate(self, nbytes: int) -> cl.Buffer:
        """Return a buffer. Raises MemoryBudgetError."""
        return self.buffers.allocate("building the scene's tree", nbytes, _ADVICE)

    def upload(self, array: Array, dtype: DTypeLike) -> cl.Buffer:
        """Return a buffer with an array; a buffer is returned unchanged. Raises like `allocate`."""
        if isinstance(array, cl.Buffer):
            return array
        return self.buffers.upload("the scene's triangles", array, dtype, _ADVICE)

    def wrap_host(self, array: Array, dtype: DTypeLike) -> cl.Buffer:
        """Return a buffer like `upload` for the time of the build; CPUs read arrays in place.

        The caller keeps the array until the stream has ended.
        """
        if isinstance(array, cl.Buffer):
            return array
        host = np.ascontiguousarray(array, dtype)
        if not (self.device.info.is_cpu and host.nbytes >= _ZERO_COPY):
            return self.upload(host, dtype)
        flags = cl.mem_flags.READ_ONLY | cl.mem_flags.USE_HOST_PTR
        return host_buffer(self.device.context, flags, host)

    def read(self, buffer: cl.Buffer, n: int, dtype: DTypeLike) -> NDArray:
        """Wait and return the first n values of a buffer."""
        return self.stream.read(buffer, np.empty(n, dtype))

    def _enqueue(self, root: str, kernel: str, n: int, group: int, arguments: dict) -> None:
        program = self._programs.get(root)
        if program is None:
            program = self._programs[root] = build_program(self.device, _source(root))
        size = (-(-n // group) * group,)
        program.lend_kernel(kernel, arguments, lambda bound: self.stream.run(bound, size, (group,)))


_BUILD, _PACK, _REINSERT = "bvh/build.cl", "bvh/pack.cl", "bvh/reinsert.cl"
_COLLAPSE, _CURVE = "bvh/collapse.cl", "bvh/curve.cl"
_DEPTH = TREE_SIZES["depth"]
_RUN = 2048  # items that a work-item bounds; of a curve it also cuts them
_DIGIT, _INDEX = CURVE_KEYS["bits"], CURVE_KEYS["index"]
_CODE = 33  # bits of a key above the index
_CHUNKS = 4  # of a compute unit, for the sort
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
    n, ordered, leaves, parts = runs(building, count, items, parts, leaf_size)
    cut = {"leaf_size": 1, "at_once": 0, "runs": 1, "depth": _DEPTH}
    tree = _divided(building, n, leaves, parts, cut)
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


@dataclass(frozen=True)
class Collapse:
    """The binary nodes that become wide nodes and leaves, on the device.

    costs, occlusion: of the binary nodes; roots: binary nodes that become wide nodes; firsts: a
    wide node's first child and first leaf; leaf_roots: binary nodes that become wide leaves;
    totals: the numbers of both, and the wide tree's figures.
    """

    built: Tree
    costs: cl.Buffer
    occlusion: cl.Buffer
    roots: cl.Buffer
    firsts: cl.Buffer
    leaf_roots: cl.Buffer
    totals: cl.Buffer


@dataclass(frozen=True)
class Figures:
    """The numbers of a wide tree's nodes and leaves.

    steps: (begin, count) of the nodes of each level, the lowest first; stats: see `Bvh`.
    """

    nodes: int
    leaves: int
    steps: tuple[tuple[int, int], ...]
    stats: dict[str, float]


def collapse(building: Building, built: Tree) -> Collapse:
    """Enqueue the choice and numbering of wide nodes; the host does not wait."""
    n = built.count
    costs, occlusion = building.allocate(64 * n), building.allocate(8 * n)
    below = {"nodes": built.nodes, "costs": costs, "occlusion": occlusion}
    parts = {"items": built.items, "ranges": built.ranges, **below}
    begin = (1 << built.levels) - 1
    building.run(_COLLAPSE, "collapse_subtree", 1 << built.levels, begin=begin, **parts)
    for level in reversed(range(built.levels)):
        begin = (1 << level) - 1
        building.run(_COLLAPSE, "collapse_level", 1 << level, begin=begin, **parts)

    roots, firsts = building.allocate(4 * n), building.allocate(8 * n)
    leaf_roots, totals = building.allocate(4 * n), building.allocate(4 * (4 + _DEPTH))
    numbers = {"roots": roots, "firsts": firsts, "leaf_roots": leaf_roots, "totals": totals}
    binary = {"nodes": built.nodes, "costs": costs, "count": 2 * n}
    building.run(_COLLAPSE, "collapse_number", 1, **binary, **numbers)
    return Collapse(built, costs, occlusion, roots, firsts, leaf_roots, totals)


def figures(building: Building, chosen: Collapse) -> Figures:
    """Wait and return the figures of a wide tree."""
    words = building.read(chosen.totals, 4 + _DEPTH, np.uint32)
    n_nodes, n_leaves, levels = words[:3].tolist()
    starts = [*words[4 : 4 + levels].tolist(), n_nodes]
    steps = tuple((begin, end - begin) for begin, end in pairwise(starts))[::-1]
    cost = float(words[3:].view(np.float32)[0])
    stats = {"nodes": n_nodes, "leaves": n_leaves, "depth": levels - 1, "cost": cost}
    return Figures(n_nodes, n_leaves, steps, stats)


def write_nodes(building: Building, chosen: Collapse, nodes: cl.Buffer) -> None:
    """Enqueue writing of all wide nodes, or as many as the buffer holds."""
    building.run_each(
        _COLLAPSE, "collapse_nodes", nodes.size // 256, nodes=chosen.built.nodes,
        costs=chosen.costs, occlusion=chosen.occlusion, roots=chosen.roots, firsts=chosen.firsts,
        totals=chosen.totals, wide=nodes,
    )  # fmt: skip


def write_indices(building: Building, chosen: Collapse, indices: cl.Buffer) -> None:
    """Enqueue the boxes of leaves with a box each; binary leaves get these numbers."""
    built = chosen.built
    leaves = {"nodes": built.nodes, "items": built.items, "leaf_roots": chosen.leaf_roots}
    building.run_each(_COLLAPSE, "collapse_indices", built.count, indices=indices, **leaves)


def runs(
    building: Building, count: int, items: cl.Buffer, parts: cl.Buffer, leaf_size: int
) -> tuple[int, cl.Buffer, cl.Buffer, cl.Buffer]:
    """Cut items into leaves of at most `leaf_size` <= 8; wait for the number of leaves.

    Returns it, the items in the leaves' order, an item for each leaf, and their extents.
    """
    keys = _sorted(building, count, items, parts)
    stretches = -(-count // _RUN)
    ordered, lengths = building.allocate(32 * count), building.allocate(count)
    numbers = building.allocate(4 * (stretches + 1))
    curve = {"count": count, "run": _RUN, "sorted": ordered, "lengths": lengths}
    cut = {"items": items, "keys": keys, "leaf_size": leaf_size, "numbers": numbers}
    building.run(_CURVE, "curve_cut", stretches, **curve, **cut)
    building.run(_CURVE, "curve_scan", 1, numbers=numbers, rows=stretches, columns=1)
    n = int(building.read(numbers, stretches + 1, np.uint32)[-1])
    leaves, extents = building.allocate(32 * n), building.allocate(64 * stretches)
    output = {"numbers": numbers, "runs": leaves, "extents": extents}
    building.run(_CURVE, "curve_runs", stretches, **curve, **output)
    return n, ordered, leaves, extents


def _sorted(building: Building, count: int, items: cl.Buffer, parts: cl.Buffer) -> cl.Buffer:
    """Return the items' keys in ascending order."""
    whole, unused = building.allocate(64), building.allocate(16)
    root = {"parts": parts, "n_parts": parts.size // 64, "ranges": unused, "extents": whole}
    building.run(_BUILD, "build_root", 1, count=count, **root)
    keys, others = building.allocate(8 * count), building.allocate(8 * count)
    cells = _cells(building.read(whole, 16, np.float32)[8:])
    cells["tables"] = building.upload(cells["tables"], np.uint64)
    building.run_each(_CURVE, "curve_keys", count, items=items, keys=keys, **cells)
    chunk = -(-count // (_CHUNKS * building.device.info.compute_units))
    chunks = -(-count // chunk)
    numbers = building.allocate(4 * ((chunks << _DIGIT) + 1))
    chunked = {"count": count, "run": chunk, "numbers": numbers}
    for shift in range(_INDEX, _INDEX + _CODE, _DIGIT):
        building.run(_CURVE, "curve_count", chunks, keys=keys, shift=shift, **chunked)
        building.run(_CURVE, "curve_scan", 1, numbers=numbers, rows=chunks, columns=1 << _DIGIT)
        moved = {"keys": keys, "sorted": others}
        building.run(_CURVE, "curve_move", chunks, shift=shift, **moved, **chunked)
        keys, others = others, keys
    return keys


def _cells(span: NDArray[np.float32]) -> dict[str, Any]:
    """Return the arguments of `curve_keys`, which encodes doubled centroids.

    span: low corner and negated high corner of the doubled centroids, (8,). Each step halves a
    cell's longest side; the first step is the code's highest bit (Vinkler, Bittner and Havran 2017,
    "Extended Morton codes").
    """
    low = span[:3].astype(float)
    size = np.maximum(-span[4:7].astype(float) - low, 0.0)
    left, bits = size.copy(), np.zeros(3, int)
    tables = np.zeros((3, 2, 256), np.uint64)
    halved = []
    for _ in range(_CODE):
        axis = int(np.argmax(np.where(bits < 16, left, -1.0)))
        left[axis] /= 2
        bits[axis] += 1
        halved.append((axis, bits[axis]))
    for position, (axis, nth) in enumerate(reversed(halved)):
        byte, bit = divmod(int(bits[axis] - nth), 8)
        tables[axis, byte] |= (np.arange(256, dtype=np.uint64) >> bit & 1) << position
    scale = 0.999999 * 2.0**bits / np.maximum(size, 1e-30)  # finite as a float32
    return {"low": (*low, 0.0), "scale": (*scale, 0.0), "tables": tables}
