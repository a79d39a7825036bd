"""Arrays of callers: numpy arrays, or PyOpenCL arrays and buffers that are used in place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray
from pyopencl.array import Array

from ..errors import SceneError

ArrayInput: TypeAlias = Any  # an array or sequence of numbers, a pyopencl Array, or a Buffer


@dataclass
class DeviceArg:
    """Values on the device, as a kernel takes them.

    buffer: None for no values; rows: how many; offset: of the first in the buffer [elements];
    events: that they wait for.
    """

    buffer: Any
    rows: int
    offset: int = 0
    events: Sequence[cl.Event] = ()


def on_device(array: ArrayInput) -> bool:
    """Return whether an array is in device memory."""
    return isinstance(array, (Array, cl.MemoryObjectHolder))


def device_arg(
    context: cl.Context, name: str, array: ArrayInput, columns: int, *dtypes: type
) -> DeviceArg:
    """Return an array on the device as an argument.

    columns: of its rows, 0 if it has one axis; dtypes: those it may have, the first that of a
    buffer. Raises SceneError, which names the argument and says what it is instead.
    """
    if array.context != context:
        raise SceneError("it belongs to another context than the queue", where=name)
    size = np.dtype(dtypes[0]).itemsize
    if not isinstance(array, Array):
        rows, rest = divmod(array.size, size * max(columns, 1))
        if rest:
            raise _wrong(name, f"{array.size} bytes", columns, dtypes[0])
        return DeviceArg(array, rows)
    shape = array.shape
    if len(shape) != (2 if columns else 1) or (columns and shape[1] != columns):
        raise _wrong(name, shape, columns, dtypes[0])
    if array.dtype.type not in dtypes:
        raise _wrong(name, f"{shape} {array.dtype}", columns, dtypes[0])
    if not array.flags.c_contiguous:
        raise SceneError(f"its rows are not contiguous: {array.strides}", where=name)
    return DeviceArg(array.base_data, shape[0], array.offset // size, array.events)


def _wrong(name: str, found: object, columns: int, dtype: type) -> SceneError:
    wanted = f"(n, {columns})" if columns else "(n,)"
    return SceneError(f"{wanted} {np.dtype(dtype)} is wanted, not {found}", where=name)


def vectors(name: str, array: ArrayInput) -> NDArray[np.float32]:
    """Return an array of the host as (n, 3) float32, C-contiguous; a single vector is one row."""
    try:
        rows = np.atleast_2d(np.asarray(array, np.float32))
    except (TypeError, ValueError) as error:
        raise SceneError(f"it is no array of numbers: {error}", where=name) from error
    if rows.size == 0:
        return np.zeros((0, 3), np.float32)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise _wrong(name, np.shape(array), 3, np.float32)
    return np.ascontiguousarray(rows)
