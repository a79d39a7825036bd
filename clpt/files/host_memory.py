"""Memory of the host that is left to this process."""

from __future__ import annotations

import os
from pathlib import Path

# Files of a control group, versions 2 and 1: the limit, what is used, and the pages of files that
# nobody has used of late. These count as used, but the kernel gives them up first.
_CGROUPS = (
    ("memory.max", "memory.current", "inactive_file"),
    ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
)


def available(
    root: Path = Path("/sys/fs/cgroup"), membership: Path = Path("/proc/self/cgroup")
) -> int | None:
    """Return the host memory left to this process [bytes]; None where the system does not tell.

    The limits of the process's control group and of all groups that hold it count too, as does
    `ulimit -v`. root: the folder of all groups; membership: the file that names the process's.
    """
    amounts = []
    try:
        for row in Path("/proc/meminfo").read_text().splitlines():
            if row.startswith("MemAvailable:"):
                amounts.append(int(row.split()[1]) * 1024)
    except OSError:
        pass
    for group in _groups(root, membership):
        for limit, usage, files in _CGROUPS:
            try:
                left = int((group / limit).read_text()) - int((group / usage).read_text())
                stat = (group / "memory.stat").read_text().splitlines()
                inactive = dict(row.split() for row in stat).get(files, 0)
                amounts.append(left + int(inactive))
            except (OSError, ValueError):  # no cgroup of that version, or the limit is "max"
                continue
    amounts += _of_process()
    return max(0, min(amounts)) if amounts else None


def _groups(root: Path, membership: Path) -> set[Path]:
    """Return the folders of the process's control group and of all that hold it.

    A row is ID:CONTROLLERS:PATH, without controllers in version 2. In version 1 those of memory
    stand in a folder of their own, which has the name of the controllers that share it.
    """
    groups = {root, root / "memory"}
    try:
        rows = membership.read_text().splitlines()
    except OSError:
        return groups
    for row in rows:
        _, controllers, path = row.split(":", 2)
        if controllers and "memory" not in controllers.split(","):
            continue
        for tree in {root / controllers, root / "memory"} if controllers else {root}:
            group = tree / path.lstrip("/")
            groups |= {group, *(parent for parent in group.parents if parent.is_relative_to(tree))}
    return groups


def _of_process() -> list[int]:
    """Return the addresses that `ulimit -v` leaves to the process [bytes], if there is a limit."""
    try:
        import resource  # not on Windows

        most, _ = resource.getrlimit(resource.RLIMIT_AS)
        if most == resource.RLIM_INFINITY:
            return []
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        return [most - pages * os.sysconf("SC_PAGE_SIZE")]
    except (ImportError, OSError, ValueError):
        return []
