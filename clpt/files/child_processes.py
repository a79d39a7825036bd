"""Other Python processes of clpt, which import nothing from the folder in which the user stands."""

from __future__ import annotations

import os
import sys
from pathlib import Path

_HOME = str(Path(__file__).parents[2])  # where clpt itself is


def command(code: str, *arguments: str) -> list[str]:
    """Return the command of a process that runs some code, for which sys.argv[1:] are arguments.

    It finds modules where this one does, but for what is relative to the current folder. -I keeps
    Python from looking there by itself, before the code runs; -P does the same, from 3.11 on.
    """
    paths = dict.fromkeys([*(path for path in sys.path if os.path.isabs(path)), _HOME])
    code = f"import sys; sys.path[:] = {list(paths)!r}; {code}"
    return [sys.executable, "-I", "-c", code, *arguments]


def cores() -> int:
    """Return how many cores this process may use, which may be fewer than the machine has."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
