"""How much memory a device has left; OpenCL itself has no query for that."""

from __future__ import annotations

from pathlib import Path

import pyopencl as cl

_GPU_SHARE = 0.85  # a desktop and other programs keep some of a GPU's memory
# Files of a control group, versions 2 and 1: the limit, what is used, and the pages of files that
# nobody has used of late. These count as used, but the kernel gives them up first.
_CGROUPS = (
    ("memory.max", "memory.current", "inactive_file"),
    ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes", "total_inactive_file"),
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


def host_available(root: Path = Path("/sys/fs/cgroup")) -> int | None:
    """Return the host memory left to this process [bytes]; None where the system does not tell.

    root: the folder of the process's control group, whose limit counts too.
    """
    amounts = []
    try:
        for row in Path("/proc/meminfo").read_text().splitlines():
            if row.startswith("MemAvailable:"):
                amounts.append(int(row.split()[1]) * 1024)
    except OSError:
        pass
    for limit, usage, files in _CGROUPS:
        try:
            left = int((root / limit).read_text()) - int((root / usage).read_text())
            stat = (root / usage).with_name("memory.stat").read_text().splitlines()
            inactive = dict(row.split() for row in stat).get(files, 0)
            amounts.append(left + int(inactive))
        except (OSError, ValueError):  # no cgroup of that version, or the limit is "max"
            continue
    return max(0, min(amounts)) if amounts else None
