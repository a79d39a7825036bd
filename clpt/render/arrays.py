"""Arrays of a scene that may lie on a device: `pyopencl.array.Array` and `pyopencl.Buffer`."""

from __future__ import annotations

from typing import Any

import pyopencl as cl
import pyopencl.array as cl_array


def on_device(values: Any) -> bool:
    """Return whether values lie in device memory."""
    return isinstance(values, (cl_array.Array, cl.Buffer))


def on_host(values: Any) -> Any:
    """Return values in host memory; of an array on a device a copy, for which it waits."""
    return values.get() if isinstance(values, cl_array.Array) else values


def another(values: Any) -> Any:
    """Return another object for the same memory on a device: what it holds may be other now."""
    if isinstance(values, cl_array.Array):
        return values.view()
    return cl.Buffer.from_int_ptr(values.int_ptr)
