"""The bounce loop of a single kind of paths: its kernels, which run until all paths have ended.

The host only enqueues; it reads the counters of an iteration while later iterations run.
"""

from __future__ import annotations

import math
import time
from collections import OrderedDict, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from clpt import device
from clpt.device.stream import Timings
from clpt.render.flow import bounce, flags, programs
from clpt.render.flow.scene_to_tables import Lowered
from clpt.render.records import Features
from clpt.render.wavefront import launches, strategy
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.render.wavefront.path_buffers import APPENDING, GROUP, QUEUEING, PathBuffers, queue_steps
from clpt.render.wavefront.strategy import Strategy

BATCH = 8  # bounces that are enqueued between two reads of the counters
CORE_BOUNCES = 1 << 16  # bounces of all slots in a launch of the loop, for each core
LAUNCH_SECONDS = 0.05  # of a stage at most: drivers of GPUs that draw a screen end long kernels
FINISH_SECONDS = 1.0  # from a request to stop until paths in flight are abandoned
FIRST_PARTS = 8  # launches of a stage before the time of a launch is known
LEAST_ITEMS = 1 << 12  # of a part
ENDLESS = 0xFFFFFFFF  # bounces of a loop that goes on till all paths have ended
MOST_IDLE = 16  # kernels that are kept for scenes that need them again
TRIAL_BATCH = 2  # batches before the trial of sorted rays: paths of all depths are in flight then
IDLE = {"samples": (0, 0), "begin": 0, "bounces": 0, "restart": 0, "leave": None}  # nothing to do

OnBatch = Callable[[Any], bool]  # called with counters; returns whether a run goes on


@dataclass(frozen=True)
class Step:
    """A kernel of a bounce with its arguments, work-items, and those of a group."""

    name: str
    bound: device.BoundKernel
    size: tuple[int]
    group: tuple[int] | None

    def parts(self, count: int) -> Iterator[tuple[int, int]]:
        """Yield the first work-item and the number of them of about `count` launches."""
        (items,) = self.size
        group = self.group[0] if self.group else items
        most = -(-max(-(-items // count), LEAST_ITEMS) // group) * group
        for first in range(0, items, most):
            yield first, min(most, items - first)


def beginning(steps: Iterable[Step]) -> device.BoundKernel:
    """Return the kernel that begins paths, of the steps of a bounce."""
    return next(step.bound for step in steps if "samples" in step.bound.values)


class HasArguments(Protocol):
    """An owner of buffers."""

    @property
    def arguments(self) -> Mapping[str, Any]:
        """The arguments of kernels by name."""


class Kernels:
    """Programs of a device by name, and their kernels with the arguments that they all share.

    owners: of buffers, each with `arguments` by name. seconds: of building.
    """

    def __init__(self, on: device.Device, owners: Sequence[HasArguments]):
        self.device, self._owners = on, owners
        self.programs: dict[str, device.Program] = {}
        self.seconds = 0.0
        self._idle: OrderedDict[tuple[device.Program, str], device.BoundKernel] = OrderedDict()

    @property
    def arguments(self) -> dict[str, Any]:
        """The present arguments of all owners by name."""
        return {name: value for owner in self._owners for name, value in owner.arguments.items()}

    def build(self, texts: dict[str, device.Source]) -> None:
        """Build those programs that are not built yet."""
        start = time.perf_counter()
        missing = {n: text for n, text in texts.items() if n not in self.programs}
        self.programs |= device.build_all(self.device, missing)
        self.seconds += time.perf_counter() - start

    def keep(self, name: str, make: Callable[[], device.Program]) -> None:
        """Make a program, unless a program has its name."""
        if name not in self.programs:
            start = time.perf_counter()
            self.programs[name] = make()
            self.seconds += time.perf_counter() - start

    def bind(self, program: str, name: str, **more: object) -> device.BoundKernel:
        """Return a kernel of a program with its arguments, by the names in its signature."""
        kernel = self.programs[program].kernel(name)
        arguments = {**self.arguments, **more}
        named = {a.name: arguments[a.name] for a in kernel.arguments}
        bound = self._idle.pop((kernel.program, name), None)
        if bound is None:
            return kernel.bind(**named)
        bound.bind(**named)
        return bound

    def put_back(self, bound: device.BoundKernel) -> None:
        """Take a kernel that is out of use: PyOpenCL takes half a millisecond for another."""
        self._idle[bound.kernel.program, bound.kernel.name] = bound

    def tidy(self) -> None:
        """Drop what kernels out of use hold, and kernels that have been so for long."""
        while len(self._idle) > MOST_IDLE:
            self._idle.popitem(last=False)
        for bound in self._idle.values():
            bound.forget()


@dataclass(frozen=True)
class Ending:
    """The end of a stopped run of a bounce loop.

    leave: a flag; if it is raised the run may abandon paths in flight, where the device runs the
    loop, and on_batch must raise; None: the run completes its paths. pause: a flag of the loop,
    which ends launches that take too long. seconds: the longest time to the end [s]; None: the
    default of the device.
    """

    pause: device.Flag
    leave: device.Flag | None = None
    seconds: float | None = None


class BounceLoop:
    """The bounce loop of a single kind of paths in a scene.

    which: index in `Features.passes`; per_sample: paths for each sample.
    """

    def __init__(
        self,
        kernels: Kernels,
        scene: DeviceScene,
        paths: PathBuffers,
        timings: Timings,
        looped: bool,
        which: int,
        ending: Ending,
    ):
        self.kernels, self.scene, self.paths, self.timings = kernels, scene, paths, timings
        self.device, self.stream, self.looped = scene.device, scene.stream, looped
        self.lanes = self.device.lanes
        self._which, self._ending = which, ending
        self._first = 0  # the first path of the last run
        self.is_last = which == len(scene.lowered.features.passes) - 1
        self.per_sample = 1 if self.is_last else float(scene.lowered.settings["light_paths"]) or 1
        self._label = "" if self.is_last else "light "
        self._share = strategy.loop_share(self.device)
        self._stages: list[Step] | None = None
        self._loop: device.BoundKernel | None = None
        self._size = launches.first_size(self._share, self.lanes)  # of the next launch of the loop
        self._begin = 0  # the first slot of that launch
        self._parts, self._batch_bounces = FIRST_PARTS, BATCH
        self._sorted, self._batches = False, 0  # whether a trial has said that rays are sorted

    @property
    def features(self) -> Features:
        """The features of the scene, for this kind of paths."""
        return self._own(self.scene.lowered)

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
            scene = self.scene
            self.kernels.keep("loop", lambda: self._link(scene.lowered, scene.strategy))
            arguments = {"share": self._share, "which": self._which, **IDLE}
            self._loop = self.kernels.bind("loop", "loop", **arguments)
        return self._loop

    def prepare(self) -> None:
        """Build what `run` runs."""
        _ = self.loop if self.looped else self.stages

    def build_ahead(self, lowered: Lowered, chosen: Strategy) -> None:
        """Build the programs in use for another lowering, so that no later build fails."""
        if self._stages is not None:
            device.build_all(self.device, self._texts(lowered, chosen))
        if self._loop is not None:
            self._link(lowered, chosen)

    def bind_again(self) -> None:
        """Bind the kernels that are in use to the present buffers."""
        has_stages, has_loop = self._stages is not None, self._loop is not None
        if self._loop is not None:
            self.kernels.put_back(self._loop)
        self._stages = self._loop = None
        if has_stages:
            _ = self.stages
        if has_loop:
            _ = self.loop

    def numbers(self, first: int, end: int) -> tuple[int, int]:
        """Return the numbers, first and end, of the paths of samples first to end - 1."""
        return math.ceil(first * self.per_sample), math.ceil(end * self.per_sample)

    def enqueue(self, first: int, end: int) -> None:
        """Enqueue the paths of samples first to end - 1 of every pixel; wait for nothing."""
        samples = np.array(self.numbers(first, end), np.int32)
        whole = {"share": self._share, "begin": 0, "bounces": ENDLESS}
        self.loop.set_args(samples=samples, restart=1, leave=None, **whole)
        event = self.stream.run(self.loop, (self._items,), self._group)
        self.timings.add(f"{self._label}loop", event)

    def run(self, first: int, end: int, on_batch: OnBatch) -> bool:
        """Trace the paths of samples first to end - 1 of every pixel, and wait.

        on_batch is called every few iterations with the counters. If it returns False, the paths in
        flight end, and no other path begins. If it raises an error, the device finishes its work
        first, then the error is raised; paths stay in flight, and the film is incomplete. Returns
        whether all paths were traced.
        """
        numbers = self.numbers(first, end)
        self._first = numbers[0]
        self.paths.restart()
        if first < end:
            return self._go_on(numbers, self._ending.leave or self._ending.pause, on_batch)
        size = self._size  # short launches say nothing about long launches
        self._size, self._begin = launches.Size(self._share, 1), 0
        finished = self._go_on(numbers, self._ending.pause, on_batch)
        self._size, self._begin = size, 0
        return finished

    def finish(self) -> None:
        """Bring every path in flight to its end, wherever `run` was interrupted; wait for it."""
        self._ending.pause.lower()
        self._go_on((self._first, self._first), self._ending.pause, lambda _: False)

    def _go_on(self, numbers: tuple[int, int], leave: device.Flag, on_batch: OnBatch) -> bool:
        """Trace paths of these numbers until none is in flight; see `run`.

        leave: is raised for a moment if a launch takes too long.
        """
        begin = self.loop if self.looped else beginning(self.stages)
        begin.set_args(samples=numbers)
        if self.looped:
            begin.set_args(restart=0, leave=leave.argument)
        stopped = math.inf  # when the run was told to stop [s]
        reads: launches.Reads = deque()
        before, took = time.perf_counter(), 0.0
        while True:
            self._enqueue_batch()
            reads.append(self.paths.read_counters())
            self.stream.flush()
            if len(reads) < 2:
                continue
            counters, was_cut = launches.wait(reads, leave, took)
            try:
                goes_on = on_batch(counters)
            except BaseException:
                for _, later in reads:
                    device.wait(later)
                raise
            if not goes_on and stopped == math.inf:
                begin.set_args(samples=(numbers[0], numbers[0]))
                stopped = time.perf_counter()
            if counters[0] >= self.paths.slots:
                break
            before, took = time.perf_counter(), time.perf_counter() - before
            if before - stopped > FINISH_SECONDS:
                self.paths.abandon()
                stopped = before
            self._adjust(took, was_cut)
        for _, event in reads:
            device.wait(event)
        return stopped == math.inf

    def _enqueue_batch(self) -> None:
        """Enqueue the launches between two reads of the counters."""
        if self.looped:
            self._launch_loop()
            return
        if self._batches == TRIAL_BATCH and self.scene.strategy.sorted_rays is None:
            self._try_sorting()
        self._batches += 1
        self._run_steps(self.stages * self._batch_bounces)

    def _run_steps(self, steps: Iterable[Step]) -> None:
        for step in steps:
            for first, items in step.parts(self._parts):
                offset = (first,) if first else None
                event = self.stream.run(step.bound, (items,), step.group, offset)
                self.timings.add(step.name, event)

    def _try_sorting(self) -> None:
        """Run a bounce with a trial, which decides whether later bounces sort their rays.

        The trial finds the same hits of the same rays again and again.
        """
        stages, name = self.stages, f"{self._label}intersect"
        at = next((i for i, step in enumerate(stages) if step.name == name), None)
        if at is None:  # ghosts of a lens
            return
        ways = [self._bind_rays(sort, 1) for sort in (False, True)]
        self._run_steps(stages[:at])
        lowered, chosen = self.scene.lowered, self.scene.strategy
        sizes = [n.bit_length() for n in (self.paths.slots, len(lowered.faces))]
        names = [self._texts(lowered, chosen)[name].text, *map(str, sizes)]
        plain, sorts = (partial(self._wait_for, way) for way in ways)
        self._sorted = strategy.sorting_pays(self.device, names, plain, sorts)
        stages[at : at + 1] = ways[self._sorted]
        self._run_steps(stages[at:])

    def _wait_for(self, steps: Iterable[Step]) -> None:
        self._run_steps(steps)
        device.wait(self.stream.mark())

    def _launch_loop(self) -> None:
        """Enqueue a launch of the loop over the next part of the slots."""
        size, begin = self._size, self._begin
        self.loop.set_args(share=size.share, begin=begin, bounces=size.bounces)
        items = min(self._items, -(-(self.paths.slots - begin) // size.share))
        event = self.stream.run(self.loop, (items,), self._group)
        self.timings.add(f"{self._label}loop", event)
        self._begin = begin + items * size.share
        if self._begin >= self.paths.slots:
            self._begin = 0

    def _own(self, lowered: Lowered) -> Features:
        return lowered.features.passes[self._which]

    def _bind_stages(self) -> list[Step]:
        features, chosen, label = self.features, self.scene.strategy, self._label
        self.kernels.build(self._texts(self.scene.lowered, chosen))
        steps: list[Step] = []
        for stage in bounce.order(features, chosen.layout, self.lanes, chosen.interleaved):
            former = steps[-1].bound.kernel.name if steps else ""
            if stage.kernel == "intersect":
                sort = self._sorted if chosen.sorted_rays is None else chosen.sorted_rays
                steps += self._bind_rays(sort, stage.lanes)
                continue
            if chosen.queued and stage.kernel in QUEUEING and stage.kernel != former:
                steps += self._bind_queues(stage.kernel, len(features.materials.kinds))
            samples = {"samples": (0, 0)} if stage.verb == "begin" else {}
            bound = self.kernels.bind(label + stage.program, stage.kernel, **samples)
            steps.append(Step(label + stage.program, bound, *self._sizes(stage.lanes)))
        return steps

    def _bind_rays(self, sort: bool, lanes: int) -> list[Step]:
        """The kernels that find closest hits, `lanes` a work-item; sort: in the order of rays."""
        steps = self._bind_queues("intersect", 1) if sort else []
        name, queue = self._label + "intersect", {} if sort else {"queue": None}
        bound = self.kernels.bind(name, "intersect", **queue)
        return [*steps, Step(name, bound, *self._sizes(lanes))]

    def _bind_queues(self, kernel: str, kinds: int) -> list[Step]:
        """The kernels that queue slots for a stage: by material for shading, else in a queue."""
        steps = []
        wanted = kinds if kernel == "shade" else 1
        for name, size, group in queue_steps(self.paths.slots, wanted, QUEUEING[kernel]):
            bound = self.kernels.bind(self._label + APPENDING[name], name)
            steps.append(Step(name, bound, (size,), (group,) if group else None))
        return steps

    def _texts(self, lowered: Lowered, chosen: Strategy) -> dict[str, device.Source]:
        texts = programs.sources(
            self._own(lowered), chosen.layout, self.lanes,
            queued=chosen.queued, interleaved=chosen.interleaved,
        )  # fmt: skip
        return {self._label + name: text for name, text in texts.items()}

    def _link(self, lowered: Lowered, chosen: Strategy) -> device.Program:
        features, layout = lowered.features, chosen.layout
        texts = programs.loop_sources(features, layout, self.lanes, chosen.interleaved)
        known = {"loop": flags.loop_arguments(features, layout)}
        return device.link(self.device, texts, "loop", known)

    def _adjust(self, took: float, was_cut: bool) -> None:
        """Adjust the length of launches.

        took: the time between two reads of counters [s]; was_cut: see `launches.wait`. A launch of
        the loop must let a run end in time, and look at its limits. A launch of a stage must be too
        short for a driver to end it.
        """
        if not self.looped:  # a single stage may take all of a bounce
            bounce = took / self._batch_bounces
            self._parts = max(1, math.ceil(bounce / LAUNCH_SECONDS))
            self._batch_bounces = max(1, min(BATCH, int(launches.LOOP_SECONDS / bounce)))
            return
        limits = launches.Limits(
            self._share, self.lanes, self._most_bounces(), self._ending.seconds
        )
        self._size = launches.next_size(self._size, took, limits, self._begin == 0, was_cut)

    def _most_bounces(self) -> int:
        """Bounces of a loop between two reads of the counters: some hundredths of a second."""
        info, slots = self.device.info, self.paths.slots
        return max(BATCH, CORE_BOUNCES * info.compute_units // slots) if info.is_cpu else BATCH

    @property
    def _items(self) -> int:
        """The number of work-items of the loop that serve all slots."""
        return -(-self.paths.slots // self._share)

    @property
    def _group(self) -> tuple[int]:
        """The number of work-items of a group of the loop."""
        return (1 if self._share > self.lanes else GROUP,)

    def _sizes(self, lanes: int) -> tuple[tuple[int], tuple[int]]:
        """Return the numbers of work-items that serve all slots, `lanes` each, and of a group."""
        return (self.paths.slots // lanes,), (GROUP // lanes,) if lanes > 1 else (GROUP,)
