"""Runs of a render on the workers of a cluster.

A block is a range of sample numbers. Dask's scheduler assigns it to a worker, and to another after
a loss. This module cuts blocks and collects films.
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
from clpt.cluster.blocks import gaps
from clpt.cluster.tasks import Call, Calls, reply_of
from clpt.errors import ClusterError
from clpt.render.film.state import FilmState, Ranges
from clpt.render.makers.maker import Tick
from clpt.render.wavefront.tracer import Selection
from clpt.render.wavefront.wavefront import Counts

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger(__name__)

TICK = 0.1  # seconds, at most, between two calls of `tick`
LAST_SECONDS = 10.0  # for partial films after a stop
FIRST_SECONDS, MOST_SECONDS = 2.0, 30.0  # of a block, at first and after some minutes
LEAST_SECONDS = 0.3  # of the last blocks; longer than a call takes
SHARE = 0.1  # of the elapsed time that a block takes, between these bounds
CLIENT_SHARE = 0.5  # of the time, at most, for receiving and adding films
LAST_SHARE = 0.5  # of the remaining samples for all workers together: blocks shrink at the end
SLOTS = 2  # blocks a worker: the first is rendered, the second waits
MOST_FAILURES = 3  # of a block before the render fails; in a row, of a worker before it is refused


@dataclass(frozen=True)
class Film:
    """A film that a worker sent.

    counts: of the worker's samples and rays, `closest` has rays of both kinds; whole: whether all
    pixels have all samples of its ranges; False if a stop cut the block.
    """

    state: FilmState
    counts: Counts
    whole: bool = True


@dataclass
class _Block:
    """Samples first to end - 1; addresses of allowed workers, and failures so far."""

    first: int
    end: int
    at: set[str] = field(default_factory=set)
    failed_at: set[str] = field(default_factory=set)
    failures: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        return f"samples {self.first} to {self.end - 1}"


def block_seconds(workers: int, elapsed: float, film_seconds: float) -> tuple[float, float]:
    """Return the intended time of blocks and of the last blocks, `elapsed` [s] after the start.

    film_seconds: time to receive and add a film. With many workers blocks are long enough that all
    films take at most CLIENT_SHARE of the time, and at the end long enough that workers do not
    wait for each other's films.
    """
    all_films = workers * film_seconds
    usual = min(max(FIRST_SECONDS, SHARE * elapsed), MOST_SECONDS)
    return max(usual, all_films / CLIENT_SHARE), max(LEAST_SECONDS, all_films)


class Farm:
    """The workers of a cluster, whose records stay between runs.

    client, mixed, patience: see `ClusterRenderer`. priority: of this render's blocks among other
    renders of the cluster; seconds: rendering time so far.
    """

    def __init__(self, client: Client, *, mixed: bool, patience: float):
        self.client, self.known, self.seconds = client, Known(mixed, patience), 0.0
        self.priority: Callable[[], float] = lambda: 0.0

    def run(
        self, job: Job, selection: Selection, pixels: int, samples: tuple[int, int], taken: Ranges,
        add: Callable[[Film], None], tick: Tick,
    ) -> bool:  # fmt: skip
        """Let workers render samples of a selection; return whether all were rendered.

        pixels: of the picture; samples: first and end; `taken`: ranges that are done. add: called
        with each film, including partial films after a stop; tick: called repeatedly; if it
        returns False the workers stop soon.

        Raises ClusterError when the scheduler is gone, no worker is left or fit, or a block fails
        repeatedly.
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
    """Blocks of a selection of samples.

    share: the selection's part of all pixels; left: free ranges. complete: whether all samples are
    rendered; add_seconds: time to add a film.
    """

    def __init__(self, farm: Farm, job: Job, selection: Selection, share: float, left: Any):
        self.farm, self.known, self.job, self.share = farm, farm.known, job, share
        self.calls = Calls(farm.client, farm.priority)
        self.workers = Admission(self.calls, job, self.known)
        self.add_seconds = 0.0
        self._selection, self._left = tasks.pack_selection(selection), list(left)
        self._again: list[_Block] = []  # to be handed out again
        self._flights: dict[Call, _Block] = {}
        self._in_a_row: Counter[str] = Counter()  # failures by address
        self._deadline: float | None = None  # after a stop
        self._cut = False

    @property
    def complete(self) -> bool:
        return not (self._left or self._again or self._flights or self._cut)

    @property
    def over(self) -> bool:
        """Whether the run is complete, or stopped with no partial films to wait for."""
        if self._deadline is not None:
            return not self._flights or time.monotonic() > self._deadline
        return self.complete

    def stop(self) -> None:
        """Hand out no more blocks, and let workers send partial films."""
        if self._deadline is not None:
            return
        if self.workers.fit:
            self.calls.begin(self._tell_to_stop([*self.workers.fit]))
        seconds = LAST_SECONDS + len(self.workers.fit) * self.calls.film_seconds
        self._deadline = time.monotonic() + seconds

    async def _tell_to_stop(self, addresses: list[str]) -> None:
        """Ask workers to end their blocks early."""
        digest, how = self.job.digest, {"workers": addresses, "on_error": "ignore"}
        try:
            await asyncio.wait_for(
                self.calls.client.run(tasks.stop_job, digest, **how), LAST_SECONDS
            )
        except (OSError, asyncio.TimeoutError, ValueError) as error:
            log.warning("workers could not be told to stop: %s", error)

    def end(self) -> None:
        """Cancel all calls."""
        for call in [*self._flights, *self.workers.opening]:
            call.cancel()

    # ---- blocks

    def hand_out(self) -> None:
        """Submit blocks to Dask, SLOTS for each admitted worker.

        Raises ClusterError without a scheduler, and where no worker renders or can be expected to.
        """
        if self._deadline is None:
            self.workers.follow()
        for call, block in list(self._flights.items()):
            if not block.at & self.workers.there:
                call.cancel()  # Dask would wait for these workers
                self._again.append(self._flights.pop(call))
        while self._deadline is None and (self._left or self._again):
            if len(self._flights) >= SLOTS * len(self.workers.fit):
                return
            block = self._again.pop(0) if self._again else self._next()
            block.at = self.workers.fit.keys() - block.failed_at or set(self.workers.fit)
            call_of_block = self.calls.at(
                block.at, tasks.render_block, self.job.digest, block.first, block.end,
                self._selection,
            )  # fmt: skip
            self._flights[self.calls.begin(call_of_block)] = block

    def _next(self) -> _Block:
        """Cut the next block off the free ranges."""
        first, end = self._left[0]
        rates = [self.known.records[address].rate for address in self.workers.fit]
        seconds, least = block_seconds(
            len(rates), self.farm.seconds, max(self.add_seconds, self.calls.film_seconds)
        )
        mean = sum(rates) / len(rates) / self.share  # samples of these pixels [1/s]
        left = sum(after - before for before, after in self._left)
        last = max(LAST_SHARE * left / (len(rates) + len(self.workers.opening)), least * mean)
        size = min(max(1, int(min(seconds * mean, last))), end - first)
        self._left[:1] = [(first + size, end)] if first + size < end else []
        return _Block(first, first + size)

    def films(self) -> Iterator[Film]:
        """Wait for a moment, then yield the films that have arrived.

        Raises ClusterError for a block that fails repeatedly.
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
        """Return a block's film, or None after noting the failure."""
        address = str(reply.get("worker", ""))
        if "error" in reply:
            self._fail(block, address, reply)
            return None
        if "closed" in reply:  # the worker was restarted or stopped
            self.workers.reopen(address)
            self._again.append(block)
            return None
        try:
            state = tasks.state_from_arrays(reply)
            if state.taken != ((block.first, block.end),):
                raise ClusterError(f"it sent samples {state.taken} for {block}")
        except ClusterError as error:
            self.workers.refuse(address, str(error))
        cut = not reply["whole"] and self._deadline is None  # the worker is ending
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
        """Note a block's failure, and refuse a worker that fails repeatedly."""
        self.workers.look()  # raises if the scheduler is gone
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
