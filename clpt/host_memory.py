"""Memory of the host that is left to this process."""

from __future__ import annotations

import os
from pathlib import Path

# Files of a control group, versions 2 and 1: the limit, what is used, and the pages of files that
# nobody has used of late. These count as used, but the kernel gives them up first.
_CGROUPS = (
    ("memory.max", "memory.current", "inactive_file"),
    ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes", "total_inactive_file"),
)


def available(root: Path = Path("/sys/fs/cgroup")) -> int | None:
    """Return the host memory left to this process [bytes]; None where the system does not tell.

    root: the folder of the process's control group, whose limit counts too, as does `ulimit -v`.
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
    amounts += _of_process()
    return max(0, min(amounts)) if amounts else None


def _of_process() -> list[int]:
    """Return what the limit of the process's addresses leaves [bytes], if there is one."""
    try:
        import resource  # not on Windows

        most, _ = resource.getrlimit(resource.RLIMIT_AS)
        if most == resource.RLIM_INFINITY:
            return []
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        return [most - pages * os.sysconf("SC_PAGE_SIZE")]
    except (ImportError, OSError, ValueError):
        return []
