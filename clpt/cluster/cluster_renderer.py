"""A renderer whose samples come from the workers of a Dask cluster."""

from __future__ import annotations

import asyncio
import datetime
import logging
import queue
import tempfile
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt import device as dev
from clpt.cluster import tasks
from clpt.cluster.blocks import Blocks, WorkerRecord
from clpt.cluster.bundle import pack
from clpt.cluster.feeding import Feeder, Film
from clpt.errors import ClusterError, SceneError
from clpt.render.film_keeping import FilmKeeping
from clpt.render.options import check_options, check_scene
from clpt.render.pictures import Image
from clpt.render.progress import Progress
from clpt.render.renderer import MOST_SAMPLES, Renderer
from clpt.render.saved_film import (
    Origin,
    PictureForm,
    SavedFilm,
    Session,
    classes_text,
    other_devices,
)
from clpt.render.wavefront.film_state import FilmState, Ranges
from clpt.render.wavefront.wavefront import Counts
from clpt.scene import Scene
from clpt.scene.fingerprint import Plain
from clpt.spectral_exr import SpectralImage
from clpt.version import VERSION

if TYPE_CHECKING:
    from distributed import Client

log = logging.getLogger(__name__)

CHECK_EVERY = 64  # of the blocks, one in so many is rendered by two workers and compared
TELL_SECONDS = 0.2  # between calls of `progress`
FIRST_SECONDS, MOST_SECONDS = 2.0, 30.0  # that a block takes, at first and after some minutes
LEAST_SECONDS = 0.3  # of the last blocks, beside which the way to a worker is short
SHARE = 0.1  # of the time so far that a block takes, between these
CLIENT_SHARE = 0.5  # of the time, at most, in which this client gets and adds films
NO_WORKER_SECONDS = 300.0  # without any worker, until the render ends


def set_lengths(blocks: Blocks, elapsed: float, film_seconds: float) -> None:
    """Set how long blocks should take, `elapsed` [s] after the beginning.

    film_seconds: in which a film comes in and is added. With many workers blocks are long enough
    that all of their films take at most CLIENT_SHARE of the time, and at the end not so short that
    workers wait for each other's films.
    """
    all_films = len(blocks.workers) * film_seconds
    usual = min(max(FIRST_SECONDS, SHARE * elapsed), MOST_SECONDS)
    blocks.seconds = max(usual, all_films / CLIENT_SHARE)
    blocks.least_seconds = max(LEAST_SECONDS, all_films)


@dataclass(frozen=True, eq=False)
class _Sum:
    """Films that were added up, None before there is one, and what happened for all of them."""

    film: FilmState | None = None
    totals: Mapping[str, int] = field(
        default_factory=lambda: dict.fromkeys(("samples", "rays", "rejected", "full"), 0)
    )

    def plus(self, state: FilmState, counts: Mapping[str, int] | None = None) -> _Sum:
        """Return the sum with one film more."""
        film = state if self.film is None else self.film.merged(state)
        more = counts or {}
        return _Sum(film, {name: value + more.get(name, 0) for name, value in self.totals.items()})

    @property
    def taken(self) -> Ranges:
        return () if self.film is None else self.film.taken

    def counts(self, films: int) -> Counts:
        """The share of one of so many films."""
        samples, rays, rejected, full = (value // films for value in self.totals.values())
        return Counts(samples=samples, closest=rays, rejected=rejected, full=full)


class ClusterRenderer(FilmKeeping):
    """Renders a scene on the workers of a cluster, with the methods of `Renderer`.

    client: of Dask, of any cluster whose workers have clpt installed. mixed: whether workers of
    different classes of device may take part; the last bits of the picture then depend on who
    rendered what. check_every: of the blocks, one in so many is rendered by two workers and
    compared, beside the first block of each worker; 0: none. first_sample: the number of the first
    sample. device: where pictures are made of
    the film, on this machine. options: halves, layout, queued, looped, slots, texture_budget,
    tree_quality, as of `Renderer`.

    The film is added up here, and is kept whatever happens to the cluster. It may be used by one
    thread; `cancel` from any. warnings: for people.

    Raises TypeError for what is no scene or option, SceneError for a scene that cannot be written,
    or has materials that are not clpt's own.
    """

    def __init__(
        self,
        scene: Scene,
        client: Client,
        *,
        device: dev.Device | str | int | None = None,
        mixed: bool = False,
        check_every: int = CHECK_EVERY,
        patience: float = NO_WORKER_SECONDS,
        first_sample: int = 0,
        **options: Any,
    ):
        check_scene(scene)
        check_options(scene, options)
        unknown = options.keys() - set(tasks.OPTIONS)
        if unknown:
            raise TypeError(f"the option {min(unknown)!r} is of one device, not of a cluster")
        self.scene, self.client = scene, client
        self.mixed, self.check_every, self.patience = mixed, check_every, patience
        self.warnings: list[str] = []
        self._device, self._options = device, options
        self._stop = threading.Event()
        self._folder = tempfile.TemporaryDirectory(prefix="clpt-bundle-")
        bundle = pack(scene, Path(self._folder.name))
        self._job = tasks.describe_job(bundle, options)
        self._bundle = bundle
        self._sum = self._whole = _Sum()  # of all films, and of those of whole blocks
        self._held: _Sum | None = None
        self._local: Renderer | None = None  # makes pictures
        self._developed: FilmState | None = None  # that it has
        self._first_sample = first_sample
        self._blocks, self._total, self._add_seconds = Blocks(0), 0, 0.0
        self._began = datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds")
        self._seconds_rendered = 0.0
        self._sessions: tuple[Session, ...] = ()  # before
        self._classes: dict[str, Mapping[str, Plain]] = {}  # of devices that take part

    # ---- rendering

    @property
    def digest(self) -> str:
        """The SHA-256 by which workers know the job: of scene, options, kernels and version."""
        return tasks.digest_of(self._job)

    @property
    def samples(self) -> int:
        """How many samples every pixel has."""
        return self._blocks.samples_done

    @property
    def active(self) -> float:
        """1: the share of the pixels that would get more samples."""
        return 1.0

    @property
    def first_sample(self) -> int:
        """The number of the first sample."""
        return self._first_sample

    @property
    def former_seconds(self) -> float:
        """How long others rendered the film, before this renderer went on with it."""
        return sum(session.seconds for session in self._sessions)

    @property
    def workers(self) -> dict[str, WorkerRecord]:
        """What is known of each worker, by its address: its rate, blocks, samples, failures."""
        return dict(self._blocks.workers)  # type: ignore[arg-type]

    @property
    def refused(self) -> dict[str, str]:
        """Why workers take no part, by their addresses."""
        return dict(self._blocks.refused)  # type: ignore[arg-type]

    @property
    def blocks(self) -> Blocks:
        """Who renders what; see clpt.cluster.blocks. To be read only."""
        return self._blocks

    @property
    def counts(self) -> dict[str, int]:
        """Samples, rays, and what films refused (rejected, full), of all blocks that were added."""
        return dict(self._sum.totals)

    def run(
        self,
        samples: int,
        progress: Callable[[Progress], bool | None] | None = None,
        *,
        noise: float | None = None,
    ) -> bool:
        """Add samples to every pixel and wait; returns whether all were added.

        progress: called several times a second; if it returns False the run stops soon, as after
        `cancel`: workers send what they have. Samples that are missing then are rendered by the
        next run.

        Raises ClusterError when the scheduler is gone, no worker is left or fit, or a block fails
        again and again; the film keeps what was done. Raises SceneError for noise, which is for
        `Renderer` alone.
        """
        if noise is not None:
            raise SceneError("not with a cluster yet; give a number of samples", where="noise")
        if samples < 1 or self._first_sample + self.samples + samples > MOST_SAMPLES:
            raise SceneError(f"cannot add {samples} samples", where="samples")
        if self._stop.is_set():
            self._stop.clear()
            return False
        films: queue.Queue[Film] = queue.Queue()
        self._total = self.samples + samples
        self._blocks = self._next_blocks(samples)
        feeder = Feeder(
            self.client, self._blocks, self._job, self._bundle, Path(self._folder.name),
            films=films, mixed=self.mixed, patience=self.patience,
        )  # fmt: skip
        driven, began = (
            asyncio.run_coroutine_threadsafe(feeder.run(), feeder.loop),
            time.perf_counter(),
        )
        before = self._seconds_rendered
        try:
            self._collect(films, driven, feeder, progress)
        finally:
            feeder.stop()
            self._stop.clear()
            self._end(driven, films)
            self._note_classes(feeder)
            self._seconds_rendered = before + time.perf_counter() - began
        driven.result()
        return self.samples == self._total

    def _collect(
        self, films: queue.Queue[Film], driven: Any, feeder: Feeder, progress: Any
    ) -> None:
        """Add films as they come, until the feeder ends or somebody wants it to."""
        began = shown = time.perf_counter()
        before = self._seconds_rendered
        while not (driven.done() and films.empty()):
            with suppress(queue.Empty):
                self._add(films.get(timeout=TELL_SECONDS))
            now = time.perf_counter()
            film_seconds = max(self._add_seconds, feeder.film_seconds)
            set_lengths(self._blocks, now - began, film_seconds)
            self._note_classes(feeder)
            self._seconds_rendered = before + now - began
            if self._stop.is_set():
                feeder.stop()
            if progress is not None and now - shown >= TELL_SECONDS:
                shown = now
                if progress(self._so_far(now - began)) is False:
                    feeder.stop()
        if progress is not None:
            progress(self._so_far(time.perf_counter() - began))

    def _end(self, driven: Any, films: queue.Queue[Film]) -> None:
        """Wait for the feeder, and add what is still on its way."""
        while not driven.done():
            with suppress(queue.Empty):
                self._add(films.get(timeout=TELL_SECONDS))
        while not films.empty():
            self._add(films.get())

    def _next_blocks(self, samples: int) -> Blocks:
        """The blocks of a run, which fill the gaps of those before."""
        start, taken = self._first_sample, self._sum.taken
        end, left = start, samples
        for first, after in taken:
            gap = max(first - end, 0)
            if gap >= left:
                break
            end, left = max(after, end), left - gap
        return Blocks(
            end + left, taken, seconds=FIRST_SECONDS, check_every=self.check_every, first=start
        )

    def _add(self, film: Film) -> None:
        began = time.perf_counter()
        nothing_cut = self._whole is self._sum
        self._sum = self._sum.plus(film.state, film.counts)
        if film.whole:
            self._whole = self._sum if nothing_cut else self._whole.plus(film.state, film.counts)
        self._add_seconds = time.perf_counter() - began

    def _note_classes(self, feeder: Feeder) -> None:
        """Note the classes of devices that take part, and warn where others took samples before."""
        for kind, device in list(feeder.classes.items()):
            if kind in self._classes:
                continue
            self._classes[kind] = device
            others = other_devices(self._sessions, device)
            if others:
                self.warnings.append(classes_text(others))
                log.warning("%s", self.warnings[-1])

    def _so_far(self, seconds: float) -> Progress:
        totals = self._sum.totals
        return Progress(self.samples, self._total, totals["samples"], totals["rays"], seconds)

    def cancel(self) -> None:
        """Let the run, or else the next one, stop soon and return False."""
        self._stop.set()

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

    def _begin_with(self, films: _Sum, whole: _Sum | None = None) -> None:
        self._sum, self._whole = films, films if whole is None else whole
        taken = films.taken
        self._blocks = Blocks(taken[-1][1] if taken else 0, taken)

    @property
    def _here(self) -> Renderer:
        """A renderer on this machine, which renders nothing."""
        if self._local is None:
            self._local = Renderer(self.scene, self._device, **self._options)
        return self._local

    def developed(self) -> Renderer:
        """Return a renderer on this machine that holds the film so far, for its pictures."""
        local, film = self._here, self._sum.film
        if self._developed is not film and film is not None:
            local.reset()
            local.merge(film)
            for one in local.wavefronts:
                one.counts = self._sum.counts(len(local.wavefronts))
            self._developed = film
        return local

    def origin(self) -> Origin:
        """Return what the samples are of. Raises SceneError for a scene that cannot be read."""
        return self._here.origin()

    @property
    def form(self) -> PictureForm:
        """What makes a picture of the film; see `Renderer.form`."""
        return self._here.form

    @property
    def channels(self) -> tuple[str, ...]:
        """Of the `aov` integrator, else none."""
        return self.form.channels

    @property
    def is_adaptive(self) -> bool:
        """False: all pixels have the same number of samples."""
        return False

    def hold(self) -> None:
        """Keep the film of all whole blocks so far, for `saved_film`.

        Blocks that a stop cut are in the picture, but not in what is held.
        """
        self._held = self._whole

    def saved_film(self, *, held: bool = False) -> SavedFilm:
        """Return the film with all that it takes to go on with it; see `Renderer.saved_film`.

        It may lack samples before its last one, which `ClusterRenderer` takes when it goes on.
        """
        if held and self._held is None:
            raise SceneError("no film is held; call hold() first")
        films = self._held if held and self._held is not None else self._sum
        state = self._empty() if films.film is None else films.film
        number = len(state.words)
        counts = tuple(dict(vars(films.counts(number))) for _ in range(number))
        seconds = [self._seconds_rendered] + [0.0] * len(self._classes)  # each second once
        sessions = [
            Session(self._began, took, VERSION, device)
            for device, took in zip(self._classes.values(), seconds, strict=False)
        ]
        return SavedFilm(state, self.origin(), self.form, counts, (*self._sessions, *sessions), {})

    def _empty(self) -> FilmState:
        """A film without samples."""
        self._here.reset()
        self._developed = None
        return self._here.film_state()

    def restore(self, saved: SavedFilm) -> None:
        """Go on from a saved film, as `load_state` does. Raises SceneError.

        `warnings` tells, once a worker is there, where another class of device took the samples.
        """
        saved.origin.check_same(self.origin())
        if saved.adaptive:
            raise SceneError(
                "a film with adaptive sampling is not for a cluster yet", where="noise"
            )
        empty, film = self._empty(), saved.film
        if (empty.words.shape, empty.bands.shape) != (film.words.shape, film.bands.shape):
            raise SceneError("the film has another form than this scene's")
        totals = dict.fromkeys(self._sum.totals, 0)
        for one in (Counts(**counts) for counts in saved.counts):
            for name in totals:
                totals[name] += getattr(one, name)
        self._begin_with(_Sum(film if film.taken else None, totals))
        self._held, self._sessions, self._seconds_rendered = None, saved.sessions, 0.0
        self._classes = {}

    def image(self) -> Image:
        """The picture so far, see `Renderer.image`; made on this machine."""
        return self.developed().image()

    def colours(self) -> Image:
        """The picture so far in three colours, see `Renderer.colours`."""
        return self.developed().colours()

    def layers(self) -> dict[str, Image]:
        """The values of the `aov` integrator by name, see `Renderer.layers`."""
        return self.developed().layers()

    def spectral_image(self) -> SpectralImage:
        """The picture so far of a film with bands, see `Renderer.spectral_image`."""
        return self.developed().spectral_image()

    def samples_per_pixel(self) -> Image:
        """How many samples each pixel has, (h, w) float32."""
        return self.developed().samples_per_pixel()

    def close(self) -> None:
        """Give back what this machine holds; workers keep the scene until another needs room."""
        self._folder.cleanup()
        if self._local is not None:
            self._local.close()
            self._local = None

    def __enter__(self) -> ClusterRenderer:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()
