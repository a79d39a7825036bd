"""An acceleration structure over instances of meshes with transforms."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyopencl as cl
from numpy.typing import ArrayLike

from .. import bvh
from ..device import Buffers, Events
from ..errors import SceneError
from ..records import INSTANCE
from .accel import Accel
from .batch import ArrayInput, DeviceArg, device_arg, on_device, wrap_host
from .queries import Queries

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
