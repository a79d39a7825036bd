"""The film of several devices: added up, made to pictures, saved, gone on with."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from numpy.typing import NDArray

from clpt.cluster.crew import Crew
from clpt.cluster.device_worker import DeviceWorker
from clpt.cluster.multi_noise import AdaptiveCrew
from clpt.errors import ClusterError, DeviceError, MemoryBudgetError, SceneError
from clpt.render.contents import Change, Contents
from clpt.render.film.picture_form import PictureForm
from clpt.render.film.saved_film import Origin, SavedFilm
from clpt.render.locking import synchronized
from clpt.render.pictures import DevicePictures
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.film_state import FilmState
from clpt.render.wavefront.wavefront import Wavefront

log = logging.getLogger(__name__)

_Result = TypeVar("_Result")


@dataclass(frozen=True, eq=False)
class _Held:
    """A film that is held where it is: copies on devices, and what is on the host.

    workers: that have a copy of what only they have; saved: the rest, None without; so_far: of the
    film, see `FilmRenderer._progress_so_far`.
    """

    workers: list[DeviceWorker]
    saved: FilmState | None
    so_far: Mapping[str, Any]

    def film(self) -> FilmState:
        """Return the film; wait for the devices, of which one may have failed."""
        total = self.saved
        for worker in self.workers:
            film = worker.held()
            total = film if total is None else total.plus(film)
        assert total is not None, "something is held"
        return dataclasses.replace(total, taken=self.so_far["taken"])


class MultiFilm(DevicePictures):
    """Base of renderers on several devices.

    The first device stands for all: its film then holds the whole picture, and its renderer knows
    what was taken.
    """

    _crew: Crew

    def __init__(self) -> None:
        super().__init__()
        self._noise: AdaptiveCrew | None = None
        self._held: SavedFilm | _Held | None = None

    @synchronized
    def film_state(self) -> FilmState:
        """Return the film of all devices, as whole numbers; see `Renderer.film_state`.

        When all devices have failed it is what was saved of them.
        """
        taken = self._settled.taken
        if self._noise is not None and not self._crew.workers:
            return self._noise.base
        if self._noise is not None:
            state = self._on_first(lambda first: first.renderer.film_state())
            return dataclasses.replace(state, taken=taken)
        if self._crew.workers:
            self._on_first(lambda first: None)  # the host has all that they have
        if self._crew.saved is not None:
            return self._crew.saved
        return self._on_first(lambda first: first.renderer.film_state())

    @synchronized
    def merge(self, state: FilmState) -> None:
        """Add the samples of another film of the same scene to this one; see `Renderer.merge`."""
        merged = self.film_state().merged(state)

        def put(_: BaseException | None = None) -> Contents:
            self._forget()
            self._crew.saved, self._crew.saved_ranges = merged, merged.taken
            return Contents(merged.taken)

        with self._change("merge", put):
            self._contents = put()

    @property
    @synchronized
    def _wavefront(self) -> Wavefront:
        """The wavefront of the first device, whose film then holds the picture of all."""
        return self._on_first(lambda first: first.renderer._wavefront)

    # ---- saved films

    @property
    def _form(self) -> PictureForm:  # type: ignore[override]
        """The choices by which pictures are made of the film; see `Pictures`."""
        form = self._crew.first.renderer._form
        return dataclasses.replace(form, adaptive=form.adaptive or self._noise is not None)

    def _origin(self) -> Origin:
        """Return what the samples are of. Raises SceneError for a scene that cannot be read."""
        return self._crew.first.renderer._origin()

    @synchronized
    def _hold(self) -> None:
        """Keep a copy of the film as it is now, for `_saved_film`; see `Renderer`.

        Each device keeps what only it has, in its own memory.
        """
        self._held, crew = None, self._crew
        workers = [w for w in crew.workers if w.unsaved or w is crew.keeper]
        saved = crew.saved if crew.keeper is None else None
        if not workers and saved is None:
            workers = [crew.first]  # an empty film
        try:
            if crew.has_losses:
                raise ClusterError("a device has failed: others do its part first")
            for worker in workers:
                worker.hold()
            self._held = _Held(workers, saved, self._so_far_on(crew.first))
        except MemoryBudgetError:
            raise
        except Exception as error:
            log.debug("a film cannot be held on devices: %s", error)
            self._held = self._saved_film()

    @synchronized
    def _saved_film(self, *, held: bool = False) -> SavedFilm:
        """Return the film with all that it takes to go on with it; see `Renderer`.

        held: raises SceneError also where a device has failed since that had a part of it.
        """
        if held:
            if self._held is None:
                raise SceneError("no film is held")
            if isinstance(self._held, _Held):
                self._held = self._read(self._held)
            return self._held
        state, so_far = self._on_first(
            lambda first: (first.renderer.film_state(), self._so_far_on(first))
        )
        return self._film_with(dataclasses.replace(state, taken=self._settled.taken), so_far)

    def _so_far_on(self, first: DeviceWorker) -> dict[str, Any]:
        """Return a saved film's parts beside its words and origin; first: the device it is of."""
        return self._progress_so_far(first.renderer._device_class())

    def _film_with(self, state: FilmState, so_far: Mapping[str, Any]) -> SavedFilm:
        others = {name: value for name, value in so_far.items() if name != "taken"}
        return SavedFilm(state, self._origin(), self._form, **others)

    def _read(self, held: _Held) -> SavedFilm:
        """Bring what is held to the host."""
        try:
            return self._film_with(held.film(), held.so_far)
        except Exception as error:
            if held.so_far["taken"] != self._known.taken:
                message = f"a device has failed that had a part of the film: {error}"
                raise SceneError(message) from error
        return self._saved_film()  # nothing was added since: others do its part

    @synchronized
    def _restore(self, saved: SavedFilm) -> None:
        """Go on from a saved film, as `load_state` does. Raises SceneError."""

        self._follow(saved.origin)

        def load(first: DeviceWorker) -> FilmState:
            first.renderer._restore(saved)
            return first.renderer.film_state()

        with self._change("load_state") as change:
            with change.beginning_unless(Exception):
                state = self._on_first(load)
            self._go_on(state, saved)
            self._seconds_rendered, self._held = 0.0, None
            self._contents = Contents(state.taken, None, saved.sessions)

    # ---- inside

    @property
    def _adaptive(self) -> Adaptive | None:
        return None if self._noise is None else self._noise.adaptive

    def _go_on(self, state: FilmState, saved: SavedFilm) -> None:
        """Take the place of what there is by a film; the first device's counts are the film's."""
        crew = self._crew
        crew.keeper, self._noise = None, None
        crew.lost.clear()
        crew.empty(worker for worker in crew.workers if worker is not crew.first)
        crew.first.unsaved, crew.first.shows = [], True
        crew.clear_counts()
        if saved.adaptive:
            self._noise = self._adaptively(state, saved.adaptive)
        else:
            crew.saved, crew.saved_ranges = state, state.taken

    def _check_open(self) -> None:
        super()._check_open()
        if self._telling:
            raise DeviceError("devices are at work; the picture is there when the run has ended")

    def _forget(self) -> None:
        """Empty all films."""
        self._crew.empty(self._crew.workers)
        self._crew.saved, self._crew.saved_ranges, self._crew.keeper = None, (), None
        self._crew.lost.clear()
        self._held, self._noise, self._seconds_rendered = None, None, 0.0

    def _adaptively(self, base: FilmState, arrays: Mapping[str, NDArray[Any]]) -> AdaptiveCrew:
        """Begin adaptive sampling over a film; arrays: the state, if there is one."""
        return AdaptiveCrew(self._crew, base, self._first_sample, arrays)

    @synchronized
    def _on_first(self, action: Callable[[DeviceWorker], _Result]) -> _Result:
        """Do something on the first device, whose film holds the picture; or else on the next."""
        while True:
            first = self._show()
            try:
                return action(first)
            except SceneError:
                raise
            except Exception as error:
                self._crew.drop(first, error)

    def _show(self) -> DeviceWorker:
        """Let the film of the first device hold the picture; return that device."""
        crew = self._crew
        if isinstance(self._contents, Change):  # of who asks
            return self._gathered()
        moves = self._noise is not None or any(worker.unsaved for worker in crew.workers)
        if not moves and crew.workers and (crew.first.shows or crew.saved is None):
            return crew.first
        now = self._settled

        def finish(error: BaseException) -> Contents:
            if isinstance(error, Exception):
                return now  # the last device has failed
            raise error  # samples may be in two films, or in none

        with self._change("gathering of films", finish):
            first = self._gathered()
            self._contents = now
        return first

    def _gathered(self) -> DeviceWorker:
        """Move what devices have to the host, and from there to the first; return that device."""
        crew = self._crew
        if self._noise is not None:
            return self._noise.shown()
        while True:
            if any(worker.unsaved for worker in crew.workers):
                crew.save()
                crew.empty(worker for worker in crew.workers if worker.shows)
            first = crew.first
            if first.shows or crew.saved is None:
                return first
            try:
                first.show(crew.saved)
                return first
            except Exception as error:
                crew.drop(first, error)
