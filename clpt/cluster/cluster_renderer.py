"""A renderer whose samples come from the workers of a Dask cluster."""

from __future__ import annotations

import asyncio
import queue
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt import device as dev
from clpt.cluster import tasks
from clpt.cluster.blocks import Blocks, WorkerRecord
from clpt.cluster.bundle import pack
from clpt.cluster.feeding import Feeder, Film
from clpt.errors import ClusterError, SceneError
from clpt.render.options import check_options, check_scene
from clpt.render.pictures import Image
from clpt.render.progress import Progress
from clpt.render.renderer import MOST_SAMPLES, Renderer
from clpt.render.wavefront.film_state import FilmState, Ranges
from clpt.scene import Scene
from clpt.spectral_exr import SpectralImage

if TYPE_CHECKING:
    from distributed import Client

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


class ClusterRenderer:
    """Renders a scene on the workers of a cluster, with the methods of `Renderer`.

    client: of Dask, of any cluster whose workers have clpt installed. mixed: whether workers of
    different classes of device may take part; the last bits of the picture then depend on who
    rendered what. check_every: of the blocks, one in so many is rendered by two workers and
    compared, beside the first block of each worker; 0: none. device: where pictures are made of
    the film, on this machine. options: halves, layout, queued, looped, slots, texture_budget,
    tree_quality, as of `Renderer`.

    The film is added up here, and is kept whatever happens to the cluster. It may be used by one
    thread; `cancel` from any.

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
        self._film: FilmState | None = None
        self._local: Renderer | None = None  # makes pictures
        self._developed: FilmState | None = None  # that it has
        self._totals = dict.fromkeys(("samples", "rays", "rejected", "full"), 0)
        self._blocks, self._total, self._add_seconds = Blocks(0), 0, 0.0
        self._began = time.perf_counter()

    # ---- rendering

    @property
    def digest(self) -> str:
        """The SHA-256 by which workers know the job: of scene, options, kernels and version."""
        return tasks.digest_of(self._job)

    @property
    def samples(self) -> int:
        """How many samples every pixel has, which is the number of the next one."""
        return self._blocks.samples_done

    @property
    def active(self) -> float:
        """1: the share of the pixels that would get more samples."""
        return 1.0

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
        return dict(self._totals)

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
        if samples < 1 or self.samples + samples > MOST_SAMPLES:
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
        driven = asyncio.run_coroutine_threadsafe(feeder.run(), feeder.loop)
        try:
            self._collect(films, driven, feeder, progress)
        finally:
            feeder.stop()
            self._stop.clear()
            self._end(driven, films)
        driven.result()
        return self.samples == self._total

    def _collect(
        self, films: queue.Queue[Film], driven: Any, feeder: Feeder, progress: Any
    ) -> None:
        """Add films as they come, until the feeder ends or somebody wants it to."""
        began = shown = time.perf_counter()
        while not (driven.done() and films.empty()):
            with suppress(queue.Empty):
                self._add(films.get(timeout=TELL_SECONDS))
            now = time.perf_counter()
            film_seconds = max(self._add_seconds, feeder.film_seconds)
            set_lengths(self._blocks, now - began, film_seconds)
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
        taken: Ranges = () if self._film is None else self._film.taken
        end, left = 0, samples
        for first, after in taken:
            gap = first - end
            if gap >= left:
                break
            end, left = after, left - gap
        return Blocks(end + left, taken, seconds=FIRST_SECONDS, check_every=self.check_every)

    def _add(self, film: Film) -> None:
        began = time.perf_counter()
        self._film = film.state if self._film is None else self._film.merged(film.state)
        self._add_seconds = time.perf_counter() - began
        for name in self._totals:
            self._totals[name] += film.counts[name]

    def _so_far(self, seconds: float) -> Progress:
        totals = self._totals
        return Progress(self.samples, self._total, totals["samples"], totals["rays"], seconds)

    def cancel(self) -> None:
        """Let the run, or else the next one, stop soon and return False."""
        self._stop.set()

    # ---- the film

    def film_state(self) -> FilmState:
        """Return what all workers have rendered so far. Raises ClusterError before there is any."""
        if self._film is None:
            raise ClusterError("no worker has sent a film yet")
        return self._film

    def merge(self, state: FilmState) -> None:
        """Add the samples of another film of the same scene. Raises as `Renderer.merge` does."""
        self._film = state if self._film is None else self._film.merged(state)
        taken = self._film.taken
        self._blocks = Blocks(taken[-1][1] if taken else 0, taken)

    def developed(self) -> Renderer:
        """Return a renderer on this machine that holds the film so far, for its pictures."""
        if self._local is None:
            self._local = Renderer(self.scene, self._device, **self._options)
        if self._developed is not self._film and self._film is not None:
            self._local.reset()
            self._local.merge(self._film)
            films = len(self._local.wavefronts)
            for one in self._local.wavefronts:  # each has its share of what all workers counted
                for name, value in self._totals.items():
                    setattr(one.counts, "closest" if name == "rays" else name, value // films)
            self._developed = self._film
        return self._local

    def save_state(self, path: str | Path) -> None:
        """Write the film to a file, see `Renderer.save_state`: any renderer goes on from it."""
        self.developed().save_state(path)

    def load_state(self, path: str | Path) -> None:
        """Go on from a file of `save_state`, see `Renderer.load_state`."""
        local = self.developed()
        local.load_state(path)
        state = local.film_state()
        self._film = None
        self.merge(state)
        self._developed = self._film
        for name in self._totals:
            self._totals[name] = sum(getattr(counts, name) for counts in local.counts)

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
