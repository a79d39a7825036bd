"""The client's bookkeeping with 1,000 workers that die, on a clock that is not real.

    python -m bench.cluster_simulation

Workers differ in speed, die and are replaced; their films come through one network to one client,
one after the other. Nothing is rendered: what is tried is `clpt.cluster.blocks` itself, with two
tasks a worker as `clpt.cluster.feeding` gives them, and the length of blocks that
`clpt.cluster.farm` chooses. One JSON line for each case.
"""

from __future__ import annotations

import heapq
import itertools
import json
import random
import time
from dataclasses import asdict, dataclass
from typing import Any

from clpt.cluster.blocks import Block, Blocks, Outcome
from clpt.cluster.farm import set_lengths
from clpt.cluster.feeding import SLOTS

LOOK = 5.0  # [s] between looks of a worker that has nothing to do


@dataclass(frozen=True)
class Case:
    """What is simulated.

    samples: of the picture; rate: of a worker in the mean [samples/s], which they scatter about by
    the factor `spread` at most; lifetime: of a worker in the mean [s]; back: until another one
    takes its place [s]; film_seconds: in which the client gets and adds a film.
    """

    name: str
    workers: int = 1000
    samples: int = 200_000
    rate: float = 0.1
    spread: float = 2.0
    lifetime: float = 7200.0
    back: float = 60.0
    film_seconds: float = 0.01
    check_every: int = 64
    seed: int = 1


@dataclass(frozen=True)
class Outcomes:
    """What came of it.

    seconds: on the simulated clock; first: until the first film was added; efficiency: samples of
    the picture over those that the workers could have taken meanwhile; client: share of the time in
    which the client was getting films; blocks, lost, repeated, dropped: how many; deaths: of
    workers; tasks: per second; block_seconds: of the longest; bookkeeping: processor time of
    `Blocks` for each block [s].
    """

    seconds: float
    first: float
    efficiency: float
    client: float
    blocks: int
    lost: int
    repeated: int
    dropped: int
    deaths: int
    tasks: float
    block_seconds: float
    bookkeeping: float


class _Worker:
    """One worker: what it renders, and what waits; both go with it."""

    def __init__(self, name: int, rate: float, born: float):
        self.name, self.rate, self.born = name, rate, born
        self.waiting: list[Block] = []
        self.busy = False
        self.held = 0  # tasks, until their films are added
        self.alive = True
        self.asleep = 0


class Simulation:
    """A render of a case."""

    def __init__(self, case: Case):
        self.case, self.dice = case, random.Random(case.seed)
        self.blocks = Blocks(case.samples, seconds=1.0, check_every=case.check_every)
        self.events: list[tuple[float, int, Any, tuple[Any, ...]]] = []
        self.order, self.names = itertools.count(), itertools.count()
        self.now, self.free_at, self.client_busy, self.first = 0.0, 0.0, 0.0, 0.0
        self.alive_rate, self.capacity, self.deaths, self.longest = 0.0, 0.0, 0, 0.0
        self.cpu, self.added = 0.0, 0

    def run(self) -> Outcomes:
        """Simulate until all is done."""
        for _ in range(self.case.workers):
            self._at(self.dice.uniform(0.0, 5.0), self._join)
        while self.events and not self.blocks.done:
            then, _, action, arguments = heapq.heappop(self.events)
            self.capacity += (then - self.now) * self.alive_rate
            self.now = then
            action(*arguments)
        case, blocks = self.case, self.blocks
        assert blocks.taken == ((0, case.samples),)
        return Outcomes(
            seconds=self.now,
            first=self.first,
            efficiency=case.samples / self.capacity,
            client=self.client_busy / self.now,
            blocks=self.added,
            lost=blocks.lost,
            repeated=blocks.repeated,
            dropped=blocks.dropped,
            deaths=self.deaths,
            tasks=self.added / self.now,
            block_seconds=self.longest,
            bookkeeping=self.cpu / max(self.added, 1),
        )

    def _at(self, then: float, action: Any, *arguments: Any) -> None:
        heapq.heappush(self.events, (then, next(self.order), action, arguments))

    def _call(self, function: Any, *arguments: Any, **named: Any) -> Any:
        began = time.process_time()
        result = function(*arguments, **named)
        self.cpu += time.process_time() - began
        return result

    def _join(self) -> None:
        rate = self.case.rate * self.case.spread ** self.dice.uniform(-1.0, 1.0)
        worker = _Worker(next(self.names), rate, self.now)
        self.alive_rate += rate
        self.blocks.join(worker.name, "one kind")
        self._at(self.now + self.dice.expovariate(1 / self.case.lifetime), self._die, worker)
        self._feed(worker)

    def _die(self, worker: _Worker) -> None:
        worker.alive = False
        self.alive_rate -= worker.rate
        self.deaths += 1
        self._call(self.blocks.lose, worker.name)
        self._at(self.now + self.case.back, self._join)

    def _feed(self, worker: _Worker) -> None:
        """Give a worker tasks up to SLOTS; look again later where there is none."""
        while worker.alive and worker.held < SLOTS:
            set_lengths(self.blocks, self.now, self.case.film_seconds)
            block = self._call(self.blocks.take, worker.name, self.now)
            if block is None:
                if not worker.asleep:
                    worker.asleep = 1
                    self._at(self.now + LOOK, self._wake, worker)
                break
            worker.held += 1
            worker.waiting.append(block)
        self._start(worker)

    def _wake(self, worker: _Worker) -> None:
        worker.asleep = 0
        self._feed(worker)

    def _start(self, worker: _Worker) -> None:
        if worker.alive and not worker.busy and worker.waiting:
            block = worker.waiting.pop(0)
            worker.busy = True
            seconds = block.samples / worker.rate
            self.longest = max(self.longest, seconds)
            self._at(self.now + seconds, self._rendered, worker, block, seconds)

    def _rendered(self, worker: _Worker, block: Block, seconds: float) -> None:
        """The film waits for the client, which gets one at a time."""
        worker.busy = False
        if not worker.alive:
            return
        self._start(worker)
        self.free_at = max(self.free_at, self.now) + self.case.film_seconds
        self._at(self.free_at, self._received, worker, block, seconds)

    def _received(self, worker: _Worker, block: Block, seconds: float) -> None:
        if not worker.alive:
            return
        self.client_busy += self.case.film_seconds
        worker.held -= 1
        outcome = self._call(
            self.blocks.finish, worker.name, block, self.now, seconds=seconds, digest="right"
        )
        if outcome is Outcome.ADD:
            self.added += 1
            self.first = self.first or self.now
        self._feed(worker)


CASES = (
    Case("full HD, an hour", film_seconds=0.1, samples=360_000),
    Case("full HD, workers live 10 minutes", film_seconds=0.1, samples=360_000, lifetime=600.0),
    Case("4k, 32 bands, 30 workers, an hour", workers=30, film_seconds=7.5, samples=10_800),
)


def main() -> None:
    """Print the cases."""
    for case in CASES:
        began = time.perf_counter()
        found = {name: float(f"{v:.4g}") for name, v in asdict(Simulation(case).run()).items()}
        real = round(time.perf_counter() - began, 1)
        print(json.dumps({"case": case.name, **found, "simulated_in": real}), flush=True)


if __name__ == "__main__":
    main()
