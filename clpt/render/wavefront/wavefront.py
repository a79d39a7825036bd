"""The wavefront: slabs of paths in flight, and the loop that moves them through the stages.

A slot owns its pixels and regenerates its path as soon as that ends, so the device stays full at
any depth. The host only enqueues; it reads the counters of an iteration while later ones run.
"""

from __future__ import annotations

import copy
import dataclasses
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pyopencl as cl

from clpt import bvh, device
from clpt.device.timing import Timings
from clpt.errors import MemoryBudgetError
from clpt.records import PATH
from clpt.render.codegen import programs, signatures
from clpt.render.lowering.scene import Lowered
from clpt.render.wavefront import queues
from clpt.render.wavefront.device_scene import COUNTERS, GROUP, DeviceScene

FILM_WORDS = 7  # kernels/film/film.cl
FRESH = 0x2000  # kernels/path/path_state.cl
INTERLEAVED_TRIANGLES = 1 << 20  # from which rays in flight pay; measured, see bench/NOTES.md
BATCH = 8  # bounces that are enqueued before counters are asked for
CORE_BOUNCES = 1 << 16  # of all slots, that a core's part of a loop takes at once
ENDLESS = 0xFFFFFFFF  # bounces of a loop that goes on till all paths have ended
IDLE = {"samples": (0, 0), "bounces": 0, "restart": 0}  # of a loop that was asked for nothing


@dataclass
class Counts:
    """What has happened so far: samples on the film, rays traced, samples that were not finite."""

    samples: int = 0
    closest: int = 0
    shadow: int = 0
    rejected: int = 0

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


def use_interleaved_rays(on: device.Device, lowered: Lowered, layout: str) -> bool:
    """Return whether rays in flight pay: in trees of nothing but triangles, larger than the caches."""
    features, count = lowered.features, len(lowered.faces)
    only_triangles = not (features.instances or features.analytic)
    large = count >= INTERLEAVED_TRIANGLES and bvh.outgrows_caches(on, layout, count)
    return only_triangles and large


class Wavefront(DeviceScene):
    """The device side of a render: buffers, programs, and `expose`, which runs the bounce loop.

    What is wanted of it: see `Resident`.

    Raises MemoryBudgetError, KernelBuildError, DeviceError.
    """

    def __init__(self, on: device.Device, lowered: Lowered, **wanted: Any):
        super().__init__(on, lowered, **wanted)
        self.lanes = on.lanes
        self.timings = Timings(on.queue)
        self.programs: dict[str, device.Program] = {}
        self._allocate_film()

    def with_channel(self, channel: str) -> Wavefront:
        """Another film of the same scene, for another channel of the `aov` integrator.

        It shares everything on the device but the film and the picture.
        """
        other = copy.copy(self)
        features = dataclasses.replace(self.lowered.features, channel=channel)
        other.lowered = dataclasses.replace(self.lowered, features=features)
        other.named = dict(self.named)
        other.programs = {n: p for n, p in self.programs.items() if not n.startswith("shade_")}
        for made in ("stages", "loop"):
            other.__dict__.pop(made, None)
        other._allocate_film()
        return other

    def _allocate_film(self) -> None:
        """A film and a picture of its own, and kernels bound to them."""
        settings = self.lowered.settings
        self.film_bytes = 4 * FILM_WORDS * int(settings["padded_pixels"]) * int(settings["planes"])
        pixels = int(settings["width"]) * int(settings["height"])
        sizes = {"film": self.film_bytes, "image": 16 * pixels}
        advice = "lower the image's size"
        if self.lowered.features.bands:
            bands = int(settings["bands"])
            advice += " or the number of bands"
            sizes["bands"] = 8 * bands * int(settings["padded_pixels"]) * int(settings["planes"])
            sizes["band_image"] = 4 * bands * pixels
            if sizes["bands"] // 4 >= 1 << 31:  # kernels/film/bands.cl counts words by an int
                raise MemoryBudgetError("the film of bands", sizes["bands"], 1 << 33, advice)
        for name, size in sizes.items():
            self.named[name] = self.buffers.allocate(f"the {name}", size, advice)
        self.band_bytes = sizes.get("bands", 0)
        shape, image = (*self._size[::-1], 4), self.named["image"]
        self.film = device.DeviceArray(self.device.queue, shape, np.float32, data=image)
        self._pictured: cl.Event | None = None  # the event of the last command that wrote `film`
        self._bind_film()
        self.clear()

    def _bind_film(self) -> None:
        """The kernels that make a picture of the film."""
        self._build(programs.film_sources(self.lowered.features, self.tree.layout))
        self.accumulate = self._bound("accumulate", "accumulate", samples=0.0)
        if self.band_bytes:
            self.accumulate_bands = self._bound("bands", "accumulate_bands")

    def bind_again(self, rebuilt: bool) -> None:
        """Give all kernels the buffers of `named` once more; rebuilt: other programs have them."""
        made = {name: vars(self).pop(name) for name in ("stages", "loop") if name in vars(self)}
        if rebuilt:
            self.programs = {}
        elif "loop" in made:
            self.loop = self._bind(made["loop"].kernel, **IDLE)
        self._bind_film()
        for name in made:
            getattr(self, name)

    def _build(self, texts: dict[str, device.Source]) -> None:
        """Build the programs of these that are not there yet."""
        start = time.perf_counter()
        missing = {n: text for n, text in texts.items() if n not in self.programs}
        self.programs |= device.build_all(self.device, missing)
        self.seconds["programs"] += time.perf_counter() - start

    def _texts(self, lowered: Lowered, layout: str, queued: str) -> dict[str, device.Source]:
        interleaved = use_interleaved_rays(self.device, lowered, layout)
        return programs.sources(
            lowered.features, layout, self.lanes, queued=queued, interleaved=interleaved
        )

    @cached_property
    def stages(self) -> list[Step]:
        """The kernels of a bounce in their order, for a host that enqueues bounce after bounce."""
        features, layout = self.lowered.features, self.tree.layout
        self._build(self._texts(self.lowered, layout, self.queued))
        interleaved = use_interleaved_rays(self.device, self.lowered, layout)
        made: list[Step] = []
        for stage in programs.order(features, layout, self.lanes, interleaved):
            if self.queued and stage.kernel == "shade" and made[-1].bound.kernel.name != "shade":
                kinds = len(features.materials)
                for name, size, group in queues.steps(self.queued, self.slots, kinds):
                    bound = self._bound(self.queued, name)
                    made.append(Step(name, bound, (size,), (group,) if group else None))
            given = {"samples": (0, 0)} if not made else {}
            bound = self._bound(stage.program, stage.kernel, **given)
            made.append(Step(stage.program, bound, *self._sizes(stage.lanes)))
        return made

    @cached_property
    def loop(self) -> device.BoundKernel:
        """The kernel of the bounce loop on the device, for a host that does not wait."""
        start = time.perf_counter()
        kernel = self._link(self.lowered, self.tree.layout).kernel("loop")
        self.seconds["programs"] += time.perf_counter() - start
        return self._bind(kernel, **IDLE)

    def _link(self, lowered: Lowered, layout: str) -> device.Program:
        features, interleaved = (
            lowered.features,
            use_interleaved_rays(self.device, lowered, layout),
        )
        texts = programs.loop_sources(features, layout, self.lanes, interleaved)
        known = {"loop": signatures.loop_arguments(features, layout)}
        return device.link(self.device, texts, "loop", known)

    def build_ahead(self, lowered: Lowered, layout: str, queued: str) -> None:
        """Build for another scene the programs that are in use, so that it fails here or never."""
        device.build_all(self.device, programs.film_sources(lowered.features, layout))
        if "loop" in vars(self):
            self._link(lowered, layout)
        if "stages" in vars(self):
            device.build_all(self.device, self._texts(lowered, layout, queued))

    @property
    def _round(self) -> list[Step]:
        """What `expose` enqueues between two looks at the counters."""
        if self.looped:
            return [Step("loop", self.loop, *self._sizes(self.lanes))]
        return self.stages * BATCH

    def auxiliary_kernel(
        self, texts: dict[str, device.Source], name: str, **given: Any
    ) -> device.BoundKernel:
        """A kernel beside the bounce, of the program of its name in `texts`, with its arguments."""
        self._build(texts)
        return self._bound(name, name, **given)

    @property
    def _bounces(self) -> int:
        """Bounces of a loop between two looks at the counters: some hundredths of a second."""
        info = self.device.info
        return max(BATCH, CORE_BOUNCES * info.compute_units // self.slots) if info.is_cpu else BATCH

    def _bound(self, program: str, name: str, **given: Any) -> device.BoundKernel:
        return self._bind(self.programs[program].kernel(name), **given)

    def _bind(self, kernel: device.Kernel, **given: Any) -> device.BoundKernel:
        """A kernel with its arguments, which are told by their names in its signature."""
        named = {**self.named, **given}
        return kernel.bind(**{a.name: named[a.name] for a in kernel.arguments})

    def _sizes(self, lanes: int) -> tuple[tuple[int], tuple[int]]:
        """How many work-items serve all slots, `lanes` each, and how many of them are a group."""
        return (self.slots // lanes,), (GROUP // lanes,) if lanes > 1 else (GROUP,)

    def clear(self) -> None:
        """Empty the film and begin again at sample 0."""
        self.counts, self._seen = Counts(), np.zeros(len(COUNTERS), np.uint32)
        self.samples_per_pixel = 0.0  # paths per pixel
        self._fill("counters", 0, 0, 4 * len(COUNTERS))
        self._fill("film", 0, 0, self.film_bytes)
        self.stream.after(self.film.events)
        event = self.stream.fill(self.named["image"], 0, 0, self.named["image"].size)
        device.supersede(self.film, event)
        if self.band_bytes:
            self._fill("bands", 0, 0, self.band_bytes)

    def _fill(self, name: str, value: int, offset: int, size: int) -> None:
        self.stream.fill(self.named[name], value, offset, size)

    def enqueue(self, first: int, end: int) -> None:
        """Enqueue that samples first to end - 1 of every pixel are added; nothing is waited for."""
        samples = np.array([first, end], np.int32)
        self.loop.set_args(samples=samples, bounces=ENDLESS, restart=1)
        size, group = self._sizes(self.lanes)
        self.timings.add("loop", self.stream.run(self.loop, size, group))
        self.samples_per_pixel += end - first
        self.accumulate_film()

    def render_samples(
        self, first: int, end: int, on_batch: Callable[[Counts], bool] | None = None
    ) -> bool:
        """Add samples first to end - 1 of every pixel to the film, and wait.

        on_batch is called every few iterations with the counts; if it returns False, every path is
        brought to its end and the exposure stops: a valid film, whose pixels differ in their number
        of samples. Returns whether it ran to its end.
        """
        steps = self._round
        begin = steps[0].bound
        self.rewind()
        begin.set_args(samples=(first, end))
        if self.looped:
            begin.set_args(bounces=self._bounces, restart=0)
        before, finished = self.counts.samples, True
        reads: deque[tuple[np.ndarray, cl.Event]] = deque()
        while True:
            for step in steps:
                self.timings.add(step.name, self.stream.run(step.bound, step.size, step.group))
            host = np.zeros(len(COUNTERS), np.uint32)
            event = self.stream.read_later(self.named["counters"], host)
            self.stream.flush()
            reads.append((host, event))
            if len(reads) < 2:
                continue
            now, event = reads.popleft()
            event.wait()
            self._count(now)
            if on_batch and finished and not on_batch(self.counts):
                begin.set_args(samples=(first, first))
                finished = False
            if now[0] >= self.slots:
                break
        for _, event in reads:
            event.wait()
        width, height = self._size
        new = (self.counts.samples - before) / (width * height)
        self.samples_per_pixel += end - first if finished else new
        self.accumulate_film()
        return finished

    def rewind(self) -> None:
        """Let every slot begin its list again."""
        word = next(m.word for m in PATH.members if m.name == "state")
        self._fill("path_words", FRESH, 4 * word * self.stride, 4 * self.slots)
        self._fill("counters", 0, 0, 4)

    def _count(self, now: np.ndarray) -> None:
        """Add what the counters have gained since they were read last."""
        new = now - self._seen  # unsigned: right even after they wrapped around
        self._seen = now
        for name, n in zip(COUNTERS[1:], new[1:].tolist(), strict=True):
            setattr(self.counts, name, getattr(self.counts, name) + n)

    def accumulate_film(self) -> None:
        """Enqueue that `film` becomes the picture of what was exposed."""
        if self.lowered.features.light_paths:
            self.accumulate.set_args(samples=self.samples_per_pixel)
        others = [e for e in self.film.events if e is not self._pictured]  # of who reads it
        self.stream.after(others)
        self._pictured = self.stream.run(self.accumulate, self._size)
        device.supersede(self.film, self._pictured)

    def image(self) -> np.ndarray:
        """The picture so far, (h, w, 3) float32 in the film's output space; waits for it."""
        width, height = self._size
        whole = self.stream.read(self.named["image"], np.empty((height, width, 4), np.float32))
        return np.ascontiguousarray(whole[:, :, :3])

    def bands(self) -> np.ndarray:
        """The mean radiance in each band so far, (h, w, bands) float32, of a film with bands."""
        width, height = self._size
        self.stream.run(self.accumulate_bands, (width, height))
        shape = (height, width, int(self.lowered.settings["bands"]))
        return self.stream.read(self.named["band_image"], np.empty(shape, np.float32))

    @cached_property
    def _size(self) -> tuple[int, int]:
        """Width and height of the film [pixels]."""
        return int(self.lowered.settings["width"]), int(self.lowered.settings["height"])
