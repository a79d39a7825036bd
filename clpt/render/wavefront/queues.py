"""Queues: the slots that wait for each kind of material, brought together before shading.

`append` reserves entries for a whole group of work-items at once: for a host that enqueues stages.
In the loop on the device (kernels/stage/loop.cl) a work-item sorts its own slots. The picture is
the same to the bit, since the work of a slot does not depend on its position in a queue.
"""

from __future__ import annotations

GROUP = 256  # work-items that append together


def sizes(slots: int, kinds: int, queued: bool) -> dict[str, int]:
    """Return how many words each buffer has: a queue for every kind, or one for the loop."""
    if not queued:
        return {"queue": slots}
    return {"queue": slots * kinds, "queue_starts": kinds, "queue_counts": kinds}


def steps(slots: int, kinds: int) -> list[tuple[str, int, int | None]]:
    """Return the kernels in their order, how many work-items each has and how many are a group."""
    return [("append_begin", kinds, None), ("append", -(-slots // GROUP) * GROUP, GROUP)]
