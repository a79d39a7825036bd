"""Several devices of this machine that take the samples of one film."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from numpy.typing import NDArray

from clpt import device as dev
from clpt.cluster.crew import Crew
from clpt.cluster.device_worker import DeviceWorker, Once, device_names, where_it_works
from clpt.cluster.host_maker import HostMaker
from clpt.errors import SceneError
from clpt.render.film.state import FilmState, Ranges
from clpt.render.makers.contents import Contents
from clpt.render.makers.device_film import Apply, Changes, DeviceFilm, texture_budget_of
from clpt.render.makers.maker import Call, Held, Settle
from clpt.render.options import RenderOptions
from clpt.render.wavefront.adaptive import Adaptive
from clpt.render.wavefront.tracer import Selection
from clpt.render.wavefront.wavefront import Counts, Wavefront
from clpt.scene import Scene
from clpt.scene.fingerprint import Plain
from clpt.scene.integrators import Integrator


class DevicesMaker(HostMaker):
    """Devices that share the samples, each with a film of its own.

    options: see `RenderOptions`. The first device that has not failed is the home. What it knows of
    noise is kept on the host after each call, by `Adaptive.keep`: where it fails, the call begins
    again on the next one, which takes the same samples and comes to the same decisions.
    """

    def __init__(self, scene: Scene, devices: Sequence[dev.Device], options: RenderOptions):
        self.start = time.perf_counter()
        if options.get("texture_budget") is None:
            options["texture_budget"] = min(texture_budget_of(device) for device in devices)
        share = Once()
        made = where_it_works(lambda on: DeviceFilm(scene, on, options, share), list(devices))
        workers, self._lost_at_first = [], list[str]()
        for name, result in zip(device_names(list(devices)), made, strict=True):
            if isinstance(result, DeviceFilm):
                workers.append(DeviceWorker(name, result))
            else:
                self._lost_at_first.append(f"{name} failed and is left out: {result}")
        self.crew = Crew(workers)

    # ---- what there is

    @property
    def home(self) -> DeviceFilm:
        """The first device that has not failed. Raises ClusterError if all have."""
        return self.crew.first.film

    @property
    def devices(self) -> tuple[dev.Device, ...]:
        """The devices that have not failed."""
        return tuple(worker.film.device for worker in self.crew.workers)

    @property
    def warnings(self) -> list[str]:
        """Warnings of the scene, and one of each device that failed."""
        crew = self.crew
        failed = [f"{worker.name} failed and is left out: {error}" for worker, error in crew.failed]
        of_scene = crew.workers[0].film.warnings if crew.workers else []
        return [*of_scene, *self._lost_at_first, *failed]

    @property
    def counts(self) -> Counts:
        """Counts of all devices so far."""
        return self.crew.counts

    @property
    def classes(self) -> tuple[Mapping[str, Plain], ...]:
        """The class of all devices together."""
        each = [worker.film.device_class() for worker in self.crew.workers]
        together = dict(self.home.device_class())
        for name in together:
            values = list(dict.fromkeys(str(one[name]) for one in each))
            if len(values) > 1:
                together[name] = " and ".join(values)
        return (together,)

    # ---- samples

    def prepare(self) -> None:
        """Run every kernel of `run` once on each device."""
        self._on_each(lambda one: one.wavefront.render_samples(0, 0))

    def begin(self, call: Call, now: Contents, more: Contents) -> Settle:
        """Return what makes the film whole; see `Maker`.

        The film holds what devices took. With adaptive sampling an error leaves it as it was.
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

    def run(self, call: Call, adaptive: Adaptive | None, tick: Callable[[], bool]) -> bool:
        """Add samples to the film; return whether all were added.

        Raises ClusterError when the last device has failed: the film has what was saved of it.
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

    def _run_adaptively(self, call: Call, adaptive: Adaptive, tick: Callable[[], bool]) -> bool:
        if call.noise is not None:
            return adaptive.run(call.end, call.noise, lambda _: tick())
        finished = self.add(self.crew.whole, call.first, call.end, tick)
        adaptive.skip(call.end)  # after a stop too: numbers are not used again
        return finished

    def add(self, selection: Selection, first: int, end: int, tick: Callable[[], bool]) -> bool:
        """Add samples first to end - 1 of a selection; return whether it was not stopped."""
        return self.crew.run(selection, ((first, end),), tick)

    def use_all_pixels(self) -> None:
        """Let later calls sample every pixel."""
        self.crew.use_all_pixels()

    def adaptively(self, arrays: Mapping[str, NDArray[Any]], first: int) -> Adaptive:
        """Return adaptive sampling of the film, on the first device where it works."""
        while True:
            home = self.home
            try:
                begun = super().adaptively(arrays, first)
                begun.keep()
                return begun
            except SceneError:
                raise
            except Exception as error:
                self._drop(home.wavefront, error)

    # ---- the film

    @property
    def film(self) -> FilmState | None:  # type: ignore[override]
        """The film of all that has come to the host."""
        return self.crew.saved

    @property
    def is_scattered(self) -> bool:
        """Whether devices have samples that the host has not."""
        return any(worker.unsaved for worker in self.crew.workers)

    def gather(self) -> None:
        """Bring what devices have to the host; others do again what cannot be read."""
        self.crew.save()

    def words(self, *names: str) -> FilmState:
        """Return the film, whose parts are together."""
        while True:
            if self.film is not None:
                return self.film
            home = self.home
            try:
                return home.no_words
            except Exception as error:
                self._drop(home.wavefront, error)

    def put(self, state: FilmState | None, counts: Counts | None = None) -> None:
        """Let the film be another one."""
        self.crew.put(state)
        if counts is not None:
            self.crew.count_from(counts)

    def shown(self) -> DeviceFilm:
        """Return the first device, whose own film is now the whole one."""
        while True:
            first, film = self.crew.first, self.film
            try:
                if film is not None:
                    first.show(film)
                return first.film
            except Exception as error:
                self.crew.drop(first, error)

    def hold(self, taken: Ranges) -> Held:
        """Let each device keep a copy of what only it has. Raises MemoryBudgetError."""
        if self.film is None and not self.is_scattered:
            return Held(lambda: self.words(), self.counts, taken)
        return self.crew.hold(taken)

    def empty(self, *, seed: int | None = None, recover: bool = False) -> None:
        """Let all films be empty; an error at any line may have left them as they are."""
        crew = self.crew
        crew.rest()
        self._on_each(lambda one: one.empty(seed=seed, recover=True))
        crew.put(None)
        crew.use_all_pixels()
        crew.count_from(Counts())

    def update(self, changes: Changes, events: dev.Events, apply: Apply) -> None:
        """Render another scene from now on, which is lowered once for all devices."""
        share = Once()
        self._write(lambda one: one.update(changes, events, _written, share), apply)

    def follow(self, way: Integrator, apply: Apply) -> None:
        """Render in another way, which made a film that is gone on with."""
        share = Once()
        self._write(lambda one: one.follow(way, _written, share), apply)

    def _write(self, action: Callable[[DeviceFilm], None], apply: Apply) -> None:
        """Change the scene on every device at once."""
        apply(lambda: self._on_each(action), refusals=(Exception,))

    def close(self) -> None:
        """Give the memory of all devices back."""
        for worker in [*self.crew.workers, *(worker for worker, _ in self.crew.failed)]:
            worker.film.close()

    # ---- inside

    def _drop(self, wavefront: Wavefront, error: BaseException) -> None:
        """Leave a device out from now on. Raises the error where no other is left."""
        for worker in list(self.crew.workers):
            if worker.film.wavefront is wavefront:
                self.crew.drop(worker, error)
        if not self.crew.workers:
            raise error

    def _on_each(self, action: Callable[[DeviceFilm], Any]) -> None:
        """Do something on every device at once; drop those that fail, unless all do.

        Raises SceneError, TypeError as the first device does.
        """
        workers = list(self.crew.workers)
        results = where_it_works(lambda worker: action(worker.film), workers)
        for worker, result in zip(workers, results, strict=True):
            if isinstance(result, BaseException):
                worker.unsaved.clear()  # of the picture that ends
                self.crew.drop(worker, result)


def _written(write: Callable[[], None], *, again: bool = False) -> None:
    """Write what changes on a device, within the change of all devices."""
    write()
