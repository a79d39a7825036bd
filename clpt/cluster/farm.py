"""The workers of a cluster: which of them take part, and runs in which they take samples.

A block is a range of sample numbers. Dask's scheduler decides who renders it, and lets another
worker do so when one is gone; here blocks are cut, workers are checked, and films are counted.
"""

from __future__ import annotations

import asyncio
import concurrent.futures
import logging
import secrets
import time
from collections import Counter
from collections.abc import Callable, Collection, Coroutine, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt.cluster import tasks
from clpt.cluster.blocks import WorkerRecord
from clpt.cluster.bundle import Bundle
from clpt.cluster.sample_ranges import gaps
from clpt.errors import ClusterError
from clpt.render.wavefront.film_state import FilmState, Ranges
from clpt.render.wavefront.tracer import Selection
from clpt.scene.fingerprint import Plain

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger(__name__)

TICK = 0.1  # seconds, at most, between two calls of `tick`
LOOK_SECONDS = 0.5  # between looks at which workers there are
ANSWER_SECONDS = 30.0  # in which a scheduler answers
LAST_SECONDS = 10.0  # in which workers send what they have, after a stop
FIRST_SECONDS, MOST_SECONDS = 2.0, 30.0  # that a block takes, at first and after some minutes
LEAST_SECONDS = 0.3  # of the last blocks, beside which the way to a worker is short
SHARE = 0.1  # of the time so far that a block takes, between these
CLIENT_SHARE = 0.5  # of the time, at most, in which this client gets and adds films
LAST_SHARE = 0.5  # of all that is left, that all workers together get: blocks shrink at the end
SLOTS = 2  # blocks of a worker: one is rendered, one waits
MOST_HELD = 4  # films that come in at a time; further ones stay at their workers
MOST_FAILURES = 3  # of a block, before the render ends; of a worker in a row, before it is refused
GONE = "the scheduler is gone"


@dataclass(frozen=True)
class Film:
    """What a worker sent.

    counts: samples, rays, rejected, full; whole: whether all pixels have the samples of its ranges,
    as they have unless a stop cut the block.
    """

    state: FilmState
    counts: dict[str, int]
    whole: bool = True


@dataclass(frozen=True)
class Job:
    """What workers render: text, from `tasks.describe_job`; the bundle of its scene; and the folder
    that holds the files of the bundle.
    """

    text: str
    bundle: Bundle
    folder: Path

    @cached_property
    def digest(self) -> str:
        """The SHA-256 by which workers know it: of scene, options, kernels and version."""
        return tasks.digest_of(self.text)


@dataclass
class Agreed:
    """What renderers know alike that render side by side.

    kind: the class of device that takes part, that of the first worker; "" before there is one.
    checked: workers whose sample was that of another one.
    """

    kind: str = ""
    checked: set[str] = field(default_factory=set)


@dataclass
class _Block:
    """Samples first to end - 1, and at which workers they failed, for which reasons."""

    first: int
    end: int
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
    others of the same cluster. workers: those that take part; refused: why others do not; lost: how
    many are gone; classes: of devices that take part, by what they are called; seconds: in which it
    rendered.
    """

    def __init__(self, client: Client, *, mixed: bool, patience: float):
        self.client, self.mixed, self.patience = client, mixed, patience
        self.priority: Callable[[], float] = lambda: 0.0
        self.workers: dict[str, WorkerRecord] = {}
        self.refused: dict[str, str] = {}
        self.lost = 0
        self.classes: dict[str, dict[str, Plain]] = {}
        self.seconds = 0.0
        self.agreed = Agreed()

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
                run.follow()
                run.hand_out()
        finally:
            run.end()
        return run.complete


class _Run:
    """Blocks of one selection of samples, and the workers that have its job open.

    share: of the pixels that have these samples; left: ranges that nobody has. complete: whether
    all samples are taken; add_seconds: in which a film is added.
    """

    def __init__(self, farm: Farm, job: Job, selection: Selection, share: float, left: Any):
        self.farm, self.client, self.job, self.share = farm, farm.client, job, share
        self.add_seconds = self.film_seconds = 0.0
        self._selection, self._left = tasks.pack_selection(selection), list(left)
        self._again: list[_Block] = []  # that came back
        self._flights: dict[concurrent.futures.Future[Any], _Block] = {}
        self._opening: dict[concurrent.futures.Future[Any], str] = {}
        self._fit: dict[str, str] = {}  # classes of the workers that may render, by address
        self._trials: dict[str, tuple[str, str]] = {}  # their class and film of one sample
        self._in_a_row: Counter[str] = Counter()  # failures
        self._gathering = asyncio.Semaphore(MOST_HELD)
        self._looked, self._seen = -LOOK_SECONDS, time.monotonic()
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
        if self._fit:
            self._begin(self._tell_to_stop([*self._fit]))
        seconds = LAST_SECONDS + len(self._fit) * self.film_seconds
        self._deadline = time.monotonic() + seconds

    async def _tell_to_stop(self, addresses: list[str]) -> None:
        """Let blocks end with what they have, beside which workers answer."""
        digest, how = self.job.digest, {"workers": addresses, "on_error": "ignore"}
        try:
            await asyncio.wait_for(self.client.run(tasks.stop_job, digest, **how), LAST_SECONDS)
        except (OSError, asyncio.TimeoutError, ValueError) as error:
            log.warning("workers could not be told to stop: %s", error)

    def end(self) -> None:
        """Want nothing more of what is on its way."""
        for call in [*self._flights, *self._opening]:
            call.cancel()

    # ---- blocks

    def hand_out(self) -> None:
        """Let Dask have blocks, two for each worker that may render."""
        while self._deadline is None and (self._left or self._again):
            if len(self._flights) >= SLOTS * len(self._fit):
                return
            block = self._again.pop(0) if self._again else self._next()
            at = self._fit.keys() - block.failed_at or self._fit.keys()
            call = self._call(
                tasks.render_block, self.job.digest, block.first, block.end, self._selection,
                at=at, loosely=True,
            )  # fmt: skip
            self._flights[self._begin(call)] = block

    def _next(self) -> _Block:
        """Cut a block off what is left."""
        first, end = self._left[0]
        rates = [self.farm.workers[address].rate for address in self._fit]
        seconds, least = block_seconds(
            len(rates), self.farm.seconds, max(self.add_seconds, self.film_seconds)
        )
        mean = sum(rates) / len(rates) / self.share  # samples of these pixels, a second
        left = sum(after - before for before, after in self._left)
        last = max(LAST_SHARE * left / (len(rates) + len(self._opening)), least * mean)
        size = min(max(1, int(min(seconds * mean, last))), end - first)
        self._left[:1] = [(first + size, end)] if first + size < end else []
        return _Block(first, first + size)

    def films(self) -> Iterator[Film]:
        """Yield the films that are there, after waiting for a moment if there is none.

        Raises ClusterError for a block that fails again and again.
        """
        calls = [*self._flights, *self._opening]
        if not calls:
            time.sleep(TICK)
        concurrent.futures.wait(calls, TICK, concurrent.futures.FIRST_COMPLETED)
        for call in [call for call in self._opening if call.done()]:
            self._admit(self._opening.pop(call), _reply(call))
        for call in [call for call in self._flights if call.done()]:
            film = self._take_in(self._flights.pop(call), _reply(call))
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
            self._fit.pop(address, None)
            self._trials.pop(address, None)
            self._again.append(block)
            return None
        try:
            state = tasks.state_from_arrays(reply)
            if state.taken != ((block.first, block.end),):
                raise ClusterError(f"it sent samples {state.taken} for {block}")
        except ClusterError as error:
            self._refuse(address, str(error))
        cut = not reply["whole"] and self._deadline is None  # its worker ends
        if cut or address not in self._fit:
            self._again.append(block)
            return None
        del self._in_a_row[address]
        self.farm.workers[address].note(
            (block.end - block.first) * self.share, float(reply["seconds"])
        )
        counts = {name: int(reply[name]) for name in ("samples", "rays", "rejected", "full")}
        return Film(state, counts, bool(reply["whole"]))

    def _fail(self, block: _Block, address: str, reply: tasks.Reply) -> None:
        """Note that a block was not done, and refuse a worker that cannot do any."""
        self._look()  # which raises if it is the scheduler that is gone
        reason = f"{address}: {reply['error']}" if address else str(reply["error"])
        log.warning("%s: %s", block, reason)
        block.failures += [reason] * (MOST_FAILURES if reply.get("killed") else 1)
        if len(block.failures) >= MOST_FAILURES:
            raise ClusterError(
                f"{block} failed {MOST_FAILURES} times, the last time: {block.failures[-1]}"
            )
        self._again.append(block)
        block.failed_at.add(address)
        if address in self._fit:
            self._in_a_row[address] += 1
            self.farm.workers[address].failures += 1
            if self._in_a_row[address] >= MOST_FAILURES:
                self._refuse(address, f"it failed {MOST_FAILURES} times in a row: {reason}")

    # ---- workers

    def follow(self) -> None:
        """Open the job at workers that came; forget those that went.

        Raises ClusterError without a scheduler, and where nobody renders and nobody will.
        """
        if self._deadline is not None or time.monotonic() < self._looked + LOOK_SECONDS:
            return
        addresses = self._look()
        farm = self.farm
        for address in farm.workers.keys() - addresses:
            log.warning("the worker %s is gone; others render its samples", address)
            farm.lost += 1
            del farm.workers[address]
            self._fit.pop(address, None)
        for call in [call for call, address in self._opening.items() if address not in addresses]:
            call.cancel()
            del self._opening[call]
        for address in sorted(addresses - self._fit.keys() - farm.refused.keys()):
            if address not in self._opening.values() and address not in self._trials:
                self._opening[self._begin(self._open(address))] = address
        self._judge()
        if self._fit or self._opening:
            self._seen = time.monotonic()
        if addresses and addresses <= farm.refused.keys():
            named = "; ".join(f"{name}: {why}" for name, why in list(farm.refused.items())[:4])
            raise ClusterError(f"no worker can render this: {named}")
        if time.monotonic() - self._seen > farm.patience:
            raise ClusterError(f"for {farm.patience:.0f} s there was no worker")

    def _look(self) -> set[str]:
        """The workers that the scheduler knows. Raises ClusterError without a scheduler."""
        try:
            addresses = set(self._begin(self.client.scheduler.ncores()).result(ANSWER_SECONDS))
        except (OSError, TimeoutError, concurrent.futures.TimeoutError, AttributeError) as error:
            raise ClusterError(f"{GONE}; what was rendered so far is kept") from error
        self._looked = time.monotonic()
        self._trials = {name: trial for name, trial in self._trials.items() if name in addresses}
        return addresses

    async def _open(self, address: str) -> tasks.Reply:
        """Open the job at a worker, with one sample of one that was not checked; its answer."""
        at = [address]
        reply = await self._call(tasks.open_job, self.job.text, {}, at=at)
        if "lacks" in reply:
            files = self._files(reply["lacks"])
            reply = await self._call(tasks.open_job, self.job.text, files, at=at)
        reason = reply.get("refused") or reply.get("error")
        if reason is None and "kind" not in reply:
            reason = "it cannot keep the scene's files"
        if reason is not None:
            return {"refused": reason}
        return reply if address in self.farm.agreed.checked else await self._try(address, reply)

    async def _try(self, address: str, opened: tasks.Reply) -> tasks.Reply:
        """Let a worker render one sample, and tell only the digest of its film."""
        reply = await self._call(tasks.render_trial, self.job.digest, at=[address])
        if "error" in reply:
            return reply
        return {**opened, "trial": reply.get("sha256"), "took": reply.get("seconds")}

    def _files(self, digests: list[str]) -> dict[str, Any]:
        """Tasks whose results are files of the bundle; workers get them from each other."""
        named = self.job.bundle.files.items()
        paths = {digest: self.job.folder / name for name, digest in named}
        return {
            digest: self.client.submit(
                tasks.give, paths[digest].read_bytes(), key=f"clpt-file-{digest}"
            )
            for digest in digests
            if digest in paths
        }

    def _admit(self, address: str, reply: tasks.Reply) -> None:
        """Let a worker render that has the job open, if it may, and its sample is right."""
        agreed, kind = self.farm.agreed, str(reply.get("kind", ""))
        reason = reply.get("refused") or reply.get("error")
        if reason is not None:
            self._refuse(address, str(reason))
            return
        if not self.farm.mixed:
            agreed.kind = agreed.kind or kind
            if kind != agreed.kind:
                reason = f"it is of another class of device: {kind}, others: {agreed.kind}"
                self._refuse(address, reason)
                return
        self.farm.classes[kind] = dict(reply["class"])
        record = self.farm.workers.setdefault(address, WorkerRecord())
        record.kind = kind
        if reply.get("trial"):
            record.rate = record.rate or 1.0 / max(float(reply["took"]), 1e-6)
            self._trials[address] = kind, str(reply["trial"])
            self._judge()
        elif address in agreed.checked:
            self._fit[address] = kind

    def _judge(self) -> None:
        """Compare the samples of workers of each class, and refuse those whose sample is wrong.

        Of two equal ones both are right; a worker without an equal is believed. Raises ClusterError
        where it cannot be told whose is wrong, and nobody comes who might.
        """
        checked = self.farm.agreed.checked
        for kind in {kind for kind, _ in self._trials.values()}:
            films = {name: film for name, (of, film) in self._trials.items() if of == kind}
            peers = [name for name, of in self._fit.items() if of == kind and name not in films]
            if len(films) == 1 and peers:  # what do those have that were checked before it came?
                if peers[0] not in self._opening.values():
                    opened = {"kind": kind, "class": self.farm.classes[kind]}
                    self._opening[self._begin(self._try(peers[0], opened))] = peers[0]
                continue
            votes: Counter[str] = Counter()
            for name, film in films.items():
                votes[film] += 2 if name in checked else 1
            (best, most), (_, second) = [*votes.most_common(2), ("", 0)][:2]
            if self._opening and (most < 2 or most == second):
                continue  # for another one that gets ready
            if most == second:
                raise ClusterError(
                    f"{' and '.join(films)} have different films of a sample, though they are of "
                    "one kind; one of them computes wrongly"
                )
            for name, film in films.items():
                if film != best:
                    self._refuse(name, "its film of a sample is wrong")
                    continue
                self._fit[name] = kind
                if most > 1:
                    checked.add(name)

    def _refuse(self, address: str, reason: str) -> None:
        log.warning("the worker %s is refused: %s", address, reason)
        self.farm.refused[address] = reason
        self.farm.workers.pop(address, None)
        self._fit.pop(address, None)
        self._trials.pop(address, None)

    # ---- Dask

    def _begin(self, call: Coroutine[Any, Any, Any]) -> concurrent.futures.Future[Any]:
        """Let Dask's event loop do something."""
        return asyncio.run_coroutine_threadsafe(call, self.client.loop.asyncio_loop)

    async def _call(
        self, function: Any, *arguments: Any, at: Collection[str], loosely: bool = False
    ) -> tasks.Reply:
        """Run a function at one of some workers and return what it returns, or an "error".

        loosely: or at any other, once these are gone.
        """
        from distributed import KilledWorker

        future = self.client.submit(
            function, *arguments, key=f"clpt-{function.__name__}-{secrets.token_hex(8)}",
            workers=[*at], allow_other_workers=loosely, priority=self.farm.priority(),
        )  # fmt: skip
        getting: asyncio.Future[Any] | None = None
        try:
            await future._state.wait()
            async with self._gathering:
                began = time.monotonic()
                # Dask gathers for several calls at once: to cancel one would cancel all of them.
                getting = asyncio.ensure_future(self.client.gather(future, direct=True))
                reply = await asyncio.shield(getting)
                if function is tasks.render_block:
                    self.film_seconds = (time.monotonic() - began) / MOST_HELD
        except asyncio.CancelledError as error:
            if future.status != "cancelled":  # it is this call that is not wanted any more
                raise
            return {"error": f"the scheduler cancelled a task {error}"}
        except Exception as error:
            first = next(iter(str(error).splitlines()), "")
            killed = isinstance(error, KilledWorker)
            return {"error": f"{type(error).__name__}: {first}", "killed": killed}
        finally:
            if getting is None or getting.done():
                future.release()
            else:
                getting.add_done_callback(lambda done: (future.release(), _outcome(done)))
        return reply if isinstance(reply, dict) else {"error": "it sent what is no reply"}


def _reply(call: concurrent.futures.Future[tasks.Reply]) -> tasks.Reply:
    """Return what a call has come to."""
    return {"error": "it was cancelled"} if call.cancelled() else call.result()


def _outcome(done: asyncio.Future[Any]) -> BaseException | None:
    """Return what a call has raised that nobody waits for: else asyncio logs it."""
    return None if done.cancelled() else done.exception()
