"""Sizes of the launches of the bounce loop, so that a host looks at limits and signals in time.

A launch takes some of the slots through some bounces. The cost of a bounce may grow a
million times from one bounce to the next, where paths enter a dense medium. So the first launches
are small, and they grow while they are short. A launch that takes too long all the same is cut: its
work-items return after their bounce.
"""

from __future__ import annotations

import math
import time
from collections import deque
from dataclasses import dataclass

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import device

LOOP_SECONDS = 0.5  # after which a launch is cut
AIM_SECONDS = LOOP_SECONDS / 2  # of a launch at most, by the time of the launch before
LEAST_SECONDS = 0.02  # of a launch: the host looks at the end of each, which takes it .1 ms
LONGER = 8  # times the usual bounces, at most, where launches are shorter
LEAST_LAUNCH = 1 / 2  # of the usual launch: shorter launches cost too much
LAUNCHES = 3  # launches that a run waits for, about, before it ends
FIRST_PART = 16  # the first launches take this part of the slots
FIRST_LOOK = 0.9  # of the time of the launch before: the second look at an event
POLLS = 8  # then the next look comes after this part of the time so far
SHORTEST = 5e-5  # between two looks [s]

Reads = deque[tuple[NDArray[np.uint64], cl.Event]]  # of counters, and the ends of the reads


@dataclass(frozen=True)
class Size:
    """The slots of each work-item of a launch, and their bounces."""

    share: int
    bounces: int


@dataclass(frozen=True)
class Limits:
    """Limits of launches on a device.

    share: the most slots of a work-item; lanes: slots that are traced together; bounces: the most
    bounces, but of launches shorter than LEAST_SECONDS; cancel_seconds: the longest time from a
    request to stop to the end of the run [s], or None.
    """

    share: int
    lanes: int
    bounces: int
    cancel_seconds: float | None = None

    def fit(self, share: int) -> int:
        """Return the nearest possible number of slots of a work-item: a power of two of blocks."""
        blocks = max(min(share, self.share) // self.lanes, 1)
        return min(self.lanes << blocks.bit_length() - 1, self.share)


def first_size(share: int, lanes: int) -> Size:
    """Return the size of the first launch; share, lanes: see `Limits`."""
    return Size(Limits(share, lanes, 1).fit(share // FIRST_PART), 1)


def next_size(
    size: Size, took: float, limits: Limits, has_all_slots: bool, was_cut: bool = False
) -> Size:
    """Return the size of the launch after a launch of `size`.

    took: the time of that launch [s]; has_all_slots: the next launch begins at the first slot;
    was_cut: the launch ended after an unknown number of bounces, which counts as a single bounce. A
    launch takes AIM_SECONDS at most by the rate of the launch before, unless a bounce of a block of
    slots takes longer.
    """
    bounces = 1 if was_cut else size.bounces
    rate = size.share * bounces / max(took, 1e-6)  # bounces of a slot of each work-item [1/s]
    fitting = int(rate * AIM_SECONDS)
    if fitting < limits.share:
        return Size(limits.fit(min(fitting, 2 * size.share)), 1)
    if size.share < limits.share:
        return Size(limits.fit(2 * size.share), 1) if has_all_slots else size
    wanted = limits.bounces
    if limits.cancel_seconds is None:
        in_least = int(rate / limits.share * LEAST_SECONDS)
        wanted = max(wanted, min(in_least, LONGER * wanted))
    else:
        in_time = int(rate / limits.share * limits.cancel_seconds / LAUNCHES)
        in_time = max(in_time, bounces // 2)  # other commands take time too
        wanted = max(min(in_time, wanted), math.ceil(wanted * LEAST_LAUNCH))
    return Size(limits.share, max(1, min(wanted, 2 * bounces, fitting // limits.share)))


def wait(reads: Reads, cut: device.Flag, expected: float = 0.0) -> tuple[NDArray[np.uint64], bool]:
    """Wait for the first read; return its counters, and whether launches were cut.

    expected: the time of the launch before [s]: looks at an event take time of the device. A launch
    is cut after LOOP_SECONDS, where the device sees the flag. Then all reads are awaited, and the
    last counters are returned.
    """
    counters, event = reads.popleft()
    if cut.argument is None or _ends(event, LOOP_SECONDS, FIRST_LOOK * expected):
        device.wait(event)
        return counters, False
    cut.raise_()
    device.wait(event)
    while reads:
        counters, event = reads.popleft()
        device.wait(event)
    cut.lower()
    return counters, True


def _ends(event: cl.Event, seconds: float, pause: float) -> bool:
    """Wait for an event, for some seconds at most; return whether it has ended or failed.

    pause: before the second look [s].
    """
    start = time.perf_counter()
    while event.command_execution_status > cl.command_execution_status.COMPLETE:
        elapsed = time.perf_counter() - start
        if elapsed > seconds:
            return False
        time.sleep(min(max(pause, elapsed / POLLS, SHORTEST), seconds))
        pause = 0.0
    return True
