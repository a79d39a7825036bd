"""Makers take the samples of a film: a device, several devices, or the workers of a cluster.

A renderer asks its maker for samples, for their sums, and for another scene. The renderer develops,
saves and continues the film, in the same way for all makers.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from clpt import device as dev
from clpt.errors import SceneError
from clpt.render.edit.plan import Plan
from clpt.render.film.state import FilmState, Ranges
from clpt.render.makers import planning
from clpt.render.makers.contents import Contents, Settle
from clpt.render.makers.device_film import DeviceFilm
from clpt.render.makers.planning import Changes
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.tracer import Tracer
from clpt.render.wavefront.wavefront import Counts
from clpt.scene import Scene
from clpt.scene.fingerprint import Plain

Tick = Callable[[], bool]  # returns whether a call goes on


class Discarded(Exception):
    """A call ended at once, and the film has no meaning."""


@dataclass(frozen=True, eq=False)
class Held:
    """A copy of a film on its device; read: brings it to the host."""

    read: Callable[[], FilmState]
    counts: Counts
    taken: Ranges


@dataclass(frozen=True)
class Call:
    """A request for samples first to end - 1 of all pixels, or of pixels with more than `noise`."""

    first: int
    end: int
    noise: float | None = None


class Maker(ABC):
    """Base of makers: they take samples of a scene into a film; by default `home` does the work.

    start: of its construction [s of time.perf_counter]. shows_meanwhile: whether the film can be
    shown during a run; adds_films: whether the film is a sum of films. Such a film can be saved
    during a run, and the next call first takes samples that it lacks.
    """

    start: float
    shows_meanwhile = adds_films = False

    # ---- properties

    @property
    @abstractmethod
    def home(self) -> DeviceFilm:
        """The film on the device that shows it and measures its noise."""

    @property
    def scene(self) -> Scene:
        """The scene that is rendered."""
        return self.home.scene

    @property
    def devices(self) -> tuple[dev.Device, ...]:
        """The devices of this machine that are in use."""
        return (self.home.device,)

    @property
    def warnings(self) -> list[str]:
        """Warnings of the scene and of its workers, for people."""
        return self.home.warnings

    @property
    def counts(self) -> Counts:
        """Counts of paths and rays since the film was empty."""
        return self.home.wavefront.counts

    @property
    def classes(self) -> tuple[Mapping[str, Plain], ...]:
        """The classes of the devices that took samples; equal classes give equal films."""
        return (self.home.device_class(),)

    # ---- samples

    def after(self, events: dev.Events) -> None:
        """Let later commands wait for events of the caller."""
        self.home.wavefront.stream.after(events)

    @property
    def last(self) -> Any:
        """The event of the last command; None once it has ended."""
        return self.home.wavefront.stream.last

    def prepare(self) -> None:
        """Run all kernels once, so that the first samples come at once."""
        self.home.wavefront.render_samples(0, 0)

    @abstractmethod
    def begin(self, call: Call, now: Contents, more: Contents) -> Settle:
        """Return a function that makes the film whole after `run`, and returns its contents.

        now: the present contents; more: with the samples of the call. The argument of the function
        is the error that ended the call, or None. It raises an error if the film is invalid.
        """

    @abstractmethod
    def run(self, call: Call, adaptive: Adaptive | None, tick: Tick) -> bool:
        """Add samples to the film; return whether all were added.

        tick: called repeatedly; if it returns False the call ends soon.
        """

    def leave(self, film: bool) -> None:  # noqa: B027
        """Set whether a call that stops may leave its film unfinished."""

    def tracer(self) -> Tracer:
        """Return the tracer that adds selections of samples to the film."""
        return Tracer(self.home.wavefront)

    def adaptively(self, arrays: Mapping[str, NDArray[Any]], first: int) -> Adaptive:
        """Return adaptive sampling of the film from its beginning or from a state.

        arrays: the state, empty at the beginning; first: the first missing sample at the beginning.
        The film and its present state do not change. Raises SceneError if halves are needed and
        absent, and for a state of another film.
        """
        home = self.home
        begun = Adaptive(home.wavefront, self.tracer(), home.denoised_noise(self.words))
        if not arrays:
            begun.skip(first)
            return begun
        try:
            begun.restore(arrays)
        except (KeyError, ValueError) as error:
            message = f"the state of adaptive sampling does not fit: {error}"
            raise SceneError(message) from error
        return begun

    # ---- the film

    @property
    def is_scattered(self) -> bool:
        """Whether parts of the film must be brought together before it can be read."""
        return False

    def gather(self) -> None:  # noqa: B027
        """Bring the parts of the film together."""

    def words(self, *names: str) -> FilmState:
        """Return the film on the host; names: of the arrays to read, by default all."""
        return self.home.words(*names)

    @abstractmethod
    def put(self, state: FilmState, counts: Counts | None = None) -> None:
        """Replace the film and, unless None, its counts; after an error it may be called again."""

    def shown(self) -> DeviceFilm:
        """Return the home, which has the whole film; `gather` must come before."""
        return self.home

    @abstractmethod
    def hold(self, taken: Ranges) -> Held:
        """Copy the present film, which has these samples. Raises MemoryBudgetError."""

    def empty(self, *, seed: int | None = None, recover: bool = False) -> None:
        """Empty the film; seed: of later samples; recover: after an error at any line."""
        self.home.empty(seed=seed, recover=recover)

    def plan(self, changes: Changes, events: dev.Events = None) -> Plan | None:
        """Return the plan of a changed scene; None if nothing is to be written.

        events: to wait for before arrays of the changes are read. Raises as `Renderer.update` does.
        """
        return planning.plan(self.home, changes, events)

    def close(self) -> None:
        """Release the devices' memory."""
        self.home.close()
