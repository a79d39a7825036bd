"""A batch of rays on its way to the device, and the arrays that its hits go to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray
from pyopencl.array import Array

from ..errors import SceneError
from .arrays import DeviceArg, Given, device_arg, on_device, vectors

Made = Mapping[str, tuple[int, type]]  # name: (columns, 0 if it has one axis; type) of a result


@dataclass(frozen=True)
class Rays:
    """Rays on the device.

    waits: whether they came from the host, which then waits for the hits; named: arguments of the
    kernel; held: the arrays among them.
    """

    count: int
    waits: bool
    named: dict[str, Any]
    device_arg: tuple[DeviceArg, ...]


def rays(
    context: cl.Context,
    shares: bool,
    origins: Given,
    directions: Given,
    t_min: Given,
    t_max: Given,
) -> Rays:
    """Check a batch, and put on the device what is not there. Raises SceneError.

    shares: whether the device works in the host's memory.
    """
    both = {"origins": origins, "directions": directions}
    waits = not any(map(on_device, both.values()))
    looked: dict[str, Any] = {
        name: device_arg(context, name, given, 3, np.float32)
        if on_device(given)
        else vectors(name, given)
        for name, given in both.items()
    }
    lengths = [one.rows if isinstance(one, DeviceArg) else len(one) for one in looked.values()]
    count = max(lengths) if min(lengths) else 0
    for name, one in looked.items():
        if not isinstance(one, DeviceArg):
            same = np.repeat(one, count, 0) if len(one) == 1 else one
            looked[name] = wrap_host(context, same, waits and shares)
        if looked[name].rows != count:
            message = f"{lengths[0]} origins have {lengths[1]} directions"
            raise SceneError(message, where="directions")
    named: dict[str, Any] = {name: one.buffer for name, one in looked.items()}
    for name, given in (("t_min", t_min), ("t_max", t_max)):
        each = _ends(context, name, given, count, waits and shares)
        looked[name] = each or DeviceArg(None, count)
        named |= {f"{name}s": looked[name].buffer, name: 0.0 if each else given}
    return Rays(count, waits, named, tuple(looked.values()))


def _ends(
    context: cl.Context, name: str, given: Given, count: int, shared: bool
) -> DeviceArg | None:
    """Where each of the rays begins or ends; None if one number says it."""
    if on_device(given):
        each = device_arg(context, name, given, 0, np.float32)
    elif isinstance(given, (int, float)) or np.ndim(given) == 0:
        return None
    else:
        each = wrap_host(context, np.ascontiguousarray(given, np.float32).ravel(), shared)
    if each.rows != count:
        raise SceneError(f"{count} rays have {each.rows} of it", where=name)
    return each


def wrap_host(context: cl.Context, array: NDArray[Any], shared: bool) -> DeviceArg:
    """An array of the host for a kernel: where it lies, for one that is waited for, or a copy."""
    if not array.size:
        return DeviceArg(None, len(array))
    flags = cl.mem_flags
    access = flags.READ_WRITE if array.flags.writeable else flags.READ_ONLY
    how = flags.USE_HOST_PTR if shared else flags.COPY_HOST_PTR
    return DeviceArg(cl.Buffer(context, access | how, hostbuf=array), len(array))


def results(
    queue: cl.CommandQueue, count: int, made: Made, out: Mapping[str, Any]
) -> tuple[dict[str, Array], dict[str, DeviceArg]]:
    """Arrays on the device for the hits of `count` rays, and as the kernel takes them.

    Those of `out` are taken where they are given. Raises SceneError if one of these does not fit.
    """
    arrays: dict[str, Array] = {}
    places: dict[str, DeviceArg] = {}
    for name, (columns, kind) in made.items():
        array = out.get(name)
        if array is None:
            array = Array(queue, (count, columns) if columns else (count,), kind)
        elif not isinstance(array, Array):
            raise SceneError(f"its {name} is no array on the device", where="out")
        place = device_arg(queue.context, name, array, columns, kind)
        if place.rows != count:
            raise SceneError(f"{count} rays have {place.rows} {name} in it", where="out")
        arrays[name], places[name] = array, place
    return arrays, places


def host_results(
    context: cl.Context, shares: bool, count: int, made: Made
) -> tuple[dict[str, NDArray[Any]], dict[str, DeviceArg]]:
    """The same on the host, for a kernel that is waited for."""
    arrays: dict[str, NDArray[Any]] = {
        name: np.empty((count, columns) if columns else count, kind)
        for name, (columns, kind) in made.items()
    }
    return arrays, {name: wrap_host(context, array, shares) for name, array in arrays.items()}


def offsets(parts: Sequence[DeviceArg]) -> tuple[int, ...]:
    """The kernels' `begins`: where eight arrays begin, those that are not there at 0."""
    return (*(part.begin for part in parts), *[0] * (8 - len(parts)))
