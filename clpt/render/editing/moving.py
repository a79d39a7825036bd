"""Shapes that move where they are: tables and trees on the device follow them, nothing is rebuilt.

What a shape of triangles has in the joined tables is written anew by kernels, from arrays that may
lie on the device, then the tree is fitted to it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import bvh, transforms
from clpt.records import SHAPE
from clpt.render.editing.moving_instances import Boxes, MovingInstances, Place
from clpt.render.editing.moving_spheres import MovingSpheres
from clpt.render.lowering.device_arrays import on_device
from clpt.render.lowering.geometry import shapes
from clpt.render.lowering.geometry.tessellate import keeps_its_kind
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import Scene
from clpt.scene.shapes import Instance, Mesh, Shape, Spheres

_ROOT = "motion/place_vertices.cl"
_NORMALS = 1  # SHAPE_NORMALS of kernels/path/surface_flags.cl
_MOVES = {"to_world", "vertices", "normals", "centers"}  # what may change in place
ANEW = 16  # moves of spheres, which go each its own way, from one tree to the next

Action = Callable[[], None]


@dataclass(eq=False)
class _Region:
    """What one shape has in the tables, a run of each.

    row: its row of `shapes`; vertices, faces: first and number; flips: whether its faces are turned
    round; whole: whether none was left out; own: its transform within the instance that places it.
    Buffers are made when a move
    first asks for them: matrix: where it is placed; local: vertices and normals before that, and
    what they were made of; around: the triangles around each vertex, as place.cl has them.
    """

    row: NDArray[Any]
    shape: Any
    vertices: tuple[int, int]
    faces: tuple[int, int]
    flips: bool = False
    whole: bool = True
    own: transforms.Matrix = field(default_factory=lambda: transforms.IDENTITY)
    matrix: cl.Buffer | None = None
    local: tuple[Any, dict[str, cl.Buffer]] | None = None
    around: dict[str, cl.Buffer] | None = None


class Moving:
    """What of a scene on the device can move, and how.

    scene: as it was lowered. Of each shape that moved without new vertices a copy of its own
    vertices and normals stays on the device; of each smooth one whose vertices moved, 4 bytes a
    vertex and 12 a triangle.
    """

    def __init__(self, front: Wavefront, scene: Scene):
        self.front, self.lowered = front, front.lowered
        self.building = bvh.Building(front.device, stream=front.stream)
        self.regions: dict[int, list[_Region]] = {}  # by the number of the scene's shape
        self._boxes: dict[str, tuple[NDArray[np.float32], cl.Buffer]] = {}
        self._moved: set[str] = set()
        self._moves = 0  # of spheres
        self._spheres = MovingSpheres(front, self.building)
        self._instances = MovingInstances(front, self.building)
        instances = self.lowered.instances
        world = len(self.lowered.faces) - sum(instances.triangles)
        for region in self._all_regions():
            number = int(region.row["number"])
            if region.row["kind"] == 0 and region.faces[0] >= world:
                continue  # of a group: its instances move, not it
            placed = scene.shapes[number]
            if isinstance(placed, Instance):
                outer = shapes.placement(placed)
                region.own = transforms.inverse(outer) @ shapes.placement(region.shape)
            self.regions.setdefault(number, []).append(region)

    def move(self, scene: Scene, swaps: Mapping[int, tuple[Any, Any]]) -> bool:
        """Enqueue that shapes are where others that take their place are, and what follows.

        scene: as it is; swaps: see clpt.render.editing.scene_edit. Returns False, with nothing done, where the
        tables must be made anew: what has more than another place or other vertices, what emits, a
        group's shapes, another number of vertices, other vertices of a mesh that has triangles
        without an area, a shape that is mirrored, all where light is traced from lights.

        Raises SceneError for a transform that is singular, and arrays of the wrong shape or type.
        """
        if self.lowered.features.light_paths:
            return False
        numbers = {id(shape): number for number, shape in enumerate(scene.shapes)}
        actions: list[Action] = []
        instances: list[tuple[int, Shape]] = []
        places: list[Place | None] = []
        for old, new in swaps.values():
            number = numbers.get(id(old))
            if number is None or not _moves_only(old, new):
                return False
            place = self._floats(new.to_world, (4, 4)) if on_device(new.to_world) else None
            if place is None and on_device(new.to_world):
                return False
            for region in self.regions.get(number, ()):
                made = self._plan(region, old, new, place)
                if made is None:
                    return False
                actions += made
            rows = self._instances.rows.get(number, ())
            instances += [(k, new) for k in rows]
            places += [place for _ in rows]
        if instances:
            act = self._instances.plan(instances, places)
            given = self.lowered.instances.boxes
            actions.append(lambda: act(self._boxes_of("instance", given)))
        for action in actions:
            action()
        self._fit()
        return True

    def _all_regions(self) -> list[_Region]:
        """What every shape has in the tables, in the order of their rows."""
        lowered = self.lowered
        made, ends = [], (len(lowered.vertices), len(lowered.faces))
        for row, shape, vertex, face in reversed(lowered.owners):
            if row["kind"]:
                made.append(_Region(row, shape, (0, 0), (0, 0)))
                continue
            runs = (vertex, ends[0] - vertex), (face, ends[1] - face)
            flips = transforms.flips_handedness(shapes.placement(shape))
            whole = not isinstance(shape, Mesh) or len(shape.faces) == runs[1][1]
            made.append(_Region(row, shape, *runs, flips, whole))
            ends = vertex, face
        return made[::-1]

    def _plan(
        self, region: _Region, old: Any, new: Any, placed: Place | None
    ) -> list[Action] | None:
        """What moves a region with its shape; None if nothing can."""
        if region.shape.emission is not None:
            return None
        if region.row["kind"]:
            return None if placed else self._analytic(region, new)
        count = region.vertices[1]
        for values in (getattr(new, name, None) for name in ("vertices", "normals")):
            if on_device(values) and self._floats(values, (count, 3)) is None:
                return None
        matrix, points = transforms.IDENTITY, None
        if placed is None:
            matrix = shapes.placement(new) @ region.own
            if transforms.flips_handedness(matrix) != region.flips:
                return None
        elif isinstance(new, Instance):
            return None
        if getattr(new, "vertices", None) is not getattr(old, "vertices", None):
            if not region.whole:
                return None
            if not on_device(new.vertices):
                points = shapes.points(new)
                if len(points) != count:
                    return None
        return [lambda: self._place(region, new, points, matrix, placed)]

    def _analytic(self, region: _Region, new: Any) -> list[Action] | None:
        """What moves what is no triangles; None where that is another shape then."""
        shape = region.shape if isinstance(new, Instance) else new
        matrix = shapes.placement(new) @ region.own
        placed = dataclasses.replace(shape, to_world=matrix)
        if not keeps_its_kind(placed):
            return None
        many = isinstance(shape, Spheres)
        place = self._spheres.plan(region.row, shape, matrix) if many else None
        if many and place is None:
            return None
        single = None if many else self._single(region, placed)

        def move() -> None:
            region.shape = shape
            boxes = self._boxes_of("shape", self.lowered.boxes)
            if place is not None:
                place(boxes[1])
            elif single is not None:
                single(boxes)
            self.front.moved |= {"geometry", "spheres"}

        return [move]

    def _single(self, region: _Region, shape: Shape) -> Callable[[Boxes], None]:
        """What enqueues that a sphere, disk or cylinder has other parameters and another box."""
        words, box = shapes.row(shape), np.stack(shapes.bounds(shape))
        rows = self.lowered.tables["shapes"].view(SHAPE.dtype)
        first = int(self.lowered.settings["first_analytic"])
        number = int(np.flatnonzero(rows["params"][first:] == region.row["params"])[0])

        def act(boxes: Boxes) -> None:
            stream = self.front.stream
            stream.write(self.front.named["geometry"], words, 4 * int(region.row["params"]))
            boxes[0][number] = box
            stream.write(boxes[1], box, box.nbytes * number)

        return act

    def _boxes_of(self, name: str, given: NDArray[np.float32]) -> Boxes:
        """The boxes under a tree, which will be fitted to what they are then."""
        if name not in self._boxes:
            host = given.copy()
            self._boxes[name] = host, self.front.buffers.upload("boxes of what moves", host)
        self._moved.add(name)
        return self._boxes[name]

    def _place(
        self,
        region: _Region,
        new: Shape,
        points: shapes.Points | None,
        matrix: transforms.Matrix,
        placed: Place | None,
    ) -> None:
        """Enqueue what a region's vertices and normals are after a move.

        points: new vertices of the host; placed: where the matrix is, of one on the device.
        """
        front = self.front
        if not isinstance(new, Instance):
            region.shape = new
        table, (first, count) = front.named["vertices"], region.vertices
        still = placed is None and np.array_equal(matrix, transforms.IDENTITY)
        if points is not None and placed is None:
            if not still:
                points = transforms.transform_points(matrix, points).astype(np.float32)
            front.stream.write(table, points, 12 * first)
        elif still:
            source, begin = self._local(region, "vertices")
            places = {"src_offset": 4 * begin, "dst_offset": 12 * first, "byte_count": 12 * count}
            front.stream.copy(table, source, **places)
        else:
            front.stream.after(getattr(new.to_world, "events", ()) if placed else ())
            placed = placed or self._matrix(region, matrix)
            self._run("place_vertices", region, self._local(region, "vertices"), placed)
        if region.row["flags"] & _NORMALS:
            if shapes.smooth(region.shape):
                self._smooth(region)
            else:
                placed = placed or self._matrix(region, matrix)
                side = -1.0 if region.shape.flip_normals else 1.0
                source = self._local(region, "normals")
                self._run("place_normals", region, source, placed, side=side)
        front.moved |= {"vertices", "normals"}
        self._moved.add("triangles")

    def _run(
        self, kernel: str, region: _Region, source: Place, matrix: Place, **more: float
    ) -> None:
        """Enqueue a kernel of place.cl over a region's vertices."""
        first, count = region.vertices
        table = kernel.removeprefix("place_")
        self.building.run_each(
            _ROOT, kernel, count, first=first, source=source[0], source_begin=source[1],
            matrix=matrix[0], matrix_begin=matrix[1], **{table: self.front.named[table]}, **more,
        )  # fmt: skip

    def _matrix(self, region: _Region, matrix: transforms.Matrix) -> Place:
        """Where a region's placement is, which is sent there."""
        if region.matrix is None:
            region.matrix = self.front.buffers.allocate("a shape's transform", 64)
        self.front.stream.write(region.matrix, matrix.astype(np.float32))
        return region.matrix, 0

    def _local(self, region: _Region, name: str) -> Place:
        """Where vertices or normals of a region's shape are, before it is placed."""
        shape = region.shape
        given = getattr(shape, name, None)
        if on_device(given):
            self.front.stream.after(getattr(given, "events", ()))
            found = self._floats(given, (region.vertices[1], 3))
            assert found is not None  # `_plan` has looked
            return found
        of = getattr(shape, "vertices", None)
        if region.local is None or region.local[0] is not of:
            region.local = of, {}
        if name not in region.local[1]:
            vertices, _, normals, _ = shapes.local(shape)
            points: Any = vertices if name == "vertices" else normals
            buffer = self.front.buffers.upload(f"{name} of a shape that moves", points, np.float32)
            region.local[1][name] = buffer
        return region.local[1][name], 0

    def _floats(self, values: Any, shape: tuple[int, ...]) -> Place | None:
        """Where an array on the device begins; None for another shape, type, order or context."""
        if isinstance(values, cl.Buffer):
            fits, place = values.size == 4 * np.prod(shape), (values, 0)
        else:
            fits = values.shape == shape and values.dtype == np.float32
            fits &= values.flags.c_contiguous
            place = values.base_data, values.offset // 4
        return place if fits and place[0].context == self.front.device.context else None

    def _smooth(self, region: _Region) -> None:
        """Enqueue that a region's normals follow from its triangles."""
        first, count = region.vertices
        if region.around is None:
            begin, faces = region.faces
            corners = self.lowered.faces[begin : begin + faces].ravel()
            order = np.argsort(corners, kind="stable")
            ends = np.searchsorted(corners[order], np.arange(first, first + count + 1))
            give = self.front.buffers
            region.around = {
                "around": give.upload("triangles around vertices", begin + order // 3, np.uint32),
                "offsets": give.upload("numbers of triangles around vertices", ends, np.uint32),
            }
        named = {name: self.front.named[name] for name in ("vertices", "faces", "normals")}
        self.building.run_each(
            _ROOT, "smooth_normals", count, first=first, **named, **region.around
        )

    def _fit(self) -> None:
        """Enqueue that trees follow what has moved."""
        front = self.front
        if "triangles" in self._moved:
            named = front.named
            bvh.refit(self.building, front.tree, named["vertices"], named["faces"], parts=[0])
        for name in self._moved & set(front.box_trees):
            self._moves += name == "shape"
            anew = name == "shape" and self._moves % ANEW == 0
            fit = bvh.rebuild_boxes if anew else bvh.refit_boxes
            fit(self.building, front.box_trees[name], self._boxes[name][1])
        if "instance" in self._moved:
            front.moved.add("instances")
        self._moved.clear()


def _moves_only(old: Any, new: Any) -> bool:
    """Whether nothing but places differs between two shapes."""
    if not isinstance(new, Shape) or type(old) is not type(new):
        return False
    return {name for name, value in vars(new).items() if value is not vars(old)[name]} <= _MOVES
