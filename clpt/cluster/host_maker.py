"""Makers whose films are added up on the host: the base of several devices and of clusters."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable

from clpt import device as dev
from clpt.errors import ClusterError
from clpt.render.film.state import FilmState
from clpt.render.makers.maker import Maker
from clpt.render.wavefront.tracer import OnBatch, Selection, Tracer


class HostMaker(Maker):
    """Base of makers whose films are added up on the host.

    film: all that has come to the host; None where that is nothing.
    """

    film: FilmState | None

    def after(self, events: dev.Events) -> None:
        """Wait for events of the caller."""
        for event in events or ():
            dev.wait(event)

    @property
    def last(self) -> None:
        """None: all has been waited for."""

    @abstractmethod
    def add(self, selection: Selection, first: int, end: int, tick: Callable[[], bool]) -> bool:
        """Add samples first to end - 1 of a selection; return whether it was not stopped."""

    def use_all_pixels(self) -> None:
        """Let later calls sample every pixel."""

    def words(self, *names: str) -> FilmState:
        """Return the film, whose parts are together."""
        return self.home.no_words if self.film is None else self.film

    def tracer(self) -> Tracer:
        """Return what adds selections of samples to the film."""
        return HostTracer(self)


class HostTracer(Tracer):
    """Adds samples to a film on the host, and shows it at home where its noise is measured."""

    def __init__(self, maker: HostMaker):
        self._maker, self._home = maker, maker.home
        super().__init__(self._home.wavefront)
        self._kept: FilmState | None = None

    def add(self, selection: Selection, first: int, end: int, on_batch: OnBatch) -> bool:
        """Add samples first to end - 1 of a selection; return whether it was not stopped."""
        if selection.paths == "guides":  # beside others, which the film at home was made to have
            self._maker.put(self._home.words())
        return self._maker.add(selection, first, end, lambda: on_batch(None))

    def gather(self) -> None:
        """Let the film at home hold all that was added so far."""
        self._maker.gather()
        self._show()

    def keep(self) -> None:
        """Keep what the film holds, for `give_back`."""
        self._kept = self._maker.words()

    def give_back(self) -> None:
        """Let the film hold what it did at `keep`."""
        assert self._kept is not None, "it was kept"
        self._maker.put(self._kept)
        self._show()

    def use_all_pixels(self) -> None:
        """Let later calls sample every pixel."""
        self._maker.use_all_pixels()

    def _show(self) -> None:
        """Let the film at home be the whole one. Raises ClusterError where that has failed."""
        if self._maker.shown() is not self._home:
            raise ClusterError("the device has failed that measures the noise")
