"""Leaves cut from a space-filling curve, for fast builds, by kernels/bvh/curve.cl."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from ..records import CURVE_KEYS
from .building import Building

_CURVE, _BUILD = "bvh/curve.cl", "bvh/build.cl"
_DIGIT, _INDEX = CURVE_KEYS["bits"], CURVE_KEYS["index"]
_CODE = 33  # bits of a key above the index
_CHUNKS = 4  # of a compute unit, for the sort
_RUN = 2048  # items of the curve that a work-item cuts and bounds


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
