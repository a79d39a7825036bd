"""A device that shares a picture with others: its film and the samples that only it holds."""

from __future__ import annotations

import _thread
import threading
from collections.abc import Callable
from contextlib import suppress
from queue import Empty, SimpleQueue
from typing import Any

from clpt.device import Device
from clpt.errors import SceneError
from clpt.render.film.state import FilmState, Ranges, join_ranges
from clpt.render.makers.device_film import DeviceFilm
from clpt.render.wavefront.bounce_loop import OnBatch
from clpt.render.wavefront.tracer import Selection, use_all_pixels
from clpt.render.wavefront.wavefront import Counts, Wavefront

TICK = 0.05  # seconds between two polls for changes without notice


class Threads:
    """Threads that work together until `over` is set.

    The main thread may be interrupted between starting a thread and noting it. So threads register
    themselves, and a thread that starts too late does nothing.
    """

    def __init__(self) -> None:
        # Ctrl-C may interrupt the main thread inside a Condition, which threading.Thread.start
        # uses, and leave it locked for ever or released twice. The interpreter's built-in locks,
        # queues and threads have no such moment.
        self._lock = threading.RLock()
        self._news: SimpleQueue[None] = SimpleQueue()
        self._at_work = 0
        self.over = False

    def start(self, action: Callable[[], Any]) -> None:
        """Run an action in a new thread."""

        def work() -> None:
            with self._lock:
                if self.over:
                    return
                self._at_work += 1
            try:
                action()
            finally:
                with self._lock:
                    self._at_work -= 1
                self.tell()

        _thread.start_new_thread(work, ())

    def tell(self) -> None:
        """Wake up a waiting thread."""
        self._news.put(None)

    def wait(self) -> None:
        """Wait for news, at most TICK."""
        with suppress(Empty):
            self._news.get(timeout=TICK)

    def end(self) -> None:
        """Set `over` and wait for the threads."""
        with self._lock:
            self.over = True
        while self._at_work:
            self.wait()


def on_all(action: Callable[[Any], Any], items: list[Any]) -> list[Any]:
    """Run an action for all items in parallel; return results, exceptions for failed items.

    All threads have ended when this returns or raises.
    """
    results: dict[int, Any] = {}

    def do(i: int) -> None:
        try:
            results[i] = action(items[i])
        except BaseException as error:
            results[i] = error

    threads = Threads()
    try:
        for i in range(len(items)):
            threads.start(lambda i=i: do(i))  # type: ignore[misc]
        while len(results) < len(items):
            threads.wait()
    finally:
        threads.end()
    return [results[i] for i in range(len(items))]


class DeviceWorker:
    """A device that works with others.

    name: for people; film: of this device; unsaved: selections and ranges of samples that only
    this film holds; shown: the film that `show` wrote, if any; is_other: whether the film may
    differ from `unsaved`; paths: the number traced; rate: of paths [1/s], 0 while unknown.
    """

    def __init__(self, name: str, film: DeviceFilm):
        self.name, self.film = name, film
        self.unsaved: list[tuple[Selection, int, int]] = []
        self.unsaved_seconds = 0.0
        self.shown: FilmState | None = None
        self.is_other = False
        self.paths, self.rate = 0, 0.0
        self.past = Counts()  # before the film was emptied
        self._selected: tuple[Selection, Wavefront] | None = None

    @property
    def counts(self) -> Counts:
        """Counts of all samples of this device."""
        return self.past.plus(self.film.wavefront.counts)

    @property
    def ranges(self) -> Ranges:
        """The sample ranges of all pixels that only this film holds."""
        ranges: Ranges = ()
        for selection, first, end in self.unsaved:
            if selection.paths == "all":
                ranges = join_ranges(ranges, ((first, end),))
        return ranges

    def do(self, selection: Selection, first: int, end: int, on_batch: OnBatch) -> bool:
        """Add samples first to end - 1 to the film; return False after a stop."""
        wavefront = self.film.wavefront
        former, by = self._selected or (None, None)
        if selection is not former or by is not wavefront:
            selection.prepare(wavefront)
        self._selected = selection, wavefront
        return selection.add(wavefront, first, end, on_batch)

    def take(self) -> FilmState:
        """Return the film, and empty it."""
        state = self.film.words()
        self.clear()
        return state

    def clear(self) -> None:
        """Empty the film."""
        self.past = self.counts
        self.film.wavefront.clear()
        self.unsaved, self.unsaved_seconds, self.shown = [], 0.0, None
        self.is_other = False

    def use_all_pixels(self) -> None:
        """Let later calls sample every pixel."""
        self._selected = None
        use_all_pixels(self.film.wavefront)

    def show(self, state: FilmState) -> None:
        """Replace the film, for pictures."""
        if self.shown is not state:
            self.is_other, self.shown = True, None  # valid after an error at any line
            self.film.put(state)
            self.shown = state


def device_names(devices: list[Device]) -> list[str]:
    """Return names of devices: devices with equal labels get numbers."""
    labels = [device.info.label for device in devices]
    return [
        f"{label} #{labels[: i + 1].count(label)}" if labels.count(label) > 1 else label
        for i, label in enumerate(labels)
    ]


def results_where_possible(action: Callable[[Any], Any], items: list[Any]) -> list[Any]:
    """Run an action for all items in parallel; return results, exceptions for failed items.

    Raises the first SceneError or TypeError, and the first exception where all items failed.
    """
    results = on_all(action, items)
    errors = [result for result in results if isinstance(result, BaseException)]
    for error in errors:
        if isinstance(error, (SceneError, TypeError)):
            raise error
    if len(errors) == len(items):
        raise errors[0]
    return results
