"""Makers take the samples of a film: a device, several devices, or the workers of a cluster.

A renderer asks its maker for samples, for their sums, and for another scene. The renderer develops,
saves and continues the film, in the same way for all makers. The maker of a device stands here too:
its film is in the memory of the device.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from numpy.typing import NDArray

from clpt import device as dev
from clpt.errors import DeviceError, MemoryBudgetError, SceneError
from clpt.render.edit.plans import Plan
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
        """Run all kernels once and wait, so that the first samples come at once."""
        self.home.wavefront.render_samples(0, 0)
        self.home.wavefront.stream.wait()  # for the picture of the film, whose kernel ran last

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


class DeviceMaker(Maker):
    """Takes samples on a device; home: their film."""

    shows_meanwhile = True

    def __init__(self, home: DeviceFilm):
        self._home, self.start = home, home.start
        self._discards = False

    @property
    def home(self) -> DeviceFilm:
        """The film on the device."""
        return self._home

    # ---- samples

    def begin(self, call: Call, now: Contents, more: Contents) -> Settle:
        """Return the function that ends a call; see `Maker`.

        After an error at any line the film has the contents `more`, although some pixels may lack
        some of the samples, or `now` if no sample has begun. After an error of the device the
        function raises that error if samples have begun.
        """
        wavefront = self._home.wavefront
        wavefront.begun = False

        def settle(error: BaseException | None) -> Contents:
            begun = wavefront.begun
            if error is None:
                return more
            if isinstance(error, DeviceError) and not isinstance(error, MemoryBudgetError):
                if begun:
                    raise error
                return now
            wavefront.finish()
            if more.adaptive is not None:
                more.adaptive.finish()
                if call.noise is None and begun and call.end > call.first:
                    more.adaptive.skip(call.end)
            wavefront.refresh()
            return more if begun else now

        return settle

    def run(self, call: Call, adaptive: Adaptive | None, tick: Tick) -> bool:
        """Add samples to the film; return whether all were added. Raises Discarded."""

        def on_batch(_: object) -> bool:
            goes_on = tick()
            if not goes_on and self._discards:
                raise Discarded
            return goes_on

        wavefront = self._home.wavefront
        wavefront.leave.lower()  # a late `leave` for a former call may have raised it
        if call.noise is not None and adaptive is not None:
            return adaptive.run(call.end, call.noise, on_batch)
        finished = wavefront.render_samples(call.first, call.end, on_batch)
        if adaptive is not None:
            adaptive.skip(call.end)  # also after a stop: numbers of samples are used once
        return finished

    def enqueue(self, call: Call, adaptive: Adaptive | None) -> None:
        """Enqueue samples of all pixels; wait for nothing."""
        wavefront = self._home.wavefront
        wavefront.enqueue(call.first, call.end)
        wavefront.stream.flush()
        if adaptive is not None:
            adaptive.skip(call.end)

    def leave(self, film: bool) -> None:
        """Set whether a call that stops may abandon paths in flight."""
        if film and self._home.is_open:  # `run` sees the reason soon after the flag
            self._home.wavefront.leave.raise_()
        self._discards = film

    # ---- the film

    def put(self, state: FilmState, counts: Counts | None = None) -> None:
        """Enqueue the words of another film."""
        if counts is not None:
            self._home.wavefront.counts = counts
        self._home.put(state)

    def hold(self, taken: Ranges) -> Held:
        """Copy the film on the device, over a former copy. Raises MemoryBudgetError."""
        self._home.wavefront.film.hold()
        return Held(partial(self._home.words, held=True, taken=taken), self.counts, taken)
