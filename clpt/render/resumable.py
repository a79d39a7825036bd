"""Renderers whose film can be saved, merged, continued elsewhere, and shown on its device."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, ClassVar

import pyopencl as cl
from numpy.typing import DTypeLike, NDArray
from pyopencl.array import Array

from clpt import device as dev
from clpt import images
from clpt.errors import MemoryBudgetError, SceneError
from clpt.images.colour import View
from clpt.render.film import film_file
from clpt.render.film.film_file import Origin, SavedFilm, Session
from clpt.render.film.resolve import Resolve, Screen
from clpt.render.film.state import FilmState
from clpt.render.film_renderer import FilmRenderer
from clpt.render.makers.contents import Contents, synchronized
from clpt.render.makers.maker import Held
from clpt.render.makers.planning import Changes
from clpt.render.wavefront.wavefront import Counts
from clpt.scene.fingerprint import Plain
from clpt.version import VERSION

log = logging.getLogger(__name__)


class ResumableRenderer(FilmRenderer):
    """Base of renderers: their film is saved, merged, continued, and shown on its device.

    _make_widget: makes the widget of notebooks, see `clpt/__init__`.
    """

    _make_widget: ClassVar[Callable[..., Any]]

    _held: tuple[Held, dict[str, Any]] | SavedFilm | None = None
    _resolve: Resolve | None = None  # built for the first picture that is resolved

    # ---- the film, saved and merged

    @synchronized
    def film_state(self) -> FilmState:
        """Return what the film holds, as whole numbers on the host; wait for it."""
        taken = self._settled.taken
        return dataclasses.replace(self._brought().words(), taken=taken)

    @synchronized
    def merge(self, state: FilmState) -> None:
        """Add the samples of another film of the same scene to this film, and wait.

        The picture is then equal to the bit to the picture of a renderer that took all samples. To
        continue a state, merge it into a new renderer. `self.samples` is then the number after the
        last sample.

        Raises SceneError if the film has another form, or a sample is in both: nothing has changed.
        """
        merged = self.film_state().merged(state)
        after = dataclasses.replace(self._settled, taken=merged.taken, adaptive=None)
        self._put("merge", merged, after)

    def _put(
        self, name: str, film: FilmState, after: Contents, counts: Counts | None = None
    ) -> None:
        """Replace the film; after: its contents; counts: of a film that is continued."""

        def put(_: BaseException | None = None) -> Contents:
            self._maker.put(film, counts)
            if counts is not None:
                self._held, self._seconds_rendered = None, 0.0
            return after

        with self._change(name, put):
            self._contents = put()

    def save_state(self, path: str | Path) -> None:
        """Write the film to a file for `load_state`, also in another process.

        path: of the file; a former file is replaced.

        Raises SceneError for a file that cannot be written: the former file is then unchanged.
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
        self._held = self._resolve = None

    # ---- the picture on the device and for screens

    @property
    @synchronized
    def film(self) -> dev.DeviceArray:
        """The picture so far on the device, (h, w, 4) float32, valid when its `events` have ended.

        Red, green and blue, linear in the film's output space, equal to `colours` within an ulp of
        the largest sum; last, the number of samples of the pixel. Always the same memory, on the
        renderer's queue; steps wait for `events` that readers add, as its `get_async` does.
        """
        return self._wavefront.film.picture

    @synchronized
    def resolve(
        self,
        into: Array | cl.MemoryObject | None = None,
        *,
        dtype: DTypeLike | None = None,
        exposure: float = 0.0,
        tone: str = "none",
        srgb: bool | None = None,
        flip: bool = False,
        view: View | None = None,
        wait_for: dev.Events = None,
    ) -> Any:
        """Enqueue a picture (h, w, 4) for a screen, opaque, from the film as it then is.

        into: the caller's Array or Buffer, or 2D Image of 8-bit or float RGBA, as OpenGL shares
        them; None makes an Array. dtype: uint8 (the default, the bytes of a .png) or float32.
        exposure [stops] over the film's `display_exposure`; tone: none, reinhard, aces, agx or
        neutral, see clpt.images.colour; srgb: whether the sRGB transfer is applied, by
        default to uint8 only; colours become Rec. 709. view: of OpenColorIO, in the place of tone
        and
        transfer: a table of it, right to 1/512 for 98 of 100 colours. flip: the first row is the
        lowest. wait_for: events of the caller that come first.

        Returns the Array, whose `events` hold the event of the picture; for an Image the event.
        Raises DeviceError if the picture does not fit, UnknownKindError for names.
        """
        wavefront = self._wavefront
        picture = wavefront.film.picture
        if self._resolve is None or self._resolve.stream is not wavefront.stream:
            self._resolve = Resolve(wavefront.device, wavefront.stream)
        film = self.scene.film
        screen = Screen(exposure + film.display_exposure, tone, srgb, view, film.output_space)
        return self._resolve(picture, into, screen, dtype=dtype, flip=flip, wait_for=wait_for)

    def widget(self, **options: Any) -> Any:
        """Return a widget for notebooks: the scene, rendered while it is watched and steered.

        It is rendered by another renderer, with these options, in a thread of its own; see
        clpt.view.widget.Widget. Raises ClptError where clpt[notebook] is not installed.
        """
        return type(self)._make_widget(self.scene, self.device, **options)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """`image()`, for numpy.asarray(renderer): a copy, which waits."""
        if copy is not None and not copy:
            raise ValueError("a picture on a device becomes an array of numpy only by a copy")
        image = self.image()
        return image if dtype is None else image.astype(dtype, copy=False)

    def _repr_png_(self) -> bytes:
        """Return the picture so far as PNG, which a notebook shows of a renderer; waits."""
        return images.png(self.resolve().get()[..., :3])
