"""An acceleration structure over an application's triangles."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from .. import bvh
from ..device import Buffers, Events, wait
from ..errors import SceneError
from . import batch
from .batch import ArrayInput, device_arg, on_device
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
