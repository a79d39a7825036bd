"""How much memory a device has left; OpenCL itself has no query for that."""

from __future__ import annotations

from pathlib import Path

import pyopencl as cl

_GPU_SHARE = 0.85  # a desktop and other programs keep some of a GPU's memory
_CGROUPS = (
    ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
    (
        "/sys/fs/cgroup/memory/memory.limit_in_bytes",
        "/sys/fs/cgroup/memory/memory.usage_in_bytes",
    ),
)


def free(device: cl.Device, is_cpu: bool, global_mem: int) -> int:
    """Return an estimate of what may be allocated on the device now [bytes]."""
    if is_cpu:
        return min(global_mem, host_available() or global_mem)
    if "cl_amd_device_attribute_query" in device.extensions:
        try:
            kib = device.get_info(cl.device_info.GLOBAL_FREE_MEMORY_AMD)
            return min(global_mem, int(kib[0] if isinstance(kib, list) else kib) * 1024)
        except cl.Error:
            pass
    return int(_GPU_SHARE * global_mem)


def host_available() -> int | None:
    """Return the host memory left to this process [bytes]; None where the system does not tell."""
    amounts = []
    try:
        for row in Path("/proc/meminfo").read_text().splitlines():
            if row.startswith("MemAvailable:"):
                amounts.append(int(row.split()[1]) * 1024)
    except OSError:
        pass
    for limit, usage in _CGROUPS:
        try:
            amounts.append(int(Path(limit).read_text()) - int(Path(usage).read_text()))
        except (OSError, ValueError):  # no cgroup of that version, or the limit is "max"
            continue
    return max(0, min(amounts)) if amounts else None
