"""Spheres whose centres come from device memory, frame after frame, without a way over the host."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pyopencl as cl

from clpt import transforms
from clpt.bvh import Building
from clpt.records import SHAPE
from clpt.render.lowering.device_arrays import as_array, on_device
from clpt.render.lowering.geometry import shapes, spheres
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene.shapes import Spheres

_ROOT = "motion/place_spheres.cl"


class MovingSpheres:
    """What writes the spheres of a render anew where they are: their table and their boxes.

    Of spheres that were moved by arrays of the host, a copy of these stays on the device.
    """

    def __init__(self, front: Wavefront, building: Building):
        self.front, self.building = front, building
        self._sources: dict[int, cl.Buffer] = {}

    def plan(
        self, row: Any, shape: Spheres, matrix: transforms.Matrix
    ) -> Callable[[cl.Buffer], None] | None:
        """Return what enqueues that spheres are as in a shape, given the buffer of all boxes.

        row: theirs in `shapes`; shape: as it will be; matrix: its placement in the world. None for
        another number of spheres, for arrays on the device of another type or form, and for spheres
        that emit: lights follow from them.

        Raises SceneError for memory of another context, or a matrix that stretches.
        """
        count, where, queue = self._count(row), shapes.where(shape), self.front.stream.queue
        centers = as_array(shape.centers, "centers", queue, where)
        if shape.emission is not None or len(centers) != count:
            return None
        placed = dataclasses.replace(shape, to_world=matrix)
        common = spheres.common(placed)
        scale = float(common.view(np.float32)[shapes.member("sphere", "radius")])
        given = None
        if not on_device(centers) and not on_device(shape.radii):
            given = spheres.balls(dataclasses.replace(shape, to_world=np.eye(4)))
        elif not (on_device(centers) and _in_place(centers)):
            return None
        columns = centers.shape[1] if given is None else 4

        def act(boxes: cl.Buffer) -> None:
            front = self.front
            at, geometry = int(row["params"]), front.lowered.tables["geometry"]
            if not np.array_equal(geometry[at : at + len(common)], common):
                front.stream.write(front.named["geometry"], common, 4 * at)
                geometry[at : at + len(common)] = common
            front.moved.add("spheres")
            if given is None:
                front.stream.after(centers.events)
                source, begin = centers.base_data, centers.offset // 4
            else:
                source, begin = self._sent(int(row["prim"]), given), 0
            prim = int(row["prim"])
            self.building.run_each(
                _ROOT, "place_spheres", count, source=source, source_begin=begin, columns=columns,
                matrix=np.asarray(matrix, np.float32).ravel(), scale=scale,
                padding=shapes.PADDING, first=prim - int(front.lowered.settings["single_count"]),
                first_box=prim, spheres=front.named["spheres"], boxes=boxes,
            )  # fmt: skip

        return act

    def _count(self, row: Any) -> int:
        """How many spheres a row of `shapes` stands for."""
        rows = self.front.lowered.tables["shapes"].view(SHAPE.dtype)
        behind = rows["prim"][(rows["kind"] == row["kind"]) & (rows["prim"] > row["prim"])]
        end = int(behind.min()) if len(behind) else len(self.front.lowered.boxes)
        return end - int(row["prim"])

    def _sent(self, prim: int, given: spheres.Balls) -> cl.Buffer:
        """A buffer with centres and radii that come from the host."""
        if prim not in self._sources:
            self._sources[prim] = self.front.buffers.allocate("spheres that move", given.nbytes)
        self.front.stream.write(self._sources[prim], given)
        return self._sources[prim]


def _in_place(centers: Any) -> bool:
    """Whether a kernel can read centres where they are on the device."""
    form = len(centers.shape) == 2 and centers.shape[1] in (3, 4)
    return form and centers.dtype == np.float32 and bool(centers.flags.c_contiguous)
