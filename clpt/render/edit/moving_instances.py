"""Instances that move on the device: their rows and boxes follow their transforms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt.arrays import Points, on_device
from clpt.bvh import Building
from clpt.geometry import instancing
from clpt.records import INSTANCE
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.scene.shapes import Shape

_ROOT = "stage/place_vertices.cl"

Location = tuple[cl.Buffer, int]  # a buffer, and the offset in it [words]
Boxes = tuple[NDArray[np.float32], cl.Buffer]  # what trees are over, on the host and the device
# Which instances, their rows and their boxes.
Transformed = tuple[NDArray[Any], NDArray[Any], NDArray[np.float32]]


class MovingInstances:
    """The instances of a scene on a device, and what moves them.

    numbers: by the number of a scene's shape, which instances it is, in the scene's order.
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
    ) -> Callable[[Boxes], None]:
        """Return what enqueues a move of instances, given the boxes of all.

        moved: which instances, and what they are then; matrices: those of their transforms that are
        on the device. Raises SceneError for a transform that is singular.
        """
        of_host = [one for one, matrix in zip(moved, matrices, strict=True) if matrix is None]
        transformed = self._transformed(of_host) if of_host else []

        def act(boxes: Boxes) -> None:
            if transformed:
                self._send(transformed, boxes)
            for (k, new), matrix in zip(moved, matrices, strict=True):
                if matrix is not None:
                    self._place(k, new, matrix, boxes[1])

        return act

    def _transformed(self, moved: Sequence[tuple[int, Shape]]) -> list[Transformed]:
        """The rows and boxes of instances whose transforms are on the host, by prototype."""
        matrices = instancing.matrices([new for _, new in moved])
        which = np.array([k for k, _ in moved])
        prototypes = self.lowered.prototypes[which]
        transformed = []
        for prototype in np.unique(prototypes).tolist():
            own = prototypes == prototype
            numbers = self.lowered.rows["number"][which[own]]
            hull, centre = self._hull(prototype), self.lowered.centres[prototype]
            rows, boxes = instancing.place(matrices[own], numbers, hull, centre)
            transformed.append((which[own], rows, boxes))
        return transformed

    def _send(self, transformed: list[Transformed], boxes: Boxes) -> None:
        """Enqueue that rows and boxes are written, neighbours at once.

        A row that a transform on the device has written is not known here, and never overwritten.
        """
        trees = self.scene.trees
        table, leaf = trees.rows, np.argsort(trees.order)
        for which, rows, own in transformed:
            for name in ("origin", "x", "y", "z"):
                table[name][leaf[which]] = rows[name]
            boxes[0][which] = own
        every = np.concatenate([which for which, _, _ in transformed])
        words = table.view(np.uint32).reshape(len(table), -1)
        self._write(trees.instances, words, leaf[every])
        self._write(boxes[1], boxes[0].reshape(len(table), -1), every)

    def _place(self, k: int, new: Shape, matrix: Location, boxes: cl.Buffer) -> None:
        """Enqueue that an instance has a transform that is on the device."""
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
        """Points whose hull holds the triangles of a prototype."""
        if prototype not in self._hulls:
            lowered, triangles = self.scene.lowered, self.lowered.triangles
            end = len(lowered.faces) - sum(triangles[prototype + 1 :])
            faces = lowered.faces[end - triangles[prototype] : end]
            owned = lowered.vertices[faces.min() : faces.max() + 1]
            self._hulls[prototype] = instancing.hull_points(owned)
        return self._hulls[prototype]

    def _write(self, buffer: cl.Buffer, table: NDArray[Any], rows: NDArray[np.integer]) -> None:
        """Enqueue that rows of a table are written, neighbours at once."""
        rows = np.unique(rows)
        for run in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
            begin, end = int(run[0]), int(run[-1]) + 1
            self.scene.stream.write(buffer, table[begin:end], begin * table[:1].nbytes)
