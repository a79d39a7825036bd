"""A renderer whose samples come from the workers of a Dask cluster."""

from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Callable, Mapping
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
from clpt.render.contract.features import Features
from clpt.render.editing.scene_edit import MaterialKey
from clpt.render.film_renderer import Watch
from clpt.render.locking import synchronized
from clpt.render.options import check_options, check_scene
from clpt.render.progress import Progress
from clpt.render.stats import RenderStats
from clpt.render.wavefront.film_state import FilmState, Ranges, join_ranges
from clpt.render.wavefront.tracer import OnBatch, Selection
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.materials import Material

if TYPE_CHECKING:
    from distributed import Client

NO_WORKER_SECONDS = 300.0  # without any worker, until the render ends


class ClusterRenderer(ClusterFilm):
    """Renders a scene on the workers of a cluster, with the methods of `Renderer`.

    client: of Dask, of any cluster whose workers have clpt installed. mixed: whether workers of
    different classes of device may take part; the last bits of the picture then depend on who
    rendered what. first_sample: the number of the first sample. device: where pictures are made of
    the film, and its noise is measured, on this machine. beside: a renderer of the same cluster, at
    whose side this one renders, by devices of one class.
    options: halves, layout, queued, looped, slots, texture_budget, tree_quality, denoise, as of
    `Renderer`.

    The film is added up here, and is kept whatever happens to the cluster. At a stop workers send
    what they have; the next run renders what is missing, but with noise no number is used again. It
    may be used by one thread; `cancel` from any. warnings: for people.

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
        options = {name: value for name, value in options.items() if value is not None}
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
        """A record of each worker, by its address: its rate, blocks, samples, failures."""
        return dict(self.farm.known.records)

    @property
    def _device_text(self) -> str:
        """The classes of the workers' devices, for people."""
        kinds = {record.kind for record in self.workers.values()}
        return "; ".join(sorted(kinds)) or super()._device_text

    @property
    def refused(self) -> dict[str, str]:
        """The reasons why workers take no part, by their addresses."""
        return dict(self.farm.known.refused)

    @property
    def lost(self) -> int:
        """The number of workers that are gone."""
        return self.farm.known.lost

    @property
    def _features(self) -> Features:
        return self._here._wavefront.features

    @property
    def _pixels(self) -> int:
        return self._here._wavefront.paths.pixels

    def _add_samples(self, first: int, end: int, noise: float | None, watch: Watch) -> bool:
        """Add samples to all pixels, or to those with noise; return whether all were added.

        Noise is measured on this machine; pixels and numbers of samples are those of one
        `Renderer`, if its device is of the class of the workers'. At a stop workers send what they
        have. Samples that are missing then are rendered by the next run, but for runs with noise,
        which use no number again.

        Raises ClusterError when the scheduler is gone, no worker is left or fit, or a block fails
        again and again; the film keeps what was done.
        """

        def tick() -> bool:
            self._note_classes(self.farm.known.classes)
            return watch()

        samples = end - first
        if noise is None and self._noise is None:
            finished = self._run_all(samples, tick)
        else:
            taken = self._sum.taken
            first = taken[-1][1] if taken else self._first_sample
            finished = self._run_adaptively(first, first + samples, noise, tick)
        tick()
        error, self._error = self._error, None
        if error is not None and watch.raised is None:
            raise error
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
        return self._ask(Selection("all", 1), 1, (start, end + left), taken, self._add, tick)

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
            every = Selection("all", self._here._wavefront.paths.pixels)
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

        pixels = self._here._wavefront.paths.pixels
        return self._ask(selection, pixels, (first, end), (), note, lambda: on_batch(None))

    def _ask(
        self, selection: Selection, pixels: int, samples: tuple[int, int], taken: Ranges,
        add: Callable[[Film], None], tick: Callable[[], bool],
    ) -> bool:  # fmt: skip
        """See `Farm.run`; what goes wrong with the cluster is raised by `run`, at its end."""
        try:
            return self.farm.run(self._job, selection, pixels, samples, taken, add, tick)
        except ClusterError as error:
            self._error = error
            return False

    def _so_far(self, end: int, seconds: float) -> Progress:
        if self._noise is not None:
            return super()._so_far(end, seconds)
        samples, counts = float(self.samples - self._first_sample), self.counts
        return Progress(samples, end, counts.samples, counts.rays, seconds)

    @synchronized
    def update(
        self,
        *,
        camera: Camera | None = None,
        materials: Mapping[MaterialKey, Material] | None = None,
        scene: Scene | None = None,
    ) -> None:
        """Render another scene from now on, or another camera; begin at the first sample again.

        What is known of the workers stays; they open the scene at the next run. Raises as
        `ClusterRenderer` does, and SceneError for materials alone.
        """
        if materials is not None:
            raise SceneError("give the whole scene", where="materials")
        if scene is not None:
            check_scene(scene)
        scene = needs.prepared(self.scene if scene is None else scene, self.denoise)
        if camera is not None:
            scene = dataclasses.replace(scene, camera=camera)
        former, self.scene = self._folder, scene
        self._pack()
        former.cleanup()
        if self._local is not None:
            try:
                self._local.update(scene=scene)
            except SceneError:  # a film of another form
                self._local.close()
                self._local = self._resolve = None
        self._begin_anew()

    @property
    def stats(self) -> RenderStats:
        """Figures of this machine's part; see `Renderer.stats`."""
        return self._here.stats

    def close(self) -> None:
        """Give back what this machine holds; workers keep the scene until another needs room."""
        self._folder.cleanup()
        if self._local is not None:
            self._local.close()
            self._local = None
