"""Instances and spheres that move on the device, frame after frame.

The rows and boxes of instances follow their transforms. Centres of spheres may come from memory of
the device, without a copy on the host.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Balls, Points, on_device
from clpt.bvh import Building
from clpt.geometry import analytic, instancing, shapes
from clpt.records import INSTANCE, SHAPE
from clpt.render.records.tables import as_array
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.scene.shapes import Shape, Spheres

_ROOT, _SPHERES = "stage/place.cl#vertices", "stage/place.cl#spheres"

Location = tuple[cl.Buffer, int]  # a buffer, and the offset in it [words]
Boxes = tuple[NDArray[np.float32], cl.Buffer]  # the boxes of a tree, on the host and the device
# Indices of instances, their rows and their boxes.
Transformed = tuple[NDArray[Any], NDArray[Any], NDArray[np.float32]]


class CannotMove(Exception):
    """A change that the kernels of clpt.render.edit.moving cannot make; its text says why.

    It never leaves clpt: the scene is then lowered again, and the reason is logged.
    """


class MovingInstances:
    """The instances of a scene on a device, and the kernels that move them.

    numbers: the indices of instances, in the scene's order, by the number of the scene's shape.
    """

    def __init__(self, scene: DeviceScene, building: Building):
        self.scene, self.building = scene, building
        self.lowered = scene.lowered.instances
        self.numbers: dict[int, list[int]] = {}
        for k, number in enumerate(self.lowered.rows["number"].tolist()):
            self.numbers.setdefault(number, []).append(k)
        self._hulls: dict[int, Points] = {}

    def plan(
        self, moved: Sequence[tuple[int, Shape]], matrices: Sequence[Location | None]
    ) -> list[Transformed]:
        """Return the rows and boxes of instances whose transforms are on the host.

        moved: indices of instances, and their new shapes; matrices: their transforms on the device,
        None for transforms on the host. Raises SceneError for a transform that is singular.
        """
        of_host = [pair for pair, matrix in zip(moved, matrices, strict=True) if matrix is None]
        return self._transformed(of_host) if of_host else []

    def move(
        self,
        transformed: list[Transformed],
        moved: Sequence[tuple[int, Shape]],
        matrices: Sequence[Location | None],
        boxes: Boxes,
    ) -> None:
        """Enqueue a move; transformed: the result of `plan`; boxes: of all instances."""
        if transformed:
            self._send(transformed, boxes)
        for (k, new), matrix in zip(moved, matrices, strict=True):
            if matrix is not None:
                self._place(k, new, matrix, boxes[1])

    def _transformed(self, moved: Sequence[tuple[int, Shape]]) -> list[Transformed]:
        """Return the rows and boxes of instances with transforms on the host, by prototype."""
        matrices = instancing.matrices([new for _, new in moved])
        which = np.array([k for k, _ in moved])
        prototypes = self.lowered.prototypes[which]
        transformed = []
        for prototype in np.unique(prototypes).tolist():
            same = prototypes == prototype
            numbers = self.lowered.rows["number"][which[same]]
            hull, centre = self._hull(prototype), self.lowered.centres[prototype]
            rows, boxes = instancing.place(matrices[same], numbers, hull, centre)
            transformed.append((which[same], rows, boxes))
        return transformed

    def _send(self, transformed: list[Transformed], boxes: Boxes) -> None:
        """Enqueue writes of rows and boxes, a write for each run of neighbours.

        The host does not know rows that kernels wrote, and never overwrites them.
        """
        trees = self.scene.trees
        table, leaf = trees.rows, np.argsort(trees.order)
        for which, rows, new_boxes in transformed:
            for name in ("origin", "x", "y", "z"):
                table[name][leaf[which]] = rows[name]
            boxes[0][which] = new_boxes
        every = np.concatenate([which for which, _, _ in transformed])
        words = table.view(np.uint32).reshape(len(table), -1)
        self._write(trees.instances, words, leaf[every])
        self._write(boxes[1], boxes[0].reshape(len(table), -1), every)

    def _place(self, k: int, new: Shape, matrix: Location, boxes: cl.Buffer) -> None:
        """Enqueue the kernel that gives an instance a transform on the device."""
        prototype = int(self.lowered.prototypes[k])
        hull, trees = self._hull(prototype), self.scene.trees
        if on_device(new.to_world):
            self.scene.stream.after(getattr(new.to_world, "events", ()))
        leaf = int(np.flatnonzero(trees.order == k)[0])
        self.building.run(
            _ROOT, "place_instance", 1, matrix=matrix[0], matrix_begin=matrix[1],
            centre=(*self.lowered.centres[prototype], 0.0), low=(*hull.min(axis=0), 0.0),
            high=(*hull.max(axis=0), 0.0), at=INSTANCE.words * leaf, number=k,
            instances=trees.instances, boxes=boxes,
        )  # fmt: skip

    def _hull(self, prototype: int) -> Points:
        """Return points whose hull contains the triangles of a prototype."""
        if prototype not in self._hulls:
            lowered, triangles = self.scene.lowered, self.lowered.triangles
            end = len(lowered.faces) - sum(triangles[prototype + 1 :])
            faces = lowered.faces[end - triangles[prototype] : end]
            owned = lowered.vertices[faces.min() : faces.max() + 1]
            self._hulls[prototype] = instancing.hull_points(owned)
        return self._hulls[prototype]

    def _write(self, buffer: cl.Buffer, table: NDArray[Any], rows: NDArray[np.integer]) -> None:
        """Enqueue writes of rows of a table, a write for each run of neighbours."""
        rows = np.unique(rows)
        for run in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
            begin, end = int(run[0]), int(run[-1]) + 1
            self.scene.stream.write(buffer, table[begin:end], begin * table[:1].nbytes)


class MovingSpheres:
    """The spheres of a scene on a device, and the kernels that write their table and boxes.

    A copy of arrays of the host that moved spheres stays on the device.
    """

    def __init__(self, scene: DeviceScene, building: Building):
        self.scene, self.building = scene, building
        self._sources: dict[int, cl.Buffer] = {}
        self._common: dict[int, NDArray[np.uint32]] = {}  # by their first word in `geometry`

    def plan(
        self, row: NDArray[np.void], shape: Spheres, matrix: transforms.Matrix
    ) -> tuple[NDArray[np.uint32], Any]:
        """Return the parameters that spheres share, and their centres, for `move`.

        row: of the shape in `shapes`; shape: the new shape; matrix: its transform to the world.

        Raises CannotMove for another number of spheres and for arrays on the device of another type
        or form; SceneError for memory of another context, or a matrix that stretches.
        """
        count, where, queue = self._count(row), shapes.where(shape), self.scene.stream.queue
        centers = as_array(shape.centers, "centers", queue, where)
        if len(centers) != count:
            raise CannotMove(f"{where} has {len(centers)} spheres, and had {count}")
        common = analytic.common(shape.placed(matrix))
        balls = None
        if not on_device(centers) and not on_device(shape.radii):
            balls = analytic.balls(shape.placed(np.eye(4)))
        elif not (on_device(centers) and _readable_in_place(centers)):
            raise CannotMove(
                f"the centres of {where} are no (n, 3) or (n, 4) float32 on the device"
            )
        return common, centers if balls is None else balls

    def move(
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
            _SPHERES, "place_spheres", self._count(row), source=source, source_begin=offset,
            columns=centers.shape[1], matrix=np.asarray(matrix, np.float32).ravel(),
            scale=float(common.view(np.float32)[analytic.member("sphere", "radius")]),
            padding=analytic.PADDING, first=prim - int(scene.lowered.settings["single_count"]),
            first_box=prim, spheres=scene.tables["spheres"], boxes=boxes,
        )  # fmt: skip

    def _write_common(self, first: int, common: NDArray[np.uint32]) -> None:
        """Enqueue the parameters that spheres share, if the device has other values."""
        lowered = self.scene.lowered.tables["geometry"][first : first + len(common)]
        if not np.array_equal(self._common.get(first, lowered), common):
            self.scene.stream.write(self.scene.tables["geometry"], common, 4 * first)
            self._common[first] = common

    def _count(self, row: NDArray[np.void]) -> int:
        """Return the number of spheres of a row of `shapes`."""
        lowered = self.scene.lowered
        rows = lowered.tables["shapes"].view(SHAPE.dtype)
        behind = rows["prim"][(rows["kind"] > 0) & (rows["prim"] > row["prim"])]
        end = int(behind.min()) if len(behind) else len(lowered.boxes)
        return end - int(row["prim"])

    def _upload(self, prim: int, balls: Balls) -> cl.Buffer:
        """Return a buffer with centres and radii from the host."""
        if prim not in self._sources:
            buffers = self.scene.buffers
            self._sources[prim] = buffers.allocate("spheres that move", balls.nbytes)
        self.scene.stream.write(self._sources[prim], balls)
        return self._sources[prim]


def _readable_in_place(centers: Any) -> bool:
    """Return whether a kernel can read centres in their memory on the device."""
    form = len(centers.shape) == 2 and centers.shape[1] in (3, 4)
    return form and centers.dtype == np.float32 and bool(centers.flags.c_contiguous)
