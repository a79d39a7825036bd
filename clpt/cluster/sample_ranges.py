"""Ranges of sample numbers: what is added to them, and what is missing."""

from __future__ import annotations

from bisect import bisect

from clpt.render.film.state import Ranges


def with_range(taken: Ranges, first: int, end: int) -> Ranges:
    """Return ranges and one more, which is apart from them; neighbours become one range."""
    before = after = bisect(taken, (first, end))
    if before and taken[before - 1][1] == first:
        before -= 1
        first = taken[before][0]
    if after < len(taken) and taken[after][0] == end:
        end = taken[after][1]
        after += 1
    return (*taken[:before], (first, end), *taken[after:])


def gaps(taken: Ranges, first: int, end: int) -> list[tuple[int, int]]:
    """Return the ranges of [first, end) that are not taken."""
    missing = []
    for start, stop in taken:
        if start > first:
            missing.append((first, min(start, end)))
        first = max(first, stop)
        if first >= end:
            break
    if first < end:
        missing.append((first, end))
    return [(a, b) for a, b in missing if a < b]
