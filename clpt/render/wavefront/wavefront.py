"""The wavefront: paths in flight that go through the stages, and the film that they fill.

A slot owns its pixels and regenerates its path as soon as that ends, so the device stays full at
any depth. Where paths start at lights beside those from the camera, they take turns in the slots.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import bvh, device
from clpt.arrays import Words
from clpt.device.stream import Timings
from clpt.render.film.state import SAMPLES_WORD
from clpt.render.flow import programs
from clpt.render.flow.scene_to_tables import Lowered
from clpt.render.records import Features
from clpt.render.wavefront import strategy
from clpt.render.wavefront.bounce_loop import BounceLoop, Ending, Kernels, OnBatch, Step
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.render.wavefront.film import Film
from clpt.render.wavefront.light_caches import Guide, Photons
from clpt.render.wavefront.path_buffers import COUNTERS, PathBuffers, divide_film
from clpt.render.wavefront.strategy import UNTUNED, Strategy, Tuning

log = logging.getLogger(__name__)

TURN_SAMPLES = 16  # of a pixel, that each kind of paths takes at a turn; a small film gets more
TURN_PATHS = 1 << 20


@dataclass(frozen=True)
class Counts:
    """Counts so far: samples put on the film, rays traced, samples that the film refused.

    rejected: samples that were not finite, or brighter than a film takes; full: how often a sum of
    a pixel was found near the end of its range.
    """

    samples: int = 0
    closest: int = 0
    shadow: int = 0
    rejected: int = 0
    full: int = 0

    @property
    def rays(self) -> int:
        return self.closest + self.shadow

    def plus(self, other: Counts) -> Counts:
        """Return the sums of both counts."""
        return Counts(**{name: value + vars(other)[name] for name, value in vars(self).items()})


class Wavefront:
    """A film of a scene on a device, and `render_samples`, which runs the bounce loop.

    scene, paths: what is on the device; looped: whether a kernel on the device runs the loop;
    tuning: for the strategies of other lowerings.

    counts: of rays and samples; begun: whether paths may have begun since someone set it to False;
    leave: a flag. When it is raised, `render_samples` and the like return as soon as the device
    can, with paths in flight: their on_batch must raise an error then, and the film is incomplete.

    Raises MemoryBudgetError, KernelBuildError, DeviceError.
    """

    def __init__(self, scene: DeviceScene, paths: PathBuffers, looped: bool, tuning: Tuning):
        self.device, self.stream, self.buffers = scene.device, scene.stream, scene.buffers
        self.scene, self.paths, self.looped = scene, paths, looped
        self._tuning, self.lanes = tuning, self.device.lanes
        self.timings = Timings(self.device.queue)
        features = self.features
        self.film = film = Film(self.stream, self.buffers, paths.settings, features)
        merged, guided = features.transport.merged, features.transport.guided
        photons = Photons(self.stream, self.buffers, paths.settings) if merged else None
        guide = Guide(self.stream, paths) if guided else None
        self.photons, self.guide = photons, guide
        stores = [store for store in (photons, guide) if store is not None]
        self.kernels = Kernels(self.device, (scene, paths, film, *stores))
        self.leave, pause = device.Flag(self.device), device.Flag(self.device)
        self.begun = False
        self._in_flight: BounceLoop | None = None  # whose paths may not have ended
        self._counted = np.zeros(len(COUNTERS), np.uint64), Counts()  # read last, and what it gives
        self.loops = [
            BounceLoop(
                self.kernels, scene, paths, self.timings, looped, which,
                Ending(pause, None if guide and which == 0 else self.leave, tuning.cancel_seconds),
            )
            for which in range(len(features.passes))
        ]  # fmt: skip
        self._trainer = self.loops.pop(0) if guide else None  # of the guide
        self._bind_film()
        self.clear()

    @classmethod
    def create(
        cls,
        on: device.Device,
        lowered: Lowered,
        tuning: Tuning = UNTUNED,
        *,
        slots: int | None = None,
        trees: bvh.Quality | DeviceScene = "high",
        halves: bool = False,
    ) -> Wavefront:
        """Return a wavefront of a lowered scene, which others may render too.

        slots: paths in flight; None suits the device. trees: see `DeviceScene`. halves: whether
        even and odd samples are kept apart.

        Raises as `Wavefront` does, SceneError for a layout that cannot hold the scene.
        """
        chosen = strategy.choose(on, lowered, tuning)
        looped = strategy.use_loop(on) if tuning.looped is None else tuning.looped
        if looped:  # beside the trees
            texts = programs.loop_sources(
                lowered.features, chosen.layout, on.lanes, chosen.interleaved
            )
            device.compile_ahead(on, texts, "loop")
        stream, buffers = device.Stream(on.queue), device.Buffers(on)
        padded_pixels = int(lowered.settings["padded_pixels"])
        footprint = lowered.features.footprint_words
        divided = divide_film(
            on.info, padded_pixels, buffers.limit, slots, looped, halves, footprint
        )
        if "variance" in lowered.features.film.layers.names:
            divided = replace(divided, octaves=2)
        scene = DeviceScene(stream, buffers, lowered, chosen, trees)
        share = strategy.loop_share(on)
        blocks = (
            -(-divided.total // share) * on.lanes if share > on.lanes else 0
        )  # a block for each work-item
        in_flight = PathBuffers(
            stream, buffers, lowered, divided, blocks, chosen.queued, in_blocks=on.lanes == 1
        )
        return cls(scene, in_flight, looped, tuning)

    @property
    def counts(self) -> Counts:
        return self._counted[1]

    @counts.setter
    def counts(self, counts: Counts) -> None:
        self._counted = self._counted[0], counts

    @property
    def features(self) -> Features:
        """The features of the scene."""
        return self.scene.lowered.features

    @property
    def has_light_paths(self) -> bool:
        """Whether the film has sums of paths that start at lights."""
        return self.features.transport.light_paths or self.features.transport.weighed

    @property
    def light_group(self) -> int:
        """Which of a pixel's words is the first that light paths add to."""
        return self.features.passes[0].film.first_word

    @property
    def arguments(self) -> dict[str, Any]:
        """The arguments of all kernels by name: of the scene, the paths and the film."""
        return self.kernels.arguments

    def choose_strategy(self, lowered: Lowered) -> Strategy:
        """Return how another lowering would be rendered. Raises SceneError as `create` does."""
        return strategy.choose(self.device, lowered, self._tuning)

    @property
    def programs(self) -> dict[str, device.Program]:
        """The programs that are built, by name."""
        return self.kernels.programs

    @property
    def program_seconds(self) -> float:
        """The time that building the programs took [s]."""
        return self.kernels.seconds

    @property
    def stages(self) -> list[Step]:
        """The kernels of a bounce of paths from the camera, in their order."""
        return self.loops[-1].stages

    def prepare(self) -> None:
        """Build what `render_samples` runs, so that its first samples come at once."""
        for loop in self._all_loops:
            loop.prepare()
        for store in (self.photons, self.guide):
            if store is not None:
                store.prepare(self.kernels)

    def build_ahead(self, lowered: Lowered, chosen: Strategy) -> None:
        """Build the programs in use for another lowering, so that no later build fails."""
        device.build_all(self.device, programs.film_sources(lowered.features, chosen.layout))
        for loop in self._all_loops:
            loop.build_ahead(lowered, chosen)

    def bind_again(self, rebuilt: bool) -> None:
        """Bind all kernels to the present buffers; rebuilt: build their programs again too."""
        if rebuilt:
            self.kernels.programs.clear()
        self.kernels.put_back(self._accumulate)
        self._bind_film()
        for loop in self._all_loops:
            loop.bind_again()
        self.kernels.tidy()

    def show_in(self, picture: device.DeviceArray) -> None:
        """Put the picture of the film into the memory of another picture of the same size."""
        self.film.show_in(picture)
        self.bind_again(rebuilt=False)

    def auxiliary_kernel(
        self, texts: dict[str, device.Source], name: str, **more: object
    ) -> device.BoundKernel:
        """Return a kernel beside the bounce, of the program of its name, with its own arguments."""
        self.kernels.build(texts)
        return self.kernels.bind(name, name, **more)

    def clear(self, *, learned: bool = False) -> None:
        """Enqueue that the film is empty; the next sample is number 0.

        learned: the guide keeps what it has learned, with the seed of that time.
        """
        self._light_paths = 0  # that are in the film
        self._in_flight = None  # the next paths take the places of these
        self.paths.clear_counters()
        self._counted = np.zeros(len(COUNTERS), np.uint64), Counts()
        self.film.clear()
        if self.guide is not None:
            self.guide.trained &= learned

    def enqueue(self, first: int, end: int) -> None:
        """Enqueue that samples first to end - 1 of every pixel are added; wait for nothing."""
        self.begun = True
        self.learn(looped=True)
        for turn in self._turns(first, end) if self.photons else [(first, end)]:
            for loop in self.loops:
                self._before(loop)
                loop.enqueue(*turn)
        self._note_paths(first, end)
        self.accumulate_film()

    def render_samples(self, first: int, end: int, on_batch: OnBatch | None = None) -> bool:
        """Add samples first to end - 1 of every pixel to the film, and wait.

        on_batch is called every few iterations with the counts; if it returns False, every path is
        brought to its end, while it is still called, and no other begins: a valid film, whose
        pixels differ in their number of samples. Returns whether all samples were added.
        """
        finished = all(
            self._run(loop, *turn, on_batch)
            for turn in self._turns(first, end)
            for loop in self.loops
        )
        if finished:
            self._note_paths(first, end)
            self.accumulate_film()
        else:
            self.refresh()
        return finished

    def render_from_camera(self, first: int, end: int, on_batch: OnBatch | None = None) -> bool:
        """Add samples as `render_samples`, without light paths."""
        finished = self._run(self.loops[-1], first, end, on_batch)
        self.accumulate_film()
        return finished

    def render_from_lights(self, first: int, end: int, on_batch: OnBatch | None = None) -> bool:
        """Add the light paths of samples as `render_samples`, without the samples."""
        finished = self.trace_from_lights(first, end, on_batch)
        self.refresh()
        return finished

    def trace_from_lights(self, first: int, end: int, on_batch: OnBatch | None = None) -> bool:
        """As `render_from_lights`, but leave the picture as it is."""
        return self._run(self.loops[0], first, end, on_batch)

    def finish(self) -> None:
        """Bring every path in flight to its end, and wait.

        Paths may be wherever an interrupt has left `render_samples` and the like; `refresh` then
        makes a picture of the film.
        """
        self.stream.rejoin()
        if self._in_flight is not None:
            self._in_flight.finish()
            self._in_flight = None

    def refresh(self) -> None:
        """Make the picture of whatever the film holds."""
        if self.has_light_paths:
            self._light_paths = self.film.count_samples(self.light_group)
        self.accumulate_film()

    def accumulate_film(self) -> cl.Event:
        """Enqueue that the film's picture becomes that of the samples so far; return the event."""
        if self.has_light_paths:
            self._accumulate.set_args(light_paths=self._light_paths / math.prod(self.film.size))
        return self.film.accumulate(self._accumulate)

    def set_words(self, arrays: Mapping[str, Words]) -> None:
        """Enqueue that the film holds these words, of the form that `Film.words` returns."""
        self.film.set_words(arrays)
        if self.has_light_paths:
            counts = arrays["words"][:, self.light_group + SAMPLES_WORD]
            self._light_paths = int(counts.sum(dtype=np.uint64))
        self.accumulate_film()

    def _bind_film(self) -> None:
        """Bind the kernel that makes a picture of the film."""
        self.kernels.build(programs.film_sources(self.features, self.scene.strategy.layout))
        self._accumulate = self.kernels.bind("accumulate", "accumulate", light_paths=0.0)

    def _turns(self, first: int, end: int) -> list[tuple[int, int]]:
        """Return ranges of samples, which all kinds of paths take in turn.

        Ranges are short, so that the film is balanced whenever a render stops. An empty range gives
        a single empty turn.
        """
        if len(self.loops) == 1 or first == end:
            return [(first, end)]
        step = 1 if self.photons else max(TURN_SAMPLES, TURN_PATHS // self.paths.pixels)
        return [(at, min(at + step, end)) for at in range(first, end, step)]

    def _run(self, loop: BounceLoop, first: int, end: int, on_batch: OnBatch | None) -> bool:
        """Trace samples first to end - 1 of a single kind; return whether all were traced."""
        wanted = True
        self._before(loop)

        def count(counters: NDArray[np.uint64]) -> bool:
            nonlocal wanted
            self._count(counters, loop.is_last)
            wanted = (on_batch is None or on_batch(self.counts)) and wanted
            return wanted

        self.begun = True
        if first < end:
            self.learn(looped=self.looped)
        return self._trace(loop, first, end, count)

    def _trace(self, loop: BounceLoop, first: int, end: int, count: OnBatch) -> bool:
        """Run a loop; `finish` does what is left where an interrupt ends it."""
        self._in_flight = loop
        finished = loop.run(first, end, count)
        self._in_flight = None
        return finished

    @property
    def _all_loops(self) -> list[BounceLoop]:
        """All loops, with the loop that trains a guide."""
        return [*([self._trainer] if self._trainer else []), *self.loops]

    def learn(self, *, looped: bool) -> None:
        """Let a guide learn from light paths, if it has not; looped: and wait for nothing."""
        guide = self.guide
        if guide is None or guide.trained:
            return
        assert self._trainer is not None, "a guide has a trainer"
        guide.clear()
        if looped:
            self._trainer.enqueue(0, guide.samples)
        else:
            self._trace(self._trainer, 0, guide.samples, lambda _: True)
        guide.sum(self.kernels)

    def _before(self, loop: BounceLoop) -> None:
        """Enqueue what paths of a kind need of the photons of their pass."""
        if self.photons is not None:
            if loop.is_last:
                self.photons.sort(self.kernels)
            else:
                self.photons.clear()

    def _note_paths(self, first: int, end: int) -> None:
        """Count the light paths of samples first to end - 1, which are in the film by now."""
        first, end = self.loops[0].numbers(first, end)
        self._light_paths += (end - first) * self.paths.pixels

    def _count(self, counters: NDArray[np.uint64], samples: bool) -> None:
        """Add what the counters have gained since they were read last; samples: these too."""
        before, counts = self._counted
        gained = dict(zip(COUNTERS[1:], (counters - before)[1:].tolist(), strict=True))
        if not samples:
            gained["samples"] = 0
        sums = {name: value + gained[name] for name, value in vars(counts).items()}
        self._counted = counters, Counts(**sums)
