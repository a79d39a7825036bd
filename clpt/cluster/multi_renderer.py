"""A renderer on several devices of this machine at once."""

from __future__ import annotations

import dataclasses
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from numpy.typing import NDArray

from clpt import device as dev
from clpt.cluster.crew import Crew, LostPicture
from clpt.cluster.device_worker import DeviceWorker, Job, Once, SharingRenderer
from clpt.cluster.multi_resumable import MultiResumable
from clpt.errors import DeviceError, SceneError
from clpt.render.editing.scene_edit import MaterialKey, ShapeKey
from clpt.render.options import RenderOptions, check_options, check_scene
from clpt.render.pictures import Image
from clpt.render.progress import Progress
from clpt.render.renderer import next_range, texture_budget_of
from clpt.render.saved_film import SavedFilm
from clpt.render.stats import RenderStats
from clpt.render.wavefront import adaptive
from clpt.render.wavefront.film_state import FilmState, Ranges, join_ranges
from clpt.render.wavefront.tracer import Tracer
from clpt.render.wavefront.wavefront import Counts, Wavefront
from clpt.render.wavefront.work_list import PixelIndices
from clpt.scene import Scene
from clpt.scene.cameras import Camera
from clpt.scene.fingerprint import Plain
from clpt.scene.materials import Material

if TYPE_CHECKING:
    from typing_extensions import Unpack

Call = tuple[int, int, float | None]
Calls = list[Call]
Arrays = Mapping[str, NDArray[Any]]
_Result = TypeVar("_Result")


@dataclass(frozen=True)
class DeviceShare:
    """What a device has done for a picture.

    name: of the device; share: of all paths, 0 to 1; rate: of paths [1/s]; failure: why it was left
    out, None where it was not.
    """

    name: str
    share: float
    rate: float
    failure: str | None


@dataclass
class _Noise:
    """Adaptive sampling on the first device, with the help of the others.

    base: the film before; arrays: the state then, see `Adaptive.arrays`; calls: of `run` since,
    first, end and noise, None for all pixels.
    """

    adaptive: adaptive.Adaptive
    base: FilmState
    calls: Calls
    arrays: Arrays


class MultiRenderer(MultiResumable):
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
        self._start = time.perf_counter()
        check_scene(scene)
        check_options(scene, options)
        if options.pop("queue", None) is not None:
            raise DeviceError("a queue is of one device; give a Renderer the queue")
        threads, profiling = options.pop("threads", None), options.get("profiling", False)
        chosen = dev.choose_all(devices, profiling=profiling, threads=threads)
        self._first_sample = options.pop("first_sample", 0) or 0
        if options.get("texture_budget") is None:
            options["texture_budget"] = min(texture_budget_of(device) for device in chosen)
        self._stop = threading.Event()
        shared, warnings = Once(), list[str]()

        def make(device: dev.Device) -> SharingRenderer:
            return SharingRenderer(scene, device, shared, **options)

        names = _names(chosen)
        made = _on_all(make, chosen)
        workers = []
        for name, result in zip(names, made, strict=True):
            if isinstance(result, SharingRenderer):
                workers.append(DeviceWorker(name, result))
            else:
                warnings.append(f"{name} failed and is left out: {result}")
        self._crew = Crew(workers, self._stop)
        self._lost_at_first = warnings
        self.channels = workers[0].renderer.channels
        self._taken: Ranges = ()
        self._noise: _Noise | None = None
        self._seconds: dict[str, float] = {}
        self._telling = False

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

    def device_class(self) -> dict[str, Plain]:
        """Return what decides the last bits of samples, of all devices; see `Renderer`."""
        first = self._crew.first.renderer.device_class()
        each = [worker.renderer.device_class() for worker in self._crew.workers]
        for name in first:
            values = list(dict.fromkeys(str(one[name]) for one in each))
            if len(values) > 1:
                first[name] = " and ".join(values)
        return first

    @property
    def shares(self) -> tuple[DeviceShare, ...]:
        """What each device has done so far, those that failed last."""
        failed = {id(worker): str(error) for worker, error in self._crew.failed}
        workers = [*self._crew.workers, *(worker for worker, _ in self._crew.failed)]
        paths = max(sum(worker.paths for worker in workers), 1)
        return tuple(
            DeviceShare(one.name, one.paths / paths, one.rate, failed.get(id(one)))
            for one in workers
        )

    @property
    def warnings(self) -> list[str]:
        """Of the scene, and of devices that failed."""
        crew = self._crew
        failed = [f"{worker.name} failed and is left out: {error}" for worker, error in crew.failed]
        of_scene = crew.workers[0].renderer.warnings if crew.workers else []
        return [*of_scene, *self._lost_at_first, *failed]

    @property
    def counts(self) -> tuple[Counts, ...]:
        """What has happened so far, of each film; see `Renderer.counts`."""
        return self._crew.counts

    @property
    def stats(self) -> RenderStats:
        """Figures of the first device; see `Renderer.stats`."""
        stats = self._crew.first.renderer.stats
        return dataclasses.replace(stats, seconds={**stats.seconds, **self._seconds})

    @property
    def samples(self) -> int:
        """The number of the next sample; see `Renderer.samples`."""
        return self._taken[-1][1] if self._taken else self._first_sample

    @property
    def active(self) -> float:
        """The share of the pixels that would get more samples; see `Renderer.active`."""
        return 1.0 if self._noise is None else self._noise.adaptive.active

    # ---- rendering

    def prepare(self) -> None:
        """Run every kernel of `run` once on each device; see `Renderer.prepare`."""
        with self._lock:
            self._on_each(lambda renderer: renderer.prepare())

    def run(
        self,
        samples: int,
        progress: Callable[[Progress], bool | None] | None = None,
        *,
        noise: float | None = None,
    ) -> bool:
        """Add samples to every pixel and wait; see `Renderer.run`.

        progress is called in this thread; it cannot ask for the picture. Raises ClusterError too,
        when the last device has failed: `film_state` then has the samples that were saved.
        """
        with self._lock:
            self._check_open()
            first, end = next_range(self.samples, samples)
            if self._stop.is_set():  # before it began: nothing is taken
                self._stop.clear()
                return False
            if noise is not None:
                noise = adaptive.checked(noise, self._crew.first.renderer.wavefronts[0].features)
            raised: list[BaseException] = []
            tick = self._ticker(end, progress, raised)
            finished, began = False, time.perf_counter()
            try:
                if noise is None and self._noise is None:
                    finished = self._crew.run(self._whole_job, ((first, end),), tick)
                else:
                    finished = self._run_adaptively((first, end, noise), tick)
            finally:
                self._stop.clear()
                self._seconds_rendered += time.perf_counter() - began
                if self._noise is None:
                    self._taken = self._crew.ranges
                else:
                    self._taken = join_ranges(self._taken, ((first, end),))
            if raised:
                raise raised.pop()
            return finished

    def cancel(self) -> None:
        """Let the `run` of another thread, or else the next one, stop soon and return False."""
        self._stop.set()

    def reset(self, *, seed: int | None = None, first_sample: int | None = None) -> None:
        """Empty the film; the next sample is the first one again; see `Renderer.reset`."""
        with self._lock:
            self._check_open()
            self._on_each(lambda renderer: renderer.reset(seed=seed).wait())
            self._forget()
            self._crew.clear_counts()
            if first_sample is not None:
                self._first_sample = first_sample

    def update(
        self,
        *,
        camera: Camera | None = None,
        materials: Mapping[MaterialKey, Material] | None = None,
        transforms: Mapping[ShapeKey, Any] | None = None,
        vertices: Mapping[ShapeKey, Any] | None = None,
        scene: Scene | None = None,
    ) -> None:
        """Bring what changed to all devices, and begin again at sample 0; see `Renderer.update`.

        Arrays are of numpy. The scene is lowered once for all devices.
        """
        with self._lock:
            self._check_open()
            shared = Once()

            def change(renderer: SharingRenderer) -> None:
                renderer.shared = shared
                renderer.update(
                    camera=camera, materials=materials, transforms=transforms, vertices=vertices,
                    scene=scene,
                ).wait()  # fmt: skip

            self._on_each(change)
            self._forget()
            self._crew.clear_counts()

    # ---- the film

    def film_state(self) -> FilmState:
        """Return the film of all devices, as whole numbers; see `Renderer.film_state`.

        When all devices have failed it is what was saved of them.
        """
        with self._lock:
            self._check_open()
            if self._noise is not None and not self._crew.workers:
                return self._noise.base
            if self._noise is not None:
                state = self._on_first(lambda first: first.renderer.film_state())
                return dataclasses.replace(state, taken=self._taken)
            if self._crew.workers:
                self._crew.save()
            if self._crew.saved is not None:
                return self._crew.saved
            return self._on_first(lambda first: first.renderer.film_state())

    def merge(self, state: FilmState) -> None:
        """Add the samples of another film of the same scene to this one; see `Renderer.merge`."""
        with self._lock:
            merged = self.film_state().merged(state)
            self._forget()
            self._crew.saved, self._crew.saved_ranges = merged, merged.taken
            self._taken = merged.taken

    @property
    def wavefronts(self) -> list[Wavefront]:  # type: ignore[override]
        """Those of the first device, whose films then hold the picture of all."""
        with self._lock:
            self._check_open()
            return self._on_first(lambda first: first.renderer.wavefronts)

    def image(self) -> Image:
        """The picture so far of all devices; see `Renderer.image`."""
        return self._on_first(lambda first: first.renderer.image())

    def colours(self) -> Image:
        """The picture so far in three colours, (h, w, 3) float32, also of a film with bands."""
        return self._on_first(lambda first: first.renderer.colours())

    def layers(self) -> dict[str, Image]:
        """The values of the `aov` integrator by name, (h, w, 1 to 3) float32."""
        return self._on_first(lambda first: first.renderer.layers())

    def halves(self) -> tuple[Image, Image]:
        """Return the pictures of the even and of the odd samples; see `Renderer.halves`."""
        return self._on_first(lambda first: first.renderer.halves())

    def close(self) -> None:
        """Give the memory of all devices back; see `Renderer.close`."""
        with self._lock:
            self._closed = True
            for worker in [*self._crew.workers, *(worker for worker, _ in self._crew.failed)]:
                worker.renderer.close()
            self._crew.workers, self._noise = [], None

    def __enter__(self) -> MultiRenderer:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    # ---- inside

    @property
    def _adaptive(self) -> adaptive.Adaptive | None:
        return None if self._noise is None else self._noise.adaptive

    def _go_on(self, state: FilmState, saved: SavedFilm) -> None:
        """Take the place of what there is by a film; the first device's counts are the film's."""
        crew = self._crew
        crew.keeper, self._noise = None, None
        crew.lost.clear()
        crew.empty(worker for worker in crew.workers if worker is not crew.first)
        crew.first.unsaved, crew.first.shows = [], True
        crew.clear_counts()
        self._taken = state.taken
        if saved.adaptive:
            self._begin_adaptively(state, [], saved.adaptive)
        else:
            crew.saved, crew.saved_ranges = state, state.taken

    def _check_open(self) -> None:
        if self._closed:
            raise DeviceError("this MultiRenderer is closed; make another one")
        if self._telling:
            raise DeviceError("devices are at work; the picture is there when the run has ended")

    def _forget(self) -> None:
        """Note that all films are empty."""
        self._crew.empty(self._crew.workers)
        self._crew.saved, self._crew.saved_ranges, self._crew.keeper = None, (), None
        self._crew.lost.clear()
        self._taken, self._noise = (), None
        self._held, self._sessions, self._seconds_rendered = None, (), 0.0

    @property
    def _whole_job(self) -> Job:
        """Samples of all pixels."""
        return Job(Wavefront.render_samples, self._crew.first.renderer.wavefronts[0].paths.pixels)

    def _ticker(
        self,
        end: int,
        progress: Callable[[Progress], bool | None] | None,
        raised: list[BaseException],
    ) -> Callable[[], bool]:
        """Return what is called while devices work: it returns whether they go on."""
        began = time.perf_counter()
        pixels = self._whole_job.paths * len(self.channels or (None,))

        def tick() -> bool:
            counts = self._crew.counts
            paths, rays = sum(c.samples for c in counts), sum(c.rays for c in counts)
            now = time.perf_counter()
            if paths:
                self._seconds.setdefault("first_sample", now - self._start)
            if raised or self._stop.is_set() or progress is None:
                return not raised and not self._stop.is_set()
            self._telling = True
            try:
                so_far = Progress(paths / pixels, end, paths, rays, now - began, self.active)
                return progress(so_far) is not False
            except BaseException as error:
                raised.append(error)
                return False
            finally:
                self._telling = False

        return tick

    def _on_each(self, action: Callable[[SharingRenderer], Any]) -> None:
        """Do something on every device at once; drop those that fail, unless all do.

        Raises SceneError, TypeError as the first device does.
        """
        workers = list(self._crew.workers)
        results = _on_all(lambda worker: action(worker.renderer), workers)
        for worker, result in zip(workers, results, strict=True):
            if isinstance(result, Exception):
                worker.unsaved.clear()  # of the picture that ends
                self._crew.drop(worker, result)

    def _on_first(self, action: Callable[[DeviceWorker], _Result]) -> _Result:
        """Do something on the first device, whose film holds the picture; or else on the next."""
        with self._lock:
            self._check_open()
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
        while self._noise is not None:
            try:
                self._restart_if_lost(lambda: True)
                self._gather()
                return crew.first
            except LostPicture:
                continue
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

    # ---- noise

    def _run_adaptively(self, call: Call, tick: Callable[[], bool]) -> bool:
        """Add samples to the pixels with noise, or to all; return whether it was not stopped.

        What the first device has of it cannot be done by others alone: when it fails, all begins
        again on the next one, which takes the same samples and comes to the same decisions.
        """
        if self._noise is None:
            base = self.film_state()
            self._begin_adaptively(base, [], {})
        while True:
            try:
                if not self._restart_if_lost(tick):
                    return False
                finished = self._call(call, tick)
                break
            except LostPicture:
                continue
        assert self._noise is not None
        self._noise.calls.append(call)
        return finished

    def _begin_adaptively(self, base: FilmState, calls: Calls, arrays: Arrays) -> None:
        """Begin adaptive sampling on the first device, over a film; calls, arrays: see `_Noise`."""
        crew = self._crew
        while True:
            crew.empty(crew.workers)
            first = crew.first
            try:
                first.show(base)
                wavefront = first.renderer.wavefronts[0]
                begun = adaptive.Adaptive(wavefront, _CrewTracer(wavefront, self))
                if arrays:
                    begun.restore(arrays)
                break
            except Exception as error:
                crew.drop(first, error)
        if not arrays:
            begun.skip(base.taken[-1][1] if base.taken else self._first_sample)
        crew.keeper = first
        self._noise = _Noise(begun, base, calls, arrays)

    def _restart_if_lost(self, tick: Callable[[], bool]) -> bool:
        """Begin again where the first device has failed; return whether it was not stopped."""
        noise, crew = self._noise, self._crew
        assert noise is not None, "adaptive sampling has begun"
        if crew.keeper in crew.workers:
            return True
        crew.lost.clear()
        crew.keeper = None
        self._begin_adaptively(noise.base, noise.calls, noise.arrays)
        return all(self._call(call, tick) for call in noise.calls)

    def _call(self, call: Call, tick: Callable[[], bool]) -> bool:
        """What one `run` adds. Raises LostPicture when the first device fails."""
        first, end, noise = call
        crew, adaptively = self._crew, self._noise
        assert adaptively is not None
        keeper = crew.first
        try:
            if noise is not None:
                return adaptively.adaptive.run(end, noise, lambda _: tick())
            finished = crew.run(self._whole_job, ((first, end),), tick)
            if finished:
                adaptively.adaptive.skip(end)
            return finished
        except (LostPicture, SceneError):
            raise
        except Exception as error:
            if not crew.workers:
                raise
            crew.drop(keeper, error)
            raise LostPicture from error

    def _gather(self) -> None:
        """Add what other devices hold to the film of the first. Raises LostPicture."""
        crew = self._crew
        while True:
            helpers = [w for w in crew.workers if w.unsaved and w is not crew.keeper]
            if not helpers and not crew.lost:
                break
            for worker in helpers:
                jobs = list(worker.unsaved)
                try:
                    state = worker.take()
                except Exception as error:
                    worker.unsaved = jobs
                    crew.drop(worker, error)
                    continue
                self._add_to_first(state)
            if crew.lost and not crew.repeat(lambda: True):
                crew.lost.clear()
        crew.first.unsaved.clear()

    def _add_to_first(self, state: FilmState) -> None:
        """Add a film to that of the first device. Raises LostPicture."""
        keeper = self._crew.first
        try:
            own = keeper.renderer.film_state()
            keeper.show(
                dataclasses.replace(own, taken=()).merged(dataclasses.replace(state, taken=()))
            )
        except Exception as error:
            self._crew.drop(keeper, error)
            raise LostPicture from error


class _CrewTracer(Tracer):
    """Adds samples with the help of all devices."""

    def __init__(self, wavefront: Wavefront, renderer: MultiRenderer):
        super().__init__(wavefront)
        self.renderer = renderer

    def from_camera(
        self,
        pixels: PixelIndices,
        ends: PixelIndices,
        first: int,
        end: int,
        on_batch: adaptive.OnBatch,
    ) -> bool:
        """Add samples first to end - 1 of these pixels, of each before its own of `ends`."""
        return self._run(Wavefront.render_from_camera, pixels, ends, first, end, on_batch)

    def from_lights(
        self, pixels: PixelIndices, first: int, end: int, on_batch: adaptive.OnBatch
    ) -> bool:
        """Add the light paths of samples first to end - 1; pixels: all of the picture."""
        return self._run(Wavefront.render_from_lights, pixels, None, first, end, on_batch)

    def guides(
        self, pixels: PixelIndices, first: int, end: int, on_batch: adaptive.OnBatch
    ) -> bool:
        """As `from_lights`, and leave the film's picture as it is."""
        return self._run(Wavefront.trace_from_lights, pixels, None, first, end, on_batch)

    def gather(self) -> None:
        """Let the film hold all that was added so far."""
        self.renderer._gather()

    def discard(self) -> None:
        """Forget what was added since `gather`."""
        crew = self.renderer._crew
        crew.lost.clear()
        crew.empty(w for w in crew.workers if w.unsaved and w is not crew.keeper)
        for worker in crew.workers:
            worker.unsaved = []

    def use_all_pixels(self, pixels: PixelIndices) -> None:
        """Let later renders sample every pixel; pixels: all of the picture."""
        crew = self.renderer._crew
        for worker in list(crew.workers):
            try:
                worker.renderer.wavefronts[0].paths.set_work_list(pixels)
            except Exception as error:
                crew.drop(worker, error)

    def _run(
        self,
        do: Callable[..., bool],
        pixels: PixelIndices,
        ends: PixelIndices | None,
        first: int,
        end: int,
        on_batch: adaptive.OnBatch,
    ) -> bool:
        def prepare(wavefront: Wavefront) -> None:
            wavefront.paths.set_work_list(pixels, ends)

        job = Job(do, len(pixels), prepare)
        return self.renderer._crew.run(job, ((first, end),), lambda: on_batch(None))


def _names(devices: list[dev.Device]) -> list[str]:
    """What devices are called: those with one label get a number."""
    labels = [device.info.label for device in devices]
    return [
        f"{label} #{labels[: i + 1].count(label)}" if labels.count(label) > 1 else label
        for i, label in enumerate(labels)
    ]


def _on_all(action: Callable[[Any], Any], items: list[Any]) -> list[Any]:
    """Do something with every item at once; return the results, for some of them exceptions.

    Raises what was raised for the first item, if it is bad input or if all failed.
    """

    def tried(item: Any) -> Any:
        try:
            return action(item)
        except Exception as error:
            return error

    with ThreadPoolExecutor(len(items)) as pool:
        results = list(pool.map(tried, items))
    errors = [result for result in results if isinstance(result, Exception)]
    for error in errors:
        if isinstance(error, (SceneError, TypeError)):
            raise error
    if len(errors) == len(items):
        raise errors[0]
    return results
