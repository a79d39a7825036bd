"""Films of several devices that are saved, and gone on with; see clpt.render.resumable."""

from __future__ import annotations

import dataclasses
from abc import abstractmethod
from collections.abc import Callable
from typing import TypeVar

from clpt.cluster.device_worker import DeviceWorker
from clpt.errors import SceneError
from clpt.render.film_keeping import FilmKeeping
from clpt.render.pictures import Pictures
from clpt.render.saved_film import Origin, PictureForm, SavedFilm, Session
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.film_state import FilmState, Ranges
from clpt.render.wavefront.wavefront import Counts

_Result = TypeVar("_Result")


class MultiResumable(FilmKeeping, Pictures):
    """Base of renderers on several devices whose film can be saved.

    The first device stands for all: its film then holds the whole picture, and its renderer knows
    what was taken.
    """

    _taken: Ranges
    _first_sample: int

    def __init__(self) -> None:
        super().__init__()
        self._held: SavedFilm | None = None
        self._sessions: tuple[Session, ...] = ()  # before
        self._seconds_rendered = 0.0  # since the film was empty, or gone on with

    @property
    @abstractmethod
    def counts(self) -> tuple[Counts, ...]:
        """What has happened so far, of each film."""

    @property
    @abstractmethod
    def _adaptive(self) -> Adaptive | None:
        """What decides where samples are needed."""

    @abstractmethod
    def _on_first(self, action: Callable[[DeviceWorker], _Result]) -> _Result:
        """Do something on the first device, whose film holds the picture; or else on the next."""

    @abstractmethod
    def _go_on(self, state: FilmState, saved: SavedFilm) -> None:
        """Take the place of what there is by a film."""

    @property
    def is_adaptive(self) -> bool:
        """Whether pixels may differ in their numbers of samples."""
        return self.scene.noise is not None

    @property
    def form(self) -> PictureForm:
        """What makes a picture of the film; see `Renderer.form`."""
        return self._on_first(lambda first: first.renderer.form)

    @property
    def former_seconds(self) -> float:
        """How long others rendered the film, before this renderer went on with it."""
        return sum(session.seconds for session in self._sessions)

    @property
    def first_sample(self) -> int:
        """The number of the first sample of the film, or of the first one to come."""
        return self._taken[0][0] if self._taken else self._first_sample

    def origin(self) -> Origin:
        """Return what the samples are of. Raises SceneError for a scene that cannot be read."""
        return self._on_first(lambda first: first.renderer.origin())

    def hold(self) -> None:
        """Keep a copy of the film on the host, as it is now, for `saved_film`."""
        self._held = self.saved_film()

    def saved_film(self, *, held: bool = False) -> SavedFilm:
        """Return the film with all that it takes to go on with it; see `Renderer.saved_film`."""
        if held:
            if self._held is None:
                raise SceneError("no film is held; call hold() first")
            return self._held

        def save(first: DeviceWorker) -> SavedFilm:
            renderer = first.renderer
            renderer._taken, renderer._adaptive = self._taken, self._adaptive
            renderer._sessions, renderer._seconds_rendered = self._sessions, self._seconds_rendered
            return renderer.saved_film()

        saved = self._on_first(save)
        return dataclasses.replace(saved, counts=tuple(dict(vars(one)) for one in self.counts))

    def restore(self, saved: SavedFilm) -> None:
        """Go on from a saved film, as `load_state` does. Raises SceneError."""

        def load(first: DeviceWorker) -> FilmState:
            first.renderer.restore(saved)
            return first.renderer.film_state()

        with self._lock:
            self._go_on(self._on_first(load), saved)
            self._sessions, self._seconds_rendered, self._held = saved.sessions, 0.0, None
