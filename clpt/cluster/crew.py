"""Devices that share the samples of a picture: a thread each, which takes blocks while it is free.

Each device adds its blocks to its own film, so that a block costs nothing beside its samples. A
device that fails is dropped, and what only its film held is done again by the others.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import NoReturn

from clpt.cluster.blocks import Block, Blocks, WorkerRecord
from clpt.cluster.device_worker import DeviceWorker
from clpt.cluster.sample_ranges import gaps
from clpt.cluster.threads import TICK, Threads
from clpt.errors import ClusterError
from clpt.render.film.state import FilmState, Ranges, join_ranges
from clpt.render.makers.maker import Held
from clpt.render.wavefront.tracer import Selection
from clpt.render.wavefront.wavefront import Counts

log = logging.getLogger(__name__)

BLOCK_SECONDS = 1.0  # that a block should take
SAVE_SECONDS = 60.0  # of a device's work, after which its film goes to the host: no more is lost


class Crew:
    """Devices that work together.

    workers: those that have not failed; failed: the names and errors of the others. saved: the film
    on the host of what they took, None for an empty one. lost: selections and ranges of samples
    that no film holds any more.
    """

    def __init__(self, workers: Iterable[DeviceWorker]):
        self.workers = list(workers)
        self.failed: list[tuple[DeviceWorker, BaseException]] = []
        self.saved: FilmState | None = None
        self.lost: list[tuple[Selection, int, int]] = []
        self._lock = threading.RLock()
        self._changed = threading.Condition(self._lock)  # only threads of devices wait for it
        self._threads = Threads()
        self._past = Counts()  # of devices that failed

    @property
    def first(self) -> DeviceWorker:
        """The first device that has not failed. Raises ClusterError if all have."""
        if not self.workers:
            self._give_up()
        return self.workers[0]

    @property
    def counts(self) -> Counts:
        """Counts of all devices together, those that were dropped included."""
        total = self._past
        for worker in self.workers:
            total = total.plus(worker.counts)
        return total

    @property
    def ranges(self) -> Ranges:
        """The samples of all pixels that are in a film."""
        ranges = () if self.saved is None else self.saved.taken
        for worker in self.workers:
            ranges = join_ranges(ranges, worker.ranges)
        return ranges

    @property
    def whole(self) -> Selection:
        """Samples of all pixels."""
        return Selection("all", self.first.film.wavefront.paths.pixels)

    def run(self, selection: Selection, ranges: Ranges, tick: Callable[[], bool]) -> bool:
        """Add ranges of a selection's samples; return whether it was not stopped.

        tick: called all the while; if it returns False, devices stop. What it raises is raised when
        they have. Raises ClusterError when no device is left.
        """
        finished = self._share(selection, ranges, tick)
        while finished and self.lost:
            finished = self.repeat(tick)
        return finished

    def repeat(self, tick: Callable[[], bool]) -> bool:
        """Do again what was lost, as `run` does it."""
        selection = self.lost[0][0]
        again: Ranges = ()
        for other, first, end in self.lost:
            if other is selection:
                again = join_ranges(again, ((first, end),))
        self.lost = [entry for entry in self.lost if entry[0] is not selection]
        return self._share(selection, again, tick)

    def save(self) -> None:
        """Bring to the host what only films on devices hold; do again what cannot be read."""
        while True:
            for worker in [w for w in self.workers if w.unsaved]:
                try:
                    self._save(worker)
                except Exception as error:
                    self.drop(worker, error)
            if not self.lost:
                return
            if not self.repeat(lambda: True):
                self.lost.clear()

    def use_all_pixels(self) -> None:
        """Let later renders sample every pixel, after selections of some."""
        self._on_each(DeviceWorker.use_all_pixels)

    def count_from(self, counts: Counts) -> None:
        """Count from these, when films on devices are empty."""
        self._past = counts
        for worker in self.workers:
            worker.past = Counts()

    def put(self, film: FilmState | None) -> None:
        """Let a film be that of all devices."""
        self._on_each(DeviceWorker.clear)
        self.lost.clear()
        self.saved = film

    def hold(self, taken: Ranges) -> Held:
        """Keep copies of films on their devices. Raises ClusterError where one has failed."""
        if self.lost:
            raise ClusterError("a device has failed: others do its part first")
        workers, saved = [worker for worker in self.workers if worker.unsaved], self.saved
        for worker in workers:
            worker.film.wavefront.film.hold()

        def read() -> FilmState:
            total = saved
            for worker in workers:
                film = worker.film.words(held=True)
                total = film if total is None else total.plus(film)
            assert total is not None, "something is held"
            return replace(total, taken=taken)

        return Held(read, self.counts, taken)

    def drop(self, worker: DeviceWorker, error: BaseException) -> None:
        """Leave a device out from now on."""
        with self._lock:
            if worker not in self.workers:
                return
            self.workers.remove(worker)
            self.failed.append((worker, error))
            self.lost += worker.unsaved
            self._past = self._past.plus(worker.past)
            self._tell()
        others = "others do its part" if self.workers else "no other is left"
        log.warning("%s failed and is left out, %s: %s", worker.name, others, error)

    def _on_each(self, action: Callable[[DeviceWorker], None]) -> None:
        """Do something on every device; drop those that fail."""
        for worker in list(self.workers):
            try:
                action(worker)
            except Exception as error:
                self.drop(worker, error)

    def _give_up(self) -> NoReturn:
        worker, error = self.failed[-1]
        message = f"no device is left; the last one, {worker.name}, failed: {error}"
        raise ClusterError(message) from error

    def _share(self, selection: Selection, ranges: Ranges, tick: Callable[[], bool]) -> bool:
        """Add ranges of a selection's samples once, perhaps with losses."""
        end = ranges[-1][1]
        others = tuple(gaps(ranges, 0, end))
        blocks = Blocks(end, others, seconds=BLOCK_SECONDS)
        for worker in self.workers:
            rate = worker.rate / selection.pixels
            blocks.join(worker, WorkerRecord(worker.name, rate, size=BLOCK_SECONDS * rate))
        threads = self._threads = Threads()
        try:
            for worker in list(self.workers):
                threads.start(partial(self._work, worker, blocks, selection, threads))
            while not self._over(blocks):
                threads.wait()
                if not tick():
                    break
        finally:
            self.rest()
        tick()
        if not self.workers:
            self._give_up()
        return blocks.done

    def _over(self, blocks: Blocks) -> bool:
        return self._threads.over or blocks.done or not self.workers

    def rest(self) -> None:
        """Let devices end what they do, and wait for them."""
        self._threads.end()

    def _tell(self) -> None:
        """Wake up all who wait for a change."""
        self._changed.notify_all()
        self._threads.tell()

    def _work(
        self, worker: DeviceWorker, blocks: Blocks, selection: Selection, threads: Threads
    ) -> None:
        """Take blocks until none is left: a device's thread, one of these."""

        def goes_on(_: object = None) -> bool:
            return not threads.over

        try:
            if worker.is_other:
                worker.clear()
            while (block := self._next(worker, blocks, goes_on)) is not None:
                began = time.perf_counter()
                finished = worker.do(selection, block.first, block.end, goes_on)
                seconds = time.perf_counter() - began
                self._note(worker, blocks, selection, block, seconds, finished)
                if worker.unsaved_seconds > SAVE_SECONDS:
                    self._save(worker)
        except Exception as error:
            self.drop(worker, error)
            with self._changed:
                blocks.lose(worker)
                self._tell()

    def _next(
        self, worker: DeviceWorker, blocks: Blocks, goes_on: Callable[[], bool]
    ) -> Block | None:
        """Wait for a block; return None when there is nothing more to do."""
        with self._changed:
            while goes_on() and not blocks.done:
                block = blocks.take(worker)
                if block is not None:
                    return block
                self._changed.wait(TICK)  # the main thread tells nobody that they are over
        return None

    def _note(
        self,
        worker: DeviceWorker,
        blocks: Blocks,
        selection: Selection,
        block: Block,
        seconds: float,
        finished: bool,
    ) -> None:
        """Note that a block is in a device's film, wholly or, where it was stopped, in part."""
        with self._changed:
            worker.unsaved.append((selection, block.first, block.end))
            worker.unsaved_seconds += seconds
            if finished:
                blocks.finish(worker, seconds)
                worker.paths += block.samples * selection.pixels
                worker.rate = blocks.workers[worker].rate * selection.pixels
            self._tell()

    def _save(self, worker: DeviceWorker) -> None:
        """Add a device's film to the one on the host."""
        ranges = worker.ranges
        state = worker.take()
        with self._lock:
            given = replace(state, taken=ranges)
            self.saved = given if self.saved is None else self.saved.merged(given)
