"""The binary tree that every layout starts from, built on the device."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np
import pyopencl as cl

from .. import device as dev
from ..errors import MemoryBudgetError

_GROUP = 8  # work-items of a group in kernels with one for each triangle or node
_RUN = 2048  # items whose bounds one work-item finds
_PROGRAMS: weakref.WeakKeyDictionary[dev.Device, dict[str, dev.Program]]
_PROGRAMS = weakref.WeakKeyDictionary()


def run(device: dev.Device, root: str, kernel: str, n: int, group: int = 1, **arguments) -> None:
    """Enqueue `kernel` of the program at `root` over at least n work-items.

    Programs are kept as long as the device is.
    """
    programs = _PROGRAMS.setdefault(device, {})
    if root not in programs:
        programs[root] = dev.build(device, dev.assemble(root))
    bound = programs[root].kernel(kernel).bind(**arguments)
    bound.enqueue(device.queue, (-(-n // group) * group,), (group,))


def run_each(device: dev.Device, root: str, kernel: str, n: int, **arguments) -> None:
    """As `run`, for kernels that take `count` and look at it: one work-item for each of n."""
    run(device, root, kernel, n, _GROUP, count=n, **arguments)


def allocate(device: dev.Device, n_bytes: int) -> cl.Buffer:
    """A device buffer. Raises MemoryBudgetError where one of that size cannot be."""
    limit = device.info.max_alloc
    if n_bytes > limit:
        raise MemoryBudgetError(
            "a buffer of the acceleration structure", n_bytes, limit, "use fewer triangles"
        )
    return cl.Buffer(device.context, cl.mem_flags.READ_WRITE, max(n_bytes, 4))


def upload(device: dev.Device, array: np.ndarray | cl.Buffer, dtype: type) -> cl.Buffer:
    """The array on the device, as `dtype`; a buffer is taken as it is."""
    if isinstance(array, cl.Buffer):
        return array
    array = np.ascontiguousarray(array, dtype)
    buffer = allocate(device, array.nbytes)
    if array.nbytes:
        cl.enqueue_copy(device.queue, buffer, array)
    return buffer


@dataclass(frozen=True)
class Tree:
    """A binary tree over items, as kernels/bvh/build.cl describes it.

    items: n float8, nodes: 2n float8; ranges: the heap of ranges, `levels` levels above subtrees.
    """

    device: dev.Device
    count: int
    items: cl.Buffer
    nodes: cl.Buffer
    ranges: cl.Buffer
    levels: int


def over_triangles(device: dev.Device, count: int, vertices: cl.Buffer, faces: cl.Buffer) -> Tree:
    """Build over `count` triangles."""
    return _build(device, count, "build_triangles", vertices=vertices, faces=faces)


def over_boxes(device: dev.Device, count: int, boxes: cl.Buffer) -> Tree:
    """Build over `count` boxes, each a low and a high corner."""
    return _build(device, count, "build_boxes", boxes=boxes)


def items_only(device: dev.Device, count: int, vertices: cl.Buffer, faces: cl.Buffer) -> cl.Buffer:
    """The items of `count` triangles in the caller's order."""
    items, _, _ = _items(device, count, "build_triangles", vertices=vertices, faces=faces)
    return items


def _items(
    device: dev.Device, count: int, kernel: str, **source: cl.Buffer
) -> tuple[cl.Buffer, cl.Buffer, int]:
    items = allocate(device, 32 * count)
    parts = -(-count // _RUN)
    halves = allocate(device, 64 * parts)
    arguments = dict(count=count, run=_RUN, items=items, halves=halves, **source)
    run(device, "bvh/build.cl", kernel, parts, **arguments)
    return items, halves, parts


def _build(device: dev.Device, count: int, kernel: str, **source: cl.Buffer) -> Tree:
    items, parts, n_parts = _items(device, count, kernel, **source)
    levels = int(min(np.log2(device.info.compute_units) + 6, np.log2(count))) if count > 1 else 0
    size = 2 ** (levels + 1) - 1
    ranges, halves = allocate(device, 16 * size), allocate(device, 64 * size)
    nodes = allocate(device, 64 * count)
    root = "bvh/build.cl"
    run(device, root, "build_root", 1, parts=parts, n_parts=n_parts, count=count, ranges=ranges,
        halves=halves)  # fmt: skip
    shared = dict(items=items, nodes=nodes, ranges=ranges, halves=halves)
    for level in range(levels):
        run(device, root, "build_level", 2**level, begin=2**level - 1, **shared)
    run(device, root, "build_subtree", 2**levels, begin=2**levels - 1, **shared)
    return Tree(device, count, items, nodes, ranges, levels)
