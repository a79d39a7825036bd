"""A device that works on a picture with others: its maker, and what only its own film holds."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any, TypeVar

from clpt.cluster.threads import on_all
from clpt.device import Device
from clpt.errors import SceneError
from clpt.render.film.state import FilmState, Ranges, join_ranges
from clpt.render.makers.device_film import DeviceFilm
from clpt.render.wavefront.tracer import OnBatch, Selection, use_all_pixels
from clpt.render.wavefront.wavefront import Counts, Wavefront

_Made = TypeVar("_Made")


class Once:
    """Things that several devices share: each is made for the first that asks, and kept."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._made: dict[Any, Any] = {}

    def __call__(self, key: object, make: Callable[[], _Made]) -> _Made:
        """Return what was made for a key. Raises what `make` raised."""
        with self._lock:
            if key not in self._made:
                try:
                    self._made[key] = make()
                except SceneError as error:
                    self._made[key] = error
            if isinstance(self._made[key], SceneError):
                raise self._made[key]
            return self._made[key]


class DeviceWorker:
    """A device that works with others.

    name: for people; film: its own; unsaved: the selections and ranges of samples that it holds,
    and nothing else does; shown: the film that it was made to be, if any; is_other: whether it may
    be another one than that of `unsaved`; paths: that it traced; rate: of paths [1/s], 0 when not
    known.
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
        """Counts of what the device has rendered so far."""
        return self.past.plus(self.film.wavefront.counts)

    @property
    def ranges(self) -> Ranges:
        """The samples of all pixels that only its film holds."""
        ranges: Ranges = ()
        for selection, first, end in self.unsaved:
            if selection.paths == "all":
                ranges = join_ranges(ranges, ((first, end),))
        return ranges

    def do(self, selection: Selection, first: int, end: int, on_batch: OnBatch) -> bool:
        """Add samples first to end - 1 to the film; return whether it was not stopped."""
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
        """Let later samples be of every pixel."""
        self._selected = None
        use_all_pixels(self.film.wavefront)

    def show(self, state: FilmState) -> None:
        """Let the film be another one."""
        if self.shown is not state:
            self.is_other, self.shown = True, None  # wherever an error comes
            self.film.put(state)
            self.shown = state


def device_names(devices: list[Device]) -> list[str]:
    """Return what devices are called: those with one label get a number."""
    labels = [device.info.label for device in devices]
    return [
        f"{label} #{labels[: i + 1].count(label)}" if labels.count(label) > 1 else label
        for i, label in enumerate(labels)
    ]


def where_it_works(action: Callable[[Any], Any], items: list[Any]) -> list[Any]:
    """Do something with every item at once; return the results, for some of them exceptions.

    Raises what was raised for the first item, if it is bad input or if all failed.
    """
    results = on_all(action, items)
    errors = [result for result in results if isinstance(result, BaseException)]
    for error in errors:
        if isinstance(error, (SceneError, TypeError)):
            raise error
    if len(errors) == len(items):
        raise errors[0]
    return results
