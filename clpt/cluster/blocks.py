"""Which device renders which samples: pure bookkeeping, see `clpt.cluster.crew`.

A block is a range of sample numbers, of all pixels. Films add to the bit, so any device may do any
block. The clock is the caller's: a test gives its own.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

from clpt.cluster.sample_ranges import gaps, with_range
from clpt.render.film.state import Ranges

GROWTH = 3  # times the size of a worker's last block
LEAST = 0.1  # of the seconds that a block should take: a smaller one costs more than it helps
LAST_SHARE = 0.5  # of what a worker's rate lets it do of all that is left: blocks shrink at the end
MEMORY = 0.5  # part of the last block in a worker's rate

Worker = Hashable


@dataclass(frozen=True)
class Block:
    """Samples first to end - 1 of every pixel."""

    first: int
    end: int

    @property
    def samples(self) -> int:
        return self.end - self.first


@dataclass
class WorkerRecord:
    """A record of one worker; samples are of the whole picture.

    kind: its class of device; workers of one kind have the same bits. rate: [samples/s], 0 when not
    known; blocks, samples: that it added; size: of its last block [samples]; failures: that it had.
    """

    kind: str = ""
    rate: float = 0.0
    blocks: int = 0
    samples: float = 0.0
    size: float = 0.0
    failures: int = 0

    def note(self, samples: float, seconds: float) -> None:
        """Note a block, and how fast it was."""
        self.blocks += 1
        self.samples += samples
        if seconds > 0.0:
            rate = samples / seconds
            self.rate = rate if not self.rate else (1 - MEMORY) * self.rate + MEMORY * rate


class Blocks:
    """The samples of a render: done, handed out, and left.

    taken: ranges that are done; end: the number after the last sample; seconds: what a block should
    take. workers: those that are here.
    """

    def __init__(self, end: int, taken: Ranges = (), *, seconds: float = 1.0):
        self.taken, self.seconds = taken, seconds
        self.workers: dict[Worker, WorkerRecord] = {}
        self._free = gaps(taken, 0, end)
        self._flights: dict[Worker, Block] = {}

    @property
    def done(self) -> bool:
        """Whether all samples are taken."""
        return not self._flights and not self._free

    @property
    def left(self) -> int:
        """The number of samples that no worker has been given."""
        return sum(end - first for first, end in self._free)

    @property
    def rate(self) -> float:
        """The rate of all workers together [samples/s]."""
        return sum(record.rate for record in self.workers.values())

    def join(self, worker: Worker, record: WorkerRecord) -> None:
        """A worker is there."""
        self.workers[worker] = record

    def lose(self, worker: Worker) -> None:
        """A worker is gone: others get its block."""
        self.workers.pop(worker, None)
        block = self._flights.pop(worker, None)
        if block is not None:
            self._free.insert(0, (block.first, block.end))

    def take(self, worker: Worker) -> Block | None:
        """Return what a worker does next; None where there is nothing for it now.

        Raises KeyError for a worker that did not join.
        """
        record = self.workers[worker]
        if not self._free or self._leaves_to_others(record):
            return None
        first, end = self._free[0]
        size = min(self._size(record), end - first)
        self._free[:1] = [(first + size, end)] if first + size < end else []
        block = self._flights[worker] = Block(first, first + size)
        record.size = block.samples
        return block

    def finish(self, worker: Worker, seconds: float) -> None:
        """A worker has done its block, in some seconds."""
        block = self._flights.pop(worker)
        self.taken = with_range(self.taken, block.first, block.end)
        self.workers[worker].note(block.samples, seconds)

    def _leaves_to_others(self, record: WorkerRecord) -> bool:
        """Whether the fastest does all that is left before this worker does one sample."""
        fastest = max(other.rate for other in self.workers.values())
        return record.rate > 0.0 and self.left * record.rate < fastest

    def _size(self, record: WorkerRecord) -> int:
        """Return the number of samples for the next block of a worker."""
        if not record.rate:
            return 1
        usual = self.seconds * record.rate
        part = max(LAST_SHARE * self.left * record.rate / self.rate, LEAST * usual)
        return max(1, int(min(GROWTH * max(record.size, 1), usual, part)))
