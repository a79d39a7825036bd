"""Arrays that may lie on a device, read by who does not need OpenCL."""

from __future__ import annotations

import sys
from typing import Any


def on_host(values: Any) -> Any:
    """Return values in host memory; of an array on a device a copy, for which it waits."""
    module = sys.modules.get("pyopencl.array")  # whoever has such an array has imported it
    return values.get() if module and isinstance(values, module.Array) else values


def on_device(values: Any) -> bool:
    """Return whether values lie in device memory, an array or a buffer."""
    opencl, module = sys.modules.get("pyopencl"), sys.modules.get("pyopencl.array")
    array = module is not None and isinstance(values, module.Array)
    return array or (opencl is not None and isinstance(values, opencl.Buffer))
