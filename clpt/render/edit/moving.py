"""Shapes that move on the device: kernels write their tables and refit the trees over them.

Kernels write the vertices, normals, rows and boxes of moving shapes, from arrays on the host or the
device. Nothing is lowered or built, and the host waits for nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import bvh, transforms
from clpt.arrays import Points, on_device
from clpt.geometry import analytic, shapes, strands, triangles
from clpt.geometry.analytic import keeps_its_kind
from clpt.records import SHAPE, SHAPE_BITS
from clpt.render.edit.moving_parts import (
    Boxes,
    CannotMove,
    Location,
    MovingInstances,
    MovingSpheres,
)
from clpt.render.edit.plans import Plan
from clpt.render.edit.scene_edit import Replacements
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.scene.params import fields_of
from clpt.scene.shapes import Curves, Shape, Spheres

_ROOT = "stage/place.cl#vertices"
_NORMALS = SHAPE_BITS["normals"]
_MOVABLE = {"to_world", "vertices", "normals", "centers"}  # fields that may change
REBUILD_EVERY = 16  # moves of analytic shapes, which move independently

Action = Callable[[], None]
# Words of an analytic shape: table, words, first word; number of its first box, and its boxes.
Analytic = tuple[str, NDArray[Any], int, int, NDArray[np.float32]]


@dataclass(eq=False)
class _Ranges:
    """The ranges of a shape in the tables.

    row: its row of `shapes`; vertices, faces: first and number; mirrored: whether its transform
    flips its faces; whole: whether all its triangles have an area; in_group: its transform within
    its group. The first move that needs a buffer allocates it. matrix: its transform; local: its
    array of vertices, and buffers of vertices and normals before the transform; around: the
    triangles around each vertex, for `smooth_normals` of place_vertices.cl.
    """

    row: NDArray[Any]
    shape: Shape
    vertices: tuple[int, int]
    faces: tuple[int, int]
    mirrored: bool = False
    whole: bool = True
    in_group: transforms.Matrix = field(default_factory=lambda: transforms.IDENTITY)
    matrix: cl.Buffer | None = None
    local: tuple[Any, dict[str, cl.Buffer]] | None = None
    around: dict[str, cl.Buffer] | None = None


class Moving:
    """The shapes of a scene on a device, and the kernels that move them.

    target: the scene on the device; placed: its shapes as they were lowered. These stay on the
    device: a copy of the vertices and normals of each shape that moved without new vertices; for
    each smooth mesh whose vertices moved, 4 bytes a vertex and 12 a triangle.
    """

    def __init__(self, target: DeviceScene, placed: Sequence[Shape]):
        self.target = target
        self.building = bvh.Building(target.device, stream=target.stream)
        self.ranges: dict[int, list[_Ranges]] = {}  # by the number of the scene's shape
        self._boxes: dict[str, Boxes] = {}
        self._moved: set[str] = set()  # trees whose contents have moved
        self._shape_moves = 0
        self._spheres = MovingSpheres(target, self.building)
        self._instances = MovingInstances(target, self.building)
        lowered = target.lowered
        world = len(lowered.faces) - sum(lowered.instances.triangles)
        for ranges in self._all_ranges():
            number = int(ranges.row["number"])
            if ranges.row["kind"] == 0 and ranges.faces[0] >= world:
                continue  # a shape of a group: only its instances move
            shape = placed[number]
            if shape.group is not None:
                outer = shapes.placement(shape)
                ranges.in_group = transforms.inverse(outer) @ shapes.placement(ranges.shape)
            self.ranges.setdefault(number, []).append(ranges)

    def plan(self, placed: Sequence[Shape], replaced: Replacements) -> Move | str:
        """Return a plan of new transforms and vertices of shapes, and of refits of trees.

        placed: the scene's present shapes; replaced: the shapes that move, and their replacements.
        Returns the reason as a text if the scene must be lowered again.

        Triangles, instances, spheres, disks, cylinders and curves can move. A shape must keep its
        number of vertices, its orientation and its kind, and must not emit light. A mesh that has
        triangles without area must keep its vertices. If paths start at lights, nothing can move.

        Raises SceneError for a transform that is singular, and arrays of the wrong shape or type.
        """
        try:
            return Move(self, self._plan(placed, replaced))
        except CannotMove as reason:
            return str(reason)

    def _plan(self, placed: Sequence[Shape], replaced: Replacements) -> list[Action]:
        """Return the actions that enqueue a move. Raises CannotMove."""
        features = self.target.lowered.features
        if any(kernels.transport.light_paths for kernels in features.passes):
            raise CannotMove("light is traced from lights, whose choice follows from the shapes")
        if any(shape.motion is not None for shape in placed):
            raise CannotMove("shapes move while the shutter is open")
        if features.motion.vertices:
            raise CannotMove("vertices move while the shutter is open")
        if features.motion.spheres:
            raise CannotMove("spheres move by themselves while the shutter is open")
        numbers = {id(shape): number for number, shape in enumerate(placed)}
        actions: list[Action] = []
        instances: list[tuple[int, Shape]] = []
        matrices: list[Location | None] = []
        for old, new in replaced.values():
            number = numbers.get(id(old))
            if number is None:
                raise CannotMove(f"{_name(old)} is a group, or of one")
            _check_fields(old, new)
            if features.lights.bodies and _holds_light(old):
                raise CannotMove(f"{_name(new)} holds a medium that emits: a light follows from it")
            matrix = None
            if on_device(new.to_world):
                matrix = self._locate(new.to_world, (4, 4), f"the transform of {_name(new)}")
            for ranges in self.ranges.get(number, ()):
                actions += self._plan_shape(ranges, old, new, matrix)
            indices = self._instances.numbers.get(number, ())
            instances += [(k, new) for k in indices]
            matrices += [matrix for _ in indices]
        if instances:
            transformed = self._instances.plan(instances, matrices)
            moved, lowered = (instances, matrices), self.target.lowered.instances.boxes
            actions.append(
                lambda: self._instances.move(
                    transformed, *moved, self._boxes_of("instance", lowered)
                )
            )
        return actions

    def _all_ranges(self) -> list[_Ranges]:
        """Return the ranges of all shapes, in the order of their rows."""
        lowered = self.target.lowered
        backwards, ends = [], (len(lowered.vertices), len(lowered.faces))
        for row, shape, vertex, face in reversed(lowered.owners):
            if row["kind"]:
                backwards.append(_Ranges(row, shape, (0, 0), (0, 0)))
                continue
            vertices, faces = (vertex, ends[0] - vertex), (face, ends[1] - face)
            mirrored = transforms.flips_handedness(shapes.placement(shape))
            whole = shape.faces is None or len(shape.faces) == faces[1]
            backwards.append(_Ranges(row, shape, vertices, faces, mirrored, whole))
            ends = vertex, face
        return backwards[::-1]

    def _plan_shape(
        self, ranges: _Ranges, old: Shape, new: Shape, device_matrix: Location | None
    ) -> list[Action]:
        """Return the actions that move a shape. Raises CannotMove."""
        name = _name(new)
        if ranges.shape.emission is not None:
            raise CannotMove(f"{name} emits light: lights follow from it")
        if ranges.row["kind"]:
            if device_matrix:
                raise CannotMove(f"{name} is no triangles, and its transform is on the device")
            return self._plan_analytic(ranges, new)
        if ranges.shape.tangents is not None:
            raise CannotMove(f"{name} has tangents of its own, which lie in the world")
        count = ranges.vertices[1]
        fields, before = fields_of(new), fields_of(old)
        for field_name in ("vertices", "normals"):
            values = fields.get(field_name)
            if on_device(values):
                self._locate(values, (count, 3), f"the {field_name} of {name}")
        matrix, points = transforms.IDENTITY, None
        if device_matrix is None:
            matrix = shapes.placement(new) @ ranges.in_group
            if transforms.flips_handedness(matrix) != ranges.mirrored:
                raise CannotMove(f"the transform of {name} mirrors it")
        elif new.group is not None:
            raise CannotMove(f"{name} is copied, not shared, and its transform is on the device")
        if fields.get("vertices") is not before.get("vertices"):
            if not ranges.whole:
                raise CannotMove(f"{name} has triangles without an area")
            if not on_device(fields["vertices"]):
                points = triangles.points(new)
                if len(points) != count:
                    raise CannotMove(f"{name} has {len(points)} vertices, and had {count}")
        return [lambda: self._move_vertices(ranges, new, points, matrix, device_matrix)]

    def _plan_analytic(self, ranges: _Ranges, new: Shape) -> list[Action]:
        """Return the actions that move an analytic shape. Raises CannotMove if its kind changes."""
        shape = new if new.group is None else ranges.shape
        matrix = shapes.placement(new) @ ranges.in_group
        in_world = shape.placed(matrix)
        if not keeps_its_kind(in_world):
            raise CannotMove(f"the transform of {_name(new)} makes triangles of it")
        if isinstance(shape, Spheres):
            common, source = self._spheres.plan(ranges.row, shape, matrix)
            return [lambda: self._move_spheres(ranges, shape, matrix, common, source)]
        plan = self._plan_curves if isinstance(in_world, Curves) else self._plan_single
        words = plan(ranges, in_world)
        return [lambda: self._move_analytic(ranges, shape, *words)]

    def _move_spheres(
        self,
        ranges: _Ranges,
        shape: Shape,
        matrix: transforms.Matrix,
        common: NDArray[np.uint32],
        source: object,
    ) -> None:
        """Enqueue a move of spheres, see `MovingSpheres.plan`."""
        ranges.shape = shape
        boxes = self._boxes_of("shape", self.target.lowered.boxes)[1]
        self._spheres.move(ranges.row, matrix, common, source, boxes)
        self.target.moved_tables |= {"geometry", "spheres"}

    def _move_analytic(
        self,
        ranges: _Ranges,
        shape: Shape,
        table: str,
        words: NDArray[Any],
        begin: int,
        number: int,
        new_boxes: NDArray[np.float32],
    ) -> None:
        """Enqueue new words of a table and new boxes, see `Analytic`."""
        ranges.shape = shape
        host, buffer = self._boxes_of("shape", self.target.lowered.boxes)
        stream = self.target.stream
        stream.write(self.target.tables[table], words, 4 * begin)
        host[number : number + len(new_boxes)] = new_boxes
        stream.write(buffer, new_boxes, new_boxes[0].nbytes * number)
        self.target.moved_tables |= {"geometry", "spheres"}

    def _plan_single(self, ranges: _Ranges, shape: Shape) -> Analytic:
        """Return the new parameters and box of a sphere, disk or cylinder."""
        lowered, first_word = self.target.lowered, int(ranges.row["params"])
        words, box = analytic.row(shape), np.stack(analytic.bounds(shape))
        rows = lowered.tables["shapes"].view(SHAPE.dtype)
        first = int(lowered.settings["first_analytic"])
        number = int(np.flatnonzero(rows["params"][first:] == first_word)[0])
        return "geometry", words, first_word, number, box[None]

    def _plan_curves(self, ranges: _Ranges, shape: Shape) -> Analytic:
        """Return the new pieces of curves, as many as before, and their boxes."""
        owners = self.target.lowered.owners
        lowered = next(owner for row, owner, _, _ in owners if row is ranges.row)
        curves, former = cast(Curves, shape), cast(Curves, lowered)
        pieces, prim = strands.pieces(curves, cut_as=former), int(ranges.row["prim"])
        box = strands.boxes(pieces)
        words = self.target.lowered.tables["geometry"]
        first = words[int(ranges.row["params"]) + analytic.member("curve", "first")]
        begin = int(first.view(np.int32)) + strands.WORDS * prim
        return "spheres", pieces, begin, prim, box

    def _boxes_of(self, tree: str, lowered: NDArray[np.float32]) -> Boxes:
        """Return the boxes of a tree, which `fit_trees` will refit."""
        if tree not in self._boxes:
            host = lowered.copy()
            self._boxes[tree] = host, self.target.buffers.upload("boxes of what moves", host)
        self._moved.add(tree)
        return self._boxes[tree]

    def _move_vertices(
        self,
        ranges: _Ranges,
        new: Shape,
        points: Points | None,
        matrix: transforms.Matrix,
        device_matrix: Location | None,
    ) -> None:
        """Enqueue the vertices and normals of a shape after a move.

        points: new vertices that are on the host; matrix: the transform to the world, unless it is
        on the device.
        """
        target = self.target
        if new.group is None:
            ranges.shape = new
        table, (first, count) = target.tables["vertices"], ranges.vertices
        still = device_matrix is None and np.array_equal(matrix, transforms.IDENTITY)
        if points is not None and device_matrix is None:
            if not still:
                points = transforms.transform_points(matrix, points).astype(np.float32)
            target.stream.write(table, points, 12 * first)
        elif still:
            source, begin = self._local(ranges, "vertices")
            offsets = {"src_offset": 4 * begin, "dst_offset": 12 * first, "byte_count": 12 * count}
            target.stream.copy(table, source, **offsets)
        else:
            if device_matrix:
                target.stream.after(getattr(new.to_world, "events", ()))
            device_matrix = device_matrix or self._upload_matrix(ranges, matrix)
            self._run("vertices", ranges, self._local(ranges, "vertices"), device_matrix)
        if ranges.row["flags"] & _NORMALS and triangles.smooth(ranges.shape):
            self._smooth(ranges)
        elif ranges.row["flags"] & _NORMALS:
            device_matrix = device_matrix or self._upload_matrix(ranges, matrix)
            side = -1.0 if ranges.shape.flip_normals else 1.0
            source = self._local(ranges, "normals")
            self._run("normals", ranges, source, device_matrix, side=side)
        target.moved_tables |= {"vertices", "normals"}
        self._moved.add("triangles")

    def _run(
        self, table: str, ranges: _Ranges, source: Location, matrix: Location, **more: float
    ) -> None:
        """Enqueue the kernel that transforms a source into a shape's vertices or normals."""
        first, count = ranges.vertices
        self.building.run_each(
            _ROOT, f"place_{table}", count, first=first, source=source[0], source_begin=source[1],
            matrix=matrix[0], matrix_begin=matrix[1], **{table: self.target.tables[table]}, **more,
        )  # fmt: skip

    def _upload_matrix(self, ranges: _Ranges, matrix: transforms.Matrix) -> Location:
        """Enqueue the upload of a shape's transform; return its place."""
        if ranges.matrix is None:
            ranges.matrix = self.target.buffers.allocate("a shape's transform", 64)
        self.target.stream.write(ranges.matrix, matrix.astype(np.float32))
        return ranges.matrix, 0

    def _local(self, ranges: _Ranges, name: str) -> Location:
        """Return the place on the device of a shape's vertices or normals before its transform."""
        shape = ranges.shape
        fields = fields_of(shape)
        values = fields.get(name)
        if on_device(values):
            self.target.stream.after(getattr(values, "events", ()))
            return self._locate(values, (ranges.vertices[1], 3), name)
        vertices = fields.get("vertices")
        if ranges.local is None or ranges.local[0] is not vertices:
            ranges.local = vertices, {}
        buffers = ranges.local[1]
        if name not in buffers:
            points, _, normals, _ = triangles.local(shape)
            array: Any = points if name == "vertices" else normals
            label = f"{name} of a shape that moves"
            buffers[name] = self.target.buffers.upload(label, array, np.float32)
        return buffers[name], 0

    def _locate(self, values: Any, shape: tuple[int, ...], label: str) -> Location:
        """Return the place of a float32 array on the device. Raises CannotMove if it has others."""
        if isinstance(values, cl.Buffer):
            fits, location = values.size == 4 * np.prod(shape), (values, 0)
        else:
            fits = values.shape == shape and values.dtype == np.float32
            fits &= values.flags.c_contiguous
            location = values.base_data, values.offset // 4
        if not fits or location[0].context != self.target.device.context:
            raise CannotMove(f"{label} are no {shape} float32 in a row, in the renderer's context")
        return location

    def _smooth(self, ranges: _Ranges) -> None:
        """Enqueue the kernel that computes a shape's normals from its triangles."""
        target, (first, count) = self.target, ranges.vertices
        if ranges.around is None:
            begin, faces = ranges.faces
            corners = target.lowered.faces[begin : begin + faces].ravel()
            order = np.argsort(corners, kind="stable")
            ends = np.searchsorted(corners[order], np.arange(first, first + count + 1))
            upload = target.buffers.upload
            ranges.around = {
                "around": upload("triangles around vertices", begin + order // 3, np.uint32),
                "offsets": upload("numbers of triangles around vertices", ends, np.uint32),
            }
        tables = {name: target.tables[name] for name in ("vertices", "faces", "normals")}
        self.building.run_each(
            _ROOT, "smooth_normals", count, first=first, **tables, **ranges.around
        )

    def fit_trees(self) -> None:
        """Enqueue refits of the trees over shapes that moved."""
        target, trees = self.target, self.target.trees
        if "triangles" in self._moved:
            vertices, faces = target.tables["vertices"], target.tables["faces"]
            bvh.refit(self.building, trees.triangles, vertices, faces, parts=[0])
        for name in self._moved & set(trees.boxes):
            self._shape_moves += name == "shape"
            rebuild = name == "shape" and self._shape_moves % REBUILD_EVERY == 0
            fit = bvh.rebuild_boxes if rebuild else bvh.refit_boxes
            fit(self.building, trees.boxes[name], self._boxes[name][1])
        if "instance" in self._moved:
            target.moved_tables.add("instances")
        self._moved.clear()


@dataclass(frozen=True, eq=False)
class Move(Plan):
    """New transforms and vertices of shapes that move; actions: write the tables of each shape."""

    moving: Moving
    actions: list[Action]

    @property
    def repeatable(self) -> bool:
        return False

    def write(self) -> None:
        for action in self.actions:
            action()
        self.moving.fit_trees()


def _check_fields(old: Shape, new: Shape) -> None:
    """Raise CannotMove if fields differ between two shapes that no move can change."""
    if type(old) is not type(new):
        raise CannotMove(f"{_name(old)} becomes something else")
    before = fields_of(old)
    changed = {name for name, value in fields_of(new).items() if value is not before[name]}
    if changed - _MOVABLE:
        raise CannotMove(f"{_name(new)} has another {' and '.join(sorted(changed - _MOVABLE))}")


def _holds_light(shape: Shape) -> bool:
    """Return whether a shape, or a shape that it places, holds a medium that emits."""
    media = (member.interior for member in shape.members)
    return any(medium is not None and medium.light is not None for medium in media)


def _name(value: object) -> str:
    return shapes.where(value) if isinstance(value, Shape) else f"a {type(value).__name__}"
