"""Instances that move where they are: rows and boxes on the device follow their transforms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt.bvh import Building
from clpt.records import INSTANCE
from clpt.render.lowering.device_arrays import on_device
from clpt.render.lowering.geometry import instancing, shapes
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene.shapes import Shape

_ROOT = "motion/place_vertices.cl"

Place = tuple[cl.Buffer, int]  # a buffer, and where in it something begins [words]
Boxes = tuple[NDArray[np.float32], cl.Buffer]  # what trees are over, on the host and the device


class MovingInstances:
    """What writes instances of a render anew where they are.

    rows: by the number of the scene's shape, their places among all, in the scene's order.
    """

    def __init__(self, front: Wavefront, building: Building):
        self.front, self.building = front, building
        self.lowered = front.lowered.instances
        self.rows: dict[int, list[int]] = {}
        for k, number in enumerate(self.lowered.rows["number"].tolist()):
            self.rows.setdefault(number, []).append(k)
        self._outlines: dict[int, shapes.Points] = {}

    def plan(
        self, moved: Sequence[tuple[int, Shape]], places: Sequence[Place | None]
    ) -> Callable[[Boxes], None]:
        """Return what enqueues that instances are elsewhere, given the boxes of all.

        moved: their places among all, and what they are then; places: where the transforms are, of
        those on the device. Raises SceneError for a transform that is singular.
        """
        there = [i for i, place in enumerate(places) if place is None]
        given = [moved[i] for i in there]
        made = self._placed(given) if given else []

        def act(boxes: Boxes) -> None:
            if made:
                self._send(made, boxes)
            for (k, new), place in zip(moved, places, strict=True):
                if place is not None:
                    self._place(k, new, place, boxes[1])

        return act

    def _placed(
        self, moved: Sequence[tuple[int, Shape]]
    ) -> list[tuple[NDArray[Any], NDArray[Any], NDArray[np.float32]]]:
        """By prototype: which instances, their rows and boxes, of transforms of the host."""
        matrices = instancing.matrices([new for _, new in moved])
        rows = np.array([k for k, _ in moved])
        prototypes = self.lowered.prototypes[rows]
        made = []
        for prototype in np.unique(prototypes).tolist():
            these = prototypes == prototype
            numbers = self.lowered.rows["number"][rows[these]]
            hull_points, centre = self._outline(prototype), self.lowered.centres[prototype]
            placed, boxes = instancing.place(matrices[these], numbers, hull_points, centre)
            made.append((rows[these], placed, boxes))
        return made

    def _send(
        self, made: list[tuple[NDArray[Any], NDArray[Any], NDArray[np.float32]]], boxes: Boxes
    ) -> None:
        """Enqueue that rows and boxes are written, with what lies between the first and the last.

        What was placed by a transform of the device is not known here; it is never overwritten.
        """
        table, back = self.front.instances, np.argsort(self.front.instance_order)
        for these, placed, own in made:
            for name in ("origin", "x", "y", "z"):
                table[name][back[these]] = placed[name]
            boxes[0][these] = own
        rows = np.concatenate([these for these, _, _ in made])
        words = table.view(np.uint32).reshape(len(table), -1)
        _write(self.front, self.front.named["instances"], words, back[rows])
        _write(self.front, boxes[1], boxes[0].reshape(len(table), -1), rows)

    def _place(self, k: int, new: Shape, place: Place, boxes: cl.Buffer) -> None:
        """Enqueue that an instance is where a transform on the device puts it."""
        prototype = int(self.lowered.prototypes[k])
        hull_points = self._outline(prototype)
        if on_device(new.to_world):
            self.front.stream.after(getattr(new.to_world, "events", ()))
        back = int(np.flatnonzero(self.front.instance_order == k)[0])
        self.building.run(
            _ROOT, "place_instance", 1, matrix=place[0], matrix_begin=place[1],
            centre=(*self.lowered.centres[prototype], 0.0), low=(*hull_points.min(axis=0), 0.0),
            high=(*hull_points.max(axis=0), 0.0), at=INSTANCE.words * back, number=k,
            instances=self.front.named["instances"], boxes=boxes,
        )  # fmt: skip

    def _outline(self, prototype: int) -> shapes.Points:
        """Points around the triangles of a prototype."""
        if prototype not in self._outlines:
            lowered, triangles = self.front.lowered, self.lowered.triangles
            end = len(lowered.faces) - sum(triangles[prototype + 1 :])
            faces = lowered.faces[end - triangles[prototype] : end]
            owned = lowered.vertices[faces.min() : faces.max() + 1]
            self._outlines[prototype] = instancing.hull_points(owned)
        return self._outlines[prototype]


def _write(
    front: Wavefront, buffer: cl.Buffer, table: NDArray[Any], rows: NDArray[np.integer]
) -> None:
    """Enqueue that rows of a table are written, neighbours at once."""
    rows = np.unique(rows)
    for run in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1):
        begin, end = int(run[0]), int(run[-1]) + 1
        front.stream.write(buffer, table[begin:end], begin * table[:1].nbytes)
