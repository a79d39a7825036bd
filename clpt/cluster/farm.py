"""Runs in which the workers of a cluster take samples.

A block is a range of sample numbers. Dask's scheduler decides who renders it, and lets another
worker do so when one is gone; here blocks are cut and films are counted.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import logging
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from clpt.cluster import tasks
from clpt.cluster.admission import Admission, Job, Known
from clpt.cluster.calls import Call, Calls, reply_of
from clpt.cluster.sample_ranges import gaps
from clpt.errors import ClusterError
from clpt.render.film.state import FilmState, Ranges
from clpt.render.wavefront.tracer import Selection
from clpt.render.wavefront.wavefront import Counts

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger(__name__)

TICK = 0.1  # seconds, at most, between two calls of `tick`
LAST_SECONDS = 10.0  # in which workers send what they have, after a stop
FIRST_SECONDS, MOST_SECONDS = 2.0, 30.0  # that a block takes, at first and after some minutes
LEAST_SECONDS = 0.3  # of the last blocks, beside which the way to a worker is short
SHARE = 0.1  # of the time so far that a block takes, between these
CLIENT_SHARE = 0.5  # of the time, at most, in which this client gets and adds films
LAST_SHARE = 0.5  # of all that is left, that all workers together get: blocks shrink at the end
SLOTS = 2  # blocks of a worker: one is rendered, one waits
MOST_FAILURES = 3  # of a block, before the render ends; of a worker in a row, before it is refused


@dataclass(frozen=True)
class Film:
    """A film that a worker sent.

    counts: of what the worker did, `closest` has rays of both kinds; whole: whether all pixels have
    the samples of its ranges, as they have unless a stop cut the block.
    """

    state: FilmState
    counts: Counts
    whole: bool = True


@dataclass
class _Block:
    """Samples first to end - 1; workers that may take them now, and where and why they failed."""

    first: int
    end: int
    at: set[str] = field(default_factory=set)
    failed_at: set[str] = field(default_factory=set)
    failures: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        return f"samples {self.first} to {self.end - 1}"


def block_seconds(workers: int, elapsed: float, film_seconds: float) -> tuple[float, float]:
    """Return how long blocks should take, and the last ones, `elapsed` [s] after the beginning.

    film_seconds: in which a film comes in and is added. With many workers blocks are long enough
    that all of their films take at most CLIENT_SHARE of the time, and at the end not so short that
    workers wait for each other's films.
    """
    all_films = workers * film_seconds
    usual = min(max(FIRST_SECONDS, SHARE * elapsed), MOST_SECONDS)
    return max(usual, all_films / CLIENT_SHARE), max(LEAST_SECONDS, all_films)


class Farm:
    """The workers of a cluster: what is known of them stays from one run to the next.

    client, mixed, patience: see `ClusterRenderer`. priority: of the blocks of this render, beside
    others of the same cluster; seconds: in which it rendered.
    """

    def __init__(self, client: Client, *, mixed: bool, patience: float):
        self.client, self.known, self.seconds = client, Known(mixed, patience), 0.0
        self.priority: Callable[[], float] = lambda: 0.0

    def run(
        self, job: Job, selection: Selection, pixels: int, samples: tuple[int, int], taken: Ranges,
        add: Callable[[Film], None], tick: Callable[[], bool],
    ) -> bool:  # fmt: skip
        """Let workers take samples of a selection; return whether all were taken.

        pixels: of the picture; samples: first and end, of which `taken` are there already. add: is
        called with each film, at a stop with films that were cut too; tick: all the while; if it
        returns False the workers stop soon.

        Raises ClusterError when the scheduler is gone, no worker is left or fit, or a block fails
        again and again.
        """
        run = _Run(self, job, selection, selection.pixels / pixels, gaps(taken, *samples))
        before, began = self.seconds, time.perf_counter()
        try:
            while not run.over:
                for film in run.films():
                    began_to_add = time.perf_counter()
                    add(film)
                    run.add_seconds = time.perf_counter() - began_to_add
                self.seconds = before + time.perf_counter() - began
                if not tick():
                    run.stop()
                run.hand_out()
        finally:
            run.end()
        return run.complete


class _Run:
    """Blocks of one selection of samples.

    share: of the pixels that have these samples; left: ranges that nobody has. complete: whether
    all samples are taken; add_seconds: in which a film is added.
    """

    def __init__(self, farm: Farm, job: Job, selection: Selection, share: float, left: Any):
        self.farm, self.known, self.job, self.share = farm, farm.known, job, share
        self.calls = Calls(farm.client, farm.priority)
        self.workers = Admission(self.calls, job, self.known)
        self.add_seconds = 0.0
        self._selection, self._left = tasks.pack_selection(selection), list(left)
        self._again: list[_Block] = []  # that came back
        self._flights: dict[Call, _Block] = {}
        self._in_a_row: Counter[str] = Counter()  # failures
        self._deadline: float | None = None  # after a stop
        self._cut = False

    @property
    def complete(self) -> bool:
        return not (self._left or self._again or self._flights or self._cut)

    @property
    def over(self) -> bool:
        """Whether nothing is left to do, or it was stopped and nothing more is waited for."""
        if self._deadline is not None:
            return not self._flights or time.monotonic() > self._deadline
        return self.complete

    def stop(self) -> None:
        """Hand out nothing more, and let workers send what they have."""
        if self._deadline is not None:
            return
        if self.workers.fit:
            self.calls.begin(self._tell_to_stop([*self.workers.fit]))
        seconds = LAST_SECONDS + len(self.workers.fit) * self.calls.film_seconds
        self._deadline = time.monotonic() + seconds

    async def _tell_to_stop(self, addresses: list[str]) -> None:
        """Let blocks end with what they have, beside which workers answer."""
        digest, how = self.job.digest, {"workers": addresses, "on_error": "ignore"}
        try:
            await asyncio.wait_for(
                self.calls.client.run(tasks.stop_job, digest, **how), LAST_SECONDS
            )
        except (OSError, asyncio.TimeoutError, ValueError) as error:
            log.warning("workers could not be told to stop: %s", error)

    def end(self) -> None:
        """Want nothing more of what is on its way."""
        for call in [*self._flights, *self.workers.opening]:
            call.cancel()

    # ---- blocks

    def hand_out(self) -> None:
        """Let Dask have blocks, two for each worker that may render.

        Raises ClusterError without a scheduler, and where nobody renders and nobody will.
        """
        if self._deadline is None:
            self.workers.follow()
        for call, block in list(self._flights.items()):
            if not block.at & self.workers.there:
                call.cancel()  # Dask would wait for one of these workers
                self._again.append(self._flights.pop(call))
        while self._deadline is None and (self._left or self._again):
            if len(self._flights) >= SLOTS * len(self.workers.fit):
                return
            block = self._again.pop(0) if self._again else self._next()
            block.at = self.workers.fit.keys() - block.failed_at or set(self.workers.fit)
            asked = self.calls.at(
                block.at, tasks.render_block, self.job.digest, block.first, block.end,
                self._selection,
            )  # fmt: skip
            self._flights[self.calls.begin(asked)] = block

    def _next(self) -> _Block:
        """Cut a block off what is left."""
        first, end = self._left[0]
        rates = [self.known.records[address].rate for address in self.workers.fit]
        seconds, least = block_seconds(
            len(rates), self.farm.seconds, max(self.add_seconds, self.calls.film_seconds)
        )
        mean = sum(rates) / len(rates) / self.share  # samples of these pixels, a second
        left = sum(after - before for before, after in self._left)
        last = max(LAST_SHARE * left / (len(rates) + len(self.workers.opening)), least * mean)
        size = min(max(1, int(min(seconds * mean, last))), end - first)
        self._left[:1] = [(first + size, end)] if first + size < end else []
        return _Block(first, first + size)

    def films(self) -> Iterator[Film]:
        """Yield the films that are there, after waiting for a moment if there is none.

        Raises ClusterError for a block that fails again and again.
        """
        calls = [*self._flights, *self.workers.opening]
        if not calls:
            time.sleep(TICK)
        concurrent.futures.wait(calls, TICK, concurrent.futures.FIRST_COMPLETED)
        self.workers.admit()
        for call in [call for call in self._flights if call.done()]:
            film = self._take_in(self._flights.pop(call), reply_of(call))
            if film is not None:
                self._cut |= not film.whole
                yield film

    def _take_in(self, block: _Block, reply: tasks.Reply) -> Film | None:
        """Return a block's film, or note what went wrong instead."""
        address = str(reply.get("worker", ""))
        if "error" in reply:
            self._fail(block, address, reply)
            return None
        if "closed" in reply:  # of a worker that was started anew, or is stopped
            self.workers.reopen(address)
            self._again.append(block)
            return None
        try:
            state = tasks.state_from_arrays(reply)
            if state.taken != ((block.first, block.end),):
                raise ClusterError(f"it sent samples {state.taken} for {block}")
        except ClusterError as error:
            self.workers.refuse(address, str(error))
        cut = not reply["whole"] and self._deadline is None  # its worker ends
        if cut or address not in self.workers.fit:
            self._again.append(block)
            return None
        del self._in_a_row[address]
        self.known.records[address].note(
            (block.end - block.first) * self.share, float(reply["seconds"])
        )
        samples, rays, rejected, full = (int(reply[name]) for name in tasks.COUNTED)
        counts = Counts(samples, closest=rays, rejected=rejected, full=full)
        return Film(state, counts, bool(reply["whole"]))

    def _fail(self, block: _Block, address: str, reply: tasks.Reply) -> None:
        """Note that a block was not done, and refuse a worker that cannot do any."""
        self.workers.look()  # which raises if it is the scheduler that is gone
        reason = f"{address}: {reply['error']}" if address else str(reply["error"])
        log.warning("%s: %s", block, reason)
        block.failures += [reason] * (MOST_FAILURES if reply.get("killed") else 1)
        if len(block.failures) >= MOST_FAILURES:
            raise ClusterError(
                f"{block} failed {MOST_FAILURES} times, the last time: {block.failures[-1]}"
            )
        self._again.append(block)
        block.failed_at.add(address)
        if address in self.workers.fit:
            self._in_a_row[address] += 1
            self.known.records[address].failures += 1
            if self._in_a_row[address] >= MOST_FAILURES:
                self.workers.refuse(address, f"it failed {MOST_FAILURES} times in a row: {reason}")
