"""Queues: the slots that wait for each kind of material, brought together before shading.

`sort` is a stable counting sort, in chunks of one work-item each: for CPUs. `append` reserves
entries for a whole group of work-items at once: for devices with many of them. The picture is the
same to the bit, since the work of a slot does not depend on its position in a queue.
"""

from __future__ import annotations

WAYS = ("sort", "append")  # names of programs, kernels/stage/<name>.cl
CHUNK = 256  # slots that a work-item of `sort` counts
GROUP = 256  # work-items that append together
QUEUE = ("queue", "counts", "queue_starts", "queue_counts")


def sizes(way: str, slots: int, kinds: int) -> dict[str, int]:
    """Return how many words each buffer has; `append` has a queue for every kind."""
    if way == "append":
        return {"queue": slots * kinds, "queue_starts": kinds, "queue_counts": kinds}
    return dict(zip(QUEUE, (slots, _chunks(slots) * kinds, kinds, kinds), strict=True))


def numbers(slots: int) -> dict[str, int]:
    """Return the numbers that the kernels take, by name."""
    return {"chunk": CHUNK, "chunks": _chunks(slots), "slots": slots}


def steps(way: str, slots: int, kinds: int) -> list[tuple[str, int, int | None]]:
    """Return the kernels in their order, how many work-items each has and how many are a group."""
    if way == "append":
        return [("append_begin", kinds, None), ("append", -(-slots // GROUP) * GROUP, GROUP)]
    chunks = _chunks(slots)
    return [("sort_count", chunks, None), ("sort_scan", 1, None), ("sort_place", chunks, None)]


def _chunks(slots: int) -> int:
    return -(-slots // CHUNK)
