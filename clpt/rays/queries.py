"""Ray queries: rays in, hits out, on the host or on the device."""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray
from pyopencl.array import Array

from ..bvh import ALONE, TREES, choose_tree, traversal_text
from ..device import (
    BoundKernel,
    Device,
    Events,
    Program,
    Stream,
    Virtual,
    assemble,
    build,
    forking,
    supersede,
    wait,
)
from ..errors import DeviceError, SceneError
from ..records import INSTANCE, QUERY_SIZES
from . import batch
from .batch import ArrayInput, DeviceArg

_GROUP = 64  # rays of a work-group
_BATCH = QUERY_SIZES["rays"]  # rays of a work-item
_HITS: batch.Columns = {
    "t": (0, np.float32),
    "primitive": (0, np.int32),
    "barycentrics": (2, np.float32),
}
_SEQUENTIAL, _INTERLEAVED = "bvh/query.cl#sequential", "bvh/query.cl#interleaved"
_PROGRAMS = {  # by kernel: its program, and whether it finds all hits of a ray
    "query_closest": (_SEQUENTIAL, False),
    "query_occluded": (_SEQUENTIAL, False),
    "query_count": ("bvh/query.cl#all_hits", True),
    "query_all_hits": ("bvh/query.cl#all_hits", True),
    "place_instances": ("bvh/place.cl#instances", False),
}
_RAY_ARRAYS = ("origins", "directions", "t_mins", "t_maxs")
_Self = TypeVar("_Self", bound="Queries")


@dataclass(frozen=True)
class Hits:
    """The first hits of rays, in numpy or PyOpenCL arrays like the rays.

    t: (n,) float32 in units of the direction, inf without a hit; primitive: (n,) int32 row of
    `faces`, -1 without a hit; barycentrics: (n, 2) float32 of the face's second and third vertex;
    instance: (n,) int32, -1 without a hit, None for meshes without instances; event: the arrays
    are valid after it.
    """

    t: Any
    primitive: Any
    barycentrics: Any
    instance: Any
    event: cl.Event


@dataclass(frozen=True)
class AllHits:
    """All hits of rays, by ray and then by distance, in numpy arrays.

    ray: (k,) int64 number of the ray; t: (k,) float32; primitive: (k,) int32; barycentrics: (k, 2)
    float32, see `Hits`.
    """

    ray: NDArray[np.int64]
    t: NDArray[np.float32]
    primitive: NDArray[np.int32]
    barycentrics: NDArray[np.float32]


class Queries:
    """The queries of an acceleration structure.

    Any thread may call the methods; calls of an object run in turn.
    """

    instanced = False

    def __new__(cls, queue: object = None, *_: Any, **__: Any) -> Queries:
        if not isinstance(queue, cl.CommandQueue):  # before Python counts the other arguments
            problem = f"its first argument is a pyopencl.CommandQueue, not {type(queue).__name__}"
            advice = "clpt.device.choose().queue is one"
            if hasattr(queue, "vertices") and hasattr(queue, "faces"):
                advice += f"; of a mesh, {cls.__name__}(queue, mesh.vertices, mesh.faces)"
            raise TypeError(f"{cls.__name__}: {problem}; {advice}")
        return super().__new__(cls)

    def __init__(self, queue: cl.CommandQueue, layout: str | None):
        self.queue = queue
        self.device = Device.adopt(queue)
        self.layout = choose_tree(self.device) if layout is None else layout
        if self.layout not in TREES:
            raise SceneError(f"{layout!r} is none of {', '.join(TREES)}", where="layout")
        self._memory = queue.context, self.device.info.is_cpu
        self._stream = Stream(queue)
        self._lock = forking.renewed(threading.RLock())
        self._kernels: dict[str, BoundKernel] = {}
        self._interleaved = False  # whether a work-item traces several rays at once
        self._trees: dict[str, cl.Buffer] | None = {}

    def intersect(
        self,
        origins: ArrayInput,
        directions: ArrayInput,
        t_min: ArrayInput = 0.0,
        t_max: ArrayInput = math.inf,
        *,
        out: Hits | None = None,
        wait_for: Events = None,
    ) -> Hits:
        """Return the first hit of each ray, at t_min < t < t_max within rounding.

        origins, directions: (n, 3) float32, directions of any length; t_min, t_max: numbers or (n,)
        float32. If origins or directions are on the device, so are the hits, and the call returns
        at once: do not change the arrays before the event. Otherwise it waits and returns numpy
        arrays. A single vector of the host counts for all rays. Rays that are not finite or have no
        direction hit nothing. out: hits of as many rays on the device, to be overwritten.

        Raises SceneError for arrays of wrong shapes or types, DeviceError when closed.
        """
        columns = {**_HITS, "instance": (0, np.int32)} if self.instanced else _HITS
        before = {} if out is None else vars(out)
        rays = batch.rays(*self._memory, origins, directions, t_min, t_max)
        results, event = self._run("query_closest", rays, columns, before, wait_for)
        return Hits(**{"instance": None, **results}, event=event)

    def occluded(
        self,
        origins: ArrayInput,
        directions: ArrayInput,
        t_min: ArrayInput = 0.0,
        t_max: ArrayInput = math.inf,
        *,
        out: Array | None = None,
        wait_for: Events = None,
    ) -> Any:
        """Return whether each ray hits anything at t_min < t < t_max: (n,) uint8, 1 or 0.

        Faster than `intersect`, otherwise like it; an array on the device is valid after its last
        event. out: such an array, to be overwritten.
        """
        before = {} if out is None else {"met": out}
        rays = batch.rays(*self._memory, origins, directions, t_min, t_max)
        results, _ = self._run("query_occluded", rays, {"met": (0, np.uint8)}, before, wait_for)
        return results["met"]

    @property
    def buffers(self) -> dict[str, cl.Buffer]:
        """The trees, by the names of BVH_ARGS in `clpt.kernel_source("bvh")`, for custom kernels.

        The buffers stay when triangles move. Raises DeviceError when closed.
        """
        with self._lock:
            return dict(self._opened())

    def close(self) -> None:
        """Free the device's memory, except the caller's arrays."""
        with self._lock:
            for buffer in (self._trees or {}).values():
                buffer.release()
            self._trees = None
            self._kernels.clear()

    def __enter__(self: _Self) -> _Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _opened(self) -> dict[str, cl.Buffer]:
        if self._trees is None:
            raise DeviceError(f"this {type(self).__name__} is closed; make a new one")
        return self._trees

    def _run(
        self,
        name: str,
        rays: batch.Rays,
        columns: batch.Columns,
        out: Mapping[str, Any],
        wait_for: Events,
    ) -> tuple[Mapping[str, Any], cl.Event]:
        """Enqueue a kernel, wait if rays are on the host, and return its results and its event."""
        with self._lock:
            self._opened()
            if rays.from_host:
                if out:
                    raise SceneError("it is for rays that are on the device", where="out")
                self._stream.after(wait_for)
                arrays, outputs = batch.host_results(*self._memory, rays.count, columns)
                return arrays, self._wait(name, rays, arrays, outputs)
            results, outputs = batch.results(self.queue, rays.count, columns, out)
            self._stream.after(wait_for)
            event = self._enqueue(name, rays, outputs)
            for array in results.values():
                supersede(array, event)
            return results, event

    def _wait(
        self,
        name: str,
        rays: batch.Rays,
        arrays: Mapping[str, NDArray[Any]],
        outputs: Mapping[str, DeviceArg],
    ) -> cl.Event:
        """Run a kernel that writes arrays of the host; wait for it."""
        event = self._enqueue(name, rays, outputs)
        for key, array in arrays.items():
            if array.size:  # a copy to itself if the device uses the host's memory
                event = self._stream.read_later(outputs[key].buffer, array)
        wait(event)
        if rays.count:  # drop the kernel's references to host memory
            self._kernels[name].set_args(**dict.fromkeys([*_RAY_ARRAYS, *outputs]))
        return event

    def _enqueue(self, name: str, rays: batch.Rays, outputs: Mapping[str, DeviceArg]) -> cl.Event:
        """Enqueue a kernel for all rays, after the events of its arrays."""
        arrays = [*rays.arrays, *outputs.values()]
        self._stream.after([event for array in arrays for event in array.events])
        if not rays.count:
            return self._stream.mark()
        arguments = {
            **self._opened(),
            **rays.arguments,
            **{key: output.buffer for key, output in outputs.items()},
            "count": rays.count,
            "begins": batch.offsets(arrays),
        }
        bound = self._bind(name, arguments)
        if self._root_of(name) == _INTERLEAVED:
            return self._stream.run(bound, (-(-rays.count // _BATCH),), (1,))
        return self._stream.run(bound, (-(-rays.count // _GROUP) * _GROUP,), (_GROUP,))

    def _bind(self, name: str, arguments: Mapping[str, Any]) -> BoundKernel:
        """Return a kernel with its arguments; create it on first use."""
        bound = self._kernels.get(name)
        if bound is None:
            bound = self._kernels[name] = self._program(name).kernel(name).bind(**arguments)
        else:
            bound.set_args(**arguments)
        return bound

    def _program(self, kernel: str) -> Program:
        root, all_hits = self._root_of(kernel), _PROGRAMS[kernel][1]
        texts: Virtual = {
            "generated/layout.cl": traversal_text(self.layout, all_hits),
            "generated/instance_traversal.cl": self._instances_text(),
            "generated/motion.cl": "",  # instances stand still
            "generated/keyed_layout.cl": "",
            **({} if self.device.info.is_cpu else ALONE),
        }
        defines = {
            "USES_INSTANCES": int(self.instanced),
            "MOVES_INSTANCES": 0,
            "INSTANCE_ROW_WORDS": INSTANCE.words,
            "LANES": 1,
        }
        return build(self.device, assemble(root, texts, defines))

    def _root_of(self, kernel: str) -> str:
        root = _PROGRAMS[kernel][0]
        return _INTERLEAVED if self._interleaved and root == _SEQUENTIAL else root

    def _instances_text(self) -> str:
        """Return the generated text for the traversal of instances."""
        return ""
