"""Many copies of meshes, each at a place of its own, in one structure."""

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
from .arrays import DeviceArg, Given, device_arg, on_device
from .batch import wrap_host
from .queries import Queries

_ADVICE = "place fewer or smaller meshes"


class InstancedAccel(Queries):
    """Instances of meshes that rays can be sent at, on the caller's queue.

    accels: the meshes, in one context and of one layout; what rays need of them is copied, so they
    may be closed if they move no more. prototypes: (k,) which mesh each instance is; transforms:
    (k, 4, 4) float32 from the mesh to the world, numpy or a PyOpenCL array. A hit's `primitive`
    counts in its mesh, its `instance` says where; t is in units of the world's direction.

    Raises SceneError for what does not fit together, and for transforms that are singular or move
    a mesh beyond 1e12.
    """

    instanced = True

    def __init__(
        self,
        queue: cl.CommandQueue,
        accels: Sequence[Accel],
        prototypes: ArrayLike,
        transforms: Given,
        *,
        wait_for: Events = None,
    ):
        super().__init__(queue, accels[0].layout if accels else None)
        self.accels = tuple(accels)
        which = np.asarray(prototypes)
        self.count = len(which) if which.ndim == 1 else 0
        self._check(which)
        give = Buffers(self.device)
        sizes = np.array([[one.buffers[n].size for n in ("nodes", "leaves")] for one in accels])
        self._begins = np.cumsum(sizes, axis=0) - sizes
        self._joined = {
            name: give.allocate("the trees of instances", int(whole), _ADVICE)
            for name, whole in zip(("nodes", "leaves"), sizes.sum(axis=0), strict=True)
        }
        self._moved: list[cl.Event | None] = [None] * len(accels)
        boxes = give.allocate("boxes of instances", 24 * self.count, _ADVICE)
        self._places = {
            "begins": give.upload("the trees of instances", self._begins // 32, np.uint32),
            "prototypes": give.upload("the meshes of instances", which, np.uint32),
            "slots": give.upload("the order of instances", np.arange(self.count), np.uint32),
            "instances": give.allocate("instances", 4 * INSTANCE.words * self.count, _ADVICE),
            "boxes": boxes,
        }
        self._stream.after(wait_for)
        self._join(range(len(accels)))
        self._transforms = self._laid(transforms)
        self._place()
        there = self._stream.read(boxes, np.empty((self.count, 2, 3), np.float32))
        if not np.isfinite(there).all():
            wrong = np.argmin(np.isfinite(there).all(axis=(1, 2)))
            raise SceneError(f"instance {wrong} is singular or out of reach", where="transforms")
        self.tree = bvh.build_boxes(self.device, there, self.layout)
        order = self._stream.read(self.tree.buffers["indices"], np.empty(self.count, np.uint32))
        self._places["slots"] = give.upload("the order of instances", np.argsort(order), np.uint32)
        self._place()
        self._refitting = bvh.Building(self.device, stream=self._stream)
        self._trees = {
            **self._joined,
            "instance_nodes": self.tree.buffers["nodes"],
            "instances": self._places["instances"],
        }

    def update(self, transforms: Given | None = None, *, wait_for: Events = None) -> cl.Event:
        """Enqueue that instances move, and that meshes are as their `update` left them.

        transforms: (k, 4, 4) float32, those before by default; leave an array on the device alone
        until the event. An instance whose transform is singular is met by no ray.
        """
        with self._lock:
            self._opened()
            self._stream.after(wait_for)
            if transforms is not None:
                self._transforms = self._laid(transforms)
            moved = [i for i, one in enumerate(self.accels) if one.moved is not self._moved[i]]
            self._join(moved)
            self._place()
            bvh.refit_boxes(self._refitting, self.tree, self._places["boxes"])
            return self._stream.mark()

    def close(self) -> None:
        """Give the device's memory back; the meshes are left alone."""
        super().close()
        self._places.clear()
        self._joined.clear()

    def _check(self, which: np.ndarray) -> None:
        """Raise SceneError if the parts do not fit together."""
        for i, one in enumerate(self.accels):
            if one.layout != self.layout or one.queue.context != self.queue.context:
                raise SceneError("it has another layout or context", where=f"accels[{i}]")
        if not self.count or which.dtype.kind not in "iu":
            message = f"one whole number or more is wanted, not {which.shape} {which.dtype}"
            raise SceneError(message, where="prototypes")
        if which.min() < 0 or which.max() >= len(self.accels):
            message = f"{which.max()} is none of {len(self.accels)} meshes"
            raise SceneError(message, where="prototypes")

    def _laid(self, transforms: Given) -> DeviceArg:
        """Transforms on the device."""
        if on_device(transforms):
            shape = getattr(transforms, "shape", ())
            flat = transforms.reshape(-1, 16) if shape[1:] == (4, 4) else transforms
            found = device_arg(self.queue.context, "transforms", flat, 16, np.float32)
            if getattr(transforms, "events", ()):
                found.events = transforms.events
        else:
            array = np.ascontiguousarray(transforms, np.float32)
            if array.shape[1:] != (4, 4):
                raise SceneError(f"(k, 4, 4) is wanted, not {array.shape}", where="transforms")
            found = wrap_host(self.queue.context, array, False)
        if found.rows != self.count:
            message = f"{self.count} instances have {found.rows} of them"
            raise SceneError(message, where="transforms")
        self._stream.after(found.events)
        return found

    def _join(self, numbers: Sequence[int]) -> None:
        """Enqueue that the trees of meshes are copied to those of all."""
        for i in numbers:
            one = self.accels[i]
            self._stream.after([one.moved] if one.moved else None)
            self._moved[i] = one.moved
            for name, begin in zip(("nodes", "leaves"), self._begins[i].tolist(), strict=True):
                self._stream.copy(self._joined[name], one.buffers[name], dst_offset=begin)

    def _place(self) -> None:
        """Enqueue rows and boxes of all instances."""
        bound = self._bind(
            "place_instances",
            {
                "count": self.count,
                "nodes": self._joined["nodes"],
                "transforms": self._transforms.buffer,
                "transforms_begin": self._transforms.begin,
                **self._places,
            },
        )
        self._stream.run(bound, (self.count,))

    def _instances_text(self) -> str:
        return "\n".join(
            [
                '#include "core/lanes.cl"',
                '#include "core/math.cl"',
                "typedef struct { global const uint *instances; } Scene;",
                INSTANCE.row_text(),
                f'#include "tracing/instances_{self.layout}.cl"\n',
            ]
        )
