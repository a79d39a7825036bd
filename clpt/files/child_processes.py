"""Other Python processes of clpt. They import nothing from the current folder."""

from __future__ import annotations

import os
import sys
from pathlib import Path

_HOME = str(Path(__file__).parents[2])  # where clpt itself is


def command(code: str, *arguments: str) -> list[str]:
    """Return the command of a process that runs some code with `arguments` as sys.argv[1:].

    The process finds modules where this process does, except in the current folder. -I keeps
    Python from looking there before the code runs; from Python 3.11 on -P does the same.
    """
    paths = dict.fromkeys([*(path for path in sys.path if os.path.isabs(path)), _HOME])
    code = f"import sys; sys.path[:] = {list(paths)!r}; {code}"
    return [sys.executable, "-I", "-c", code, *arguments]


def cores() -> int:
    """Return how many cores this process may use, which may be fewer than the machine has."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
