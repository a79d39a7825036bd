"""A renderer on several devices of this machine at once, and its maker."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from clpt import device as dev
from clpt.cluster.crew import Crew
from clpt.cluster.device_worker import DeviceWorker, device_names, results_where_possible
from clpt.cluster.host_maker import HostMaker, HostPlan
from clpt.errors import DeviceError, SceneError
from clpt.render.edit.plans import Plan
from clpt.render.film.state import FilmState, Ranges
from clpt.render.makers import planning
from clpt.render.makers.contents import Contents, Settle
from clpt.render.makers.device_film import DeviceFilm, Once, texture_budget_of
from clpt.render.makers.maker import Call, Held, Tick
from clpt.render.makers.planning import Changes
from clpt.render.options import RenderOptions, check_options, check_scene
from clpt.render.resumable import ResumableRenderer
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.tracer import Selection
from clpt.render.wavefront.wavefront import Counts, Wavefront
from clpt.scene import Scene
from clpt.scene.fingerprint import Plain

if TYPE_CHECKING:
    from typing_extensions import Unpack


class DevicesMaker(HostMaker):
    """Devices that share the samples, each with a film of its own.

    options: see `RenderOptions`. The first working device is the home. `Adaptive.keep` copies its
    noise estimates to the host after each call: after its failure the call starts again on the
    next device, which takes the same samples and makes the same decisions.
    """

    def __init__(self, scene: Scene, devices: Sequence[dev.Device], options: RenderOptions):
        self.start = time.perf_counter()
        if options.get("texture_budget") is None:
            options["texture_budget"] = min(texture_budget_of(device) for device in devices)
        share = Once()
        films = results_where_possible(
            lambda on: DeviceFilm(scene, on, options, share), list(devices)
        )
        workers, self._lost_at_first = [], list[str]()
        for name, result in zip(device_names(list(devices)), films, strict=True):
            if isinstance(result, DeviceFilm):
                workers.append(DeviceWorker(name, result))
            else:
                self._lost_at_first.append(f"{name} failed and is left out: {result}")
        self.crew = Crew(workers)

    # ---- state

    @property
    def home(self) -> DeviceFilm:
        """The first working device. Raises ClusterError if all have failed."""
        return self.crew.first.film

    @property
    def devices(self) -> tuple[dev.Device, ...]:
        """The working devices."""
        return tuple(worker.film.device for worker in self.crew.workers)

    @property
    def warnings(self) -> list[str]:
        """Warnings of the scene and of failed devices."""
        crew = self.crew
        failed = [f"{worker.name} failed and is left out: {error}" for worker, error in crew.failed]
        of_scene = crew.workers[0].film.warnings if crew.workers else []
        return [*of_scene, *self._lost_at_first, *failed]

    @property
    def counts(self) -> Counts:
        """Counts of all devices together."""
        return self.crew.counts

    @property
    def classes(self) -> tuple[Mapping[str, Plain], ...]:
        """The common class of all devices."""
        each = [worker.film.device_class() for worker in self.crew.workers]
        together = dict(self.home.device_class())
        for name in together:
            values = list(dict.fromkeys(str(properties[name]) for properties in each))
            if len(values) > 1:
                together[name] = " and ".join(values)
        return (together,)

    # ---- samples

    def prepare(self) -> None:
        """Run every kernel of `run` once on each device."""
        self._on_each(lambda film: film.wavefront.render_samples(0, 0))

    def begin(self, call: Call, now: Contents, more: Contents) -> Settle:
        """Return a function that completes the film; see `Maker`.

        The film holds the samples of all devices. With adaptive sampling an error leaves it as it
        was.
        """
        film, adaptive = self.crew.saved, more.adaptive
        state = {} if adaptive is None else adaptive.arrays()

        def settle(error: BaseException | None) -> Contents:
            self.crew.rest()
            if adaptive is None:
                return replace(now, taken=self.crew.ranges)
            if error is None:
                return more
            self.put(film)
            if self.crew.workers:
                adaptive.become(self.adaptively(state, 0))
            return now

        return settle

    def run(self, call: Call, adaptive: Adaptive | None, tick: Tick) -> bool:
        """Add samples to the film; return whether all were added.

        Raises ClusterError when the last device has failed: the film then holds the saved samples.
        """
        if adaptive is None:
            return self.add(self.crew.whole, call.first, call.end, tick)
        film, state = self.film, adaptive.arrays()
        while True:
            try:
                if adaptive.wavefront is not self.home.wavefront:
                    adaptive.become(self.adaptively(state, 0))
                finished = self._run_adaptively(call, adaptive, tick)
                self.gather()
                adaptive.keep()
                return finished
            except SceneError:
                raise
            except Exception as error:
                self._drop(adaptive.wavefront, error)
                self.put(film)

    def _run_adaptively(self, call: Call, adaptive: Adaptive, tick: Tick) -> bool:
        if call.noise is not None:
            return adaptive.run(call.end, call.noise, lambda _: tick())
        finished = self.add(self.crew.whole, call.first, call.end, tick)
        adaptive.skip(call.end)  # after a stop too: sample numbers are not reused
        return finished

    def add(self, selection: Selection, first: int, end: int, tick: Tick) -> bool:
        """Add samples first to end - 1 of a selection; return False after a stop."""
        return self.crew.run(selection, ((first, end),), tick)

    def use_all_pixels(self) -> None:
        """Let later calls sample every pixel."""
        self.crew.use_all_pixels()

    def adaptively(self, arrays: Mapping[str, NDArray[Any]], first: int) -> Adaptive:
        """Return adaptive sampling of the film, on the first working device."""
        while True:
            home = self.home
            try:
                adaptive = super().adaptively(arrays, first)
                adaptive.keep()
                return adaptive
            except SceneError:
                raise
            except Exception as error:
                self._drop(home.wavefront, error)

    # ---- the film

    @property
    def film(self) -> FilmState | None:  # type: ignore[override]
        """The film on the host."""
        return self.crew.saved

    @property
    def is_scattered(self) -> bool:
        """Whether devices hold samples that the host lacks."""
        return any(worker.unsaved for worker in self.crew.workers)

    def gather(self) -> None:
        """Add devices' films to the host's; samples of unreadable films are rendered again."""
        self.crew.save()

    def words(self, *names: str) -> FilmState:
        """Return the film after `gather`."""
        while True:
            if self.film is not None:
                return self.film
            home = self.home
            try:
                return home.no_words
            except Exception as error:
                self._drop(home.wavefront, error)

    def put(self, state: FilmState | None, counts: Counts | None = None) -> None:
        """Replace the film."""
        self.crew.put(state)
        if counts is not None:
            self.crew.count_from(counts)

    def shown(self) -> DeviceFilm:
        """Return the first device after it received the whole film."""
        while True:
            first, film = self.crew.first, self.film
            try:
                if film is not None:
                    first.show(film)
                return first.film
            except Exception as error:
                self.crew.drop(first, error)

    def hold(self, taken: Ranges) -> Held:
        """Let each device keep a copy of its film. Raises MemoryBudgetError."""
        if self.film is None and not self.is_scattered:
            return Held(lambda: self.words(), self.counts, taken)
        return self.crew.hold(taken)

    def empty(self, *, seed: int | None = None, recover: bool = False) -> None:
        """Empty all films; an error at any line may have left them in any state."""
        crew = self.crew
        crew.rest()
        self._on_each(lambda film: film.empty(seed=seed, recover=True))
        crew.put(None)
        crew.use_all_pixels()
        crew.count_from(Counts())

    def plan(self, changes: Changes, events: dev.Events = None) -> Plan:
        """Return the plan of a changed scene, which is lowered once for all devices."""
        return HostPlan(self, changes, events)

    def write(self, changes: Changes, events: dev.Events) -> None:
        """Change the scene on all devices at once."""
        share = Once()

        def write(film: DeviceFilm) -> None:
            plan = planning.plan(film, changes, events, share)
            if plan is not None:
                plan.write()

        self._on_each(write)

    def close(self) -> None:
        """Free the memory of all devices."""
        for worker in [*self.crew.workers, *(worker for worker, _ in self.crew.failed)]:
            worker.film.close()

    # ---- inside

    def _drop(self, wavefront: Wavefront, error: BaseException) -> None:
        """Remove a failed device. Raises the error where no other device works."""
        for worker in list(self.crew.workers):
            if worker.film.wavefront is wavefront:
                self.crew.drop(worker, error)
        if not self.crew.workers:
            raise error

    def _on_each(self, action: Callable[[DeviceFilm], Any]) -> None:
        """Run an action on all devices in parallel; drop devices that fail, unless all fail.

        Raises the first SceneError or TypeError.
        """
        workers = list(self.crew.workers)
        results = results_where_possible(lambda worker: action(worker.film), workers)
        for worker, result in zip(workers, results, strict=True):
            if isinstance(result, BaseException):
                worker.unsaved.clear()  # they belong to the former picture
                self.crew.drop(worker, result)


@dataclass(frozen=True)
class DeviceShare:
    """A device's part in a picture.

    name: of the device; share: of all paths, 0 to 1; rate: of paths [1/s]; failure: the error of a
    failed device, None otherwise.
    """

    name: str
    share: float
    rate: float
    failure: str | None


class MultiRenderer(ResumableRenderer):
    """Renders a scene on several devices; its picture so far is available between runs.

    devices: "all", "gpu", or names or indexes as `clpt.device.choose_all` takes them, and
    clpt.device.Device objects. options: see `RenderOptions`, without `queue`; `threads` counts for
    each CPU. If all devices have the same class, as two equal GPUs do, the film equals that of a
    `Renderer` to the bit: the samples are the same on every device.

    A device that fails is left out, with a warning in `warnings` and in the log, and the others
    render its samples. The class has the methods of `Renderer` except `step`, which returns before
    devices have shared out samples. `film` is memory of the first device, which holds the picture
    until the next run.

    Raises like `Renderer`; also DeviceError if a device is named twice, and SceneError for arrays
    in a device's memory.
    """

    _maker: DevicesMaker

    def __init__(
        self,
        scene: Scene,
        devices: str | Iterable[dev.Device | str | int] = "all",
        **options: Unpack[RenderOptions],
    ):
        check_scene(scene)
        check_options(scene, options)
        if options.pop("queue", None) is not None:
            raise DeviceError("a queue is of one device; give a Renderer the queue")
        threads, profiling = options.pop("threads", None), options.get("profiling", False)
        chosen = dev.choose_all(devices, profiling=profiling, threads=threads)
        maker = DevicesMaker(scene, chosen, options)
        super().__init__(maker, options.get("denoise"), options.get("first_sample") or 0)

    @property
    def shares(self) -> tuple[DeviceShare, ...]:
        """The part of each device in the picture so far, failed devices last."""
        crew = self._maker.crew
        failed = {id(worker): str(error) for worker, error in crew.failed}
        workers = [*crew.workers, *(worker for worker, _ in crew.failed)]
        paths = max(sum(worker.paths for worker in workers), 1)
        return tuple(
            DeviceShare(worker.name, worker.paths / paths, worker.rate, failed.get(id(worker)))
            for worker in workers
        )
