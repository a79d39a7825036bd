"""A renderer whose samples come from the workers of a Dask cluster, and its maker."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt import device as dev
from clpt.cluster import tasks
from clpt.cluster.admission import Job
from clpt.cluster.blocks import WorkerRecord
from clpt.cluster.bundle import pack
from clpt.cluster.farm import Farm, Film
from clpt.cluster.host_maker import HostMaker, HostPlan
from clpt.denoise import needs
from clpt.errors import SceneError
from clpt.render.edit.plans import Plan
from clpt.render.film.state import FilmState, Ranges
from clpt.render.makers import planning
from clpt.render.makers.contents import Contents, Settle
from clpt.render.makers.device_film import DeviceFilm, open_device
from clpt.render.makers.maker import Call, Held, Tick
from clpt.render.makers.planning import Changes
from clpt.render.options import check_options, check_scene
from clpt.render.resumable import ResumableRenderer
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.tracer import Selection
from clpt.render.wavefront.wavefront import Counts
from clpt.scene import Scene
from clpt.scene.fingerprint import Plain

if TYPE_CHECKING:
    from distributed import Client

NO_WORKER_SECONDS = 300.0  # without any worker, until the render fails


@dataclass(frozen=True, eq=False)
class FilmSum:
    """The sum of films, None before the first; counts: of all films together."""

    film: FilmState | None = None
    counts: Counts = Counts()

    def plus(self, film: Film, *, merged: bool) -> FilmSum:
        """Return the sum with another film; merged: whether samples of all pixels are added."""
        total = film.state
        if self.film is not None:
            total = self.film.merged(total) if merged else self.film.plus(total)
        return FilmSum(total, self.counts.plus(film.counts))

    @property
    def taken(self) -> Ranges:
        return () if self.film is None else self.film.taken


class ClusterMaker(HostMaker):
    """Workers of a cluster, whose films are added as they come.

    farm: the workers; device: of this machine, opened on first use, for pictures and noise;
    options: see `ClusterRenderer`.
    """

    adds_films = True

    def __init__(
        self,
        scene: Scene,
        farm: Farm,
        device: dev.Device | str | int | None,
        options: Mapping[str, Any],
    ):
        self.start = time.perf_counter()
        self.farm, self._device, self._options = farm, device, options
        self._home: DeviceFilm | None = None
        self._sum = self._whole = FilmSum()  # of all films; of films of whole blocks only
        self._shown: FilmState | None = None  # the film on the home device
        self._pack(scene)

    @property
    def scene(self) -> Scene:
        """The scene that is rendered."""
        return self._scene

    def _pack(self, scene: Scene) -> None:
        """Write the scene's bundle, which workers read."""
        denoise = self._options.get("denoise")
        self._scene = scene = needs.prepared(scene, denoise)
        self._folder = tempfile.TemporaryDirectory(prefix="clpt-bundle-")
        folder = Path(self._folder.name)
        bundle = pack(scene, folder)
        options = {name: self._options[name] for name in self._options if name != "denoise"}
        if needs.halves(denoise, scene.noise):
            options["halves"] = True
        self.job = Job(tasks.describe_job(bundle, options), bundle, folder)

    # ---- state

    @property
    def home(self) -> DeviceFilm:
        """A device of this machine, which renders nothing."""
        if self._home is None:
            options: Any = dict(self._options)
            self._home = DeviceFilm(self.scene, open_device(self._device, options), options)
        return self._home

    @property
    def devices(self) -> tuple[dev.Device, ...]:
        """The device of this machine, once it is in use."""
        return () if self._home is None else (self._home.device,)

    @property
    def warnings(self) -> list[str]:
        """Empty: `refused` and `lost` report workers."""
        return []

    @property
    def counts(self) -> Counts:
        """Counts of all added blocks."""
        return self._sum.counts

    @property
    def classes(self) -> tuple[Mapping[str, Plain], ...]:
        """The classes of the devices of all workers so far."""
        return tuple(self.farm.known.classes.values())

    # ---- samples

    def prepare(self) -> None:
        """Do nothing: workers prepare themselves."""

    def begin(self, call: Call, now: Contents, more: Contents) -> Settle:
        """Return a function that completes the film; see `Maker`. It keeps every film."""

        def settle(error: BaseException | None) -> Contents:
            if more.adaptive is None:
                return replace(now, taken=self._sum.taken)
            if error is not None:
                more.adaptive.finish()
            film = replace(self.words(), taken=more.taken)
            self._sum = self._whole = FilmSum(film, self.counts)
            return more

        return settle

    def run(self, call: Call, adaptive: Adaptive | None, tick: Tick) -> bool:
        """Add samples to all pixels, filling gaps, or to noisy pixels; see `Farm.run`."""
        if adaptive is not None and call.noise is not None:
            return adaptive.run(call.end, call.noise, lambda _: tick())
        if adaptive is None:
            return self._take(Selection("all", 1), 1, self._range(call), self._sum.taken, tick)
        finished = self.add(Selection("all", self._pixels), call.first, call.end, tick)
        adaptive.skip(call.end)  # after a stop too: sample numbers are not reused
        return finished

    @property
    def _pixels(self) -> int:
        return self.home.wavefront.paths.pixels

    def _range(self, call: Call) -> tuple[int, int]:
        """Return a range with as many missing samples as the call asks for."""
        taken = self._sum.taken
        left = call.end - call.first
        first = end = call.first - sum(after - before for before, after in taken)
        for before, after in taken:
            gap = max(before - end, 0)
            if gap >= left:
                break
            end, left = max(after, end), left - gap
        return first, end + left

    def add(self, selection: Selection, first: int, end: int, tick: Tick) -> bool:
        """Add samples first to end - 1 of a selection; return False after a stop."""
        return self._take(selection, self._pixels, (first, end), None, tick)

    def _take(
        self, selection: Selection, pixels: int, samples: tuple[int, int], taken: Ranges | None,
        tick: Tick,
    ) -> bool:  # fmt: skip
        """Add samples, see `Farm.run`; taken: None where pixels have different samples."""
        merged = taken is not None

        def add(film: Film) -> None:
            nothing_cut = self._whole is self._sum
            self._sum = self._sum.plus(film, merged=merged)
            if film.whole:
                self._whole = self._sum if nothing_cut else self._whole.plus(film, merged=merged)

        return self.farm.run(self.job, selection, pixels, samples, taken or (), add, tick)

    # ---- the film

    @property
    def film(self) -> FilmState | None:  # type: ignore[override]
        """The sum of all films."""
        return self._sum.film

    def put(self, state: FilmState, counts: Counts | None = None) -> None:
        """Replace the film."""
        self._sum = self._whole = FilmSum(state, self.counts if counts is None else counts)

    def shown(self) -> DeviceFilm:
        """Return the device of this machine after it received the whole film."""
        home, film = self.home, self.film
        if self._shown is not film:
            self._shown = None  # valid after an error at any line
            home.put(home.no_words if film is None else film)
            self._shown = film
        return home

    def hold(self, taken: Ranges) -> Held:
        """Keep the film of whole blocks; blocks that a stop cut are in the picture only."""
        film, counts = self._whole.film, self._whole.counts
        return Held(lambda: self.home.no_words if film is None else film, counts, taken)

    def empty(self, *, seed: int | None = None, recover: bool = False) -> None:
        """Empty the film; workers open the scene with another seed at the next call."""
        if seed is not None:
            self.take_scene(replace(self.scene, seed=seed))
        self._sum = self._whole = FilmSum()

    def plan(self, changes: Changes, events: dev.Events = None) -> Plan | None:
        """Return the plan of another scene, which workers open at the next call.

        Records of workers stay; for another integrator there is no plan, as workers agree on an
        integrator. Raises SceneError for changes of a part of the scene. The plan raises SceneError
        for a scene that cannot be written, and for custom materials.
        """
        if changes.integrator is not None:
            return None
        if changes.by_key:
            raise SceneError("give the whole scene", where=min(changes.by_key))
        scene = changes.scene or self.scene
        if changes.camera is not None:
            scene = replace(scene, camera=changes.camera)
        return HostPlan(self, Changes(scene=scene))

    def write(self, changes: Changes, events: dev.Events) -> None:
        """Let workers open the scene of the changes at the next call."""
        self.take_scene(changes.scene or self.scene)

    def take_scene(self, scene: Scene) -> None:
        """Replace the scene; a film of another form on this machine is closed."""
        former = self._folder
        self._pack(scene)
        former.cleanup()
        if self._home is None:
            return
        self._shown = None
        try:
            plan = planning.plan(self._home, Changes(scene=self.scene), [])
            if plan is not None:
                plan.write()
        except SceneError:  # a film of another form
            self._home.close()
            self._home = None
        else:
            self._home.empty()

    def close(self) -> None:
        """Free this machine's resources; workers keep the scene until another needs room."""
        self._folder.cleanup()
        if self._home is not None:
            self._home.close()


class ClusterRenderer(ResumableRenderer):
    """Renders a scene on the workers of a cluster, with the methods of `Renderer`.

    client: a Dask client of any cluster whose workers have clpt installed. mixed: whether workers
    of different device classes may take part; the last bits of the picture then depend on the
    distribution of samples. patience: seconds without any worker until the render fails.
    first_sample: the number of the first sample. device: of this machine, for pictures and noise
    measurements. beside: a renderer of the same cluster that renders at the same time; both use
    the same device class.
    options: halves, layout, queued, sorted_rays, looped, slots, texture_budget, tree_quality,
    programs, denoise, see `Renderer`.

    This process adds the films up and keeps the sum whatever happens to the cluster. At a stop
    workers send partial films; the next run renders the missing samples, but with a noise limit no
    sample number is reused. A single thread may use the renderer; `cancel` works from any thread.
    warnings: for people.

    Raises TypeError for an unknown option or anything but a scene, SceneError for a scene that
    cannot be written and for custom materials.
    """

    _maker: ClusterMaker

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
        unknown = options.keys() - {*tasks.OPTIONS, "denoise"}
        if unknown:
            raise TypeError(f"the option {min(unknown)!r} is of one device, not of a cluster")
        self.farm = Farm(client, mixed=mixed, patience=patience)
        if beside is not None:
            self.farm.known.agreed = beside.farm.known.agreed
        maker = ClusterMaker(scene, self.farm, device, options)
        super().__init__(maker, options.get("denoise"), first_sample)

    @property
    def digest(self) -> str:
        """The job's SHA-256 for workers: of scene, options, kernels and version."""
        return self._maker.job.digest

    @property
    def workers(self) -> dict[str, WorkerRecord]:
        """Records of workers by address: rate, blocks, samples, failures."""
        return dict(self.farm.known.records)

    @property
    def _device_text(self) -> str:
        kinds = {record.kind for record in self.workers.values()}
        return "; ".join(sorted(kinds)) or super()._device_text

    @property
    def refused(self) -> dict[str, str]:
        """The reasons why workers were refused, by address."""
        return dict(self.farm.known.refused)

    @property
    def lost(self) -> int:
        """The number of workers that left."""
        return self.farm.known.lost
