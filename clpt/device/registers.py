"""Programs with few registers a work-item, of compilers that take more than a program needs.

NVIDIA's takes a limit as an option and tells what it took. It fills what a limit allows, so one is
tried only below what it takes left alone; and a program that then spills is not kept. Of a program
from the driver's cache nothing is told, so whoever tries limits keeps the one that was chosen.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import TypeVar

VERBOSE = "-cl-nv-verbose"
_USED = re.compile(r"Used (\d+) registers")
_SPILLED = re.compile(r"(\d+) bytes spill stores")
_P = TypeVar("_P")


def option(limit: int) -> list[str]:
    """Return NVIDIA's options for a limit, 0 for none, and those that let it tell what it took."""
    return [VERBOSE, *([f"-cl-nv-maxrregcount={limit}"] if limit else [])]


def told(log: str) -> tuple[int, int]:
    """Return the registers and the bytes of spills, the most of all kernels that a log tells of.

    The registers are 0 where it tells of none.
    """
    found = (map(int, one.findall(log)) for one in (_USED, _SPILLED))
    return max(next(found), default=0), max(next(found), default=0)


def fewest(
    limits: Sequence[int], build: Callable[[int], tuple[_P, tuple[int, int]]]
) -> tuple[_P, int | None]:
    """Return a program of the least limit with which nothing spills, and the limit.

    The limit is 0, which is none, if all spill; None if nothing was told. build: with a limit;
    returns a program, and what `told` does.
    """
    program, (used, _) = build(0)
    for limit in sorted(limits):
        if limit < used:
            limited, (took, spilled) = build(limit)
            if took and not spilled:
                return limited, limit
    return program, 0 if used else None
