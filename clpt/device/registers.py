"""Programs with few registers a work-item, of compilers that take more than a program needs.

NVIDIA's takes a limit as an option and tells what it took. It fills what a limit allows, so one is
tried only below what it takes left alone; and a program that then spills is not kept. A program
that comes from the driver's cache tells nothing: what was chosen must be remembered.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TypeVar

VERBOSE = "-cl-nv-verbose"
_USED = re.compile(r"Used (\d+) registers")
_SPILLED = re.compile(r"(\d+) bytes spill stores")
_P = TypeVar("_P")


def option(limit: int | None) -> list[str]:
    """Return NVIDIA's options for a limit, and those that let it tell what it took."""
    return [VERBOSE, *([] if limit is None else [f"-cl-nv-maxrregcount={limit}"])]


def told(log: str) -> tuple[int, int]:
    """Return the registers and the bytes of spills, the most of all kernels that a log tells of."""
    found = (map(int, one.findall(log)) for one in (_USED, _SPILLED))
    return max(next(found), default=0), max(next(found), default=0)


def fewest(
    limits: Sequence[int], build: Callable[[int | None], tuple[_P, tuple[int, int]]]
) -> tuple[_P, int | None]:
    """Return a program of the least limit with which nothing spills, and that limit, if one does.

    build: with a limit; returns a program, and what `told` does.
    """
    program, (used, _) = build(None)
    for limit in sorted(limits):
        if limit < used:
            limited, (_, spilled) = build(limit)
            if not spilled:
                return limited, limit
    return program, None
