"""Leaves cut out of a space-filling curve, for fast builds; kernels/bvh/curve.cl has the steps."""

from __future__ import annotations

import numpy as np
import pyopencl as cl

from .building import Building

_CURVE, _BUILD = "bvh/curve.cl", "bvh/build.cl"
_BITS, _INDEX = 11, 31  # CURVE_BITS and CURVE_INDEX of that file
_CHUNKS = 4  # for each compute unit, to sort
_RUN = 2048  # items of the curve that one work-item cuts, and puts into the tree's bounds


def runs(
    building: Building, count: int, items: cl.Buffer, parts: cl.Buffer, leaf_size: int
) -> tuple[int, cl.Buffer, cl.Buffer, cl.Buffer]:
    """Cut items into leaves of at most `leaf_size` <= 8; waits for their number.

    Returns it, the items in the leaves' order, items that stand for leaves, and their extents.
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
    found, extents = building.allocate(32 * n), building.allocate(64 * stretches)
    made = {"numbers": numbers, "runs": found, "extents": extents}
    building.run(_CURVE, "curve_runs", stretches, **curve, **made)
    return n, ordered, found, extents


def _sorted(building: Building, count: int, items: cl.Buffer, parts: cl.Buffer) -> cl.Buffer:
    """The items' keys, ascending."""
    whole, unused = building.allocate(64), building.allocate(16)
    n_parts = parts.size // 64
    root = {"parts": parts, "n_parts": n_parts, "ranges": unused, "extents": whole}
    building.run(_BUILD, "build_root", 1, count=count, **root)
    keys, others = building.allocate(8 * count), building.allocate(8 * count)
    building.run_each(_CURVE, "curve_keys", count, items=items, whole=whole, keys=keys)
    chunk = -(-count // (_CHUNKS * building.device.info.compute_units))
    chunks = -(-count // chunk)
    numbers = building.allocate(4 * ((chunks << _BITS) + 1))
    chunked = {"count": count, "run": chunk, "numbers": numbers}
    for digit in range(3):
        shift = _INDEX + _BITS * digit
        building.run(_CURVE, "curve_count", chunks, keys=keys, shift=shift, **chunked)
        building.run(_CURVE, "curve_scan", 1, numbers=numbers, rows=chunks, columns=1 << _BITS)
        moved = {"keys": keys, "sorted": others}
        building.run(_CURVE, "curve_move", chunks, shift=shift, **moved, **chunked)
        keys, others = others, keys
    return keys
