"""Filters of meshopt compression, appendix B of KHR_meshopt_compression."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Bytes

FILTERS = ("NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR")


def apply(values: Bytes, name: str) -> Bytes:
    """Undo a filter on elements (count, stride). Raises ValueError for a stride it cannot have."""
    stride = values.shape[1]
    strides = {"OCTAHEDRAL": (4, 8), "QUATERNION": (8,), "COLOR": (4, 8)}
    if stride not in strides.get(name, (stride,)):
        raise ValueError(f"{name} is not for {stride} bytes")
    if name == "NONE":
        return values
    if name == "EXPONENTIAL":
        words = values.view("<i4")
        made = np.ldexp((words << 8 >> 8).astype(np.float32), words >> 24).astype("<f4")
        return made.view(np.uint8)
    made = {"OCTAHEDRAL": _octahedral, "QUATERNION": _quaternion, "COLOR": _colour}[name](
        values.view(f"<i{stride // 4}")
    )
    return np.ascontiguousarray(made).view(np.uint8)


def _octahedral(values: NDArray[Any]) -> NDArray[Any]:
    largest = np.iinfo(values.dtype).max
    one = np.maximum(values[:, 2].astype(np.float64), 1.0)
    x, y = values[:, 0] / one, values[:, 1] / one
    z = 1.0 - np.abs(x) - np.abs(y)
    t = np.minimum(z, 0.0)
    unit = np.stack([x - np.copysign(t, x), y - np.copysign(t, y), z], axis=1)
    unit *= largest / np.maximum(np.linalg.norm(unit, axis=1, keepdims=True), 1e-30)
    return np.concatenate([_rounded(unit, values.dtype), values[:, 3:]], axis=1)


def _quaternion(values: NDArray[Any]) -> NDArray[Any]:
    one = np.maximum((values[:, 3:] | 3).astype(np.float64), 1.0)
    rest = values[:, :3] / one / math.sqrt(2.0)
    w = np.sqrt(np.maximum(1.0 - (rest**2).sum(axis=1), 0.0))
    # The largest component, which is left out, stands before the others in turn.
    order = ((values[:, 3:] & 3) + np.arange(4)) % 4
    made = np.empty((len(values), 4))
    np.put_along_axis(made, order.astype(np.int64), np.column_stack([w, rest]), axis=1)
    return _rounded(made * 32767.0, values.dtype)


def _colour(values: NDArray[Any]) -> NDArray[Any]:
    unsigned = np.dtype(f"<u{values.dtype.itemsize}")
    alpha = values[:, 3].astype(np.int64) & int(np.iinfo(unsigned).max)
    y = values[:, 0].astype(np.int64) & int(np.iinfo(unsigned).max)
    co, cg = values[:, 1].astype(np.int64), values[:, 2].astype(np.int64)
    bits = np.floor(np.log2(np.maximum(alpha, 1))).astype(np.int64)
    scale = (1 << bits + 1) - 1
    a = alpha & scale >> 1
    made = np.stack([y + co - cg, y + cg, y - co - cg, a << 1 | a & 1], axis=1)
    return _rounded(made * (np.iinfo(unsigned).max / scale[:, None]), unsigned)


def _rounded(values: NDArray[np.float64], dtype: np.dtype[Any]) -> NDArray[Any]:
    """To the nearest whole number, halves away from zero."""
    limits = np.iinfo(dtype)
    whole = np.copysign(np.floor(np.abs(values) + 0.5), values)
    return np.clip(whole, limits.min, limits.max).astype(dtype)
