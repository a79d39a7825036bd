"""Who renders which samples: pure bookkeeping, for several devices and for several machines.

A block is a range of sample numbers, of all pixels. A worker takes one, and brings back its film.
Films add to the bit, so any worker may do any block, at any time, and again. The clock is an
argument: a test or a simulation gives its own.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from enum import Enum

from clpt.cluster.sample_ranges import gaps, with_range
from clpt.errors import ClusterError
from clpt.render.wavefront.film_state import Ranges

GROWTH = 3  # times the size of a worker's last block
LEAST = 0.1  # of the seconds that a block should take: a smaller one costs more than it helps
LAST_SHARE = 0.5  # of what a worker's rate lets it do of all that is left: blocks shrink at the end
PATIENCE = 1.5  # times what a block should take, after which another worker begins it too
COPIES = 2  # of a block at a time, at most, where films of a block can be dropped
MOST_FAILURES = 3  # of a block, before the render ends
MEMORY = 0.5  # part of the last block in a worker's rate

Worker = Hashable


class Outcome(Enum):
    """What becomes of the film of a block."""

    ADD = "add it to the picture"
    HOLD = "keep it until another worker's film of the block is there"
    DROP = "it is there already, or its worker is refused"


@dataclass(frozen=True)
class Block:
    """Samples first to end - 1 of every pixel; number: by which it is known."""

    number: int
    first: int
    end: int

    @property
    def samples(self) -> int:
        return self.end - self.first


@dataclass
class WorkerRecord:
    """What is known of a worker; samples are of the whole picture.

    kind: its class of device; workers of one kind have the same bits. rate: [samples/s], 0 when not
    known; blocks, samples: that it added; size: of its last block [samples]; failures: that it had.
    """

    kind: str = ""
    rate: float = 0.0
    blocks: int = 0
    samples: float = 0.0
    size: float = 0.0
    failures: int = 0
    checked: bool = False


@dataclass
class _Flight:
    """A block that is not done: who has it since when, its failures, and films to compare.

    films: digests by worker, of a block that two workers do; kind: of all of these workers.
    """

    block: Block
    since: dict[Worker, float] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)
    failed_at: set[Worker] = field(default_factory=set)
    films: dict[Worker, str] = field(default_factory=dict)
    compared: bool = False
    kind: str = ""


class Blocks:
    """The samples of a render: done, handed out, and left.

    taken: ranges that are done; first: the number of the first sample; end: that after the last
    one, which `extend` may raise; seconds: what a block should take; least_seconds: what it should
    at the end too; check_every: of the blocks, one in so many is done by two workers and compared,
    beside the first block of each worker that has an equal; 0: none.
    copies: of a block that workers do at a time, at most; 1 where a film cannot be dropped. share:
    of the pixels that have these samples. before: blocks that have ended, whose workers are known.

    counts of what went wrong: lost (blocks of workers that are gone), repeated (blocks that a
    second worker began since the first was slow), dropped (films that were there already).
    refused: why, by worker.
    """

    def __init__(
        self,
        end: int,
        taken: Ranges = (),
        *,
        seconds: float = 1.0,
        check_every: int = 0,
        copies: int = COPIES,
        first: int = 0,
        share: float = 1.0,
        before: Blocks | None = None,
    ):
        self.taken, self.end, self.share = taken, end, share
        self.seconds, self.check_every, self.copies = seconds, check_every, copies
        self.least_seconds = 0.0
        self.workers: dict[Worker, WorkerRecord] = {}
        self.former = {} if before is None else before.known  # workers that are not here yet
        self.coming: set[Worker] = set()  # workers that get ready
        self.refused: dict[Worker, str] = {} if before is None else before.refused
        self.lost = self.repeated = self.dropped = 0
        if before is not None:
            self.lost, self.repeated, self.dropped = before.lost, before.repeated, before.dropped
        self._free = gaps(taken, first, end)
        self._flights: dict[int, _Flight] = {}
        self._again: list[_Flight] = []  # blocks that came back
        self._numbers = 0
        self._closed = False

    # ---- what is left

    @property
    def waiting(self) -> bool:
        """Whether there are blocks that nobody has."""
        return not self._closed and bool(self._free or self._again)

    @property
    def done(self) -> bool:
        """Whether nothing is left, or nothing more is handed out and nothing is on its way."""
        on_their_way = any(flight.since for flight in self._flights.values())
        return not on_their_way if self._closed else self.complete

    @property
    def complete(self) -> bool:
        """Whether all samples are taken."""
        return not self._flights and not self._free

    @property
    def samples_done(self) -> int:
        return sum(end - first for first, end in self.taken)

    @property
    def in_flight(self) -> int:
        """How many blocks are at workers."""
        return sum(bool(flight.since) for flight in self._flights.values())

    @property
    def rate(self) -> float:
        """Of all workers together [samples/s]."""
        return sum(record.rate for record in self.workers.values())

    def extend(self, end: int) -> None:
        """Add samples up to another end. Does nothing where that is no later."""
        if end > self.end:
            self._free += gaps(self.taken, self.end, end)
            self.end = end

    def close(self) -> None:
        """Hand out nothing more."""
        self._closed = True

    # ---- workers

    @property
    def known(self) -> dict[Worker, WorkerRecord]:
        """The workers that are here, and those of former blocks."""
        return {**self.former, **self.workers}

    def expect(self, worker: Worker) -> None:
        """A worker gets ready, and joins or is refused."""
        self.coming.add(worker)

    def join(self, worker: Worker, kind: str = "") -> None:
        """A worker is there. One that was refused stays so."""
        self.coming.discard(worker)
        if worker in self.refused or worker in self.workers:
            return
        record = self.former.pop(worker, None)
        same = record is not None and record.kind == kind
        self.workers[worker] = record if record and same else WorkerRecord(kind)

    def lose(self, worker: Worker) -> list[Block]:
        """A worker is gone: return its blocks, which others get."""
        self.workers.pop(worker, None)
        self.former.pop(worker, None)
        self.coming.discard(worker)
        blocks = [f.block for f in self._flights.values() if worker in f.since]
        for block in blocks:
            self.lost += 1
            self._give_back(self._flights[block.number], worker)
        return blocks

    def refuse(self, worker: Worker, reason: str) -> list[Block]:
        """Take nothing more from a worker; return the blocks that it had, which others get."""
        self.refused[worker] = reason
        for flight in self._flights.values():
            flight.films.pop(worker, None)
        return self.lose(worker)

    # ---- blocks

    def take(self, worker: Worker, now: float) -> Block | None:
        """Return what a worker does next; None where there is nothing for it now.

        Raises KeyError for a worker that did not join.
        """
        if self._closed or worker in self.refused:
            return None
        record = self.workers[worker]
        flight = self._comes_again(worker) or self._new(worker) or self._slow(worker, now)
        if flight is None:
            return None
        flight.since[worker] = now
        number = flight.block.number
        self._flights[number] = self._flights.pop(number)  # in the order in which they go out
        record.size = self._of_picture(flight.block)
        return flight.block

    def finish(
        self, worker: Worker, block: Block, now: float, *, seconds: float = 0.0, digest: str = ""
    ) -> Outcome:
        """A worker brought the film of a block; return what becomes of the film.

        seconds: that the block took, where the worker tells, without what came before and after it;
        digest: of the film, for comparing. Raises ClusterError where workers of one kind have
        different films, and it cannot be told whose is wrong.
        """
        flight = self._flights.get(block.number)
        if worker in self.refused or flight is None:
            self.dropped += 1
            return Outcome.DROP
        since = flight.since.pop(worker, None)
        if worker in self.workers:
            record = self.workers[worker]
            took = seconds or (0.0 if since is None else now - since)
            _note_rate(record, self._of_picture(block), took)
        if flight.compared and not self._agreed(flight, worker, digest):
            return Outcome.HOLD
        del self._flights[block.number]
        self._again = [other for other in self._again if other is not flight]
        self.taken = with_range(self.taken, block.first, block.end)
        if worker in self.workers:
            record.blocks += 1
            record.samples += self._of_picture(block)
        return Outcome.ADD

    def give_back(self, worker: Worker, block: Block) -> None:
        """A worker did not do a block, and it is nobody's fault: another gets it."""
        flight = self._flights.get(block.number)
        if flight is not None:
            self._give_back(flight, worker)

    def fail(self, worker: Worker, block: Block, reason: str) -> None:
        """A worker could not do a block: another gets it.

        Raises ClusterError when a block has failed too often.
        """
        if worker in self.workers:
            self.workers[worker].failures += 1
        flight = self._flights.get(block.number)
        if flight is None:
            return
        flight.failures.append(reason)
        flight.failed_at.add(worker)
        self._give_back(flight, worker)
        if len(flight.failures) >= MOST_FAILURES:
            raise ClusterError(
                f"samples {block.first} to {block.end - 1} failed {len(flight.failures)} times, "
                f"the last time: {reason}"
            )

    # ---- what a worker gets

    def _comes_again(self, worker: Worker) -> _Flight | None:
        """A block that came back, or that a second worker does; better one that is new to it."""
        usable = [f for f in self._again if self._may_do(worker, f)]
        if not usable:
            return None
        flight = usable[0]
        self._again.remove(flight)
        return flight

    def _may_do(self, worker: Worker, flight: _Flight) -> bool:
        """Whether a worker is one to do a block again: one that did not do it, if there is one."""
        tried = flight.failed_at | flight.films.keys() | flight.since.keys()
        fit = self._equals(flight.kind) if flight.films else self.workers.keys()
        differ = len(set(flight.films.values())) > 1
        others = fit - tried or (differ and self.coming)
        return worker in fit and (worker not in tried or not others)

    def _equals(self, kind: str) -> set[Worker]:
        """The workers of a kind."""
        return {name for name, record in self.workers.items() if record.kind == kind}

    def _new(self, worker: Worker) -> _Flight | None:
        if not self._free or self._leaves_to_others(self.workers[worker]):
            return None
        first, end = self._free[0]
        size = min(self._size(self.workers[worker]), end - first)
        self._free[:1] = [(first + size, end)] if first + size < end else []
        flight = _Flight(Block(self._numbers, first, first + size))
        self._numbers += 1
        self._flights[flight.block.number] = flight
        self._choose_compared(flight, worker)
        return flight

    def _leaves_to_others(self, record: WorkerRecord) -> bool:
        """Whether others do all that is left before this worker does one sample.

        Only where nobody would begin the block that it takes a second time.
        """
        others = self.rate - record.rate
        return self.copies == 1 and record.rate > 0.0 and self.left * record.rate < others

    def _size(self, record: WorkerRecord) -> int:
        """How many samples the next block of a worker has."""
        if not record.rate:
            return 1
        usual = self.seconds * record.rate
        part = max(
            LAST_SHARE * self.left * self.share * record.rate / self.rate,
            LEAST * usual,
            self.least_seconds * record.rate,
        )
        size = min(GROWTH * max(record.size, self.share), usual, part)
        return max(1, int(size / self.share))

    @property
    def left(self) -> int:
        """How many samples nobody has."""
        return sum(end - first for first, end in self._free)

    def _of_picture(self, block: Block) -> float:
        """How many samples of the whole picture a block is worth."""
        return block.samples * self.share

    def _slow(self, worker: Worker, now: float) -> _Flight | None:
        """The block that is longest on its way at another worker, if that is slow with it."""
        record = self.workers[worker]
        if not record.rate:
            return None
        for flight in self._flights.values():
            since = flight.since
            if not since or len(since) >= self.copies or flight.compared:
                continue
            waited = now - min(since.values())
            if waited < PATIENCE * self.seconds:
                return None  # those after it went out later
            tried = worker in since or worker in flight.films or worker in flight.failed_at
            if not tried and waited >= PATIENCE * self._of_picture(flight.block) / record.rate:
                self.repeated += 1
                return flight
        return None

    def _give_back(self, flight: _Flight, worker: Worker) -> None:
        flight.since.pop(worker, None)
        if not flight.since and flight not in self._again:
            self._again.append(flight)

    # ---- films that are compared

    def _choose_compared(self, flight: _Flight, worker: Worker) -> None:
        """Decide whether a new block is done by two workers."""
        record = self.workers[worker]
        if not self.check_every or (record.checked and flight.block.number % self.check_every):
            return
        if len(self._equals(record.kind)) > 1:
            record.checked = flight.compared = True
            flight.kind = record.kind
            self._again.append(flight)  # for a second worker

    def _agreed(self, flight: _Flight, worker: Worker, digest: str) -> bool:
        """Note a film; return whether it is right, and refuse workers whose films are not.

        Of two equal films both are right. A worker that has no equal left is believed. Where
        films differ, and a worker gets ready that may tell whose is right, it is waited for.
        """
        again = flight.films.get(worker) == digest
        flight.films[worker] = digest
        same = {other for other, film in flight.films.items() if film == digest}
        block, asked = flight.block, flight.films.keys() | flight.since.keys()
        left = self._equals(flight.kind) - asked
        if len(same) > 1:
            for other in flight.films.keys() - same:
                self.refuse(other, f"its film of samples {block.first} to {block.end - 1} is wrong")
            for other in same & self.workers.keys():
                self.workers[other].checked = True
            return True
        if len(flight.films) == 1 and (again or not (left or flight.since)):
            return True
        if not (left or flight.since or self.coming):
            named = " and ".join(str(other) for other in flight.films)
            raise ClusterError(
                f"{named} have different films of samples {block.first} to {block.end - 1}, though "
                "they are of one kind; one of them computes wrongly"
            )
        if not flight.since and flight not in self._again:
            self._again.append(flight)
        return False


def _note_rate(record: WorkerRecord, samples: float, seconds: float) -> None:
    if seconds > 0.0:
        rate = samples / seconds
        record.rate = rate if not record.rate else (1 - MEMORY) * record.rate + MEMORY * rate
