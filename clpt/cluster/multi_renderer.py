"""A renderer on several devices of this machine at once."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from clpt import device as dev
from clpt.cluster.crew import Crew
from clpt.cluster.device_worker import (
    DeviceWorker,
    Once,
    SharingRenderer,
    device_names,
    where_it_works,
)
from clpt.cluster.multi_film import MultiFilm
from clpt.cluster.multi_noise import CrewTracer
from clpt.errors import DeviceError
from clpt.render.contents import Contents
from clpt.render.contract.features import Features
from clpt.render.editing.scene_edit import MaterialKey, ShapeKey
from clpt.render.film.saved_film import Origin
from clpt.render.film_renderer import Watch
from clpt.render.locking import healing, synchronized
from clpt.render.options import RenderOptions, check_options, check_scene
from clpt.render.renderer import texture_budget_of
from clpt.render.stats import RenderStats
from clpt.render.wavefront.film_state import FilmState, join_ranges
from clpt.render.wavefront.tracer import Tracer
from clpt.render.wavefront.wavefront import Counts
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.fingerprint import Plain
from clpt.scene.materials import Material

if TYPE_CHECKING:
    from typing_extensions import Unpack


@dataclass(frozen=True)
class DeviceShare:
    """A device's part in a picture.

    name: of the device; share: of all paths, 0 to 1; rate: of paths [1/s]; failure: why it was left
    out, None where it was not.
    """

    name: str
    share: float
    rate: float
    failure: str | None


class MultiRenderer(MultiFilm):
    """Renders a scene on several devices; its picture so far is available between runs.

    devices: "all", "gpu", or names or indexes as `clpt.device.choose_all` takes them, and
    clpt.device.Device objects. options: see `RenderOptions`, without `queue`; `threads` are of each
    CPU. The film is that of one `Renderer` to the bit, where all devices are of one class, as two
    equal GPUs are: the samples are the same, whoever takes them.

    A device that fails is left out, with a warning in `warnings` and in the log, and the others
    take its samples. It has the methods of `Renderer` but for `step`, which waits for nothing:
    which device takes a sample is known only while they run. For the same reason `film` is memory
    of the first device, which holds the picture until the next run.

    Raises as `Renderer` does; DeviceError also if a device is named twice, SceneError for arrays in
    the memory of a device.
    """

    def __init__(
        self,
        scene: Scene,
        devices: str | Iterable[dev.Device | str | int] = "all",
        **options: Unpack[RenderOptions],
    ):
        super().__init__()
        check_scene(scene)
        check_options(scene, options)
        if options.pop("queue", None) is not None:
            raise DeviceError("a queue is of one device; give a Renderer the queue")
        threads, profiling = options.pop("threads", None), options.get("profiling", False)
        chosen = dev.choose_all(devices, profiling=profiling, threads=threads)
        self._first_sample = options.pop("first_sample", 0) or 0
        if options.get("texture_budget") is None:
            options["texture_budget"] = min(texture_budget_of(device) for device in chosen)
        shared, warnings = Once(), list[str]()

        def make(device: dev.Device) -> SharingRenderer:
            return SharingRenderer(scene, device, shared, **options)

        names = device_names(chosen)
        made = where_it_works(make, chosen)
        workers = []
        for name, result in zip(names, made, strict=True):
            if isinstance(result, SharingRenderer):
                workers.append(DeviceWorker(name, result))
            else:
                warnings.append(f"{name} failed and is left out: {result}")
        self._crew = Crew(workers, self._stop)
        self._lost_at_first = warnings
        self.denoise = options.get("denoise")

    # ---- what stands for all devices

    @property
    def scene(self) -> Scene:  # type: ignore[override]
        """The scene that is rendered."""
        return self._crew.first.renderer.scene

    @property
    def device(self) -> dev.Device:  # type: ignore[override]
        """The first device, which has `film`."""
        return self._crew.first.renderer.device

    @property
    def devices(self) -> tuple[dev.Device, ...]:
        """The devices that have not failed."""
        return tuple(worker.renderer.device for worker in self._crew.workers)

    def _device_class(self) -> dict[str, Plain]:
        """Return what decides the last bits of samples, of all devices; see `Renderer`."""
        first = self._crew.first.renderer._device_class()
        each = [worker.renderer._device_class() for worker in self._crew.workers]
        for name in first:
            values = list(dict.fromkeys(str(one[name]) for one in each))
            if len(values) > 1:
                first[name] = " and ".join(values)
        return first

    @property
    def shares(self) -> tuple[DeviceShare, ...]:
        """The part of each device in the picture so far, those that failed last."""
        failed = {id(worker): str(error) for worker, error in self._crew.failed}
        workers = [*self._crew.workers, *(worker for worker, _ in self._crew.failed)]
        paths = max(sum(worker.paths for worker in workers), 1)
        return tuple(
            DeviceShare(one.name, one.paths / paths, one.rate, failed.get(id(one)))
            for one in workers
        )

    @property
    def warnings(self) -> list[str]:  # type: ignore[override]
        """Warnings of the scene, and one of each device that failed."""
        crew = self._crew
        failed = [f"{worker.name} failed and is left out: {error}" for worker, error in crew.failed]
        of_scene = crew.workers[0].renderer.warnings if crew.workers else []
        return [*of_scene, *self._lost_at_first, *failed]

    @property
    def counts(self) -> Counts:
        """Counts of all devices so far; see `Renderer.counts`."""
        return self._crew.counts

    @property
    def stats(self) -> RenderStats:
        """Figures of the first device; see `Renderer.stats`."""
        stats = self._crew.first.renderer.stats
        return dataclasses.replace(stats, seconds={**stats.seconds, **self._seconds})

    # ---- rendering

    @synchronized
    def prepare(self) -> None:
        """Run every kernel of `run` once on each device; see `Renderer.prepare`."""
        self._on_each(lambda renderer: renderer.prepare())

    @property
    def _features(self) -> Features:
        return self._crew.first.renderer._wavefront.features

    @property
    def _pixels(self) -> int:
        return self._crew.whole.pixels

    def _add_samples(self, first: int, end: int, noise: float | None, watch: Watch) -> bool:
        """Add samples to all pixels, or to those with noise; return whether all were added.

        Raises ClusterError too, when the last device has failed: `film_state` then has the samples
        that were saved.
        """
        base: FilmState | None = None  # that adaptive sampling begins over
        if noise is not None and self._noise is None:
            base = self.film_state()
        now = self._settled
        plain = noise is None and self._noise is None
        more = dataclasses.replace(now, taken=join_ranges(now.taken, ((first, end),)))

        def finish(error: BaseException) -> Contents:
            self._crew.rest()
            if plain:
                return dataclasses.replace(now, taken=self._crew.ranges)
            if isinstance(error, Exception):
                return now if self._noise is None else more
            raise error  # cells of some devices may be in no film

        with self._change("run", finish):
            if plain:
                finished = self._crew.run(self._crew.whole, ((first, end),), watch)
                self._contents = dataclasses.replace(now, taken=self._crew.ranges)
            else:
                if self._noise is None:
                    assert base is not None, "it begins with this run"
                    self._noise = self._adaptively(base, {})
                finished = self._noise.run((first, end, noise), watch)
                self._contents = more
        return finished

    def _tracer(self) -> Tracer:
        """Return what adds selections of samples to the films of all devices."""
        return CrewTracer(self._crew.first.renderer._wavefront, self._crew)

    @healing
    def reset(self, *, seed: int | None = None, first_sample: int | None = None) -> None:
        """Empty the film; the next sample is the first one again; see `Renderer.reset`."""

        def put(_: BaseException | None = None) -> Contents:
            self._crew.rest()
            self._on_each(lambda renderer: renderer.reset(seed=seed).wait())
            self._forget()
            self._crew.use_all_pixels()
            self._crew.clear_counts()
            if first_sample is not None:
                self._first_sample = first_sample
            return Contents()

        with self._healing("reset", put):
            self._contents = put()

    @synchronized
    def update(
        self,
        *,
        camera: Camera | None = None,
        materials: Mapping[MaterialKey, Material] | None = None,
        transforms: Mapping[ShapeKey, Any] | None = None,
        vertices: Mapping[ShapeKey, Any] | None = None,
        scene: Scene | None = None,
        motion: bool = False,
    ) -> None:
        """Bring what changed to all devices, and begin again at sample 0; see `Renderer.update`.

        Arrays are of numpy. The scene is lowered once for all devices.
        """
        shared = Once()

        def edit(renderer: SharingRenderer) -> None:
            renderer.shared = shared
            renderer.update(
                camera=camera, materials=materials, transforms=transforms, vertices=vertices,
                scene=scene, motion=motion,
            ).wait()  # fmt: skip

        self._begin_anew("update", edit)

    @synchronized
    def _follow(self, origin: Origin) -> None:
        """See `FilmRenderer._follow`."""
        if self._crew.first.renderer._other_way(origin) is None:
            return
        shared = Once()

        def follow(renderer: SharingRenderer) -> None:
            renderer.shared = shared
            renderer._follow(origin)

        self._begin_anew("load_state", follow)

    def _begin_anew(self, what: str, action: Callable[[SharingRenderer], None]) -> None:
        """Do something on every device that empties the film."""
        with self._change(what, heals=False) as change:
            with change.beginning_unless(Exception):
                self._on_each(action)
            self._forget()
            self._crew.clear_counts()
            self._contents = Contents()

    def close(self) -> None:
        """Give the memory of all devices back; see `Renderer.close`."""
        with self._lock:
            self._closed = True
            for worker in [*self._crew.workers, *(worker for worker, _ in self._crew.failed)]:
                worker.renderer.close()
            self._crew.workers, self._noise = [], None

    # ---- inside

    def _on_each(self, action: Callable[[SharingRenderer], Any]) -> None:
        """Do something on every device at once; drop those that fail, unless all do.

        Raises SceneError, TypeError as the first device does.
        """
        workers = list(self._crew.workers)
        results = where_it_works(lambda worker: action(worker.renderer), workers)
        for worker, result in zip(workers, results, strict=True):
            if isinstance(result, BaseException):
                worker.unsaved.clear()  # of the picture that ends
                self._crew.drop(worker, result)
