"""Devices that share the samples of a picture: each has a thread that takes blocks.

Each device adds its blocks to its own film, so that a block costs nothing beside its samples. A
device that fails is dropped, and the others render again the samples of its film.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from typing import NoReturn

from clpt.cluster.blocks import Blocks, WorkerRecord, gaps
from clpt.cluster.device_worker import TICK, DeviceWorker, Threads
from clpt.errors import ClusterError
from clpt.render.film.state import FilmState, Ranges, join_ranges
from clpt.render.makers.maker import Held, Tick
from clpt.render.wavefront.tracer import Selection
from clpt.render.wavefront.wavefront import Counts

log = logging.getLogger(__name__)

BLOCK_SECONDS = 1.0  # intended time of a block
SAVE_SECONDS = 60.0  # of work, after which a film goes to the host: a failure loses no more


class Crew:
    """Devices that work together.

    workers: devices that work; failed: failed devices with their errors. saved: the film on the
    host, None while it is empty. lost: selections and ranges of samples that no film holds any
    more.
    """

    def __init__(self, workers: Iterable[DeviceWorker]):
        self.workers = list(workers)
        self.failed: list[tuple[DeviceWorker, BaseException]] = []
        self.saved: FilmState | None = None
        self.lost: list[tuple[Selection, int, int]] = []
        self._lock = threading.RLock()
        self._changed = threading.Condition(self._lock)  # only devices' threads wait for it
        self._threads = Threads()
        self._past = Counts()  # of failed devices

    @property
    def first(self) -> DeviceWorker:
        """The first working device. Raises ClusterError if all have failed."""
        if not self.workers:
            self._give_up()
        return self.workers[0]

    @property
    def counts(self) -> Counts:
        """Counts of all devices together, including failed devices."""
        total = self._past
        for worker in self.workers:
            total = total.plus(worker.counts)
        return total

    @property
    def ranges(self) -> Ranges:
        """The sample ranges of all pixels, over all films."""
        ranges = () if self.saved is None else self.saved.taken
        for worker in self.workers:
            ranges = join_ranges(ranges, worker.ranges)
        return ranges

    @property
    def whole(self) -> Selection:
        """Samples of all pixels."""
        return Selection("all", self.first.film.wavefront.paths.pixels)

    def run(self, selection: Selection, ranges: Ranges, tick: Tick) -> bool:
        """Add ranges of a selection's samples; return False after a stop.

        tick: called repeatedly; if it returns False, devices stop. Its exceptions pass on after
        devices have stopped. Raises ClusterError when no device is left.
        """
        finished = self._share(selection, ranges, tick)
        while finished and self.lost:
            finished = self.repeat(tick)
        return finished

    def repeat(self, tick: Tick) -> bool:
        """Render lost samples again, see `run`."""
        selection = self.lost[0][0]
        again: Ranges = ()
        for other, first, end in self.lost:
            if other is selection:
                again = join_ranges(again, ((first, end),))
        self.lost = [entry for entry in self.lost if entry[0] is not selection]
        return self._share(selection, again, tick)

    def save(self) -> None:
        """Add devices' films to the host's; render again the samples of unreadable films."""
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
        """Let later renders sample every pixel, after selections of some pixels."""
        self._on_each(DeviceWorker.use_all_pixels)

    def count_from(self, counts: Counts) -> None:
        """Start counting from these counts, when devices' films are empty."""
        self._past = counts
        for worker in self.workers:
            worker.past = Counts()

    def put(self, film: FilmState | None) -> None:
        """Replace the film of all devices."""
        self._on_each(DeviceWorker.clear)
        self.lost.clear()
        self.saved = film

    def hold(self, taken: Ranges) -> Held:
        """Keep copies of films on their devices. Raises ClusterError after a device's failure."""
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
        """Remove a failed device."""
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
        """Run an action on every device; drop devices that fail."""
        for worker in list(self.workers):
            try:
                action(worker)
            except Exception as error:
                self.drop(worker, error)

    def _give_up(self) -> NoReturn:
        worker, error = self.failed[-1]
        message = f"no device is left; the last one, {worker.name}, failed: {error}"
        raise ClusterError(message) from error

    def _share(self, selection: Selection, ranges: Ranges, tick: Tick) -> bool:
        """Add ranges of a selection's samples; failures may leave `lost` samples."""
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
        """Stop all devices' threads and wait for them."""
        self._threads.end()

    def _tell(self) -> None:
        """Wake up all waiting threads."""
        self._changed.notify_all()
        self._threads.tell()

    def _work(
        self, worker: DeviceWorker, blocks: Blocks, selection: Selection, threads: Threads
    ) -> None:
        """Render blocks until none is left, in a device's thread."""

        def goes_on(_: object = None) -> bool:
            return not threads.over

        try:
            if worker.is_other:
                worker.clear()
            while (block := self._next(worker, blocks, goes_on)) is not None:
                began = time.perf_counter()
                finished = worker.do(selection, block.start, block.stop, goes_on)
                seconds = time.perf_counter() - began
                self._note(worker, blocks, selection, block, seconds, finished)
                if worker.unsaved_seconds > SAVE_SECONDS:
                    self._save(worker)
        except Exception as error:
            self.drop(worker, error)
            with self._changed:
                blocks.lose(worker)
                self._tell()

    def _next(self, worker: DeviceWorker, blocks: Blocks, goes_on: Tick) -> range | None:
        """Wait for a block; return None at the end."""
        with self._changed:
            while goes_on() and not blocks.done:
                block = blocks.take(worker)
                if block is not None:
                    return block
                self._changed.wait(TICK)  # the main thread does not notify at a stop
        return None

    def _note(
        self,
        worker: DeviceWorker,
        blocks: Blocks,
        selection: Selection,
        block: range,
        seconds: float,
        finished: bool,
    ) -> None:
        """Note that a device's film has a block, or a part of it after a stop."""
        with self._changed:
            worker.unsaved.append((selection, block.start, block.stop))
            worker.unsaved_seconds += seconds
            if finished:
                blocks.finish(worker, seconds)
                worker.paths += len(block) * selection.pixels
                worker.rate = blocks.workers[worker].rate * selection.pixels
            self._tell()

    def _save(self, worker: DeviceWorker) -> None:
        """Add a device's film to the host's."""
        ranges = worker.ranges
        state = worker.take()
        with self._lock:
            film = replace(state, taken=ranges)
            self.saved = film if self.saved is None else self.saved.merged(film)
