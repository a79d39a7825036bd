"""Base of makers that add films on the host: several devices, and clusters."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

from clpt import device as dev
from clpt.errors import ClusterError
from clpt.render.edit.plans import Plan
from clpt.render.film.state import FilmState
from clpt.render.makers.maker import Maker, Tick
from clpt.render.makers.planning import Changes
from clpt.render.wavefront.bounce_loop import OnBatch
from clpt.render.wavefront.tracer import Selection, Tracer


class HostMaker(Maker):
    """Base of makers that add films on the host.

    film: the sum on the host, None while it is empty.
    """

    film: FilmState | None

    def after(self, events: dev.Events) -> None:
        """Wait for the caller's events."""
        for event in events or ():
            dev.wait(event)

    @property
    def last(self) -> None:
        """None: calls return when their work is done."""

    @abstractmethod
    def add(self, selection: Selection, first: int, end: int, tick: Tick) -> bool:
        """Add samples first to end - 1 of a selection; return False after a stop."""

    @abstractmethod
    def write(self, changes: Changes, events: dev.Events) -> None:
        """Change the scene; see `HostPlan`."""

    def use_all_pixels(self) -> None:
        """Let later calls sample every pixel."""

    def words(self, *names: str) -> FilmState:
        """Return the film after `gather`."""
        return self.home.no_words if self.film is None else self.film

    def tracer(self) -> Tracer:
        """Return a tracer that adds selections of samples to the film."""
        return HostTracer(self)


@dataclass(frozen=True, eq=False)
class HostPlan(Plan):
    """Changes of the scene that a maker writes by itself, to its devices or for its workers."""

    maker: HostMaker
    changes: Changes
    events: dev.Events = None
    refusals = (Exception,)

    @property
    def repeatable(self) -> bool:
        return False

    def write(self) -> None:
        self.maker.write(self.changes, self.events)


class HostTracer(Tracer):
    """Adds samples to a film on the host, and copies it to the home device to measure noise."""

    def __init__(self, maker: HostMaker):
        self._maker, self._home = maker, maker.home
        super().__init__(self._home.wavefront)
        self._kept: FilmState | None = None

    def add(self, selection: Selection, first: int, end: int, on_batch: OnBatch) -> bool:
        """Add samples first to end - 1 of a selection; return False after a stop."""
        if selection.paths == "guides":  # they add to the film that `show` wrote to the home device
            self._maker.put(self._home.words())
        return self._maker.add(selection, first, end, lambda: on_batch(None))

    def gather(self) -> None:
        """Copy all added samples to the home device."""
        self._maker.gather()
        self._show()

    def keep(self) -> None:
        """Keep a copy of the film for `give_back`."""
        self._kept = self._maker.words()

    def give_back(self) -> None:
        """Restore the film of `keep`."""
        assert self._kept is not None, "it was kept"
        self._maker.put(self._kept)
        self._show()

    def use_all_pixels(self) -> None:
        """Let later calls sample every pixel."""
        self._maker.use_all_pixels()

    def _show(self) -> None:
        """Copy the film to the home device. Raises ClusterError if that device failed."""
        if self._maker.shown() is not self._home:
            raise ClusterError("the device has failed that measures the noise")
