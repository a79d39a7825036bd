"""The wavefront: the loop that moves paths in flight through the stages.

A slot owns its pixels and regenerates its path as soon as that ends, so the device stays full at
any depth. The host only enqueues; it reads the counters of an iteration while later ones run.
"""

from __future__ import annotations

import dataclasses
import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import bvh, device
from clpt.device.timing import Timings
from clpt.render.codegen import programs, signatures
from clpt.render.contract.features import Features
from clpt.render.lowering.scene import Lowered
from clpt.render.wavefront import queues, strategy
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.render.wavefront.film import Film
from clpt.render.wavefront.film_state import SAMPLES_WORD, Words
from clpt.render.wavefront.path_buffers import GROUP, PathBuffers, divide_film
from clpt.render.wavefront.strategy import Strategy, Tuning
from clpt.scene.integrators import IDS

BATCH = 8  # bounces that are enqueued between two reads of the counters
CORE_BOUNCES = 1 << 16  # of all slots, that a core's part of a loop takes at once
ENDLESS = 0xFFFFFFFF  # bounces of a loop that goes on till all paths have ended
IDLE = {"samples": (0, 0), "bounces": 0, "restart": 0}  # of a loop that has nothing to do


@dataclass
class Counts:
    """What has happened so far: samples put on the film, rays traced, what the film refused.

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


@dataclass(frozen=True)
class Step:
    """A kernel of a bounce with its arguments, work-items, and those of a group."""

    name: str
    bound: device.BoundKernel
    size: tuple[int]
    group: tuple[int] | None


class Wavefront:
    """A film of a scene on a device, and `render_samples`, which runs the bounce loop.

    scene, paths: which other wavefronts may share, one after the other; looped: whether a kernel
    on the device runs the loop; channel: of the `aov` integrator, that the film holds; tuning: for
    the strategies of other lowerings.

    counts: of rays and samples.

    Raises MemoryBudgetError, KernelBuildError, DeviceError.
    """

    def __init__(
        self,
        scene: DeviceScene,
        paths: PathBuffers,
        looped: bool,
        channel: str,
        tuning: Tuning,
    ):
        self.device, self.stream, self.buffers = scene.device, scene.stream, scene.buffers
        self.scene, self.paths, self.looped, self.channel = scene, paths, looped, channel
        self._tuning = tuning
        self._share = strategy.loop_share(self.device)
        self.lanes = self.device.lanes
        self.timings = Timings(self.device.queue)
        self.program_seconds = 0.0
        self.programs: dict[str, device.Program] = {}
        self._stages: list[Step] | None = None
        self._loop: device.BoundKernel | None = None
        features = self.features
        self.film = Film(
            self.stream, self.buffers, paths.settings,
            features.bands, features.film_weights, features.alpha,
        )  # fmt: skip
        self._bind_film()
        self.clear()

    @classmethod
    def create(
        cls,
        on: device.Device,
        lowered: Lowered,
        *,
        layout: str | None = None,
        slots: int | None = None,
        queued: bool | None = None,
        looped: bool | None = None,
        tree_quality: bvh.Quality = "high",
        halves: bool = False,
    ) -> Wavefront:
        """Return a wavefront of a lowered scene, which others may render too.

        layout: of the trees over triangles, a name in clpt.bvh.LAYOUTS; slots: paths in flight;
        queued: whether slots are queued by material before they are shaded; looped: whether a
        kernel on the device runs all bounces. Each is chosen to suit the device and the scene where
        it is None. tree_quality: see clpt.bvh.build; halves: whether even and odd samples are kept
        apart.

        Raises as `Wavefront` does, SceneError for a layout that cannot hold the scene.
        """
        tuning = Tuning(layout, queued)
        chosen = strategy.choose(on, lowered, tuning)
        if looped is None:
            looped = strategy.use_loop(on)
        if looped:  # beside the trees
            texts = programs.loop_sources(
                lowered.features, chosen.layout, on.lanes, chosen.interleaved
            )
            device.compile_ahead(on, texts, "loop")
        stream, buffers = device.Stream(on.queue), device.Buffers(on)
        settings, kinds = lowered.settings, len(lowered.features.materials)
        padded_pixels = int(settings["padded_pixels"])
        footprint = lowered.features.footprint_words
        divided = divide_film(
            on.info, padded_pixels, buffers.limit, slots, looped, halves, footprint
        )
        scene = DeviceScene(stream, buffers, lowered, chosen, tree_quality)
        share = strategy.loop_share(on)
        blocks = -(-divided.total // share) * on.lanes if share > on.lanes else 0  # one each
        in_flight = PathBuffers(
            stream, buffers, settings, divided, blocks, chosen.queued, kinds, footprint
        )
        return cls(scene, in_flight, looped, lowered.features.channel, tuning)

    def with_channel(self, channel: str) -> Wavefront:
        """Return a wavefront with another film of the same scene, for a channel of `aov`."""
        return Wavefront(self.scene, self.paths, self.looped, channel, self._tuning)

    @property
    def features(self) -> Features:
        """The features of the scene, for the channel of this film."""
        return self._features_of(self.scene.lowered)

    @property
    def arguments(self) -> dict[str, Any]:
        """The arguments of all kernels by name: of the scene, the paths and the film."""
        return {**self.scene.arguments, **self.paths.arguments, **self.film.arguments}

    def choose_strategy(self, lowered: Lowered) -> Strategy:
        """Return how another lowering would be rendered. Raises SceneError as `create` does."""
        return strategy.choose(self.device, lowered, self._tuning)

    def prepare(self) -> None:
        """Build what `render_samples` runs, so that its first samples come at once."""
        _ = self.loop if self.looped else self.stages

    def build_ahead(self, lowered: Lowered, chosen: Strategy) -> None:
        """Build the programs that are in use for another lowering, so that no later build fails."""
        texts = programs.film_sources(self._features_of(lowered), chosen.layout)
        if self._stages is not None:
            texts |= self._stage_texts(lowered, chosen)
        device.build_all(self.device, texts)
        if self._loop is not None:
            self._link(lowered, chosen)

    def bind_again(self, rebuilt: bool) -> None:
        """Bind all kernels to the present buffers; rebuilt: build their programs again too."""
        has_stages, has_loop = self._stages is not None, self._loop is not None
        self._stages = self._loop = None
        if rebuilt:
            self.programs = {}
        self._bind_film()
        if has_stages:
            _ = self.stages
        if has_loop:
            _ = self.loop

    @property
    def stages(self) -> list[Step]:
        """The kernels of a bounce in their order, for a host that enqueues bounce after bounce."""
        if self._stages is None:
            self._stages = self._bind_stages()
        return self._stages

    @property
    def loop(self) -> device.BoundKernel:
        """The kernel of the bounce loop on the device, for a host that does not wait."""
        if self._loop is None:
            if "loop" not in self.programs:
                start = time.perf_counter()
                self.programs["loop"] = self._link(self.scene.lowered, self.scene.strategy)
                self.program_seconds += time.perf_counter() - start
            self._loop = self._bind("loop", "loop", **IDLE, share=self._share)
        return self._loop

    def auxiliary_kernel(
        self, texts: dict[str, device.Source], name: str, **more: Any
    ) -> device.BoundKernel:
        """Return a kernel beside the bounce, of the program of its name, with its own arguments."""
        self._build(texts)
        return self._bind(name, name, **more)

    def clear(self) -> None:
        """Enqueue that the film is empty; the next sample is number 0."""
        self.counts = Counts()
        self._paths = [0] * self.film.halves  # that began at lights, in each half of the film
        self.paths.clear_counters()
        self.film.clear()

    def enqueue(self, first: int, end: int) -> None:
        """Enqueue that samples first to end - 1 of every pixel are added; wait for nothing."""
        first, end = self._range(first, end)
        samples = np.array([first, end], np.int32)
        self.loop.set_args(samples=samples, bounces=ENDLESS, restart=1)
        self.timings.add("loop", self.stream.run(self.loop, *self._loop_sizes()))
        self._note_paths(first, end)
        self.accumulate_film()

    def render_samples(
        self, first: int, end: int, on_batch: Callable[[Counts], bool] | None = None
    ) -> bool:
        """Add samples first to end - 1 of every pixel to the film, and wait.

        on_batch is called every few iterations with the counts; if it returns False, every path is
        brought to its end and no other begins: a valid film, whose pixels differ in their number of
        samples. Returns whether all samples were added.
        """
        first, end = self._range(first, end)
        steps = self._batch()
        begin = steps[0].bound
        self.paths.restart()
        begin.set_args(samples=(first, end))
        if self.looped:
            begin.set_args(bounces=self._loop_bounces(), restart=0)
        finished = True
        reads: deque[tuple[NDArray[np.uint64], cl.Event]] = deque()
        while True:
            for step in steps:
                self.timings.add(step.name, self.stream.run(step.bound, step.size, step.group))
            reads.append(self.paths.read_counters())
            self.stream.flush()
            if len(reads) < 2:
                continue
            counters, event = reads.popleft()
            device.wait(event)
            self._count(counters)
            if on_batch and finished and not on_batch(self.counts):
                begin.set_args(samples=(first, first))
                finished = False
            if counters[0] >= self.paths.slots:
                break
        for _, event in reads:
            device.wait(event)
        if finished:
            self._note_paths(first, end)
        elif self.features.light_paths:
            self._paths = self.film.count_samples()
        self.accumulate_film()
        return finished

    def accumulate_film(self) -> cl.Event:
        """Enqueue that the film's picture becomes that of the samples so far; return the event."""
        self._accumulate.set_args(**self._samples(0, self.film.halves))
        return self.film.accumulate(self._accumulate)

    def image(self) -> NDArray[np.float32]:
        """Return the picture so far, (h, w, 3) float32 in the film's output space; wait for it."""
        return self.film.colours()

    def half(self, which: int) -> NDArray[np.float32]:
        """Return the picture of the even (0) or odd (1) samples, as `image` does."""
        halves = (which, which + 1)
        image = self.buffers.allocate("a half's image", 16 * math.prod(self.film.size))
        own = {"image": image, "halves": halves, "samples": 0.0, **self._samples(*halves)}
        whole = self.film.made(self._bind("accumulate", "accumulate", **own), image, 4)
        return np.ascontiguousarray(whole[..., :3])

    def alpha(self) -> NDArray[np.float32]:
        """Return how much of each pixel is covered so far, (h, w) float32; wait for it."""
        image = self.buffers.allocate("the alpha", 4 * math.prod(self.film.size))
        own = {"alpha": image, "halves": (0, self.film.halves)}
        kernel = self._bind("accumulate", "accumulate_alpha", **own)
        return self.film.made(kernel, image, 1)[..., 0]

    def bands(self) -> NDArray[np.float32]:
        """Return the mean radiance in each band so far, (h, w, bands) float32; wait for it."""
        assert self._accumulate_bands is not None, "the film has no bands"
        self._accumulate_bands.set_args(**self._samples(0, self.film.halves))
        return self.film.bands(self._accumulate_bands)

    def set_words(self, film: Words, bands: Words) -> None:
        """Enqueue that the film holds these words, of the form that `Film.words` returns."""
        self.film.set_words(film, bands)
        self._paths = [int(half[SAMPLES_WORD].sum(dtype=np.uint64)) for half in film]
        self.accumulate_film()

    def _features_of(self, lowered: Lowered) -> Features:
        if lowered.features.channel == self.channel:
            return lowered.features
        return dataclasses.replace(lowered.features, channel=self.channel)

    def _bind_film(self) -> None:
        """Bind the kernels that make a picture of the film."""
        self._build(programs.film_sources(self.features, self.scene.strategy.layout))
        whole = {"halves": (0, self.film.halves), "samples": 0.0}
        self._accumulate = self._bind("accumulate", "accumulate", **whole)
        self._accumulate_bands = (
            self._bind("bands", "accumulate_bands", **whole) if self.film.has_bands else None
        )

    def _range(self, first: int, end: int) -> tuple[int, int]:
        """The numbers among these of samples that the film takes: an id is known by the first."""
        return (first, max(first, min(end, 1))) if self.channel in IDS else (first, end)

    def _note_paths(self, first: int, end: int) -> None:
        """Count the paths of sample numbers first to end - 1, which are in the film by now."""
        pixels = math.prod(self.film.size)
        for half in range(len(self._paths)):
            of_half = len(range(first + (first + half) % len(self._paths), end, len(self._paths)))
            self._paths[half] += of_half * pixels

    def _samples(self, first: int, end: int) -> dict[str, float]:
        """The argument `samples` of pictures of halves, where paths began at lights."""
        if not self.features.light_paths:
            return {}
        return {"samples": sum(self._paths[first:end]) / math.prod(self.film.size)}

    def _bind_stages(self) -> list[Step]:
        features, chosen = self.features, self.scene.strategy
        self._build(self._stage_texts(self.scene.lowered, chosen))
        steps: list[Step] = []
        for stage in programs.order(features, chosen.layout, self.lanes, chosen.interleaved):
            if stage.kernel == "shade" and steps[-1].bound.kernel.name != "shade":
                steps += self._bind_queues(chosen.queued, len(features.materials))
            samples = {} if steps else {"samples": (0, 0)}
            bound = self._bind(stage.program, stage.kernel, **samples)
            steps.append(Step(stage.program, bound, *self._sizes(stage.lanes)))
        return steps

    def _bind_queues(self, queued: bool, kinds: int) -> list[Step]:
        """The kernels that queue slots by material, none where they are not queued."""
        if not queued:
            return []
        return [
            Step(name, self._bind("append", name), (size,), (group,) if group else None)
            for name, size, group in queues.steps(self.paths.slots, kinds)
        ]

    def _stage_texts(self, lowered: Lowered, chosen: Strategy) -> dict[str, device.Source]:
        return programs.sources(
            self._features_of(lowered), chosen.layout, self.lanes,
            queued=chosen.queued, interleaved=chosen.interleaved,
        )  # fmt: skip

    def _link(self, lowered: Lowered, chosen: Strategy) -> device.Program:
        features, layout = self._features_of(lowered), chosen.layout
        texts = programs.loop_sources(features, layout, self.lanes, chosen.interleaved)
        known = {"loop": signatures.loop_arguments(features, layout)}
        return device.link(self.device, texts, "loop", known)

    def _build(self, texts: dict[str, device.Source]) -> None:
        """Build those programs that are not built yet."""
        start = time.perf_counter()
        missing = {n: text for n, text in texts.items() if n not in self.programs}
        self.programs |= device.build_all(self.device, missing)
        self.program_seconds += time.perf_counter() - start

    def _bind(self, program: str, name: str, **more: Any) -> device.BoundKernel:
        """A kernel of a program with its arguments, by the names in its signature."""
        kernel = self.programs[program].kernel(name)
        arguments = {**self.arguments, **more}
        return kernel.bind(**{a.name: arguments[a.name] for a in kernel.arguments})

    def _batch(self) -> list[Step]:
        """What `render_samples` enqueues between two reads of the counters."""
        if self.looped:
            return [Step("loop", self.loop, *self._loop_sizes())]
        return self.stages * BATCH

    def _loop_bounces(self) -> int:
        """Bounces of a loop between two reads of the counters: some hundredths of a second."""
        info, slots = self.device.info, self.paths.slots
        return max(BATCH, CORE_BOUNCES * info.compute_units // slots) if info.is_cpu else BATCH

    def _loop_sizes(self) -> tuple[tuple[int], tuple[int]]:
        """How many work-items of the loop serve all slots, and how many of them are a group."""
        items = -(-self.paths.slots // self._share)
        return (items,), (1 if self._share > self.lanes else GROUP,)

    def _sizes(self, lanes: int) -> tuple[tuple[int], tuple[int]]:
        """How many work-items serve all slots, `lanes` each, and how many of them are a group."""
        return (self.paths.slots // lanes,), (GROUP // lanes,) if lanes > 1 else (GROUP,)

    def _count(self, counters: NDArray[np.uint64]) -> None:
        """Add what the counters have gained since they were read last."""
        for name, n in self.paths.gained(counters).items():
            setattr(self.counts, name, getattr(self.counts, name) + n)
