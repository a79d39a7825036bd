"""Spheres whose centres come from device memory, frame after frame, without a way over the host."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Balls, on_device
from clpt.bvh import Building
from clpt.geometry import analytic, shapes, spheres
from clpt.records import SHAPE
from clpt.render.edit.cannot_move import CannotMove
from clpt.render.edit.moving_instances import Boxes
from clpt.render.records.device_arrays import as_array
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.scene.shapes import Spheres

_ROOT = "stage/place_spheres.cl"


class MovingSpheres:
    """The spheres of a scene on a device, and the kernels that write their table and boxes.

    Of spheres that were moved by arrays of the host, a copy of these stays on the device.
    """

    def __init__(self, scene: DeviceScene, building: Building):
        self.scene, self.building = scene, building
        self._sources: dict[int, cl.Buffer] = {}
        self._common: dict[int, NDArray[np.uint32]] = {}  # by their first word in `geometry`

    def plan(
        self, row: NDArray[np.void], shape: Spheres, matrix: transforms.Matrix
    ) -> Callable[[Boxes], None]:
        """Return what enqueues a move of spheres, given the boxes of all shapes.

        row: theirs in `shapes`; shape: as it will be; matrix: its transform to the world.

        Raises CannotMove for another number of spheres and for arrays on the device of another type
        or form; SceneError for memory of another context, or a matrix that stretches.
        """
        count, where, queue = self._count(row), shapes.where(shape), self.scene.stream.queue
        centers = as_array(shape.centers, "centers", queue, where)
        if len(centers) != count:
            raise CannotMove(f"{where} has {len(centers)} spheres, and had {count}")
        common = spheres.common(dataclasses.replace(shape, to_world=matrix))
        balls = None
        if not on_device(centers) and not on_device(shape.radii):
            balls = spheres.balls(dataclasses.replace(shape, to_world=np.eye(4)))
        elif not (on_device(centers) and _readable_in_place(centers)):
            raise CannotMove(
                f"the centres of {where} are no (n, 3) or (n, 4) float32 on the device"
            )
        source = centers if balls is None else balls
        return lambda boxes: self._move(row, matrix, common, source, boxes[1])

    def _move(
        self,
        row: NDArray[np.void],
        matrix: transforms.Matrix,
        common: NDArray[np.uint32],
        centers: Any,
        boxes: cl.Buffer,
    ) -> None:
        """Enqueue a move; centers: on the device, or the balls (n, 4) of the host."""
        scene, prim = self.scene, int(row["prim"])
        self._write_common(int(row["params"]), common)
        scene.moved_tables.add("spheres")
        if on_device(centers):
            scene.stream.after(centers.events)
            source, offset = centers.base_data, centers.offset // 4
        else:
            source, offset = self._upload(prim, centers), 0
        self.building.run_each(
            _ROOT, "place_spheres", self._count(row), source=source, source_begin=offset,
            columns=centers.shape[1], matrix=np.asarray(matrix, np.float32).ravel(),
            scale=float(common.view(np.float32)[analytic.member("sphere", "radius")]),
            padding=analytic.PADDING, first=prim - int(scene.lowered.settings["single_count"]),
            first_box=prim, spheres=scene.tables["spheres"], boxes=boxes,
        )  # fmt: skip

    def _write_common(self, first: int, common: NDArray[np.uint32]) -> None:
        """Enqueue the parameters that spheres share, where they are not those on the device."""
        lowered = self.scene.lowered.tables["geometry"][first : first + len(common)]
        if not np.array_equal(self._common.get(first, lowered), common):
            self.scene.stream.write(self.scene.tables["geometry"], common, 4 * first)
            self._common[first] = common

    def _count(self, row: NDArray[np.void]) -> int:
        """Return the number of spheres that a row of `shapes` stands for."""
        lowered = self.scene.lowered
        rows = lowered.tables["shapes"].view(SHAPE.dtype)
        behind = rows["prim"][(rows["kind"] > 0) & (rows["prim"] > row["prim"])]
        end = int(behind.min()) if len(behind) else len(lowered.boxes)
        return end - int(row["prim"])

    def _upload(self, prim: int, balls: Balls) -> cl.Buffer:
        """A buffer with centres and radii that come from the host."""
        if prim not in self._sources:
            buffers = self.scene.buffers
            self._sources[prim] = buffers.allocate("spheres that move", balls.nbytes)
        self.scene.stream.write(self._sources[prim], balls)
        return self._sources[prim]


def _readable_in_place(centers: Any) -> bool:
    """Whether a kernel can read centres where they are on the device."""
    form = len(centers.shape) == 2 and centers.shape[1] in (3, 4)
    return form and centers.dtype == np.float32 and bool(centers.flags.c_contiguous)
