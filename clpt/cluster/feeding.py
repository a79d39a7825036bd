"""Gives blocks to the workers of a Dask cluster and gets their films, in Dask's event loop."""

from __future__ import annotations

import asyncio
import itertools
import logging
import queue
import secrets
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt.cluster import tasks
from clpt.cluster.blocks import Block, Blocks, Outcome
from clpt.cluster.bundle import Bundle
from clpt.errors import ClusterError
from clpt.render.wavefront.film_state import FilmState
from clpt.render.wavefront.tracer import Selection
from clpt.scene.fingerprint import Plain

if TYPE_CHECKING:
    from distributed import Client, Future

log = logging.getLogger(__name__)

SLOTS = 2  # tasks of a worker: one is rendered, one waits
LOOK_SECONDS = 0.5  # between looks at which workers there are
WAIT_SECONDS = 1.0  # between looks for a slow block, of a worker that has nothing to do
TURN_SECONDS = 0.1  # between looks whether another render needs workers
MOST_LOOKS = 200.0  # of these by all workers together [1/s]
ANSWER_SECONDS = 30.0  # in which a scheduler answers
LAST_SECONDS = 10.0  # in which workers send what they have, after a stop
MOST_HELD = 4  # films that wait to be added; further ones stay at their workers
MOST_FAILURES = 3  # of a worker in a row, before it is refused
MOST_LOSSES = 10  # of workers that had a block, before the render ends
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


@dataclass
class Chosen:
    """The class of device that takes part: that of the first worker; "" before there is one."""

    kind: str = ""


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


class Feeder:
    """One run: every worker gets blocks as long as there are some.

    All of it runs in the event loop of Dask's client, but for `stop`. blocks: of a selection's
    samples; films: get what is to be added, and None at the end; mixed, patience, waits: see
    `Farm`; chosen: the class of device that takes part.
    """

    def __init__(
        self, client: Client, blocks: Blocks, job: Job, selection: Selection, *,
        films: queue.Queue[Film | None], mixed: bool, patience: float, chosen: Chosen,
        waits: Callable[[], bool] = lambda: False,
    ):  # fmt: skip
        self.client, self.blocks, self.job = client, blocks, job
        self.films, self.mixed, self.patience, self.chosen = films, mixed, patience, chosen
        self.waits, self._selection = waits, tasks.pack_selection(selection)
        self.loop: asyncio.AbstractEventLoop = client.loop.asyncio_loop
        self._serving: dict[str, asyncio.Task[None]] = {}
        self._changed = asyncio.Event()
        self.classes: dict[str, dict[str, Plain]] = {}  # of devices, by what they are called
        self.film_seconds = 0.0  # in which a film comes in, beside others
        self._stopping = self._ended = False
        self._errors: list[BaseException] = []
        self._failures: dict[str, int] = {}
        self._losses: dict[int, int] = {}  # of a block, by its number
        self._numbers, self._name = itertools.count(), secrets.token_hex(4)
        self._gathering: asyncio.Semaphore

    def stop(self) -> None:
        """Hand out no more blocks, and let workers send what they have. From any thread."""
        if not self._stopping:
            self._stopping = True
            self.loop.call_soon_threadsafe(self._changed.set)

    async def run(self) -> None:
        """Give blocks to workers until all are done. Raises ClusterError."""
        self._gathering = asyncio.Semaphore(MOST_HELD)
        seen = time.monotonic()
        try:
            while not (self.blocks.done or self._stopping):
                addresses = await self._addresses()
                await self._follow(addresses)
                if self._errors:
                    raise self._errors[0]
                if self._working():
                    seen = time.monotonic()
                self._check_any(addresses, time.monotonic() - seen)
                await self._wait(LOOK_SECONDS)
            if self._stopping and not self.blocks.done:
                await self._stop_workers()
        finally:
            self._ended = True
            self.blocks.close()
            for task in self._serving.values():
                task.cancel()
            try:
                await asyncio.gather(*self._serving.values(), return_exceptions=True)
            finally:
                self.films.put(None)

    # ---- who is there

    async def _addresses(self) -> set[str]:
        """The workers that the scheduler knows. Raises ClusterError without a scheduler."""
        try:
            answer = self.client.scheduler.ncores()
            return set(await asyncio.wait_for(answer, ANSWER_SECONDS))
        except (OSError, asyncio.TimeoutError, AttributeError) as error:
            raise ClusterError(f"{GONE}; what was rendered so far is kept") from error

    async def _follow(self, addresses: set[str]) -> None:
        """Serve workers that came; note those that went."""
        for address in self.blocks.former.keys() - addresses:
            self.blocks.lose(address)
        for address in self._serving.keys() - addresses:
            self._serving.pop(address).cancel()
            self._lose(address)
        for address in sorted(addresses - self._serving.keys()):
            if address not in self.blocks.refused:
                self.blocks.expect(address)
                self._serving[address] = asyncio.create_task(self._serve(address))

    def _lose(self, address: str) -> None:
        """Give the blocks of a worker that is gone to others.

        Raises ClusterError for a block whose workers are gone again and again.
        """
        lost = self.blocks.lose(address)
        log.warning("the worker %s is gone; its %d blocks go to others", address, len(lost))
        self._changed.set()
        for block in lost:
            self._losses[block.number] = self._losses.get(block.number, 0) + 1
            if self._losses[block.number] >= MOST_LOSSES:
                raise ClusterError(
                    f"{MOST_LOSSES} workers that rendered samples {block.first} to {block.end - 1} "
                    f"are gone, the last one {address}"
                )

    def _working(self) -> bool:
        return any(not task.done() for task in self._serving.values())

    def _check_any(self, addresses: set[str], seconds: float) -> None:
        """Raise ClusterError where nobody renders, and nobody will."""
        refused = self.blocks.refused
        if addresses and addresses <= refused.keys():
            named = "; ".join(f"{name}: {reason}" for name, reason in list(refused.items())[:4])
            raise ClusterError(f"no worker can render this: {named}")
        if seconds > self.patience:
            raise ClusterError(f"for {seconds:.0f} s there was no worker")

    async def _wait(self, seconds: float) -> None:
        """Wait until something changes, or for some seconds."""
        waiting = self._changed
        with suppress(asyncio.TimeoutError):
            await asyncio.wait_for(waiting.wait(), seconds)
        if waiting is self._changed and waiting.is_set():
            self._changed = asyncio.Event()

    async def _stop_workers(self) -> None:
        """Let blocks end with what they have, and wait for that."""
        self.blocks.close()
        serving = [address for address, task in self._serving.items() if not task.done()]
        call = self.client.run(tasks.stop_job, self.job.digest, workers=serving, on_error="ignore")
        pending = [self._serving[address] for address in serving]
        try:
            await asyncio.wait_for(call, LAST_SECONDS)
        except (OSError, asyncio.TimeoutError, ValueError) as error:
            log.warning("workers could not be told to stop: %s", error)
        if pending:
            seconds = LAST_SECONDS + len(pending) * self.film_seconds
            await asyncio.wait(pending, timeout=seconds)

    # ---- one worker

    async def _serve(self, address: str) -> None:
        """Open the job at a worker, then give it blocks."""
        try:
            while self.waits() and not self._stopping:
                await self._wait(TURN_SECONDS)
            kind = None if self._stopping else await self._open(address)
            if kind is None:
                return
            self.blocks.join(address, kind)
            await asyncio.gather(*(self._feed(address) for _ in range(SLOTS)))
        except asyncio.CancelledError:
            raise
        except BaseException as error:
            self._errors.append(error)
            self._changed.set()

    async def _open(self, address: str) -> str | None:
        """Open the job at a worker; return its class of device, None if it takes no part."""
        reply = await self._call(address, tasks.open_job, self.job.text, {})
        if "lacks" in reply:
            files = self._files(reply["lacks"])
            reply = await self._call(address, tasks.open_job, self.job.text, files)
        reason = reply.get("refused") or reply.get("error")
        kind = str(reply.get("kind", ""))
        if reason is None and not kind:
            reason = "it cannot keep the scene's files"
        if reason is None and not self.mixed:
            self.chosen.kind = self.chosen.kind or kind
            if kind != self.chosen.kind:
                reason = f"it is of another class of device: {kind}, others: {self.chosen.kind}"
        if reason is None:
            self.classes[kind] = dict(reply.get("class", {}))
            log.info("the worker %s is ready in %.2f s: %s", address, reply["seconds"], kind)
            return kind
        self._refuse(address, reason)
        return None

    def _files(self, digests: list[str]) -> dict[str, Future]:
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

    async def _feed(self, address: str) -> None:
        """Give a worker blocks, one after the other."""
        while not (self._stopping or self.blocks.done):
            if self.waits():
                await self._wait(TURN_SECONDS)
                continue
            block = self.blocks.take(address, time.monotonic())
            if block is None:
                if address in self.blocks.refused:
                    return
                await self._wait(max(WAIT_SECONDS, len(self._serving) / MOST_LOOKS))
                continue
            reply = await self._call(
                address, tasks.render_block, self.job.digest, block.first, block.end,
                self._selection,
            )  # fmt: skip
            await self._take_in(address, block, reply)
        self._changed.set()

    async def _take_in(self, address: str, block: Block, reply: dict[str, Any]) -> None:
        """Add a worker's film, or note what went wrong instead."""
        if "closed" in reply:
            self.blocks.give_back(address, block)
            self._changed.set()
            if not self._stopping:
                await self._open(address)
            return
        if "error" in reply:
            self._fail(address, block, str(reply["error"]))
            return
        try:
            state = await asyncio.to_thread(tasks.state_from_arrays, reply)
            self._check(state, block)
        except ClusterError as error:
            self._refuse(address, str(error))
            return
        if not reply["whole"] and not self._stopping:
            self.blocks.give_back(address, block)
            return
        self._failures.pop(address, None)
        outcome = self.blocks.finish(
            address, block, time.monotonic(), seconds=float(reply["seconds"]),
            digest=str(reply["sha256"]),
        )  # fmt: skip
        if outcome is Outcome.ADD:
            counts = {name: int(reply[name]) for name in ("samples", "rays", "rejected", "full")}
            self.films.put(Film(state, counts, bool(reply["whole"])))

    def _check(self, state: FilmState, block: Block) -> None:
        """Raise ClusterError for a film that is not of a block."""
        if state.taken != ((block.first, block.end),):
            raise ClusterError(f"it sent samples {state.taken} for {block.first} to {block.end}")

    def _fail(self, address: str, block: Block, reason: str) -> None:
        """Note that a worker could not do a block, and refuse one that cannot do any."""
        log.warning("the worker %s: %s", address, reason)
        self._failures[address] = self._failures.get(address, 0) + 1
        self.blocks.fail(address, block, f"{address}: {reason}")
        self._changed.set()
        if self._failures[address] >= MOST_FAILURES:
            self._refuse(address, f"it failed {MOST_FAILURES} times in a row: {reason}")

    def _refuse(self, address: str, reason: str) -> None:
        log.warning("the worker %s is refused: %s", address, reason)
        self.blocks.refuse(address, reason)
        self._changed.set()

    async def _call(self, address: str, function: Any, *arguments: Any) -> dict[str, Any]:
        """Run a function at a worker and return what it returns, or an "error"."""
        future = self.client.submit(
            function, *arguments, key=f"clpt-{self._name}-{next(self._numbers)}",
            workers=[address], allow_other_workers=False, retries=0,
        )  # fmt: skip
        try:
            await future._state.wait()
            async with self._gathering:
                began = time.monotonic()
                reply = await self.client.gather(future, direct=True)
                if function is tasks.render_block:
                    self.film_seconds = (time.monotonic() - began) / MOST_HELD
        except asyncio.CancelledError:  # of this task, or by the scheduler
            if self._ended or address not in self._serving:
                raise
            return {"error": "the scheduler cancelled a task"}
        except Exception as error:
            first = next(iter(str(error).splitlines()), "")
            return {"error": f"{type(error).__name__}: {first}"}
        finally:
            future.release()
        return reply if isinstance(reply, dict) else {"error": "it sent what is no reply"}
