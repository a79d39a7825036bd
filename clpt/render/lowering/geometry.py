"""The shapes of a scene as the device has them: rows, triangles, boxes and instances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.bvh.build import MOST
from clpt.errors import SceneError
from clpt.geometry import (
    analytic,
    instancing,
    motion,
    shape_records,
    shapes,
    spheres,
    strands,
    triangles,
)
from clpt.geometry.instancing import Instances, Placed, Prototype
from clpt.geometry.motion import Motions
from clpt.records import SHAPE, SHAPE_BITS
from clpt.render.analysis.index import SceneIndex
from clpt.render.lowering.encoder import Encoder
from clpt.render.lowering.materials.material_words import MaterialWords
from clpt.render.lowering.textures.attributes import Owner
from clpt.scene.params import fields_of
from clpt.scene.shapes import Shape

LEAST_RADIUS = 1e-12  # of a sphere around a scene [m]
SWEPT_CELLS = 4  # of the hull of what moves, see `instancing.hull_points`

Triangles = tuple[NDArray[np.float32], NDArray[np.uint32], NDArray[np.uint32]]


@dataclass(frozen=True)
class Emitter:
    """A shape with an `emission`.

    shape_row: its row in `shapes`; vertices, faces, uvs: its triangles as `shapes.triangles` gave
    them, needed for a mesh and a cube; of `spheres`, vertices are their balls; keys: rows of each
    vertex, as of `triangles.keyed`.
    """

    shape: Shape
    shape_row: int
    vertices: shapes.Points | None = None
    faces: shapes.Faces | None = None
    uvs: shapes.Points | None = None
    keys: int = 1


@dataclass(frozen=True)
class Geometry:
    """What the shapes of a scene became.

    rows: of `shapes`, those of analytic shapes last; owners: of each row, with its first vertex and
    face; vertices (n, 3) float32, faces (m, 3) uint32 and tags (m,) uint32, the shape of each
    triangle: the world's before those of groups; boxes (k, 2, 3) float32: of analytic shapes;
    world_vertices: how many vertices are not a group's; first_analytic: a row; single_count:
    analytic shapes that are one each; analytic: their kinds; normals, uvs: whether a shape needs
    them; tangents: of shapes that say their own, each with its first vertex; keys: by the first
    vertex of a shape how many rows each of its vertices has, where that is not one.
    """

    rows: tuple[np.ndarray, ...]
    owners: tuple[Owner, ...]
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

    def bounding_sphere(self) -> tuple[NDArray[np.float64], float]:
        """Return centre and radius of a sphere around the scene; a unit one if it is empty."""
        vertices = self.vertices[: self.world_vertices]
        boxes = [box for box in (self.boxes, self.instances.boxes) if len(box)]
        lows = [vertices.min(axis=0)] if len(vertices) else []
        highs = [vertices.max(axis=0)] if len(vertices) else []
        lows += [box[:, 0].min(axis=0) for box in boxes]
        highs += [box[:, 1].max(axis=0) for box in boxes]
        if not lows:
            return np.zeros(3), 1.0
        low, high = np.min(lows, axis=0), np.max(highs, axis=0)
        return (low + high) / 2, max(float(np.linalg.norm(high - low)) / 2, LEAST_RADIUS)


def lower_geometry(index: SceneIndex, encoder: Encoder, materials: MaterialWords) -> Geometry:
    """Put the shapes of a scene into the tables.

    Raises SceneError for a shape that makes no sense, and for more triangles than a tree can hold.
    """
    kinds = shape_records.ANALYTIC
    meshes = [one for one in index.placed if one.shape.kind not in kinds]
    others = [one for one in index.placed if one.shape.kind in kinds]
    many = list(shape_records.ONE_OF)
    others.sort(key=lambda one: one.shape.kind in many and 1 + many.index(one.shape.kind))
    single = [one for one in others if one.shape.kind not in shape_records.ONE_OF]
    builder = _Builder(encoder, materials, len(single), index.motions)
    builder.spheres_move = spheres_move(index)
    for one in meshes:
        builder.add(one)
    world_vertices = builder.vertex_count
    instances = instancing.concatenated([builder.share(p) for p in index.prototypes])
    encoder.store.append("instances", instances.rows.view(np.uint32))
    first_analytic = len(builder.rows)
    for one in others:
        builder.add(one)
    builder.add_pieces()
    boxes = [builder.around(one, np.array([analytic.bounds(one.shape)])) for one in single]
    vertices, faces, tags = builder.concatenated()
    return Geometry(
        rows=tuple(builder.rows),
        owners=tuple(builder.owners),
        vertices=vertices,
        faces=faces,
        tags=tags,
        boxes=np.concatenate(
            [
                np.zeros((0, 2, 3), np.float32),
                *boxes,
                *(
                    builder.around(one, own)
                    for one, own in zip(others[len(single) :], builder.many, strict=True)
                ),
            ]
        ),
        instances=instances,
        emitters=tuple(builder.emitters),
        world_vertices=world_vertices,
        first_analytic=first_analytic,
        single_count=len(single),
        analytic=frozenset(one.shape.kind for one in others),
        normals=builder.normals,
        uvs=builder.uvs,
        tangents=tuple(builder.tangents),
        warnings=tuple(triangles.warnings_of(builder.flat)),
        keys=builder.keys,
    )


def spheres_move(index: SceneIndex) -> bool:
    """Whether many spheres in one shape belong to something that deforms."""
    deforming = index.motions.deforming
    return any(one.shape.kind == "spheres" and one.number in deforming for one in index.placed)


@dataclass
class _Builder:
    """What `lower_geometry` has put into the tables so far."""

    encoder: Encoder
    materials: MaterialWords
    single_count: int
    motions: Motions
    rows: list[np.ndarray] = field(default_factory=list)
    owners: list[Owner] = field(default_factory=list)
    emitters: list[Emitter] = field(default_factory=list)
    parts: list[tuple[np.ndarray, np.ndarray, int]] = field(default_factory=list)
    flat: list[triangles.Flat] = field(default_factory=list)
    many: list[NDArray[np.float32]] = field(default_factory=list)
    curves: list[tuple[np.ndarray, Shape, strands.Pieces]] = field(default_factory=list)
    vertex_count: int = 0
    face_count: int = 0
    normals: bool = False
    uvs: bool = False
    tangents: list[tuple[int, np.ndarray]] = field(default_factory=list)
    keys: dict[int, int] = field(default_factory=dict)
    spheres_move: bool = False

    def add(self, one: Placed, times: Sequence[float] = ()) -> None:
        """Append a shape's row; its triangles, or its parameters, go into the tables.

        times: at which the vertices have rows, for what belongs to something that deforms.
        """
        shape: Any = one.shape
        row = np.zeros((), SHAPE.dtype)
        row["number"], row["light"] = one.number, -1
        front, back, two_sided = self.materials.sides(shape)
        row["front"], row["back"] = np.array([front, back], np.uint32).view(np.int32)
        row["flags"] = SHAPE_BITS["two_sided"] if two_sided else 0
        self.owners.append((row, shape, self.vertex_count, self.face_count))
        if shape.kind not in shape_records.ANALYTIC:
            corners = self._add_triangles(shape, row, times)
        else:
            row["kind"] = 1 + shape_records.ANALYTIC.index(shape.kind)
            corners = (None, None, None)
            if shape.kind == "curves":
                self._add_curves(shape, row)
            else:
                row["params"] = self.encoder.store.append("geometry", analytic.row(shape))
                if shape.kind in shape_records.ONE_OF:
                    corners = self._add_balls(shape, row, self.motions.deforming.get(one.number))
        if shape.emission is not None:
            count = len(times) if _in_triangles(shape) else 1
            self.emitters.append(Emitter(shape, len(self.rows), *corners, keys=max(count, 1)))
            values = fields_of(shape.emission).values()
            self.uvs |= any(getattr(value, "is_texture", False) for value in values)
        self.rows.append(row)

    def around(self, one: Placed, boxes: NDArray[Any]) -> NDArray[np.float32]:
        """Boxes (n, 2, 3) of a shape, and where it moves around all that they sweep."""
        if one.number not in self.motions.shapes:
            return np.asarray(boxes, np.float32)
        return self.motions.swept(one.number, boxes)

    def _add_balls(
        self, shape: Any, row: np.ndarray, times: tuple[float, ...] | None
    ) -> tuple[Any, Any, Any]:
        """Append many spheres; return them in the place of vertices.

        times: at which they have rows, for what belongs to something that deforms.
        """
        row["prim"] = self.single_count + sum(map(len, self.many))
        row["flags"] |= SHAPE_BITS["many"]
        store, by = self.encoder.store, shapes.geometry(shape)
        if times:
            keyed = self.encoder.cache(spheres.keyed, shape, times, by=(*by, times))
            self.many.append(spheres.swept(keyed))
            at, balls = store.append_floats("spheres", keyed), keyed[:, 0]
        else:
            balls = self.encoder.cache(spheres.balls, shape, by=by)
            self.many.append(spheres.boxes([balls]))
            at = store.append_floats("spheres", balls)
        if self.spheres_move:
            # where primitive 0 would be
            first = at - balls.shape[1] * len(times or (0.0,)) * int(row["prim"])
            store.append("geometry", np.array([first], np.int32).view(np.uint32))
        return balls, None, None

    def _add_curves(self, shape: Any, row: np.ndarray) -> None:
        """Append the boxes of a shape's pieces; `add_pieces` appends the pieces."""
        row["prim"] = self.single_count + sum(map(len, self.many))
        found = self.encoder.cache(strands.pieces, shape, by=shapes.geometry(shape))
        self.curves.append((row, shape, found))
        self.many.append(strands.boxes(found))

    def add_pieces(self) -> None:
        """Put the pieces of all curves into `spheres`, and where they are into `geometry`."""
        if not self.curves:
            return
        store, member = self.encoder.store, analytic.member("curve", "first")
        for row, shape, found in self.curves:
            words, at = analytic.row(shape), store.append_floats("spheres", found)
            words[member] = np.int32(at - strands.WORDS * int(row["prim"])).view(np.uint32)
            row["params"] = store.append("geometry", words)

    def _add_triangles(
        self, shape: Any, row: np.ndarray, times: Sequence[float]
    ) -> tuple[Any, Any, Any]:
        """Append a shape's triangles; return their vertices, faces and uvs."""
        by = shapes.geometry(shape)
        if times:
            row["flags"] |= SHAPE_BITS["deforms"]
            self.keys[self.vertex_count] = len(times)
            made = self.encoder.cache(triangles.keyed, shape, times, by=(*by, times))
        else:
            made = self.encoder.cache(triangles.counted, shape, by=by)
        vertices, faces, normals, uvs, flat = made
        self.flat += flat
        row["prim"] = self.face_count
        row["flags"] |= SHAPE_BITS["normals"] if normals is not None else 0
        row["flags"] |= SHAPE_BITS["uvs"] if uvs is not None else 0
        zeros = np.zeros_like(vertices)
        self.encoder.store.append_floats("normals", zeros if normals is None else normals)
        self.encoder.store.append_floats("uvs", zeros[:, :2] if uvs is None else uvs)
        self.normals |= normals is not None
        if getattr(shape, "tangents", None) is not None and not times:
            row["flags"] |= SHAPE_BITS["tangents"]
            own = (*shapes.geometry(shape), shape.tangents)
            along = self.encoder.cache(triangles.tangents, shape, by=own)
            self.tangents.append((self.vertex_count, along))
        moved = faces + np.uint32(self.vertex_count)
        self.parts.append((vertices, moved, len(self.rows)))
        self.vertex_count += len(vertices)
        self.face_count += len(faces)
        return vertices, faces, uvs

    def share(self, prototype: Prototype) -> instancing.Shared:
        """Append the rows of shapes that instances share, and their triangles once."""
        before, first = len(self.parts), self.face_count
        times = self.motions.deforming.get(int(prototype.numbers[0]), ())
        number = int(prototype.numbers[0]) if prototype.moves or times else 0
        for shape in prototype.shapes:
            self.add(Placed(shape, number), times)
        own = self.parts[before:]
        whole, centre = instancing.centred(np.concatenate([v for v, _, _ in own]))
        points = instancing.hull_points(whole)
        placed, boxes = instancing.place(prototype.to_world, prototype.numbers, points, centre)
        moving = [i for i, n in enumerate(prototype.numbers) if int(n) in self.motions.shapes]
        if moving:
            coarse = instancing.hull_points(whole, SWEPT_CELLS).astype(np.float64) + centre
            for i in moving:
                keys = self.motions.shapes[int(prototype.numbers[i])]
                swept = transforms.transform_points(prototype.to_world[i], coarse)
                boxes[i] = motion.swept(keys, swept[None], self.motions.shutter)[0]
        ends = np.cumsum([len(v) for v, _, _ in own])[:-1]
        self.parts[before:] = [
            (moved, faces, number)
            for moved, (_, faces, number) in zip(np.split(whole, ends), own, strict=True)
        ]
        placed["prim"] = first
        count = max(len(times), 1)
        return instancing.Shared(placed, boxes, self.face_count - first, centre, count)

    def concatenated(self) -> Triangles:
        """Return all vertices, faces and tags."""
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
    """Whether each triangle of a shape that emits is a light."""
    return shape.kind not in (*shape_records.RECORDS, *shape_records.ANALYTIC)


def shape_words(rows: Sequence[np.ndarray]) -> NDArray[np.uint32]:
    """Return rows of `shapes` as words."""
    return np.concatenate([np.zeros(0, SHAPE.dtype), *map(np.atleast_1d, rows)]).view(np.uint32)
