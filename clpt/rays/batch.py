"""Rays and hits as arguments of kernels: numpy arrays, or PyOpenCL arrays used in place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray
from pyopencl.array import Array

from ..arrays import real
from ..device import host_buffer
from ..errors import SceneError

ArrayInput: TypeAlias = Any  # an array or sequence of numbers, a pyopencl Array, or a Buffer
Columns = Mapping[str, tuple[int, type]]  # by result: columns, 0 for a single axis, and the type


@dataclass
class DeviceArg:
    """Values on the device as a kernel's argument.

    buffer: None for no values; rows: their number; offset: of the first in the buffer [elements];
    events: to wait for before reading.
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

    columns: of its rows, 0 for a single axis; dtypes: allowed dtypes, the first for buffers. Raises
    SceneError, which names the argument and its actual shape and type.
    """
    if array.context != context:
        raise SceneError("it belongs to another context than the queue", where=name)
    size = np.dtype(dtypes[0]).itemsize
    if not isinstance(array, Array):
        rows, remainder = divmod(array.size, size * max(columns, 1))
        if remainder:
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


def _wrong(name: str, actual: object, columns: int, dtype: type) -> SceneError:
    wanted = f"(n, {columns})" if columns else "(n,)"
    return SceneError(f"{wanted} {np.dtype(dtype)} is wanted, not {actual}", where=name)


def vectors(name: str, array: ArrayInput) -> NDArray[np.float32]:
    """Return an array of the host as C-contiguous (n, 3) float32; a vector becomes a row."""
    try:
        rows = np.atleast_2d(np.asarray(array, np.float32))
    except (TypeError, ValueError) as error:
        raise SceneError(f"it is no array of numbers: {error}", where=name) from error
    if rows.size == 0:
        return np.zeros((0, 3), np.float32)
    if rows.ndim != 2 or rows.shape[1] != 3:
        raise _wrong(name, np.shape(array), 3, np.float32)
    return np.ascontiguousarray(rows)


@dataclass(frozen=True)
class Rays:
    """Rays on the device.

    from_host: whether origins and directions are on the host, which then waits for the hits;
    arguments: of the kernel by name; arrays: origins, directions, t_min and t_max.
    """

    count: int
    from_host: bool
    arguments: dict[str, Any]
    arrays: tuple[DeviceArg, ...]


def rays(
    context: cl.Context,
    shares: bool,
    origins: ArrayInput,
    directions: ArrayInput,
    t_min: ArrayInput,
    t_max: ArrayInput,
) -> Rays:
    """Check a batch and return it as arguments, with copies of host arrays. Raises SceneError.

    shares: whether the device uses the host's memory, so that no copy is needed.
    """
    both = {"origins": origins, "directions": directions}
    from_host = not any(map(on_device, both.values()))
    checked: dict[str, Any] = {
        name: device_arg(context, name, array, 3, np.float32)
        if on_device(array)
        else vectors(name, array)
        for name, array in both.items()
    }
    lengths = [a.rows if isinstance(a, DeviceArg) else len(a) for a in checked.values()]
    count = max(lengths) if min(lengths) else 0
    arrays: dict[str, DeviceArg] = {}
    for name, argument in checked.items():
        if not isinstance(argument, DeviceArg):
            repeated = np.repeat(argument, count, 0) if len(argument) == 1 else argument
            argument = wrap_host(context, repeated, from_host and shares)
        if argument.rows != count:
            message = f"{lengths[0]} origins have {lengths[1]} directions"
            raise SceneError(message, where="directions")
        arrays[name] = argument
    arguments: dict[str, Any] = {name: a.buffer for name, a in arrays.items()}
    for name, limit in (("t_min", t_min), ("t_max", t_max)):
        each = _limits(context, name, limit, count, from_host and shares)
        arrays[name] = each or DeviceArg(None, count)
        arguments |= {
            f"{name}s": arrays[name].buffer,
            name: 0.0 if each else real(limit, name),
        }
    return Rays(count, from_host, arguments, tuple(arrays.values()))


def _limits(
    context: cl.Context, name: str, limit: ArrayInput, count: int, shared: bool
) -> DeviceArg | None:
    """Return a limit of each ray's interval; None for a common number."""
    if on_device(limit):
        each = device_arg(context, name, limit, 0, np.float32)
    elif np.ndim(limit) == 0:
        return None
    else:
        each = wrap_host(context, np.ascontiguousarray(limit, np.float32).ravel(), shared)
    if each.rows != count:
        raise SceneError(f"{count} rays have {each.rows} of it", where=name)
    return each


def wrap_host(context: cl.Context, array: NDArray[Any], shared: bool) -> DeviceArg:
    """Return an array of the host as an argument.

    shared: the kernel uses the array in place, and the caller keeps it until the kernel has ended;
    otherwise a copy.
    """
    if not array.size:
        return DeviceArg(None, len(array))
    flags = cl.mem_flags
    access = flags.READ_WRITE if array.flags.writeable else flags.READ_ONLY
    memory = flags.USE_HOST_PTR if shared else flags.COPY_HOST_PTR
    return DeviceArg(host_buffer(context, access | memory, array), len(array))


def results(
    queue: cl.CommandQueue, count: int, columns: Columns, out: Mapping[str, Any]
) -> tuple[dict[str, Array], dict[str, DeviceArg]]:
    """Return arrays on the device for the hits of `count` rays, and their arguments.

    Arrays in `out` are reused. Raises SceneError if an array does not fit.
    """
    arrays: dict[str, Array] = {}
    arguments: dict[str, DeviceArg] = {}
    for name, (width, kind) in columns.items():
        array = out.get(name)
        if array is None:
            array = Array(queue, (count, width) if width else (count,), kind)
        elif not isinstance(array, Array):
            raise SceneError(f"its {name} is no array on the device", where="out")
        argument = device_arg(queue.context, name, array, width, kind)
        if argument.rows != count:
            raise SceneError(f"{count} rays have {argument.rows} {name} in it", where="out")
        arrays[name], arguments[name] = array, argument
    return arrays, arguments


def host_results(
    context: cl.Context, shares: bool, count: int, columns: Columns
) -> tuple[dict[str, NDArray[Any]], dict[str, DeviceArg]]:
    """Return arrays on the host for the hits of `count` rays, and their arguments."""
    arrays: dict[str, NDArray[Any]] = {
        name: np.empty((count, width) if width else count, kind)
        for name, (width, kind) in columns.items()
    }
    return arrays, {name: wrap_host(context, array, shares) for name, array in arrays.items()}


def offsets(arrays: Sequence[DeviceArg]) -> tuple[int, ...]:
    """Return the kernels' `begins`: offsets of eight arrays, padded with 0."""
    return (*(array.offset for array in arrays), *[0] * (8 - len(arrays)))
