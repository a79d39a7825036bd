"""A batch of rays as arguments of a kernel, and the arrays that its hits go to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray
from pyopencl.array import Array

from .. import scalars
from ..device import host_buffer
from ..errors import SceneError
from .arrays import ArrayInput, DeviceArg, device_arg, on_device, vectors

Columns = Mapping[str, tuple[int, type]]  # of results: columns, 0 for one axis, and the type


@dataclass(frozen=True)
class Rays:
    """Rays on the device.

    from_host: whether origins and directions came from the host, which then waits for the hits;
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
    """Return a batch as arguments, checked, with copies of what is on the host. Raises SceneError.

    shares: whether the device works in the host's memory, so that nothing needs to be copied.
    """
    both = {"origins": origins, "directions": directions}
    from_host = not any(map(on_device, both.values()))
    checked: dict[str, Any] = {
        name: device_arg(context, name, array, 3, np.float32)
        if on_device(array)
        else vectors(name, array)
        for name, array in both.items()
    }
    lengths = [one.rows if isinstance(one, DeviceArg) else len(one) for one in checked.values()]
    count = max(lengths) if min(lengths) else 0
    arrays: dict[str, DeviceArg] = {}
    for name, one in checked.items():
        if not isinstance(one, DeviceArg):
            whole = np.repeat(one, count, 0) if len(one) == 1 else one
            one = wrap_host(context, whole, from_host and shares)
        if one.rows != count:
            message = f"{lengths[0]} origins have {lengths[1]} directions"
            raise SceneError(message, where="directions")
        arrays[name] = one
    arguments: dict[str, Any] = {name: one.buffer for name, one in arrays.items()}
    for name, limit in (("t_min", t_min), ("t_max", t_max)):
        each = _limits(context, name, limit, count, from_host and shares)
        arrays[name] = each or DeviceArg(None, count)
        arguments |= {
            f"{name}s": arrays[name].buffer,
            name: 0.0 if each else scalars.real(limit, name),
        }
    return Rays(count, from_host, arguments, tuple(arrays.values()))


def _limits(
    context: cl.Context, name: str, limit: ArrayInput, count: int, shared: bool
) -> DeviceArg | None:
    """Where each ray begins or ends; None if one number holds for all."""
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

    shared: the kernel works in the array itself, which the caller keeps until the kernel has ended;
    otherwise in a copy.
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
    """Return arrays on the device for the hits of `count` rays, and as arguments.

    Those in `out` are used again. Raises SceneError if one of them does not fit.
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
    """Return the same on the host, for a kernel that is waited for."""
    arrays: dict[str, NDArray[Any]] = {
        name: np.empty((count, width) if width else count, kind)
        for name, (width, kind) in columns.items()
    }
    return arrays, {name: wrap_host(context, array, shares) for name, array in arrays.items()}


def offsets(arrays: Sequence[DeviceArg]) -> tuple[int, ...]:
    """Return the kernels' `begins`: the offsets of eight arrays, 0 where there are fewer."""
    return (*(array.offset for array in arrays), *[0] * (8 - len(arrays)))
