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
from clpt.device.buffers import Buffers
from clpt.device.timing import Timings
from clpt.errors import MemoryBudgetError, SceneError
from clpt.records import PATH, SLABS, TABLES
from clpt.render import arguments, programs
from clpt.render.features import Features
from clpt.render.lower import Lowered

FILM_WORDS = 7  # kernels/lib/film.cl
FRESH = 0x2000  # kernels/lib/path_state.cl
COUNTERS = ("done", "samples", "closest", "shadow", "rejected")
PADDING = 80  # words between streams: powers of two collide in a cache
GROUP = 64  # slots are a multiple of it, and it is the local size of one-lane kernels
BATCH = 8  # bounces that are enqueued before counters are asked for
ENDLESS = 0xFFFFFFFF  # bounces of a loop that goes on till all paths have ended
IDLE = {"samples": (0, 0), "turns": 0, "restart": 0}  # of a loop that was asked for nothing
CPU_SLOTS, GPU_SLOTS = 1 << 14, 1 << 20
BRUTE_SHAPES = 32  # analytic shapes up to which all of them are tried
QUEUE = ("queue", "counts", "queue_starts", "queue_counts")
SORT = ("sort_count", "sort_scan", "sort_place")
CHUNK = 256  # slots that a work-item of the sort counts


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
class _Step:
    """A kernel of a bounce with its arguments, work-items, and those of a group."""

    name: str
    bound: device.Bound
    size: tuple[int]
    group: tuple[int] | None


class Wavefront:
    """The device side of a render: buffers, programs, and `expose`, which runs the bounce loop.

    layout: of the triangles, None for what suits the device; slots: paths in flight, None likewise;
    queued: whether shading is sorted, None likewise; looped: whether `expose` too uses the loop on
    the device.

    Raises MemoryBudgetError, KernelBuildError, DeviceError.
    """

    def __init__(
        self,
        on: device.Device,
        lowered: Lowered,
        *,
        layout: str | None = None,
        slots: int | None = None,
        queued: bool | None = None,
        looped: bool = False,
    ):
        self.device, self.lowered = on, lowered
        self.counts = Counts()
        self.moved: set[str] = set()  # tables that hold something else than `lowered`
        self.stream = device.Stream(on.queue)
        self.timings = Timings(on.queue)
        self.buffers = Buffers(on)
        self._wanted, self.looped = (layout, queued), looped
        layout, self.queued = self.suited(lowered)
        self.lanes = on.lanes
        self.programs: dict[str, device.Program] = {}
        self.seconds = {"programs": 0.0}
        self._place_slots(slots or (CPU_SLOTS if on.info.is_cpu else GPU_SLOTS))
        self._allocate(layout)
        self._expose_new()

    def suited(self, lowered: Lowered) -> tuple[str, bool]:
        """The layout for a scene and whether shading is sorted: as asked, or as suits the device.

        Raises SceneError for a layout that cannot hold the scene.
        """
        layout, queued = self._wanted
        features, on = lowered.features, self.device
        if layout is None:
            layout = bvh.choose_layout(on, len(lowered.faces))
            many = len(lowered.boxes) > BRUTE_SHAPES or features.instances
            if layout == "brute" and many:
                layout = "wide8" if on.info.is_cpu else "binary"
        elif layout == "brute" and features.instances:
            raise SceneError("the layout brute holds no instances; choose wide8 or binary")
        kinds = len(features.materials)
        if queued is None:
            queued = kinds > 1 and (not on.info.is_cpu or kinds > 4)
        return layout, queued

    def sibling(self, channel: str) -> Wavefront:
        """Another film of the same scene, for another channel of the `aov` integrator.

        It shares everything on the device but the film and the picture.
        """
        other = copy.copy(self)
        features = dataclasses.replace(self.lowered.features, channel=channel)
        other.lowered = dataclasses.replace(self.lowered, features=features)
        other.named = dict(self.named)
        shared = {n: program for n, program in self.programs.items() if not n.startswith("shade_")}
        other.programs = shared
        for made in ("stages", "loop"):
            other.__dict__.pop(made, None)
        other._expose_new()
        return other

    def _place_slots(self, wanted: int) -> None:
        """Divide the film among slots: as many as wanted, or as memory allows."""
        settings = self.lowered.settings
        places = int(settings["places"])
        words = sum(record.words for record in SLABS) + 2
        largest = max(record.words for record in SLABS)
        room = min(
            self.buffers.limit // 2 // (4 * words), self.device.info.max_alloc // 4 // largest
        )
        wanted = min(wanted, int(room) - PADDING)
        if wanted < GROUP:
            raise MemoryBudgetError(
                "the least number of paths", 4 * words * GROUP, self.buffers.limit,
                "close other programs or choose another device",
            )  # fmt: skip
        whole = -(-places // GROUP) * GROUP
        per_plane = min(wanted // GROUP * GROUP, whole)
        planes = max(1, wanted // whole) if per_plane == whole else 1
        settings["per_plane"], settings["planes"] = per_plane, planes
        settings["slots"] = per_plane * planes
        self.slots, self.stride = per_plane * planes, per_plane * planes + PADDING

    def _allocate(self, layout: str) -> None:
        lowered, give = self.lowered, self.buffers
        settings = lowered.settings
        self.named: dict[str, Any] = {"stride": self.stride}
        for name in TABLES:
            self.named[name] = lowered.lent.get(name) or give.upload(
                f"the table of {name}", lowered.table(name)
            )
        self.build_triangles(layout)
        self.build_boxes()
        for record in SLABS:
            name = f"{record.name.lower()}_words"
            advice = "lower the number of slots"
            self.named[name] = give.allocate(name, 4 * record.words * self.stride, advice)
            self.stream.fill(self.named[name], 0, 0, 4 * record.words * self.stride)
        self.named["counters"] = give.allocate("the counters", 4 * len(COUNTERS))
        self.named["settings"] = give.upload("the settings", settings.reshape(1).view(np.uint32))
        self.allocate_queue()

    def allocate_queue(self) -> None:
        """What sorting by material works on, where there is sorting."""
        if self.queued:
            give, kinds = self.buffers, len(self.lowered.features.materials)
            chunks = -(-self.slots // CHUNK)
            sizes = self.slots, chunks * kinds, kinds, kinds
            for name, words in zip(QUEUE, sizes, strict=True):
                self.named[name] = give.allocate("the sort", 4 * words)
            self.named.update(chunk=CHUNK, chunks=chunks, slots=self.slots)

    def build_triangles(self, layout: str) -> None:
        """The trees over triangles, of the world and of every group."""
        start = time.perf_counter()
        lowered, instances = self.lowered, self.lowered.instances
        vertices = self.named["vertices"] if len(lowered.faces) else lowered.vertices
        counts = [len(lowered.faces) - sum(instances.triangles), *instances.triangles]
        for name in ("tris", "nodes", "leaves"):  # of the tree before
            self.named.pop(name, None)
        self.tree, self._begins = bvh.build_parts(
            self.device, vertices, lowered.faces, lowered.tags, counts, layout
        )
        self.named.update(self.tree.buffers, triangles=max(self.tree.count, 0))
        self.seconds["trees"] = time.perf_counter() - start

    def build_boxes(self) -> None:
        """Trees over analytic shapes and instances, which learn where their triangles begin."""
        start = time.perf_counter()
        lowered, instances, layout = self.lowered, self.lowered.instances, self.tree.layout
        self.box_trees = {}
        if lowered.features.analytic and layout != "brute":
            self.box_trees["shape"] = bvh.build_boxes(self.device, lowered.boxes)
        if lowered.features.instances:
            self.box_trees["instance"] = bvh.build_boxes(self.device, instances.boxes, layout)
            indices = self.box_trees["instance"].buffers["indices"]
            order = self.buffers.download(indices, (len(instances.rows),), np.uint32)
            rows = instances.rows[order]  # as the leaves, so that neighbours are near each other
            rows["nodes"], rows["leaves"] = self._begins[1 + instances.prototypes[order]].T
            words = rows.view(np.uint32)
            self.named["instances"] = self.buffers.upload("the table of instances", words)
            self.instances, self.instance_order = rows, order
        for name, tree in self.box_trees.items():
            self.named |= {f"{name}_{part}": buffer for part, buffer in tree.buffers.items()}
        self.seconds["trees"] += time.perf_counter() - start

    def _expose_new(self) -> None:
        """A film and a picture of its own, and kernels bound to them."""
        settings = self.lowered.settings
        self.film_bytes = 4 * FILM_WORDS * int(settings["places"]) * int(settings["planes"])
        pixels = int(settings["width"]) * int(settings["height"])
        sizes = {"film": self.film_bytes, "image": 16 * pixels}
        advice = "lower the image's size"
        if self.lowered.features.bands:
            bands = int(settings["bands"])
            advice += " or the number of bands"
            sizes["bands"] = 8 * bands * int(settings["places"]) * int(settings["planes"])
            sizes["band_image"] = 4 * bands * pixels
            if sizes["bands"] // 4 >= 1 << 31:  # kernels/lib/bands.cl counts words by an int
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
        self._build("accumulate", *(["bands"] if self.band_bytes else []))
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

    def _build(self, *wanted: str) -> None:
        """Build the programs of these names that are not there yet; all, if none is named."""
        start = time.perf_counter()
        features, layout = self.lowered.features, self.tree.layout
        texts = programs.sources(features, layout, self.lanes, queued=self.queued)
        missing = {n: texts[n] for n in wanted or texts if n not in self.programs}
        self.programs |= device.build_all(self.device, missing)
        self.seconds["programs"] += time.perf_counter() - start

    @cached_property
    def stages(self) -> list[_Step]:
        """The kernels of a bounce in their order, for a host that enqueues bounce after bounce."""
        self._build()
        made: list[_Step] = []
        chunks = -(-self.slots // CHUNK)
        for stage in programs.order(self.lowered.features, self.tree.layout, self.lanes):
            if self.queued and stage.kernel == "shade" and made[-1].bound.kernel.name != "shade":
                for name, size in (
                    ("sort_count", chunks),
                    ("sort_scan", 1),
                    ("sort_place", chunks),
                ):
                    made.append(_Step(name, self._bound("sort", name), (size,), None))
            given = {"samples": (0, 0)} if not made else {}
            bound = self._bound(stage.program, stage.kernel, **given)
            made.append(_Step(stage.program, bound, *self._sizes(stage.lanes)))
        return made

    @cached_property
    def loop(self) -> device.Bound:
        """The kernel of the bounce loop on the device, for a host that does not wait."""
        start = time.perf_counter()
        kernel = self._link(self.lowered.features, self.tree.layout).kernel("loop")
        self.seconds["programs"] += time.perf_counter() - start
        return self._bind(kernel, **IDLE)

    def _link(self, features: Features, layout: str) -> device.Program:
        texts = programs.loop_sources(features, layout, self.lanes)
        signatures = {"loop": arguments.loop_arguments(features, layout)}
        return device.link(self.device, texts, "loop", signatures)

    def build_ahead(self, features: Features, layout: str, queued: bool) -> None:
        """Build for other features the programs that are in use, so that it fails here or never."""
        if "loop" in vars(self):
            self._link(features, layout)
        if "stages" in vars(self):
            device.build_all(
                self.device, programs.sources(features, layout, self.lanes, queued=queued)
            )

    @property
    def _round(self) -> list[_Step]:
        """What `expose` enqueues between two looks at the counters."""
        if self.looped:
            return [_Step("loop", self.loop, *self._sizes(self.lanes))]
        return self.stages * BATCH

    def _bound(self, program: str, name: str, **given: Any) -> device.Bound:
        return self._bind(self.programs[program].kernel(name), **given)

    def _bind(self, kernel: device.Kernel, **given: Any) -> device.Bound:
        """A kernel with its arguments, which are told by their names in its signature."""
        named = {**self.named, **given}
        return kernel.bind(**{a.name: named[a.name] for a in kernel.arguments})

    def _sizes(self, lanes: int) -> tuple[tuple[int], tuple[int]]:
        """How many work-items serve all slots, `lanes` each, and how many of them are a group."""
        return (self.slots // lanes,), (GROUP // lanes,) if lanes > 1 else (GROUP,)

    def clear(self) -> None:
        """Empty the film and begin again at sample 0."""
        self.counts, self._seen = Counts(), np.zeros(len(COUNTERS), np.uint32)
        self.exposed = 0.0  # paths per pixel
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
        self.loop.set(samples=samples, turns=ENDLESS, restart=1)
        size, group = self._sizes(self.lanes)
        self.timings.add("loop", self.stream.run(self.loop, size, group))
        self.exposed += end - first
        self._accumulate()

    def expose(
        self, first: int, end: int, on_batch: Callable[[Counts], bool] | None = None
    ) -> bool:
        """Add samples first to end - 1 of every pixel to the film, and wait.

        on_batch is called every few iterations with the counts; if it returns False, every path is
        brought to its end and the exposure stops: a valid film, whose pixels differ in their number
        of samples. Returns whether it ran to its end.
        """
        steps = self._round
        begin = steps[0].bound
        self._rewind()
        begin.set(samples=(first, end))
        if self.looped:
            begin.set(turns=BATCH, restart=0)
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
                begin.set(samples=(first, first))
                finished = False
            if now[0] >= self.slots:
                break
        for _, event in reads:
            event.wait()
        width, height = self._size
        new = (self.counts.samples - before) / (width * height)
        self.exposed += end - first if finished else new
        self._accumulate()
        return finished

    def _rewind(self) -> None:
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

    def count(self) -> Counts:
        """The counts of all that was enqueued; waits for it."""
        self._count(self.stream.read(self.named["counters"], np.empty(len(COUNTERS), np.uint32)))
        return self.counts

    def _accumulate(self) -> None:
        if self.lowered.features.light_paths:
            self.accumulate.set(samples=self.exposed)
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
