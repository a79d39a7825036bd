"""A renderer whose samples come from the workers of a Dask cluster."""

from __future__ import annotations

import dataclasses
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt import device as dev
from clpt.cluster import tasks
from clpt.cluster.admission import Job
from clpt.cluster.blocks import WorkerRecord
from clpt.cluster.bundle import pack
from clpt.cluster.cluster_film import ClusterFilm, FilmSum
from clpt.cluster.farm import Farm, Film
from clpt.denoise import needs
from clpt.errors import ClusterError, SceneError
from clpt.render.options import check_options, check_scene
from clpt.render.progress import Progress
from clpt.render.renderer import MOST_SAMPLES
from clpt.render.wavefront import adaptive
from clpt.render.wavefront.film_state import FilmState, Ranges, join_ranges
from clpt.render.wavefront.tracer import OnBatch, Selection
from clpt.scene import Scene

if TYPE_CHECKING:
    from distributed import Client

TELL_SECONDS = 0.2  # between calls of `progress`
NO_WORKER_SECONDS = 300.0  # without any worker, until the render ends

OnProgress = Callable[[Progress], bool | None]


class ClusterRenderer(ClusterFilm):
    """Renders a scene on the workers of a cluster, with the methods of `Renderer`.

    client: of Dask, of any cluster whose workers have clpt installed. mixed: whether workers of
    different classes of device may take part; the last bits of the picture then depend on who
    rendered what. first_sample: the number of the first sample. device: where pictures are made of
    the film, and its noise is measured, on this machine. beside: a renderer of the same cluster, at
    whose side this one renders, by devices of one class.
    options: halves, layout, queued, looped, slots, texture_budget, tree_quality, denoise, as of
    `Renderer`.

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
        patience: float = NO_WORKER_SECONDS,
        first_sample: int = 0,
        beside: ClusterRenderer | None = None,
        **options: Any,
    ):
        check_scene(scene)
        check_options(scene, options)
        self.denoise = options.pop("denoise", None)
        scene = needs.prepared(scene, self.denoise)
        options |= {"halves": True} if needs.halves(scene, self.denoise) else {}
        unknown = options.keys() - set(tasks.OPTIONS)
        if unknown:
            raise TypeError(f"the option {min(unknown)!r} is of one device, not of a cluster")
        super().__init__(scene, device, first_sample, options)
        self.farm = Farm(client, mixed=mixed, patience=patience)
        if beside is not None:
            self.farm.known.agreed = beside.farm.known.agreed
        self._stop = threading.Event()
        self._error: ClusterError | None = None
        self._pack()

    def _pack(self) -> None:
        """Write the scene as workers get it."""
        self._folder = tempfile.TemporaryDirectory(prefix="clpt-bundle-")
        folder = Path(self._folder.name)
        bundle = pack(self.scene, folder)
        self._job = Job(tasks.describe_job(bundle, dict(self._options)), bundle, folder)

    # ---- rendering

    @property
    def digest(self) -> str:
        """The SHA-256 by which workers know the job: of scene, options, kernels and version."""
        return self._job.digest

    @property
    def workers(self) -> dict[str, WorkerRecord]:
        """What is known of each worker, by its address: its rate, blocks, samples, failures."""
        return dict(self.farm.known.records)

    @property
    def refused(self) -> dict[str, str]:
        """Why workers take no part, by their addresses."""
        return dict(self.farm.known.refused)

    @property
    def lost(self) -> int:
        """How many workers are gone."""
        return self.farm.known.lost

    def run(
        self, samples: int, progress: OnProgress | None = None, *, noise: float | None = None
    ) -> bool:
        """Add samples to every pixel and wait; returns whether all were added.

        noise: leave pixels as soon as the noise around them is as low; see `Renderer.run`. Noise is
        measured on this machine; pixels and numbers of samples are those of one `Renderer`, if its
        device is of the class of the workers'.
        progress: called several times a second; if it returns False the run stops soon, as after
        `cancel`: workers send what they have. Samples that are missing then are rendered by the
        next run, but for runs with noise, which use no number again. What it raises is raised when
        workers have sent what they have.

        Raises ClusterError when the scheduler is gone, no worker is left or fit, or a block fails
        again and again; the film keeps what was done. Raises SceneError for noise that makes no
        sense with the scene, and for too many samples.
        """
        taken = self._sum.taken
        first = taken[-1][1] if taken else self._first_sample
        if samples < 1 or self.samples + samples > MOST_SAMPLES:
            raise SceneError(f"cannot add {samples} samples", where="samples")
        if noise is not None:
            noise = adaptive.checked(noise, self._here.wavefront.features)
        if self._stop.is_set():
            self._stop.clear()
            return False
        ticker = _Ticker(self, progress, self.samples + samples, self._seconds_rendered)
        self._error = None
        try:
            if noise is None and self._noise is None:
                finished = self._run_all(samples, ticker)
            else:
                finished = self._run_adaptively(first, first + samples, noise, ticker)
            ticker(at_once=True)
        finally:
            self._stop.clear()
        if ticker.raised is not None:
            raise ticker.raised
        if self._error is not None:
            raise self._error
        return finished

    def _run_all(self, samples: int, tick: Callable[[], bool]) -> bool:
        """Add samples to all pixels, which fill the gaps of those before."""
        start, taken = self._first_sample, self._sum.taken
        end, left = start, samples
        for first, after in taken:
            gap = max(first - end, 0)
            if gap >= left:
                break
            end, left = max(after, end), left - gap
        return self._take(Selection("all", 1), 1, (start, end + left), taken, self._add, tick)

    def _add(self, film: Film) -> None:
        nothing_cut = self._whole is self._sum
        self._sum = self._sum.plus(film.state, film.counts)
        if film.whole:
            self._whole = self._sum if nothing_cut else self._whole.plus(film.state, film.counts)

    def _run_adaptively(
        self, first: int, end: int, noise: float | None, tick: Callable[[], bool]
    ) -> bool:
        """Add samples to the pixels with noise, or to all; return whether it was not stopped."""
        if self._noise is None:
            self._begin_adaptively({})
        assert self._noise is not None and self._tracer is not None
        try:
            if noise is not None:
                return self._noise.run(end, noise, lambda _: tick())
            every = Selection("all", self._here.wavefront.paths.pixels)
            finished = self._tracer.add(every, first, end, lambda _: tick())
            if finished:
                self._noise.skip(end)
            return finished
        finally:
            self._tracer.gather()
            taken = join_ranges(self._sum.taken, ((first, end),))
            film = dataclasses.replace(self._here.film_state(), taken=taken)
            self._sum = self._whole = FilmSum(film, self._sum.totals)
            self._shown = film

    def _take_selection(
        self, selection: Selection, first: int, end: int, add: Callable[[FilmState], None],
        on_batch: OnBatch,
    ) -> bool:  # fmt: skip
        def note(film: Film) -> None:
            self._sum = self._sum.counting(film.counts)
            add(film.state)

        pixels = self._here.wavefront.paths.pixels
        return self._take(selection, pixels, (first, end), (), note, lambda: on_batch(None))

    def _take(
        self, selection: Selection, pixels: int, samples: tuple[int, int], taken: Ranges,
        add: Callable[[Film], None], tick: Callable[[], bool],
    ) -> bool:  # fmt: skip
        """See `Farm.run`; what goes wrong with the cluster is raised by `run`, at its end."""
        try:
            return self.farm.run(self._job, selection, pixels, samples, taken, add, tick)
        except ClusterError as error:
            self._error = error
            return False

    def _note(self, seconds: float) -> None:
        """Note how long the film has been rendered, and by which classes of devices."""
        self._seconds_rendered = seconds
        self._note_classes(self.farm.known.classes)

    def _so_far(self, total: int, seconds: float) -> Progress:
        totals, samples = self._sum.totals, float(self.samples - self._first_sample)
        if self._noise is not None:
            samples = totals["samples"] / (self.scene.film.width * self.scene.film.height)
        return Progress(samples, total, totals["samples"], totals["rays"], seconds, self.active)

    def cancel(self) -> None:
        """Let the run, or else the next one, stop soon and return False."""
        self._stop.set()

    def update(self, *, scene: Scene) -> None:
        """Render another scene from now on, and begin at the first sample again.

        What is known of the workers stays; they open the scene at the next run. Raises as
        `ClusterRenderer` does.
        """
        check_scene(scene)
        scene = needs.prepared(scene, self.denoise)
        former, self.scene = self._folder, scene
        self._pack()
        former.cleanup()
        if self._local is not None:
            try:
                self._local.update(scene=scene)
            except SceneError:  # a film of another form
                self._local.close()
                self._local = None
        self._begin_anew()

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


class _Ticker:
    """Called while workers render: returns whether they go on.

    total: samples at the end; before: seconds rendered till now. raised: what `progress` raised.
    """

    def __init__(
        self, renderer: ClusterRenderer, progress: OnProgress | None, total: int, before: float
    ):
        self._renderer, self._progress, self._total = renderer, progress, total
        self._before, self._began = before, time.perf_counter()
        self._shown = 0.0
        self.raised: BaseException | None = None

    def __call__(self, *, at_once: bool = False) -> bool:
        """Tell of the progress if that is due, or at once."""
        renderer, seconds = self._renderer, time.perf_counter() - self._began
        renderer._note(self._before + seconds)
        goes_on = self.raised is None and not renderer._stop.is_set()
        if not goes_on or self._progress is None:
            return goes_on
        if not at_once and seconds - self._shown < TELL_SECONDS:
            return True
        self._shown = seconds
        try:
            return self._progress(renderer._so_far(self._total, seconds)) is not False
        except BaseException as error:
            self.raised = error
            return False
