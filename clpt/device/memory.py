"""Estimate of a device's free memory: OpenCL itself has no query for it."""

from __future__ import annotations

import pyopencl as cl

from clpt.files import host_memory

_GPU_SHARE = 0.85  # a desktop and other programs keep some of a GPU's memory


def free(device: cl.Device, is_cpu: bool, global_mem: int) -> int:
    """Return an estimate of what may be allocated on the device now [bytes]."""
    if is_cpu:
        return min(global_mem, host_memory.available() or global_mem)
    if "cl_amd_device_attribute_query" in device.extensions:
        try:
            kib = device.get_info(cl.device_info.GLOBAL_FREE_MEMORY_AMD)
            return min(global_mem, int(kib[0] if isinstance(kib, list) else kib) * 1024)
        except cl.Error:
            pass
    return int(_GPU_SHARE * global_mem)
