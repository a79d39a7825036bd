"""A lowered scene on a device: its tables and trees, and the slabs of the paths in flight."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from clpt import bvh, device
from clpt.device.buffers import Buffers
from clpt.errors import MemoryBudgetError, SceneError
from clpt.records import SLABS, TABLES
from clpt.render.lowering.scene import Lowered
from clpt.render.wavefront import queues, work_list

COUNTERS = ("done", "samples", "closest", "shadow", "rejected")
PADDING = 80  # words between streams: powers of two collide in a cache
GROUP = 64  # slots are a multiple of it, and it is the local size of one-lane kernels
CPU_SLOTS = 1 << 14
UNIT_SLOTS = 1 << 14  # of a compute unit of what is no CPU, which holds about an eighth at once
MOST_SLOTS = 1 << 22  # kernels/core/math.cl divides them as floats
# A work-item of the loop keeps its paths in the first cache, and waits the less for the longest of
# them the more samples each slot has to take: few slots, measured on CPUs.
LOOP_SLOTS = 1 << 10  # a core
LOOP_PATHS = 1 << 22  # to be taken, from which a loop is worth its compilation
BRUTE_SHAPES = 32  # analytic shapes up to which all of them are tried
UNSORTED = 4  # kinds of cheap materials up to which sorting costs more; measured, bench/NOTES.md


def default_slots(info: device.DeviceInfo) -> int:
    """How many paths in flight suit a device: more for one with more compute units.

    A CPU has as many as its cache takes. What is no CPU gets several times as many as it holds at
    once, so that the queues of several kinds of material, and what is left at the end of a queue,
    do not leave units idle. `Resident` takes fewer where memory is short.
    """
    if info.is_cpu:
        return CPU_SLOTS
    return min(info.compute_units * UNIT_SLOTS, MOST_SLOTS)


class DeviceScene:
    """What a scene is on a device, by the names of the kernels' arguments in `named`.

    layout: of the triangles, None for what suits the device; slots: paths in flight, None likewise;
    queued: whether shading goes along queues, None likewise, or how, see clpt.render.wavefront.queues.WAYS;
    looped: whether the loop of stages is on the device, None likewise, for as many paths as will be
    taken; tree_quality: see clpt.bvh.build, for previews and scenes that are often built anew.

    Raises MemoryBudgetError, DeviceError, SceneError for a layout that cannot hold the scene.
    """

    def __init__(
        self,
        on: device.Device,
        lowered: Lowered,
        layout: str | None = None,
        slots: int | None = None,
        queued: bool | str | None = None,
        looped: bool | None = None,
        paths: int = 0,
        tree_quality: bvh.Quality = "high",
    ):
        self.device, self.lowered = on, lowered
        self.moved: set[str] = set()  # tables that hold something else than `lowered`
        self.stream = device.Stream(on.queue)
        self.buffers = Buffers(on)
        self.seconds = {"programs": 0.0}
        self._wanted, self.tree_quality = (layout, queued), tree_quality
        layout, self.queued = self.suited(lowered)
        if looped is None:
            looped = on.info.is_cpu and not self.queued and paths >= LOOP_PATHS
        self.looped = looped
        self._place_slots(slots or default_slots(on.info))
        if slots is None and looped and on.info.is_cpu:
            self._narrow(LOOP_SLOTS * on.info.compute_units)
        self._allocate(layout)

    def suited(self, lowered: Lowered) -> tuple[str, str]:
        """The layout for a scene, and how slots are queued, "" if not: as asked, or as suits.

        Raises SceneError for a layout that cannot hold the scene.
        """
        layout, queued = self._wanted
        features, on = lowered.features, self.device
        if layout is None:
            layout = bvh.choose_layout(on, len(lowered.faces))
            many = len(lowered.boxes) > BRUTE_SHAPES or features.instances
            if layout == "brute" and many:
                layout = bvh.choose_tree(on)
        elif layout == "brute" and features.instances:
            raise SceneError(
                f"the layout brute holds no instances; choose {' or '.join(bvh.TREES)}"
            )
        kinds = len(features.materials)
        if queued is None:
            few = 1 if not on.info.is_cpu or features.costly else UNSORTED
            queued = kinds > few
        if queued is True:
            queued = "sort" if on.info.is_cpu else "append"
        if queued and queued not in queues.WAYS:
            raise SceneError(f"{queued!r} is none of {', '.join(queues.WAYS)}", where="queued")
        return layout, queued or ""

    def _place_slots(self, wanted: int) -> None:
        """Divide the film among slots: as many as wanted, or as memory allows."""
        settings = self.lowered.settings
        padded_pixels = int(settings["padded_pixels"])
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
        whole = -(-padded_pixels // GROUP) * GROUP
        per_plane = min(wanted // GROUP * GROUP, whole)
        planes = max(1, wanted // whole) if per_plane == whole else 1
        self._set_slots(per_plane, planes)

    def _narrow(self, wanted: int) -> None:
        """Take fewer slots a plane; sums, and so the picture, follow from the number of planes."""
        settings = self.lowered.settings
        planes = int(settings["planes"])
        fewer = max(wanted // planes // GROUP, 1) * GROUP
        self._set_slots(min(fewer, int(settings["per_plane"])), planes)

    def _set_slots(self, per_plane: int, planes: int) -> None:
        settings = self.lowered.settings
        settings["per_plane"], settings["planes"] = per_plane, planes
        settings["slots"] = per_plane * planes
        self.slots, self.stride = per_plane * planes, per_plane * planes + PADDING

    def _allocate(self, layout: str) -> None:
        lowered, give = self.lowered, self.buffers
        settings = lowered.settings
        self.named: dict[str, Any] = {"stride": self.stride}
        for name in TABLES:
            self.named[name] = lowered.zero_copy.get(name) or give.upload(
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
        whole = work_list.table(settings, work_list.inside(settings))
        self.named["work_list"] = give.upload("the walk over the film", whole)
        self.allocate_queue()

    def work_list(
        self, padded_pixels: work_list.PixelIndices, ends: work_list.PixelIndices | None = None
    ) -> None:
        """Enqueue that exposures take these places from now on, each up to its own end."""
        self.stream.write(
            self.named["work_list"], work_list.table(self.lowered.settings, padded_pixels, ends)
        )

    def allocate_queue(self) -> None:
        """What queues by material are in, where there are some."""
        if self.queued:
            kinds = len(self.lowered.features.materials)
            for name, words in queues.sizes(self.queued, self.slots, kinds).items():
                self.named[name] = self.buffers.allocate("the queues", 4 * words)
            self.named.update(queues.numbers(self.slots))

    def build_triangles(self, layout: str) -> None:
        """The trees over triangles, of the world and of every group."""
        start = time.perf_counter()
        lowered, instances = self.lowered, self.lowered.instances
        vertices = self.named["vertices"] if len(lowered.faces) else lowered.vertices
        counts = [len(lowered.faces) - sum(instances.triangles), *instances.triangles]
        for name in ("tris", "nodes", "leaves"):  # of the tree before
            self.named.pop(name, None)
        self.tree, self._offsets = bvh.build_parts(
            self.device,
            vertices,
            lowered.faces,
            lowered.tags,
            counts,
            layout,
            self.tree_quality,
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
            rows["nodes"], rows["leaves"] = self._offsets[1 + instances.prototypes[order]].T
            words = rows.view(np.uint32)
            self.named["instances"] = self.buffers.upload("the table of instances", words)
            self.instances, self.instance_order = rows, order
        for name, tree in self.box_trees.items():
            self.named |= {f"{name}_{part}": buffer for part, buffer in tree.buffers.items()}
        self.seconds["trees"] += time.perf_counter() - start
