"""The shapes of a scene in the forms that rays intersect: triangles, boxes and instances."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Faces, Points, corners_of, fits_single
from clpt.bvh.build import MOST
from clpt.errors import SceneError
from clpt.files import budget
from clpt.geometry import analytic, instancing, motion, shapes, strands, triangles
from clpt.geometry.instancing import Instances, Placed, Prototype
from clpt.geometry.motion import Motions
from clpt.records import SHAPE, SHAPE_BITS
from clpt.render.records.tables import LoweringCache, content
from clpt.render.scene_index import SceneIndex
from clpt.scene.shapes import Shape

LEAST_RADIUS = 1e-12  # of a sphere around a scene [m]
SWEPT_CELLS = 4  # of the hull of a moving instance, see `instancing.hull_points`

Owner = tuple[np.ndarray, Shape, int, int]  # a row of `shapes`, its shape, first vertex and face
Triangles = tuple[NDArray[np.float32], NDArray[np.uint32], NDArray[np.uint32]]


@dataclass(frozen=True)
class Emitter:
    """A shape with an `emission`.

    shape_row: its row in `shapes`; vertices, faces, uvs: its triangles from `shapes.triangles`,
    for a mesh and a cube; for `spheres`, vertices are balls (n, 4); keys: rows of each vertex, see
    `triangles.keyed`.
    """

    shape: Shape
    shape_row: int
    vertices: Points | None = None
    faces: Faces | None = None
    uvs: Points | None = None
    keys: int = 1


@dataclass(frozen=True)
class Stored:
    """Arrays of a shape for tables beside `shapes`.

    vertices: their number; normals, uvs: of the vertices, or None; many: balls (n, 4) or (n, k, 4)
    of `spheres`, or pieces of `curves`; else None.
    """

    vertices: int = 0
    normals: Points | None = None
    uvs: Points | None = None
    many: NDArray[np.float32] | None = None


@dataclass(frozen=True)
class Geometry:
    """The shapes of a scene as triangles, boxes and instances, with their rows of `shapes`.

    rows: with number, kind, first primitive and flags, analytic shapes last; owners: the shape of
    each row, with its first vertex and face; stored: for each row, arrays for other tables;
    vertices (n, 3) float32, faces (m, 3) uint32 and tags (m,) uint32, the row of each triangle's
    shape: first the world's, then those of groups; boxes (k, 2, 3) float32: of analytic shapes;
    world_vertices: number of vertices outside of groups; first_analytic: the first row of an
    analytic shape; single_count: number of analytic shapes but for `spheres` and `curves`;
    analytic: their kinds; normals, uvs: whether a shape needs them; tangents: arrays of shapes with
    tangents, each with its first vertex; keys: number of rows of each vertex of a shape, by the
    shape's first vertex; 1 where it is absent.
    """

    rows: tuple[np.ndarray, ...]
    owners: tuple[Owner, ...]
    stored: tuple[Stored, ...]
    vertices: NDArray[np.float32]
    faces: NDArray[np.uint32]
    tags: NDArray[np.uint32]
    boxes: NDArray[np.float32]
    instances: Instances
    emitters: tuple[Emitter, ...]
    world_vertices: int
    first_analytic: int
    single_count: int
    analytic: frozenset[str]
    normals: bool
    uvs: bool
    tangents: tuple[tuple[int, NDArray[np.float32]], ...]
    warnings: tuple[str, ...]
    keys: Mapping[int, int] = field(default_factory=dict)

    @property
    def keyed(self) -> bool:
        """Whether vertices have a row for each of several keys."""
        return any(count > 1 for count in self.keys.values())

    def meshes(self) -> Iterator[tuple[Shape, slice, slice]]:
        """Yield the shapes of triangles outside of groups, with their vertices and faces."""
        starts = [(shape, vertex, face) for _, shape, vertex, face in self.owners]
        world = len(self.faces) - sum(self.instances.triangles)
        ends = [*starts, (None, self.world_vertices, world)][1:]
        for (shape, vertex, face), (_, last_vertex, last_face) in zip(starts, ends, strict=True):
            if face < last_face <= world:
                yield shape, slice(vertex, last_vertex), slice(face, last_face)

    @cached_property
    def digest(self) -> bytes:
        """A digest of the places of all triangles, boxes and instances."""
        placed = self.instances
        arrays = self.vertices, self.faces, self.boxes, placed.rows, placed.prototypes, placed.boxes
        return content(*arrays, np.array(placed.triangles))

    @cached_property
    def mesh_corners(self) -> NDArray[np.float32]:
        """The least and the largest corner (2, 3) of its meshes outside of groups; none: (0, 3)."""
        vertices = self.vertices[: self.world_vertices]
        return corners_of(vertices) if len(vertices) else vertices

    def bounding_sphere(self) -> tuple[NDArray[np.float64], float]:
        """Return centre and radius of a sphere around the scene; the unit sphere if it is empty.

        Raises SceneError for a scene whose size is beyond float32.
        """
        boxes = [self.mesh_corners, self.boxes.reshape(-1, 3), self.instances.boxes.reshape(-1, 3)]
        corners = [corners_of(box) for box in boxes if len(box)]
        if not corners:
            return np.zeros(3), 1.0
        low, high = corners_of(np.concatenate(corners))
        if max(np.abs(low).max(), np.abs(high).max()) > triangles.FAR:
            low, high = low.astype(np.float64), high.astype(np.float64)
        if not fits_single(2.0 * (high - low)):
            raise SceneError("the scene is too large: its size must be below 1.7e38 m")
        return (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, LEAST_RADIUS)


def _divided(placed: Iterable[Placed]) -> tuple[list[Placed], list[Placed]]:
    """Return shapes of triangles, and analytic shapes with `spheres` and `curves` at the end."""
    meshes: list[Placed] = []
    others: list[Placed] = []
    many = list(shapes.ONE_OF)
    for each in placed:
        (others if each.shape.kind in shapes.ANALYTIC else meshes).append(each)
    others.sort(key=lambda each: each.shape.kind in many and 1 + many.index(each.shape.kind))
    return meshes, others


def assembled(index: SceneIndex, cache: LoweringCache) -> Geometry:
    """Return the shapes of a scene in the forms that rays intersect.

    Raises SceneError for an invalid shape, and for more triangles than a tree can hold.
    """
    meshes, others = _divided(index.placed)
    single = [each for each in others if each.shape.kind not in shapes.ONE_OF]
    builder = _Builder(cache, len(single), index.motions)
    for each in meshes:
        builder.add(each)
    world_vertices = builder.vertex_count
    instances = instancing.concatenated([builder.share(p) for p in index.prototypes])
    first_analytic = len(builder.rows)
    for each in others:
        builder.add(each)
    boxes = [np.zeros((0, 2, 3), np.float32)]
    boxes += [builder.swept(each, np.array([analytic.bounds(each.shape)])) for each in single]
    many_boxes = zip(others[len(single) :], builder.many, strict=True)
    boxes += [builder.swept(each, many) for each, many in many_boxes]
    vertices, faces, tags = builder.concatenated()
    return Geometry(
        rows=tuple(builder.rows),
        owners=tuple(builder.owners),
        stored=tuple(builder.stored),
        vertices=vertices,
        faces=faces,
        tags=tags,
        boxes=np.concatenate(boxes),
        instances=instances,
        emitters=tuple(builder.emitters),
        world_vertices=world_vertices,
        first_analytic=first_analytic,
        single_count=len(single),
        analytic=frozenset(each.shape.kind for each in others),
        normals=builder.normals,
        uvs=builder.uvs,
        tangents=tuple(builder.tangents),
        warnings=tuple(triangles.warnings_of(builder.flat)),
        keys=builder.keys,
    )


def spheres_move(index: SceneIndex) -> bool:
    """Return whether a `spheres` shape deforms."""
    deforming = index.motions.deforming
    return any(each.shape.kind == "spheres" and each.number in deforming for each in index.placed)


@dataclass
class _Builder:
    """The parts of a `Geometry` while `assembled` collects them."""

    cache: LoweringCache
    single_count: int
    motions: Motions
    rows: list[np.ndarray] = field(default_factory=list)
    owners: list[Owner] = field(default_factory=list)
    stored: list[Stored] = field(default_factory=list)
    emitters: list[Emitter] = field(default_factory=list)
    parts: list[tuple[np.ndarray, np.ndarray, int]] = field(default_factory=list)
    flat: list[triangles.Flat] = field(default_factory=list)
    many: list[NDArray[np.float32]] = field(default_factory=list)
    vertex_count: int = 0
    face_count: int = 0
    normals: bool = False
    uvs: bool = False
    tangents: list[tuple[int, np.ndarray]] = field(default_factory=list)
    keys: dict[int, int] = field(default_factory=dict)

    def add(self, placed: Placed, times: Sequence[float] = ()) -> None:
        """Append a shape's row, and its triangles, balls or pieces.

        times: of the rows of each vertex, if the shape or another in its group deforms.
        """
        budget.check_time()
        shape = placed.shape
        row = np.zeros((), SHAPE.dtype)
        row["number"], row["light"] = placed.number, -1
        self.owners.append((row, shape, self.vertex_count, self.face_count))
        corners: tuple[Any, Any, Any] = (None, None, None)
        stored = Stored()
        if shape.kind not in shapes.ANALYTIC:
            corners, stored = self._add_triangles(shape, row, times)
        else:
            row["kind"] = 1 + shapes.ANALYTIC.index(shape.kind)
            if shape.kind == "curves":
                stored = self._add_curves(shape, row)
            elif shape.kind in shapes.ONE_OF:
                times_of = self.motions.deforming.get(placed.number)
                balls, stored = self._add_balls(shape, row, times_of)
                corners = balls, None, None
        if shape.emission is not None:
            count = len(times) if _in_triangles(shape) else 1
            self.emitters.append(Emitter(shape, len(self.rows), *corners, keys=max(count, 1)))
            self.uvs |= shape.emission.has_textures
        self.rows.append(row)
        self.stored.append(stored)

    def swept(self, placed: Placed, boxes: NDArray[Any]) -> NDArray[np.float32]:
        """Return the boxes (n, 2, 3) of a shape, enlarged by its motion."""
        if placed.number not in self.motions.shapes:
            return np.asarray(boxes, np.float32)
        return self.motions.swept(placed.number, boxes)

    def _add_balls(
        self, shape: Shape, row: np.ndarray, times: tuple[float, ...] | None
    ) -> tuple[Any, Stored]:
        """Append the boxes of `spheres`; return their balls (n, 4) at the first of the times."""
        row["prim"] = self.single_count + sum(map(len, self.many))
        row["flags"] |= SHAPE_BITS["many"]
        by = shapes.geometry(shape)
        if times:
            keyed = self.cache(analytic.keyed, shape, times, by=(*by, times))
            self.many.append(analytic.swept(keyed))
            budget.take_arrays((keyed, self.many[-1]), shapes.where(shape))
            return keyed[:, 0], Stored(many=keyed)
        balls = self.cache(analytic.balls, shape, by=by)
        self.many.append(analytic.boxes([balls]))
        budget.take_arrays((balls, self.many[-1]), shapes.where(shape))
        return balls, Stored(many=balls)

    def _add_curves(self, shape: Shape, row: np.ndarray) -> Stored:
        row["prim"] = self.single_count + sum(map(len, self.many))
        pieces = self.cache(strands.pieces, shape, by=shapes.geometry(shape))
        self.many.append(strands.boxes(pieces))
        budget.take_arrays((pieces, self.many[-1]), shapes.where(shape))
        return Stored(many=pieces)

    def _add_triangles(
        self, shape: Shape, row: np.ndarray, times: Sequence[float]
    ) -> tuple[tuple[Any, Any, Any], Stored]:
        """Append a shape's triangles; return their vertices, faces, uvs, and the other arrays."""
        by = shapes.geometry(shape)
        if times:
            row["flags"] |= SHAPE_BITS["deforms"]
            self.keys[self.vertex_count] = len(times)
            arrays = self.cache(triangles.keyed, shape, times, by=(*by, times))
        else:
            arrays = self.cache(triangles.counted, shape, by=by)
        vertices, faces, normals, uvs, flat = arrays
        budget.take_arrays((vertices, faces, normals, uvs), shapes.where(shape))
        self.flat += flat
        row["prim"] = self.face_count
        row["flags"] |= SHAPE_BITS["normals"] if normals is not None else 0
        row["flags"] |= SHAPE_BITS["uvs"] if uvs is not None else 0
        self.normals |= normals is not None
        if shape.tangents is not None and not times:
            row["flags"] |= SHAPE_BITS["tangents"]
            tangents = self.cache(triangles.tangents, shape, by=(*by, shape.tangents))
            self.tangents.append((self.vertex_count, tangents))
        numbered = faces + np.uint32(self.vertex_count)
        self.parts.append((vertices, numbered, len(self.rows)))
        self.vertex_count += len(vertices)
        self.face_count += len(faces)
        return (vertices, faces, uvs), Stored(len(vertices), normals, uvs)

    def share(self, prototype: Prototype) -> instancing.Shared:
        """Append the rows and the triangles of shapes that instances share."""
        before, first = len(self.parts), self.face_count
        times = self.motions.deforming.get(int(prototype.numbers[0]), ())
        number = int(prototype.numbers[0]) if prototype.moves or times else 0
        for shape in prototype.shapes:
            self.add(Placed(shape, number), times)
        parts = self.parts[before:]
        whole, centre = instancing.centred(np.concatenate([v for v, _, _ in parts]))
        points = instancing.hull_points(whole)
        placed, boxes = instancing.place(prototype.to_world, prototype.numbers, points, centre)
        moving = [i for i, n in enumerate(prototype.numbers) if int(n) in self.motions.shapes]
        if moving:
            coarse = instancing.hull_points(whole, SWEPT_CELLS).astype(np.float64) + centre
            for i in moving:
                keys = self.motions.shapes[int(prototype.numbers[i])]
                swept = transforms.transform_points(prototype.to_world[i], coarse)
                boxes[i] = motion.swept(keys, swept[None], self.motions.shutter)[0]
        ends = np.cumsum([len(v) for v, _, _ in parts])[:-1]
        self.parts[before:] = [
            (vertices, faces, number)
            for vertices, (_, faces, number) in zip(np.split(whole, ends), parts, strict=True)
        ]
        placed["prim"] = first
        count = max(len(times), 1)
        return instancing.Shared(placed, boxes, self.face_count - first, centre, count)

    def concatenated(self) -> Triangles:
        if max(self.vertex_count, self.face_count) > MOST:
            raise SceneError(
                f"{self.face_count:,} triangles with {self.vertex_count:,} vertices: of either "
                f"there may be {MOST:,}; use instances for what repeats"
            )
        if not self.parts:
            return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint32), np.zeros(0, np.uint32)
        vertices, faces, numbers = zip(*self.parts, strict=True)
        self.parts.clear()
        tags = [np.full(len(f), n, np.uint32) for f, n in zip(faces, numbers, strict=True)]
        return np.concatenate(vertices), np.concatenate(faces), np.concatenate(tags)


def _in_triangles(shape: Shape) -> bool:
    """Return whether each triangle of an emitting shape becomes a light."""
    return shape.kind not in (*shapes.RECORDS, *shapes.ANALYTIC)
