"""Bookkeeping of sample ranges and of the blocks that devices render, for `clpt.cluster.crew`.

A block is a range of sample numbers, of all pixels. Films add to the bit, so any device may render
any block. The caller measures the time.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Hashable
from dataclasses import dataclass

from clpt.render.film.state import Ranges

GROWTH = 3  # at most, over the size of a worker's last block
LEAST = 0.1  # share of a block's intended seconds, below which overhead dominates
LAST_SHARE = 0.5  # of the remaining samples by a worker's rate: blocks shrink at the end
MEMORY = 0.5  # weight of the last block in a worker's rate

Worker = Hashable


def with_range(taken: Ranges, first: int, end: int) -> Ranges:
    """Return ranges and a disjoint range; adjacent ranges become a single range."""
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


@dataclass
class WorkerRecord:
    """A worker's record; samples are of the whole picture.

    kind: device class; workers of a class render the same bits. rate: [samples/s], 0 while
    unknown; blocks, samples: the number added; size: of the last block [samples]; failures: their
    number.
    """

    kind: str = ""
    rate: float = 0.0
    blocks: int = 0
    samples: float = 0.0
    size: float = 0.0
    failures: int = 0

    def note(self, samples: float, seconds: float) -> None:
        """Note a finished block and update the rate."""
        self.blocks += 1
        self.samples += samples
        if seconds > 0.0:
            rate = samples / seconds
            self.rate = rate if not self.rate else (1 - MEMORY) * self.rate + MEMORY * rate


class Blocks:
    """The samples of a render: done, handed out, and free.

    taken: ranges that are done; end: the number after the last sample; seconds: intended time of a
    block. workers: records of the workers that joined.
    """

    def __init__(self, end: int, taken: Ranges = (), *, seconds: float = 1.0):
        self.taken, self.seconds = taken, seconds
        self.workers: dict[Worker, WorkerRecord] = {}
        self._free = gaps(taken, 0, end)
        self._flights: dict[Worker, range] = {}

    @property
    def done(self) -> bool:
        """Whether all samples are done."""
        return not self._flights and not self._free

    @property
    def left(self) -> int:
        """The number of samples that were not handed out."""
        return sum(end - first for first, end in self._free)

    @property
    def rate(self) -> float:
        """The rate of all workers together [samples/s]."""
        return sum(record.rate for record in self.workers.values())

    def join(self, worker: Worker, record: WorkerRecord) -> None:
        """Add a worker."""
        self.workers[worker] = record

    def lose(self, worker: Worker) -> None:
        """Remove a worker; its block becomes free."""
        self.workers.pop(worker, None)
        block = self._flights.pop(worker, None)
        if block is not None:
            self._free.insert(0, (block.start, block.stop))

    def take(self, worker: Worker) -> range | None:
        """Return a worker's next block of samples; None if no block is free or others are faster.

        Raises KeyError for a worker that did not join.
        """
        record = self.workers[worker]
        if not self._free or self._leaves_to_others(record):
            return None
        first, end = self._free[0]
        size = min(self._size(record), end - first)
        self._free[:1] = [(first + size, end)] if first + size < end else []
        block = self._flights[worker] = range(first, first + size)
        record.size = size
        return block

    def finish(self, worker: Worker, seconds: float) -> None:
        """Note that a worker has finished its block, and how long it took."""
        block = self._flights.pop(worker)
        self.taken = with_range(self.taken, block.start, block.stop)
        self.workers[worker].note(len(block), seconds)

    def _leaves_to_others(self, record: WorkerRecord) -> bool:
        """Whether the fastest worker finishes all samples before this worker finishes a sample."""
        fastest = max(other.rate for other in self.workers.values())
        return record.rate > 0.0 and self.left * record.rate < fastest

    def _size(self, record: WorkerRecord) -> int:
        if not record.rate:
            return 1
        usual = self.seconds * record.rate
        part = max(LAST_SHARE * self.left * record.rate / self.rate, LEAST * usual)
        return max(1, int(min(GROWTH * max(record.size, 1), usual, part)))
