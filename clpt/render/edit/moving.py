"""Shapes that move on the device: kernels write their tables and refit the trees over them.

The vertices, normals, rows and boxes of shapes that move are written by kernels, from arrays that
may be on the device. Nothing is lowered or built, and the host waits for nothing.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import bvh, transforms
from clpt.arrays import Points, on_device
from clpt.geometry import analytic, shapes, strands, triangles
from clpt.geometry.tessellate import keeps_its_kind
from clpt.records import SHAPE, SHAPE_BITS
from clpt.render.edit.cannot_move import CannotMove
from clpt.render.edit.moving_instances import Boxes, Location, MovingInstances
from clpt.render.edit.moving_spheres import MovingSpheres
from clpt.render.edit.scene_edit import Replacements
from clpt.render.wavefront.device_scene import DeviceScene
from clpt.scene import Scene
from clpt.scene.params import fields_of
from clpt.scene.shapes import Curves, Instance, Mesh, Shape, Spheres

_ROOT = "stage/place_vertices.cl"
_NORMALS = SHAPE_BITS["normals"]
_MOVABLE = {"to_world", "vertices", "normals", "centers"}  # fields that may change
REBUILD_EVERY = 16  # moves of analytic shapes, each of which goes its own way

Action = Callable[[], None]


@dataclass(eq=False)
class _Ranges:
    """The ranges of the tables that one shape has.

    row: its row of `shapes`; vertices, faces: first and number; mirrored: whether its transform
    flips its faces; whole: whether no triangle was left out; own: its transform within its group.
    The first move that needs a buffer makes it. matrix: its transform; local: its vertices
    and normals before the transform, and the array of vertices that they are of; around: the
    triangles around each vertex, for `smooth_normals` of place_vertices.cl.
    """

    row: NDArray[Any]
    shape: Shape
    vertices: tuple[int, int]
    faces: tuple[int, int]
    mirrored: bool = False
    whole: bool = True
    own: transforms.Matrix = field(default_factory=lambda: transforms.IDENTITY)
    matrix: cl.Buffer | None = None
    local: tuple[Any, dict[str, cl.Buffer]] | None = None
    around: dict[str, cl.Buffer] | None = None


class Moving:
    """The shapes of a scene on a device, and the kernels that move them.

    target: the scene on the device; scene: as it was lowered. A copy of the vertices and normals of
    each shape that moved without new vertices stays on the device, and for each smooth mesh whose
    vertices moved 4 bytes a vertex and 12 a triangle.
    """

    def __init__(self, target: DeviceScene, scene: Scene):
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
                continue  # of a group: its instances move, not it
            shape = scene.shapes[number]
            if isinstance(shape, Instance):
                outer = shapes.placement(shape)
                ranges.own = transforms.inverse(outer) @ shapes.placement(ranges.shape)
            self.ranges.setdefault(number, []).append(ranges)

    def plan(self, scene: Scene, replaced: Replacements) -> Callable[[], None] | str:
        """Return what enqueues that shapes have other transforms or vertices, and trees follow.

        scene: as it is; replaced: the shapes that move, and what they become. Returns a text where
        the scene must be lowered again: why.

        Triangles, instances, spheres, disks, cylinders and curves can move. A shape must keep its
        number of vertices, its orientation and its kind, and must not emit light. A mesh of which a
        triangle without area was left out keeps its vertices. Where light is traced from lights
        nothing moves.

        Raises SceneError for a transform that is singular, and arrays of the wrong shape or type.
        """
        try:
            actions = self._plan(scene, replaced)
        except CannotMove as reason:
            return str(reason)

        def move() -> None:
            for action in actions:
                action()
            self._fit_trees()

        return move

    def _plan(self, scene: Scene, replaced: Replacements) -> list[Action]:
        """Return the actions that enqueue a move. Raises CannotMove."""
        features = self.target.lowered.features
        if any(one.transport.light_paths for one in features.passes):
            raise CannotMove("light is traced from lights, whose choice follows from the shapes")
        if any(shape.motion is not None for shape in scene.shapes):
            raise CannotMove("shapes move while the shutter is open")
        if features.motion.vertices:
            raise CannotMove("vertices move while the shutter is open")
        if features.motion.spheres:
            raise CannotMove("spheres move by themselves while the shutter is open")
        numbers = {id(shape): number for number, shape in enumerate(scene.shapes)}
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
            own = self._instances.numbers.get(number, ())
            instances += [(k, new) for k in own]
            matrices += [matrix for _ in own]
        if instances:
            act = self._instances.plan(instances, matrices)
            boxes = self.target.lowered.instances.boxes
            actions.append(lambda: act(self._boxes_of("instance", boxes)))
        return actions

    def _all_ranges(self) -> list[_Ranges]:
        """The ranges of every shape, in the order of their rows."""
        lowered = self.target.lowered
        backwards, ends = [], (len(lowered.vertices), len(lowered.faces))
        for row, shape, vertex, face in reversed(lowered.owners):
            if row["kind"]:
                backwards.append(_Ranges(row, shape, (0, 0), (0, 0)))
                continue
            vertices, faces = (vertex, ends[0] - vertex), (face, ends[1] - face)
            mirrored = transforms.flips_handedness(shapes.placement(shape))
            whole = not isinstance(shape, Mesh) or len(shape.faces) == faces[1]
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
        given, before = fields_of(new), fields_of(old)
        for field_name in ("vertices", "normals"):
            values = given.get(field_name)
            if on_device(values):
                self._locate(values, (count, 3), f"the {field_name} of {name}")
        matrix, points = transforms.IDENTITY, None
        if device_matrix is None:
            matrix = shapes.placement(new) @ ranges.own
            if transforms.flips_handedness(matrix) != ranges.mirrored:
                raise CannotMove(f"the transform of {name} mirrors it")
        elif isinstance(new, Instance):
            raise CannotMove(f"{name} is copied, not shared, and its transform is on the device")
        if given.get("vertices") is not before.get("vertices"):
            if not ranges.whole:
                raise CannotMove(f"{name} has triangles without an area")
            if not on_device(given["vertices"]):
                points = triangles.points(new)
                if len(points) != count:
                    raise CannotMove(f"{name} has {len(points)} vertices, and had {count}")
        return [lambda: self._move_vertices(ranges, new, points, matrix, device_matrix)]

    def _plan_analytic(self, ranges: _Ranges, new: Shape) -> list[Action]:
        """Return the actions that move an analytic shape. Raises CannotMove if its kind changes."""
        shape = ranges.shape if isinstance(new, Instance) else new
        matrix = shapes.placement(new) @ ranges.own
        in_world = dataclasses.replace(shape, to_world=matrix)
        if not keeps_its_kind(in_world):
            raise CannotMove(f"the transform of {_name(new)} makes triangles of it")
        if isinstance(shape, Spheres):
            act = self._spheres.plan(ranges.row, shape, matrix)
        elif isinstance(in_world, Curves):
            act = self._plan_curves(ranges, in_world)
        else:
            act = self._plan_single(ranges, in_world)

        def move() -> None:
            ranges.shape = shape
            act(self._boxes_of("shape", self.target.lowered.boxes))
            self.target.moved_tables |= {"geometry", "spheres"}

        return [move]

    def _plan_single(self, ranges: _Ranges, shape: Shape) -> Callable[[Boxes], None]:
        """Return the action that gives a sphere, disk or cylinder new parameters and a new box."""
        lowered, first_word = self.target.lowered, int(ranges.row["params"])
        words, box = analytic.row(shape), np.stack(analytic.bounds(shape))
        rows = lowered.tables["shapes"].view(SHAPE.dtype)
        first = int(lowered.settings["first_analytic"])
        number = int(np.flatnonzero(rows["params"][first:] == first_word)[0])

        def act(boxes: Boxes) -> None:
            stream = self.target.stream
            stream.write(self.target.tables["geometry"], words, 4 * first_word)
            boxes[0][number] = box
            stream.write(boxes[1], box, box.nbytes * number)

        return act

    def _plan_curves(self, ranges: _Ranges, shape: Curves) -> Callable[[Boxes], None]:
        """Return the action that gives curves other pieces, as many as before, and other boxes."""
        owners = self.target.lowered.owners
        lowered = next(owner for row, owner, _, _ in owners if row is ranges.row)
        assert isinstance(lowered, Curves)
        pieces, prim = strands.pieces(shape, cut_as=lowered), int(ranges.row["prim"])
        box = strands.boxes(pieces)
        words = self.target.lowered.tables["geometry"]
        first = words[int(ranges.row["params"]) + analytic.member("curve", "first")]
        begin = int(first.view(np.int32)) + strands.WORDS * prim

        def act(boxes: Boxes) -> None:
            stream = self.target.stream
            stream.write(self.target.tables["spheres"], pieces, 4 * begin)
            boxes[0][prim : prim + len(box)] = box
            stream.write(boxes[1], box, box[0].nbytes * prim)

        return act

    def _boxes_of(self, tree: str, lowered: NDArray[np.float32]) -> Boxes:
        """Return the boxes that a tree is over, which will be fitted to them."""
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
        if not isinstance(new, Instance):
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
        """Enqueue that a shape's vertices or normals are those of a source, transformed."""
        first, count = ranges.vertices
        self.building.run_each(
            _ROOT, f"place_{table}", count, first=first, source=source[0], source_begin=source[1],
            matrix=matrix[0], matrix_begin=matrix[1], **{table: self.target.tables[table]}, **more,
        )  # fmt: skip

    def _upload_matrix(self, ranges: _Ranges, matrix: transforms.Matrix) -> Location:
        """Enqueue that a shape's transform is on the device; return where."""
        if ranges.matrix is None:
            ranges.matrix = self.target.buffers.allocate("a shape's transform", 64)
        self.target.stream.write(ranges.matrix, matrix.astype(np.float32))
        return ranges.matrix, 0

    def _local(self, ranges: _Ranges, name: str) -> Location:
        """Return where vertices or normals of a shape are on the device, before its transform."""
        shape = ranges.shape
        given = fields_of(shape)
        values = given.get(name)
        if on_device(values):
            self.target.stream.after(getattr(values, "events", ()))
            return self._locate(values, (ranges.vertices[1], 3), name)
        vertices = given.get("vertices")
        if ranges.local is None or ranges.local[0] is not vertices:
            ranges.local = vertices, {}
        buffers = ranges.local[1]
        if name not in buffers:
            points, _, normals, _ = triangles.local(shape)
            array: Any = points if name == "vertices" else normals
            what = f"{name} of a shape that moves"
            buffers[name] = self.target.buffers.upload(what, array, np.float32)
        return buffers[name], 0

    def _locate(self, values: Any, shape: tuple[int, ...], what: str) -> Location:
        """Return where a float32 array on the device begins. Raises CannotMove for another form."""
        if isinstance(values, cl.Buffer):
            fits, location = values.size == 4 * np.prod(shape), (values, 0)
        else:
            fits = values.shape == shape and values.dtype == np.float32
            fits &= values.flags.c_contiguous
            location = values.base_data, values.offset // 4
        if not fits or location[0].context != self.target.device.context:
            raise CannotMove(f"{what} are no {shape} float32 in a row, in the renderer's context")
        return location

    def _smooth(self, ranges: _Ranges) -> None:
        """Enqueue that a shape's normals follow from its triangles."""
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

    def _fit_trees(self) -> None:
        """Enqueue that trees follow what has moved."""
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


def _check_fields(old: Shape, new: object) -> None:
    """Raise CannotMove if more than what moves differs between two shapes."""
    if not isinstance(new, Shape) or type(old) is not type(new):
        raise CannotMove(f"{_name(old)} becomes something else")
    before = fields_of(old)
    changed = {name for name, value in fields_of(new).items() if value is not before[name]}
    if changed - _MOVABLE:
        raise CannotMove(f"{_name(new)} has another {' and '.join(sorted(changed - _MOVABLE))}")


def _holds_light(shape: Shape) -> bool:
    """Whether a medium that emits is inside of a shape, or of those that an instance places."""
    own = shape.members if isinstance(shape, Instance) else (shape,)
    return any(one.interior is not None and one.interior.light is not None for one in own)


def _name(thing: object) -> str:
    return shapes.where(thing) if isinstance(thing, Shape) else f"a {type(thing).__name__}"
