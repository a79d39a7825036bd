"""The film of a cluster on the client: added up, saved, gone on with, made to pictures."""

from __future__ import annotations

import dataclasses
import datetime
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import device as dev
from clpt.cluster.cluster_noise import FarmTracer
from clpt.errors import ClusterError, SceneError
from clpt.render.contents import Contents
from clpt.render.film.developed import Developed
from clpt.render.film.picture_form import PictureForm
from clpt.render.film.saved_film import Origin, SavedFilm, Session
from clpt.render.pictures import DevicePictures
from clpt.render.renderer import Renderer
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.film_state import FilmState, Ranges
from clpt.render.wavefront.tracer import OnBatch, Selection
from clpt.render.wavefront.wavefront import Counts, Wavefront
from clpt.scene import Scene
from clpt.scene.fingerprint import Plain
from clpt.version import VERSION


@dataclass(frozen=True, eq=False)
class FilmSum:
    """The sum of films, None before there is one, and counts of what all of them took."""

    film: FilmState | None = None
    totals: Mapping[str, int] = field(
        default_factory=lambda: dict.fromkeys(("samples", "rays", "rejected", "full"), 0)
    )

    def plus(self, state: FilmState, counts: Mapping[str, int] | None = None) -> FilmSum:
        """Return the sum with one film more."""
        film = state if self.film is None else self.film.merged(state)
        return FilmSum(film, self.counting(counts or {}).totals)

    def counting(self, counts: Mapping[str, int]) -> FilmSum:
        """Return the same film, for which more has happened."""
        return FilmSum(
            self.film, {name: n + counts.get(name, 0) for name, n in self.totals.items()}
        )

    @property
    def taken(self) -> Ranges:
        return () if self.film is None else self.film.taken

    @property
    def counts(self) -> Counts:
        """Counts of all films that were added; `closest` has rays of both kinds."""
        samples, rays, rejected, full = self.totals.values()
        return Counts(samples=samples, closest=rays, rejected=rejected, full=full)


class ClusterFilm(DevicePictures):
    """Base of a renderer whose samples come from elsewhere.

    device: where pictures are made, and noise is measured; options: of the renderer that does so.
    """

    def __init__(
        self,
        scene: Scene,
        device: dev.Device | str | int | None,
        first_sample: int,
        options: Mapping[str, Any],
    ):
        super().__init__()
        self.scene = scene
        self.warnings: list[str] = []
        self._device, self._options = device, options
        self._first_sample = first_sample
        self._local: Renderer | None = None
        self._begin_anew()

    def _begin_anew(self) -> None:
        """Note that there is no film."""
        self._sum = self._whole = FilmSum()  # of all films, and of those of whole blocks
        self._held: tuple[FilmSum, Mapping[str, NDArray[Any]]] | None = None
        self._shown: FilmState | None = None  # that the local renderer has
        self._tracer: FarmTracer | None = None
        self._noise: Adaptive | None = None  # adds to the local renderer's film
        self._began = datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds")
        self._seconds_rendered = 0.0
        self._sessions: tuple[Session, ...] = ()  # before
        self._classes: dict[str, Mapping[str, Plain]] = {}  # of devices that take part

    @abstractmethod
    def _take_selection(
        self, selection: Selection, first: int, end: int, add: Callable[[FilmState], None],
        on_batch: OnBatch,
    ) -> bool:  # fmt: skip
        """Take samples of adaptive sampling, see `FarmTracer`."""

    # ---- what there is

    @property
    def samples(self) -> int:
        """The number of the next sample, if none before it is missing; see `Renderer.samples`."""
        return self._first_sample + sum(end - first for first, end in self._sum.taken)

    @property
    def first_sample(self) -> int:
        """The number of the first sample."""
        return self._first_sample

    @property
    def counts(self) -> Counts:
        """Counts of all blocks that were added; see `Renderer.counts`."""
        return self._sum.counts

    @property
    def _known(self) -> Contents:
        return Contents(self._sum.taken, self._noise, self._sessions, self._began)

    # ---- the film

    def film_state(self) -> FilmState:
        """Return what all workers have rendered so far. Raises ClusterError before there is any."""
        if self._sum.film is None:
            raise ClusterError("no worker has sent a film yet")
        return self._sum.film

    def merge(self, state: FilmState) -> None:
        """Add the samples of another film of the same scene. Raises as `Renderer.merge` does."""
        nothing_cut = self._whole is self._sum
        whole = None if nothing_cut else self._whole.plus(state)
        self._begin_with(self._sum.plus(state), whole)

    def _begin_with(self, films: FilmSum, whole: FilmSum | None = None) -> None:
        self._sum, self._whole = films, films if whole is None else whole
        self._noise = self._tracer = None

    def _begin_adaptively(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Begin adaptive sampling over the film; arrays: the state, if there is one."""
        taken = self._sum.taken
        if len(taken) > 1:
            message = "samples are missing before the last one; add them first, without noise"
            raise SceneError(message, where="noise")
        local = self.shown()
        tracer = FarmTracer(local, self._take_selection)
        begun = local._adaptively(tracer, self.denoise, arrays)
        if not arrays:
            begun.skip(taken[-1][1] if taken else self._first_sample)
        self._tracer, self._noise = tracer, begun

    @property
    def _here(self) -> Renderer:
        """A renderer on this machine, which renders nothing."""
        if self._local is None:
            self._local = Renderer(self.scene, self._device, **self._options)
        return self._local

    def shown(self) -> Renderer:
        """Return a renderer on this machine that holds the film so far."""
        local, film = self._here, self._sum.film
        if self._shown is not film:
            local.reset()
            if film is not None:
                local.merge(film)
            self._shown = film
        return local

    @property
    def device(self) -> dev.Device:  # type: ignore[override]
        """The device of this machine where pictures are made for screens, and noise is measured."""
        return self._here.device

    @property
    def devices(self) -> tuple[dev.Device, ...]:
        """The device of this machine, once it is in use."""
        return () if self._local is None else self._local.devices

    @property
    def _wavefront(self) -> Wavefront:
        """The wavefront on this machine that holds the picture so far, for screens."""
        return self.shown()._wavefront

    # ---- saved films

    def _origin(self) -> Origin:
        """Return what the samples are of. Raises SceneError for a scene that cannot be read."""
        return self._here._origin()

    def _hold(self) -> None:
        """Keep the film of all whole blocks so far, for `saved_film`.

        Blocks that a stop cut are in the picture, but not in what is held; with noise, what a run
        added that was stopped is in both.
        """
        self._held = self._whole, {} if self._noise is None else self._noise.arrays()

    def _saved_film(self, *, held: bool = False) -> SavedFilm:
        """Return the film with all that it takes to go on with it; see `Renderer`.

        It may lack samples before its last one, which `ClusterRenderer` takes when it goes on.
        """
        if held and self._held is None:
            raise SceneError("no film is held")
        adaptive = {} if self._noise is None or held else self._noise.arrays()
        films, arrays = self._held if held and self._held else (self._sum, adaptive)
        state = self._empty() if films.film is None else films.film
        counts = dict(vars(films.counts))
        seconds = [self._seconds_rendered] + [0.0] * len(self._classes)  # each second once
        sessions = [
            Session(self._began, took, VERSION, device)
            for device, took in zip(self._classes.values(), seconds, strict=False)
        ]
        sessions = [*self._sessions, *sessions]
        return SavedFilm(state, self._origin(), self._form, counts, tuple(sessions), arrays)

    def _empty(self) -> FilmState:
        """A film without samples."""
        state = self._here.film_state()
        arrays = {name: np.zeros_like(array) for name, array in state.arrays.items()}
        return FilmState(taken=(), scale=state.scale, **arrays)

    def _restore(self, saved: SavedFilm) -> None:
        """Go on from a saved film, as `load_state` does. Raises SceneError.

        `warnings` tells, once a worker is there, where another class of device took the samples.
        """
        saved.check_fits(self._origin(), self._empty())
        film, former = saved.film, (self._sum, self._whole)
        counts = Counts(**saved.counts)
        totals = {name: getattr(counts, name) for name in self._sum.totals}
        self._begin_with(FilmSum(film if film.taken else None, totals))
        if saved.adaptive:
            try:
                self._begin_adaptively(saved.adaptive)
            except SceneError:
                self._begin_with(*former)
                raise
        self._held, self._sessions, self._seconds_rendered = None, saved.sessions, 0.0
        self._classes = {}

    def _note_classes(self, classes: Mapping[str, Mapping[str, Plain]]) -> None:
        """Note the classes of devices that take part, and warn where others took samples before."""
        for kind, device in list(classes.items()):
            if kind in self._classes:
                continue
            self._classes[kind] = device
            self._warn_of_others(self._sessions, device)

    # ---- pictures

    @property
    def _form(self) -> PictureForm:  # type: ignore[override]
        """The choices by which pictures are made of the film; see `Pictures`."""
        form = self._here._form
        return dataclasses.replace(form, adaptive=form.adaptive or self._noise is not None)

    def _developed(self, *words: str) -> Developed:
        """Return the pictures of the film as it is now, which then stay; see `Pictures`."""
        return Developed(self._sum.film or self._empty(), self._form)
