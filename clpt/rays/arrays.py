"""What callers give: numpy arrays, or PyOpenCL arrays and buffers that are used where they lie."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray
from pyopencl.array import Array

from ..errors import SceneError

Given: TypeAlias = Any  # what numpy makes an array of, a pyopencl Array, or a Buffer


@dataclass
class DeviceArg:
    """Values on the device.

    buffer: what they lie in, None for none at all; begin: where, in elements; rows: how many;
    events: that they wait for.
    """

    buffer: Any
    rows: int
    begin: int = 0
    events: Sequence[cl.Event] = ()


def on_device(given: Given) -> bool:
    """Whether this is no data of the host."""
    return isinstance(given, (Array, cl.MemoryObjectHolder))


def device_arg(
    context: cl.Context, name: str, given: Given, columns: int, *dtypes: type
) -> DeviceArg:
    """An argument that is on the device, looked at.

    columns: of its rows, 0 if it has one axis; dtypes: those it may have, the first that of a
    buffer. Raises SceneError, telling the argument's name and what it is instead.
    """
    if not given.context == context:
        raise SceneError("it belongs to another context than the queue", where=name)
    size = np.dtype(dtypes[0]).itemsize
    if not isinstance(given, Array):
        rows, rest = divmod(given.size, size * max(columns, 1))
        if rest:
            raise _wrong(name, f"{given.size} bytes", columns, dtypes[0])
        return DeviceArg(given, rows)
    shape = given.shape
    if len(shape) != (2 if columns else 1) or (columns and shape[1] != columns):
        raise _wrong(name, shape, columns, dtypes[0])
    if given.dtype.type not in dtypes:
        raise _wrong(name, f"{shape} {given.dtype}", columns, dtypes[0])
    if not given.flags.c_contiguous:
        raise SceneError(f"its rows do not stand behind each other: {given.strides}", where=name)
    return DeviceArg(given.base_data, shape[0], given.offset // size, given.events)


def _wrong(name: str, found: Any, columns: int, dtype: type) -> SceneError:
    wanted = f"(n, {columns})" if columns else "(n,)"
    return SceneError(f"{wanted} {np.dtype(dtype)} is wanted, not {found}", where=name)


def vectors(name: str, given: Given) -> NDArray[np.float32]:
    """An argument on the host as (n, 3) float32, C-contiguous; a single vector is one row."""
    try:
        array = np.atleast_2d(np.asarray(given, np.float32))
    except (TypeError, ValueError) as error:
        raise SceneError(f"it is no array of numbers: {error}", where=name) from error
    if array.size == 0:
        return np.zeros((0, 3), np.float32)
    if array.ndim != 2 or array.shape[1] != 3:
        raise _wrong(name, np.shape(given), 3, np.float32)
    return np.ascontiguousarray(array)
