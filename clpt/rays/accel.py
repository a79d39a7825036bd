"""Acceleration structures over an application's triangles, and over instances of meshes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import ArrayLike, NDArray

from .. import bvh
from ..device import Buffers, Events, wait
from ..errors import SceneError
from ..records import INSTANCE
from . import batch
from .batch import ArrayInput, DeviceArg, device_arg, on_device, wrap_host
from .queries import AllHits, Queries


class Accel(Queries):
    """Triangles for ray queries, on the caller's queue and in its context.

    vertices: (n, 3) float32; faces: (m, 3) uint32 or int32. Arrays of numpy are copied. The
    constructor reads a PyOpenCL array or buffer in place, and waits. Faces on the device must stay
    unchanged as long as `update` is called. Values on the device are not checked: an index out of
    range reads outside of its buffer.
    layout: "wide8", "compact" or "binary"; by default the fastest for the device. quality: "fast"
    builds faster and traces a little slower. wait_for: events to wait for; events of PyOpenCL
    arrays are always awaited.

    moved: the event of the last update, None before the first.

    Raises SceneError for arrays of wrong shapes or types, for vertices that are not finite or
    beyond 1e12 and for indices out of range; MemoryBudgetError.
    """

    def __init__(
        self,
        queue: cl.CommandQueue,
        vertices: ArrayInput,
        faces: ArrayInput,
        *,
        layout: str | None = None,
        quality: bvh.Quality = "high",
        wait_for: Events = None,
    ):
        super().__init__(queue, layout)
        self._stream.after(wait_for)
        points, self.vertices = self._input("vertices", vertices, np.float32)
        corners, _ = self._input("faces", faces, np.uint32, np.int32)
        wait(self._stream.mark())  # the build has another stream
        self.tree = bvh.build(self.device, points, corners, layout=self.layout, quality=quality)
        self._trees = self.tree.buffers
        self._interleaved = bvh.outgrows_caches(self.device, self.layout, self.tree.count)
        self._faces = self._upload(corners, np.uint32)
        self._refitting = bvh.Building(self.device, stream=self._stream)
        self.moved: cl.Event | None = None

    def update(self, vertices: ArrayInput, *, wait_for: Events = None) -> cl.Event:
        """Enqueue a move of all vertices; their number and the faces stay.

        After large moves rays get slower; then create a new Accel. No ray hits a triangle while a
        vertex is not finite. Do not change arrays on the device before the event. Raises SceneError
        for another number or type of vertices, DeviceError when closed.
        """
        with self._lock:
            self._opened()
            self._stream.after(wait_for)
            points, count = self._input("vertices", vertices, np.float32)
            if count != self.vertices:
                raise SceneError(f"there were {self.vertices}, now {count}", where="vertices")
            if not self.tree.count:
                return self._stream.mark()
            points = self._upload(points, np.float32)
            bvh.refit(self._refitting, self.tree, points, self._faces)
            self.moved = self._stream.mark()
            return self.moved

    def intersect_all(
        self,
        origins: ArrayInput,
        directions: ArrayInput,
        t_min: ArrayInput = 0.0,
        t_max: ArrayInput = math.inf,
        *,
        wait_for: Events = None,
    ) -> AllHits:
        """Return all hits of each ray at t_min < t < t_max, by ray and then by distance.

        A ray hits each triangle at most once, and both triangles at an edge. The call waits, since
        the number of hits is unknown before. Rays: see `intersect`.
        """
        rays = batch.rays(*self._memory, origins, directions, t_min, t_max)
        with self._lock:
            self._opened()
            self._stream.after(wait_for)
            counts = np.zeros(rays.count, np.uint32)
            self._fill("query_count", rays, {"counts": counts})
            ends = np.cumsum(counts, dtype=np.uint64)
            total = int(ends[-1]) if rays.count else 0
            hits: dict[str, NDArray[Any]] = {
                "t": np.empty(total, np.float32),
                "primitive": np.empty(total, np.int32),
                "barycentrics": np.empty((total, 2), np.float32),
            }
            if total:
                self._fill("query_all_hits", rays, {"firsts": ends - counts, **hits})
        ray = np.repeat(np.arange(rays.count), counts)
        order = np.lexsort((hits["t"], ray))
        return AllHits(ray=ray[order], **{name: array[order] for name, array in hits.items()})

    def _fill(self, kernel: str, rays: batch.Rays, arrays: dict[str, NDArray[Any]]) -> None:
        """Run a kernel on arrays of the host."""
        context, shares = self._memory
        outputs = {name: batch.wrap_host(context, array, shares) for name, array in arrays.items()}
        self._wait(kernel, rays, arrays, outputs)

    def _input(self, name: str, values: ArrayInput, *kinds: type) -> tuple[Any, int]:
        """Return an array (n, 3) of the host, or a buffer with only these values; and n.

        The next command waits for the array's events.
        """
        if not on_device(values):
            array = np.asarray(values)
            if array.size == 0:
                return np.zeros((0, 3), kinds[0]), 0
            numbers = "fiu" if np.float32 in kinds else "iu"
            if array.ndim != 2 or array.shape[1] != 3 or array.dtype.kind not in numbers:
                message = f"(n, 3) {np.dtype(kinds[0])} is wanted, not {array.shape} {array.dtype}"
                raise SceneError(message, where=name)
            return array, len(array)
        argument = device_arg(self.queue.context, name, values, 3, *kinds)
        buffer, rows = argument.buffer, argument.rows
        if not rows:
            return np.zeros((0, 3), kinds[0]), 0
        self._stream.after(argument.events)
        if isinstance(buffer, cl.Buffer) and not argument.offset and buffer.size == 12 * rows:
            return buffer, rows
        copy = Buffers(self.device).allocate(f"a copy of the {name}", 12 * rows)
        self._stream.copy(copy, buffer, src_offset=4 * argument.offset, byte_count=12 * rows)
        return copy, rows

    def _upload(self, array: object, kind: type) -> Any:
        """Return a buffer with an array, None for no values; a buffer is returned unchanged."""
        if not isinstance(array, np.ndarray):
            return array
        return batch.wrap_host(self.queue.context, np.ascontiguousarray(array, kind), False).buffer


_ADVICE = "use fewer instances or smaller meshes"


class InstancedAccel(Queries):
    """Instances of meshes for ray queries, on the caller's queue.

    accels: the meshes, with a common context and layout; their trees are copied, so a mesh may be
    closed after its last move. prototypes: (k,) the mesh of each instance; transforms: (k, 4, 4)
    float32 from the mesh to the world, numpy or a PyOpenCL array. The `primitive` of a hit counts
    in its mesh, and `instance` is the instance; t is in units of the world's direction. wait_for:
    the caller's events to wait for.

    Raises SceneError for meshes of different contexts or layouts, and for a transform that is
    singular or moves a mesh beyond 1e12.
    """

    instanced = True

    def __init__(
        self,
        queue: cl.CommandQueue,
        accels: Sequence[Accel],
        prototypes: ArrayLike,
        transforms: ArrayInput,
        *,
        wait_for: Events = None,
    ):
        super().__init__(queue, accels[0].layout if accels else None)
        self.accels = tuple(accels)
        which = np.asarray(prototypes)
        self.count = len(which) if which.ndim == 1 else 0
        self._check(which)
        buffers = Buffers(self.device)
        sizes = np.array([[mesh.buffers[n].size for n in ("nodes", "leaves")] for mesh in accels])
        self._offsets = np.cumsum(sizes, axis=0) - sizes
        self._tree_buffers = {
            name: buffers.allocate("the trees of instances", int(whole), _ADVICE)
            for name, whole in zip(("nodes", "leaves"), sizes.sum(axis=0), strict=True)
        }
        self._moved: list[cl.Event | None] = [None] * len(accels)
        boxes = buffers.allocate("boxes of instances", 24 * self.count, _ADVICE)
        self._arrays = {
            "begins": buffers.upload("the trees of instances", self._offsets // 32, np.uint32),
            "prototypes": buffers.upload("the meshes of instances", which, np.uint32),
            "slots": buffers.upload("the order of instances", np.arange(self.count), np.uint32),
            "instances": buffers.allocate("instances", 4 * INSTANCE.words * self.count, _ADVICE),
            "boxes": boxes,
        }
        self._stream.after(wait_for)
        self._copy_trees(range(len(accels)))
        self._transforms = self._input(transforms)
        self.tree = self._build_tree(buffers)
        self._refitting = bvh.Building(self.device, stream=self._stream)
        self._trees = {
            **self._tree_buffers,
            "instance_nodes": self.tree.buffers["nodes"],
            "instances": self._arrays["instances"],
        }

    def _build_tree(self, buffers: Buffers) -> bvh.Bvh:
        """Compute the instances' boxes, and return the tree over them. Raises SceneError."""
        self._place_instances()
        boxes = self._arrays["boxes"]
        corners = self._stream.read(boxes, np.empty((self.count, 2, 3), np.float32))
        if not np.isfinite(corners).all():
            wrong = np.argmin(np.isfinite(corners).all(axis=(1, 2)))
            raise SceneError(f"instance {wrong} is singular or out of reach", where="transforms")
        tree = bvh.build_boxes(self.device, corners, self.layout)
        order = self._stream.read(tree.buffers["indices"], np.empty(self.count, np.uint32))
        self._arrays["slots"] = buffers.upload(
            "the order of instances", np.argsort(order), np.uint32
        )
        self._place_instances()
        return tree

    def update(self, transforms: ArrayInput | None = None, *, wait_for: Events = None) -> cl.Event:
        """Enqueue moves of instances, and of meshes after their `update`.

        transforms: (k, 4, 4) float32, by default the former; do not change an array on the device
        before the event. No ray hits an instance with a singular transform.
        """
        with self._lock:
            self._opened()
            self._stream.after(wait_for)
            if transforms is not None:
                self._transforms = self._input(transforms)
            moved = [i for i, mesh in enumerate(self.accels) if mesh.moved is not self._moved[i]]
            self._copy_trees(moved)
            self._place_instances()
            bvh.refit_boxes(self._refitting, self.tree, self._arrays["boxes"])
            return self._stream.mark()

    def close(self) -> None:
        """Free the device's memory, except the meshes'."""
        super().close()
        self._arrays.clear()
        self._tree_buffers.clear()

    def _check(self, which: np.ndarray) -> None:
        """Raise SceneError for meshes of another context or layout, or wrong prototypes."""
        for i, mesh in enumerate(self.accels):
            if mesh.layout != self.layout or mesh.queue.context != self.queue.context:
                raise SceneError("it has another layout or context", where=f"accels[{i}]")
        if not self.count or which.dtype.kind not in "iu":
            message = f"whole numbers (k,) with k > 0 are wanted, not {which.shape} {which.dtype}"
            raise SceneError(message, where="prototypes")
        if which.min() < 0 or which.max() >= len(self.accels):
            message = f"{which.max()} is none of {len(self.accels)} meshes"
            raise SceneError(message, where="prototypes")

    def _input(self, transforms: ArrayInput) -> DeviceArg:
        """Check transforms and return them as an argument; the next command awaits their events."""
        if on_device(transforms):
            shape = getattr(transforms, "shape", ())
            flat = transforms.reshape(-1, 16) if shape[1:] == (4, 4) else transforms
            argument = device_arg(self.queue.context, "transforms", flat, 16, np.float32)
            if getattr(transforms, "events", ()):
                argument.events = transforms.events
        else:
            array = np.ascontiguousarray(transforms, np.float32)
            if array.shape[1:] != (4, 4):
                raise SceneError(f"(k, 4, 4) is wanted, not {array.shape}", where="transforms")
            argument = wrap_host(self.queue.context, array, False)
        if argument.rows != self.count:
            message = f"{self.count} instances have {argument.rows} of them"
            raise SceneError(message, where="transforms")
        self._stream.after(argument.events)
        return argument

    def _copy_trees(self, numbers: Sequence[int]) -> None:
        """Enqueue copies of meshes' trees into the common buffers."""
        for i in numbers:
            mesh = self.accels[i]
            self._stream.after([mesh.moved] if mesh.moved else None)
            self._moved[i] = mesh.moved
            for name, offset in zip(("nodes", "leaves"), self._offsets[i].tolist(), strict=True):
                self._stream.copy(self._tree_buffers[name], mesh.buffers[name], dst_offset=offset)

    def _place_instances(self) -> None:
        """Enqueue the computation of all instances' rows and boxes."""
        bound = self._bind(
            "place_instances",
            {
                "count": self.count,
                "nodes": self._tree_buffers["nodes"],
                "transforms": self._transforms.buffer,
                "transforms_begin": self._transforms.offset,
                **self._arrays,
            },
        )
        self._stream.run(bound, (self.count,))

    def _instances_text(self) -> str:
        return "\n".join(
            [
                '#include "core/lanes.cl"',
                '#include "core/rows.cl"',
                '#include "core/math.cl"',
                "typedef struct { global const uint *instances; } Scene;",
                INSTANCE.row_text(many=True),
                f'#include "tracing/instances.cl#{self.layout}"\n',
            ]
        )
