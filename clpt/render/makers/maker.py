"""Makers take the samples of a film: a device, several devices, or the workers of a cluster.

A renderer asks its maker for samples, for their sums, and for another scene. What the film then is,
how it is developed, saved and gone on with is the renderer's, and the same for all makers.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from clpt import device as dev
from clpt.errors import SceneError
from clpt.render.film.state import FilmState, Ranges
from clpt.render.makers.contents import Contents
from clpt.render.makers.device_film import Apply, Changes, DeviceFilm
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.tracer import Tracer
from clpt.render.wavefront.wavefront import Counts
from clpt.scene import Scene
from clpt.scene.fingerprint import Plain
from clpt.scene.integrators import Integrator

Settle = Callable[[BaseException | None], Contents]


class Discarded(Exception):
    """A call ends at once, and the film is of no use."""


@dataclass(frozen=True, eq=False)
class Held:
    """A film that is held where it is; read: brings it to the host."""

    read: Callable[[], FilmState]
    counts: Counts
    taken: Ranges


@dataclass(frozen=True)
class Call:
    """Samples that are asked for: first to end - 1 of all pixels; noise: of those with more."""

    first: int
    end: int
    noise: float | None = None


class Maker(ABC):
    """Takes samples of a scene, and has their film; what is not said otherwise is asked of `home`.

    start: when it was begun to be made [s of time.perf_counter]. shows_meanwhile: whether the film
    can be shown while samples are taken; adds_films: whether it is a sum of films, which can be
    saved meanwhile, and lacks samples before others, which the next call takes first.
    """

    start: float
    shows_meanwhile = adds_films = False

    # ---- what there is

    @property
    @abstractmethod
    def home(self) -> DeviceFilm:
        """The film on the device where it is shown, and its noise is measured."""

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
        """Warnings of the scene, and of who takes the samples, for people."""
        return self.home.warnings

    @property
    def counts(self) -> Counts:
        """Counts of what has happened since the film was empty."""
        return self.home.wavefront.counts

    @property
    def classes(self) -> tuple[Mapping[str, Plain], ...]:
        """The classes of the devices that took samples; equal ones give equal films."""
        return (self.home.device_class(),)

    # ---- samples

    def after(self, events: dev.Events) -> None:
        """Let what follows come after events of the caller."""
        self.home.wavefront.stream.after(events)

    @property
    def last(self) -> Any:
        """The event of the last command, None where that has been waited for."""
        return self.home.wavefront.stream.last

    def prepare(self) -> None:
        """Get ready, so that the first samples come at once."""
        self.home.wavefront.render_samples(0, 0)

    @abstractmethod
    def begin(self, call: Call, now: Contents, more: Contents) -> Settle:
        """Return what makes the film whole after a call of `run`, and tells what it then holds.

        now: what it holds; more: with the samples of the call. It is told the error that ended the
        call, if one did, and raises one where the film cannot be trusted.
        """

    @abstractmethod
    def run(self, call: Call, adaptive: Adaptive | None, tick: Callable[[], bool]) -> bool:
        """Add samples to the film; return whether all were added.

        tick: is called all the while; if it returns False the call ends soon.
        """

    def leave(self, film: bool) -> None:  # noqa: B027
        """Say whether a call that is told to stop may leave its film as it is, unfinished."""

    def tracer(self) -> Tracer:
        """Return what adds selections of samples to the film."""
        return Tracer(self.home.wavefront)

    def adaptively(self, arrays: Mapping[str, NDArray[Any]], first: int) -> Adaptive:
        """Return adaptive sampling of the film, which begins, or goes on from a state.

        arrays: the state, empty at the beginning; first: the first sample that is missing then.
        The film stays as it is, and so does its own state. Raises SceneError where halves are
        wanted and not kept, and for a state of another film.
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
        """Return the film on the host; names: of the arrays that are wanted, by default all."""
        return self.home.words(*names)

    @abstractmethod
    def put(self, state: FilmState, counts: Counts | None = None) -> None:
        """Let the film be another one, and with `counts` have these; that can be done again."""

    def shown(self) -> DeviceFilm:
        """Return the home, whose film is now the whole one; its parts are together before."""
        return self.home

    @abstractmethod
    def hold(self, taken: Ranges) -> Held:
        """Keep a copy of the film as it is, of these samples. Raises MemoryBudgetError."""

    def empty(self, *, seed: int | None = None, recover: bool = False) -> None:
        """Let the film be empty; seed: of later samples; recover: from an error at any line."""
        self.home.empty(seed=seed, recover=recover)

    def update(self, changes: Changes, events: dev.Events, apply: Apply) -> None:
        """Render another scene from now on.

        events: that arrays of the changes wait for; apply: calls what writes a change, see
        `FilmRenderer._apply`.
        """
        self.home.update(changes, events, apply)

    def follow(self, way: Integrator, apply: Apply) -> None:
        """Render in another way, which made a film that is gone on with; see `update`."""
        self.home.follow(way, apply)

    def close(self) -> None:
        """Give back what it holds."""
        self.home.close()
