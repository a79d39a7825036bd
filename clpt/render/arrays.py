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
