"""Groups and their instances, on their way to the device.

Triangles of a group are shared by all its instances. Lights, analytic shapes and groups with a
single instance are copied as ordinary shapes.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Matrices, Points, on_host, single
from clpt.errors import SceneError
from clpt.files import budget
from clpt.geometry import analytic, shapes, strands, triangles, tubes
from clpt.geometry.analytic import keeps_its_kind, tessellate
from clpt.geometry.shapes import ANALYTIC, where
from clpt.geometry.tubes import Tubes, as_tubes
from clpt.records import INSTANCE
from clpt.scene.shapes import Curves, Cylinder, Group, Mesh, Shape, Sphere

CELLS = 16  # columns along a side, see `outline`
FEW = 16  # up to this number of instances curves are copied, as tubes would take more memory
ROUNDING = 4e-6  # growth of a box over its coordinates, as float32 rounds them
POINTS = 1 << 20  # that are transformed at once


@dataclass(frozen=True)
class Placed:
    """An ordinary shape, and which of the scene's shapes it is or belongs to."""

    shape: Shape
    number: int


@dataclass(frozen=True)
class Prototype:
    """Shapes of triangles that several instances share.

    to_world: (k, 4, 4) float64, of each instance; numbers: (k,), which of the scene's shapes it is;
    moves: it is a shape of its own, which moves.
    """

    shapes: tuple[Shape, ...]
    to_world: Matrices
    numbers: NDArray[np.int32]
    moves: bool = False


@dataclass(frozen=True)
class Shared:
    """A prototype as the device has it.

    rows: (k,) of INSTANCE.dtype; boxes: (k, 2, 3) float32 in the world; triangles: their number;
    middle: (3,) of the group's box, where its triangles have their origin; keys: rows of each
    vertex.
    """

    rows: NDArray[Any]
    boxes: NDArray[np.float32]
    triangles: int
    centre: NDArray[np.float64]
    keys: int = 1


@dataclass(frozen=True)
class Instances:
    """All instances of a scene.

    rows: (k,) of INSTANCE.dtype; boxes: (k, 2, 3) float32; prototypes: (k,) number of each
    instance's prototype; triangles, middles: of each prototype; keys: rows of each of its vertices,
    a row for each time.
    """

    rows: NDArray[Any]
    boxes: NDArray[np.float32]
    prototypes: NDArray[np.intp]
    triangles: tuple[int, ...]
    centres: tuple[NDArray[np.float64], ...]
    keys: tuple[int, ...] = ()


def concatenated(parts: Sequence[Shared]) -> Instances:
    """Return the instances of all prototypes in order."""
    return Instances(
        np.concatenate([np.zeros(0, INSTANCE.dtype), *(part.rows for part in parts)]),
        np.concatenate([np.zeros((0, 2, 3), np.float32), *(part.boxes for part in parts)]),
        np.repeat(np.arange(len(parts)), [len(part.rows) for part in parts]),
        tuple(part.triangles for part in parts),
        tuple(part.centre for part in parts),
        tuple(part.keys for part in parts),
    )


def distinct(shapes_: Iterable[Shape]) -> Iterator[Shape]:
    """Yield every shape that a scene has, those of its groups once and where the group has them."""
    seen: set[int] = set()
    for shape in shapes_:
        if shape.group is None:
            yield shape
        elif id(shape.group) not in seen:
            seen.add(id(shape.group))
            yield from shape.group.shapes


def sort(
    shapes: Sequence[Shape], warnings: list[str], moving: Collection[int] = ()
) -> tuple[list[Placed], list[Prototype]]:
    """Return the shapes that are lowered as they are, and the shared shapes.

    moving: indices of moving shapes; the triangles of each become a prototype and its instance.
    A sphere or tube that an instance stretches becomes a mesh; a line about it goes to `warnings`.
    Raises SceneError for an instance whose transform is singular or a projection.
    """
    placed: list[Placed] = []
    prototypes: list[Prototype] = []
    groups: dict[int, tuple[Group, list[int]]] = {}
    for number, member in enumerate(shapes):
        as_met = _met_as(member)
        if (group := as_met.group) is not None:
            groups.setdefault(id(group), (group, []))[1].append(number)
        elif number in moving and as_met.kind not in ANALYTIC:
            prototypes.append(_alone(as_met, number))
        else:
            placed.append(Placed(as_met, number))
    for group, numbers in groups.values():
        to_world = matrices([shapes[number] for number in numbers])
        shared = []
        for member in group.shapes:
            shape = _met_as(member, to_world)
            whole = Prototype((shape,), to_world, np.array(numbers, np.int32))
            if shape.kind in ANALYTIC:
                placed += _analytic(shape, whole, prototypes, warnings, moving)
            elif shape.emission is not None or len(numbers) == 1:
                placed += _own(_copies(shape, whole), prototypes, moving)
            else:
                shared.append(shape)
        if shared:
            prototypes.append(dataclasses.replace(whole, shapes=tuple(shared)))
    return placed, prototypes


def _met_as(shape: Shape, to_world: Matrices | None = None) -> Shape:
    """A shape as rays meet it: tubes for curves that shine, deform, are stretched or often placed.

    to_world: of the instances of a group, (k, 4, 4).
    """
    if not isinstance(shape, Curves) or isinstance(shape, Tubes):
        return shape
    placed = np.eye(4)[None] if to_world is None else to_world
    still = shape.emission is None and shape.deformation is None
    if (
        still
        and len(placed) <= FEW
        and all(keeps_its_kind(copy) for copy in _placed(shape, placed))
    ):
        return shape
    return as_tubes(shape)


def matrices(instances: Sequence[Shape]) -> Matrices:
    """Return the transforms of instances, (k, 4, 4), checked all at once. Raises as `sort` does."""
    try:
        placements = (on_host(instance.to_world) for instance in budget.steps(instances))
        stacked = np.stack([np.asarray(matrix, np.float64) for matrix in placements])
        affine = stacked.shape[1:] == (4, 4) and (stacked[:, 3] == transforms.IDENTITY[3]).all()
        linear = stacked[:, :3, :3]
        with np.errstate(all="ignore"):
            lengths = np.linalg.norm(linear, axis=1)
            volume = np.abs(np.linalg.det(linear)) / lengths.prod(axis=1)
        if affine and np.isfinite(stacked).all() and (volume >= transforms.SINGULAR_BELOW).all():
            return stacked
    except (TypeError, ValueError, IndexError):
        pass
    return np.stack([shapes.placement(instance) for instance in instances])


def _copies(shape: Shape, whole: Prototype) -> list[Placed]:
    """The shape once for every instance."""
    copies = _placed(shape, whole.to_world)
    return [Placed(copy, int(number)) for copy, number in zip(copies, whole.numbers, strict=True)]


def _placed(shape: Shape, to_world: Matrices) -> list[Shape]:
    """A shape under each of the transforms, which its own goes before."""
    placement = shapes.placement(shape)
    return [shape.placed(matrix @ placement) for matrix in to_world]


def _alone(shape: Shape, number: int) -> Prototype:
    """A shape that moves by itself."""
    return Prototype((shape,), np.eye(4)[None], np.array([number], np.int32), moves=True)


def _own(
    copies: list[Placed], prototypes: list[Prototype], moving: Collection[int]
) -> list[Placed]:
    """The copies that are still; those that move become prototypes."""
    prototypes += [_alone(copy.shape, copy.number) for copy in copies if copy.number in moving]
    return [copy for copy in copies if copy.number not in moving]


def _analytic(
    shape: Any,
    whole: Prototype,
    prototypes: list[Prototype],
    warnings: list[str],
    moving: Collection[int],
) -> list[Placed]:
    """An analytic shape for every instance; where it is stretched, as triangles."""
    copies = _copies(shape, whole)
    stretched = np.array([not keeps_its_kind(copy.shape) for copy in copies])
    if not stretched.any():
        return copies
    count = int(stretched.sum())
    if not isinstance(shape, (Sphere, Cylinder)):  # nor can it become triangles: tell why
        analytic.row(next(copy.shape for copy, bad in zip(copies, stretched, strict=True) if bad))
    warnings.append(
        f"{shapes.where(shape)}: {count} of {len(copies)} instances stretch it; "
        "they are met as triangles"
    )
    kept = [copy for copy, bad in zip(copies, stretched, strict=True) if not bad]
    mesh = tessellate(shape)
    others = Prototype((mesh,), whole.to_world[stretched], whole.numbers[stretched])
    if shape.emission is not None or count == 1:
        return kept + _own(_copies(mesh, others), prototypes, moving)
    prototypes.append(others)
    return kept


def centred(vertices: Points) -> tuple[Points, NDArray[np.float64]]:
    """Return vertices (n, 3) float32 about the middle of their box, and that (3,)."""
    centre = ((vertices.min(axis=0) + vertices.max(axis=0)) * np.float32(0.5)).astype(np.float64)
    return (vertices - centre).astype(np.float32), centre


def place(
    to_world: Matrices, numbers: NDArray[np.int32], points: Points, centre: Matrices
) -> tuple[NDArray[Any], NDArray[np.float32]]:
    """Return a row of INSTANCE and a box (2, 3) float32 in the world per instance.

    to_world, numbers: as of a Prototype; points, centre: of its vertices, see `outline` and
    `centred`. Of the rows, nodes, leaves and prim are 0. Raises SceneError where float32 does not
    reach.
    """
    linear = to_world[:, :3, :3]
    rows = np.zeros(len(linear), INSTANCE.dtype)
    rows["number"] = numbers
    rows["origin"] = single(linear @ centre + to_world[:, :3, 3])
    with np.errstate(all="ignore"):  # looked at below
        to_local = np.linalg.inv(linear).astype(np.float32)
        for i, name in enumerate("xyz"):
            rows[name] = to_local[:, i]
        seen = to_local.astype(np.float64)  # what rays are turned by
        seen[~(np.abs(np.linalg.det(seen)) > 0.0)] = np.nan
        boxes = _boxes(points, np.linalg.inv(seen), rows)
    wrong = ~np.isfinite(boxes).all(axis=(1, 2))
    if wrong.any():
        where = f"shapes[{numbers[np.argmax(wrong)]}]"
        raise SceneError("its transform moves a group out of float32", where=where)
    return rows, boxes


def _boxes(points: Points, linear: Matrices, rows: NDArray[Any]) -> NDArray[np.float32]:
    """Return a box (2, 3) around points under each matrix, enlarged by ROUNDING."""
    boxes = np.empty((len(rows), 2, 3))
    step = max(1, POINTS // len(points))
    columns = np.ascontiguousarray(points.T, np.float64)
    for i in range(0, len(rows), step):
        for axis in range(3):
            moved = linear[i : i + step, axis] @ columns
            boxes[i : i + step, :, axis] = np.stack([moved.min(axis=1), moved.max(axis=1)], axis=1)
    origin = rows["origin"].astype(np.float64)[:, None]
    pad = ROUNDING * (np.abs(boxes).max(axis=(1, 2)) + np.abs(origin).max(axis=(1, 2)))
    boxes += origin
    boxes[:, 0] -= pad[:, None]
    boxes[:, 1] += pad[:, None]
    return boxes.astype(np.float32)


def hull_points(vertices: Points, cells: int = CELLS) -> Points:
    """Return points (p, 3) whose hull holds the vertices and is little larger, p at most 8 cells^2.

    They are the corners of a box around the vertices in each column of a grid.
    """
    if len(vertices) <= 8:
        return vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = np.where(high > low, high - low, 1.0)
    cell = np.minimum((vertices - low) / size * cells, cells - 1).astype(np.int64)
    columns, index = np.unique(cell[:, 0] * cells + cell[:, 1], return_inverse=True)
    lows = np.full((len(columns), 3), np.inf, np.float32)
    highs = np.full((len(columns), 3), -np.inf, np.float32)
    np.minimum.at(lows, index, vertices)
    np.maximum.at(highs, index, vertices)
    corners = [[(lows, highs)[bit >> axis & 1][:, axis] for axis in range(3)] for bit in range(8)]
    return np.concatenate([np.column_stack(corner) for corner in corners])


def primitive_rows(shape: Shape, times: Sequence[float] = ()) -> NDArray[np.int64] | None:
    """Return the caller's row for each primitive of a shape, (n,); None: kernels know it.

    times: of a deforming shape's vertices [s]. The row is that in `faces` of a mesh, also if
    triangles without an area are left out, or if a face is subdivided; of curves it is the number
    of the strand. An analytic shape that its transform turns into triangles has a single row, 0.
    """
    rows = _ROWS.get(shape.kind, _of_triangles)(shape, times)
    same = (
        shape.kind != "curves" and rows is not None and np.array_equal(rows, np.arange(len(rows)))
    )
    return None if same else rows


def _of_triangles(shape: Shape, times: Sequence[float]) -> NDArray[np.int64]:
    return np.flatnonzero(triangles.kept(shape, times))


def _of_mesh(shape: Mesh, times: Sequence[float]) -> NDArray[np.int64]:
    kept = triangles.kept(shape, times)
    return np.asarray(triangles.sources(shape, len(kept))[kept])


def _of_tubes(shape: Curves, times: Sequence[float]) -> NDArray[np.int64]:
    keyed = times if shape.deformation is not None else ()
    alike = [shape.at_time(time) for time in keyed]
    vertices, faces, _, _ = triangles.local(alike[0] if alike else shape, alike)
    strand = tubes.strands(alike[0] if alike else shape, where(shape), alike, len(vertices))
    return np.asarray(strand[faces[:, 0]][triangles.kept(shape, times)])


def _of_curves(shape: Curves, times: Sequence[float]) -> NDArray[np.int64]:
    return strands.strands(shape)


def _of_one(shape: Shape, times: Sequence[float]) -> NDArray[np.int64]:
    return np.zeros(int(triangles.kept(shape, times).sum()), np.int64)


def _as_they_lie(shape: Shape, times: Sequence[float]) -> None:
    """Return None: the primitives are the rows."""


_ROWS: dict[str, Callable[..., NDArray[np.int64] | None]] = {
    "mesh": _of_mesh,
    "tubes": _of_tubes,
    "curves": _of_curves,
    "tessellated": _of_one,
    **dict.fromkeys(("sphere", "spheres", "disk", "cylinder"), _as_they_lie),
}
