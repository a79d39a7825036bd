"""Renderers whose film can be saved, merged with others, and gone on with in another process."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from clpt.errors import MemoryBudgetError, SceneError
from clpt.render.film import film_file
from clpt.render.film.saved_film import Origin, SavedFilm, Session
from clpt.render.film.state import FilmState
from clpt.render.film_renderer import FilmRenderer
from clpt.render.makers.contents import Contents
from clpt.render.makers.locking import synchronized
from clpt.render.makers.maker import Held
from clpt.render.makers.planning import Changes
from clpt.render.wavefront.wavefront import Counts
from clpt.scene.fingerprint import Plain
from clpt.version import VERSION

log = logging.getLogger(__name__)


class ResumableRenderer(FilmRenderer):
    """Base of renderers: their film is saved, merged, and gone on with."""

    _held: tuple[Held, dict[str, Any]] | SavedFilm | None = None

    @synchronized
    def film_state(self) -> FilmState:
        """Return what the film holds, as whole numbers on the host; wait for it."""
        taken = self._settled.taken
        return dataclasses.replace(self._brought().words(), taken=taken)

    @synchronized
    def merge(self, state: FilmState) -> None:
        """Add the samples of another film of the same scene to this one, and wait.

        The picture is then that of one renderer that took them all, to the bit. To go on where a
        state was taken, merge it into a new renderer. `self.samples` is then after the last one.

        Raises SceneError if the film has another form, or a sample is in both: nothing has changed.
        """
        merged = self.film_state().merged(state)
        after = dataclasses.replace(self._settled, taken=merged.taken, adaptive=None)
        self._put("merge", merged, after)

    def _put(
        self, what: str, film: FilmState, after: Contents, counts: Counts | None = None
    ) -> None:
        """Let the film be another one; after: what it then holds; counts: where it goes on."""

        def put(_: BaseException | None = None) -> Contents:
            self._maker.put(film, counts)
            if counts is not None:
                self._held, self._seconds_rendered = None, 0.0
            return after

        with self._change(what, put):
            self._contents = put()

    def save_state(self, path: str | Path) -> None:
        """Write the film to a file, from which `load_state` goes on, in another process too.

        path: of the file; the former one is replaced.

        Raises SceneError for a file that cannot be written: the former one is then as it was.
        """
        saved = self.saved_film()
        try:
            film_file.write(path, saved)
        except OSError as error:
            raise SceneError(f"cannot be written: {error}", file=path) from error

    def load_state(self, path: str | Path) -> None:
        """Go on from a file of `save_state`, of any renderer: what the film held before is gone.

        path: of the file.

        All that follows is to the bit as if nothing had been interrupted, where the device is of
        the class that took the samples; `warnings` tells where it is not.

        Raises SceneError for a file that cannot be read, is damaged, or is of another scene, other
        settings or other kernels: it says what differs, and nothing has changed.
        """
        saved = film_file.read(path)
        try:
            self._restore(saved)
        except SceneError as error:
            raise SceneError(error.message, file=path) from None

    @synchronized
    def _restore(self, saved: SavedFilm) -> None:
        """Go on from a saved film, as `load_state` does. Raises SceneError."""
        self._settled  # noqa: B018
        self._follow(saved.origin)
        saved.check_fits(self._origin(), self._maker.home.words())
        chosen = self._maker.adaptively(saved.adaptive, 0) if saved.adaptive else None
        restored = Contents(saved.film.taken, chosen, saved.sessions)
        self._put("load_state", saved.film, restored, Counts(**saved.counts))
        self._warn_of_others()

    @synchronized
    def _follow(self, origin: Origin) -> None:
        """Render in the way that made a film, if that can be; the film may be empty then.

        What is "auto" may depend on how many samples are wanted, which the film did not know.
        """
        integrator = self._maker.home.other_integrator(origin)
        if integrator is not None:
            self._write(self._maker.plan(Changes(integrator=integrator)), "load_state")

    @synchronized
    def _origin(self) -> Origin:
        """Return what the samples are of. Raises SceneError for a scene that cannot be read."""
        return self._maker.home.origin()

    def _device_class(self) -> Mapping[str, Plain]:
        """Return what decides the last bits of samples: equal classes give equal films."""
        return self._maker.classes[0]

    @synchronized
    def _hold(self) -> None:
        """Keep a copy of the film where it is, as it is now, for `saved_film`.

        So a render that is stopped in the middle of a `run` can be saved as it was before: without
        samples that some pixels have and others have not. Raises MemoryBudgetError.
        """
        so_far, self._held = self._progress(), None
        try:
            held = self._maker.hold(self._settled.taken)
        except MemoryBudgetError:
            raise
        except Exception as error:
            log.debug("a film cannot be held where it is: %s", error)
            self._held = self.saved_film()
        else:
            self._held = held, so_far

    @synchronized
    def saved_film(self, *, held: bool = False) -> SavedFilm:
        """Return the film with all that it takes to go on with it; wait for the device.

        held: as it was at the last `_hold`. Raises SceneError for a scene that cannot be read,
        without a `_hold`, and where a device has failed since that had a part of the film.
        """
        if not held:
            return self._saved(self.film_state(), self.counts, self._progress())
        if self._held is None:
            raise SceneError("no film is held")
        if not isinstance(self._held, SavedFilm):
            self._held = self._read(*self._held)
        return self._held

    def _read(self, held: Held, so_far: dict[str, Any]) -> SavedFilm:
        """Bring what is held to the host."""
        try:
            return self._saved(held.read(), held.counts, so_far)
        except MemoryError:
            raise
        except Exception as error:
            if held.taken != self._known.taken:
                message = f"a device has failed that had a part of the film: {error}"
                raise SceneError(message) from error
        return self.saved_film()  # nothing was added since

    def _progress(self) -> dict[str, Any]:
        """Return what a saved film has beside its words, counts and origin."""
        now = self._settled
        seconds = [self._seconds_rendered, *[0.0] * len(self._maker.classes)]  # each second once
        sessions = [
            Session(now.began, took, VERSION, device)
            for device, took in zip(self._maker.classes, seconds, strict=False)
        ]
        arrays = {} if now.adaptive is None else now.adaptive.arrays()
        return {"sessions": (*now.sessions, *sessions), "adaptive": arrays}

    def _saved(self, film: FilmState, counts: Counts, so_far: dict[str, Any]) -> SavedFilm:
        return SavedFilm(film, self._origin(), self.form, dict(vars(counts)), **so_far)

    def _emptied(self, *, seed: int | None = None, recover: bool = False) -> Contents:
        emptied = super()._emptied(seed=seed, recover=recover)
        self._held = None
        return emptied

    def close(self) -> None:
        """Give the device's memory back, and what is held; see `FilmRenderer.close`."""
        super().close()
        self._held = None
