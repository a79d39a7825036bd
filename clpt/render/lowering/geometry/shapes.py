"""Shapes on their way to the device: triangles, or a row of parameters for shapes met as they are.

A rectangle is both: rays meet its two triangles, light is sampled on it as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.errors import SceneError
from clpt.render.contract.shape_records import ANALYTIC, ONE_OF, RECORDS
from clpt.render.lowering.device_arrays import on_host
from clpt.render.lowering.geometry.tubes import tubes
from clpt.scene import shapes
from clpt.scene.shapes import Shape

Points = NDArray[np.float32]
Faces = NDArray[np.uint32]
Words = NDArray[np.uint32]

UNEVEN = 1e-5  # relative difference of lengths or cosine of axes from which a sphere is none
PADDING = 1e-6  # of the size of an analytic shape, for what float32 rounds in its kernel

SUMMED = 1 << 20  # triangles whose normals are summed at a time
CHUNK = 1 << 16  # triangles that are looked at at a time: what is made of them stays in the cache


# Corners of the cube's sides in the order of _CORNER_UVS, as Mitsuba has them.
_CUBE = (
    "+-- +-+ --+ ---",
    "++- -+- -++ +++",
    "+-- ++- +++ +-+",
    "+-+ +++ -++ --+",
    "--+ -++ -+- ---",
    "++- +-- --- -+-",
)
_CORNER_UVS = ((0, 1), (1, 1), (1, 0), (0, 0))
_CORNER_FACES = ((0, 1, 2), (3, 0, 2))


@dataclass(frozen=True)
class Flat:
    """How many of a shape's triangles have no area."""

    where: str
    count: int
    of: int


def where(shape: Shape) -> str:
    """Return how a message names the shape."""
    return f"{shape.kind} {shape.name!r}" if shape.name else shape.kind


def triangles(
    shape: Shape, flat: list[Flat] | None = None
) -> tuple[Points, Faces, Points | None, Points | None]:
    """Return a rectangle, cube, mesh or curves in world space: vertices, faces, normals and uvs.

    vertices (n, 3) float32 [m], faces (m, 3) uint32 counter-clockwise seen from the front, normals
    (n, 3) float32 or None, uvs (n, 2) float32 or None. Triangles without an area are left out, and
    counted in `flat`.

    Raises SceneError for a mesh that is empty, not finite or inconsistent, or a singular transform.
    """
    vertices, faces, normals, uvs = _in_world(shape)
    solid = _solid(vertices, faces)
    warnings_of = not isinstance(shape, shapes.Curves)  # a tube may shrink to a line
    if warnings_of and not solid.all() and flat is not None:
        flat.append(Flat(where(shape), int(len(solid) - solid.sum()), len(solid)))
    faces = faces if solid.all() else faces[solid]
    return vertices, np.ascontiguousarray(faces), normals, uvs


def counted(
    shape: Shape,
) -> tuple[Points, Faces, Points | None, Points | None, tuple[Flat, ...]]:
    """Return what `triangles` does, and whether it left some out."""
    flat: list[Flat] = []
    return *triangles(shape, flat), tuple(flat)


def geometry(shape: Shape) -> tuple[Any, ...]:
    """Return all that the triangles of a shape follow from: its fields but for the surface."""
    own = (value for name, value in vars(shape).items() if name not in ("material", "emission"))
    return type(shape), *own


def warnings_of(flat: Sequence[Flat]) -> list[str]:
    """Return one warning about the triangles that were left out, or none."""
    if not flat:
        return []
    head = flat[0]
    of = "all" if head.count == head.of else f"{head.count} of {head.of}"
    first = f"{head.where}: {of} triangles have no area, left out"
    if len(flat) == 1:
        return [first]
    total = sum(one.count for one in flat)
    return [f"{first}; with those of {len(flat) - 1} more shapes {total:,} in all"]


def attribute(shape: Shape, name: str) -> Points:
    """Return an attribute of a mesh, (n, 1 or 3) float32 per vertex, or per face of `triangles`.

    Raises SceneError for one that has another shape, or values that are not finite.
    """
    per_face = name.startswith("face_")
    if shape.kind in ONE_OF:
        count = len(shape.centers)  # type: ignore[attr-defined]
        if per_face:
            message = f"attribute {name!r}: spheres have no faces, its name must begin with vertex_"
            raise SceneError(message, where=where(shape))
    else:
        vertices, faces, _, _ = _in_world(shape)
        count = len(faces) if per_face else len(vertices)
    given: Any = shape.attributes[name]  # type: ignore[attr-defined]
    values = np.asarray(on_host(given), np.float32)
    values = values[:, None] if values.ndim == 1 else values
    if values.shape not in ((count, 1), (count, 3)):
        message = f"attribute {name!r} must be ({count}, 1 or 3), found {values.shape}"
        raise SceneError(message, where=where(shape))
    if not np.isfinite(values).all():
        raise SceneError(f"attribute {name!r} is not finite", where=where(shape))
    return values[_solid(vertices, faces)] if per_face else values


def _in_world(shape: Shape) -> tuple[Points, Faces, Points | None, Points | None]:
    """Vertices, faces, normals and uvs after the transform."""
    matrix = placement(shape)
    vertices, faces, normals, uvs = local(shape)
    if not np.array_equal(matrix, transforms.IDENTITY):
        vertices = transforms.transform_points(matrix, vertices).astype(np.float32)
        if not np.isfinite(vertices).all():
            raise SceneError("its transform moves vertices out of float32", where=where(shape))
        if normals is not None:
            normals = transforms.transform_normals(matrix, normals).astype(np.float32)
    if normals is not None and shape.flip_normals:
        normals = -normals
    if transforms.flips_handedness(matrix) != shape.flip_normals:
        faces = faces[:, ::-1]
    return vertices, faces, normals, uvs


def _solid(vertices: Points, faces: Faces) -> NDArray[np.bool_]:
    """Which faces have a cross product that is not zero in float32."""
    found = np.empty(len(faces), np.bool_)
    for first in range(0, len(faces), CHUNK):
        crosses = _crosses(vertices, faces[first : first + CHUNK])
        found[first : first + CHUNK] = (crosses * crosses > 0.0).any(axis=1)
    return found


def _crosses(vertices: NDArray[Any], faces: Faces) -> NDArray[Any]:
    """Cross products of the edges at each triangle's first vertex, (m, 3) like the vertices."""
    v0, v1, v2 = (vertices[faces[:, i]] for i in range(3))
    (ax, ay, az), (bx, by, bz) = (v1 - v0).T, (v2 - v0).T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def triangle_areas(vertices: Points, faces: Faces) -> NDArray[np.float64]:
    """Return the area of every triangle [m^2], (m,) float64."""
    return 0.5 * np.linalg.norm(_crosses(vertices, faces).astype(np.float64), axis=1)


def triangle_rows(vertices: Points, faces: Faces) -> Words:
    """Return a row of `Triangle` per face, (m, 10) uint32; the front is on the winding's side."""
    v0, v1, v2 = (vertices[faces[:, i]] for i in range(3))
    side = np.ones((len(faces), 1), np.float32)
    return np.ascontiguousarray(np.hstack([v0, v1 - v0, v2 - v0, side])).view(np.uint32)


def row(shape: Shape) -> Words:
    """Return the words of a rectangle, sphere, disk or cylinder in `geometry`, placed.

    Of spheres, those of one around the origin with radius 1 before `to_world`.

    Raises SceneError for a singular transform, or one after which it is no such shape any more.
    """
    matrix = placement(shape)
    record = RECORDS[ONE_OF.get(shape.kind, shape.kind)]
    if isinstance(shape, shapes.Sphere):
        radius = _positive(shape.radius, "radius", shape)
        values = _sphere(shape, matrix, _three(shape.center, "center", shape), radius)
    elif isinstance(shape, shapes.Spheres):
        values = _sphere(shape, matrix, np.zeros(3), 1.0)
    elif isinstance(shape, shapes.Cylinder):
        values = _cylinder(shape, matrix)
    else:
        s, t, center = matrix[:3, 0], matrix[:3, 1], matrix[:3, 3]
        values = {"center": center, "s": s, "t": t, "n": facing(shape)}
    flat = np.concatenate([np.ravel(values[m.name]) for m in record.members])
    return flat.astype(np.float32).view(np.uint32)


def member(kind: str, name: str) -> int:
    """Return the place of a member in a kind's row, in words."""
    return next(m.word for m in RECORDS[kind].members if m.name == name)


def _side(shape: Shape) -> float:
    return -1.0 if shape.flip_normals else 1.0


def facing(shape: Shape) -> NDArray[np.float64]:
    """Return where the front of a rectangle or disk faces in the world, (3,) of unit length."""
    return _side(shape) * transforms.transform_normals(placement(shape), [0.0, 0.0, 1.0])


def _sphere(
    shape: Shape, matrix: NDArray[np.float64], center: NDArray[np.float64], radius: float
) -> dict[str, ArrayLike]:
    axes, scale = _even_axes(matrix[:3, :3], shape)
    return {
        "center": transforms.transform_points(matrix, center),
        "radius": radius * scale,
        "side": _side(shape),
        "x": axes[:, 0],
        "y": axes[:, 1],
        "z": axes[:, 2],
    }


def _cylinder(shape: shapes.Cylinder, matrix: NDArray[np.float64]) -> dict[str, ArrayLike]:
    radius = _positive(shape.radius, "radius", shape)
    p0, p1 = _three(shape.p0, "p0", shape), _three(shape.p1, "p1", shape)
    length = np.linalg.norm(p1 - p0)
    if not length > 0.0:
        raise SceneError("p0 and p1 coincide", where=where(shape))
    frame = np.column_stack([*across((p1 - p0) / length), p1 - p0])
    placed = matrix[:3, :3] @ frame
    stretch = np.linalg.norm(placed[:, 2]) / np.linalg.norm(placed[:, 0])
    axes, scale = _even_axes(placed / [1.0, 1.0, stretch], shape)
    return {
        "p0": transforms.transform_points(matrix, p0),
        "axis": placed[:, 2],
        "radius": radius * scale,
        "side": _side(shape),
        "x": axes[:, 0],
        "y": axes[:, 1],
    }


def across(n: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return two unit axes across a unit vector (Duff et al. 2017)."""
    sign = np.copysign(1.0, n[2])
    a = -1.0 / (sign + n[2])
    b = n[0] * n[1] * a
    s = np.array([1.0 + sign * n[0] ** 2 * a, sign * b, -sign * n[0]])
    return s, np.array([b, sign + n[1] ** 2 * a, -n[1]])


def _even_axes(linear: NDArray[np.float64], shape: Shape) -> tuple[NDArray[np.float64], float]:
    """The unit columns of a matrix that scales evenly, and its scale."""
    lengths = np.linalg.norm(linear, axis=0)
    axes = linear / lengths
    uneven = np.ptp(lengths) > UNEVEN * lengths.max()
    if uneven or np.abs(axes.T @ axes - np.eye(3)).max() > UNEVEN:
        raise SceneError(
            f"its transform stretches or shears it, and then it is no {shape.kind}; "
            "use a mesh for that",
            where=where(shape),
        )
    return axes, float(lengths[0])


def area(shape: Shape) -> float:
    """Return the area of a shape in world space [m^2]."""
    if shape.kind not in RECORDS:
        vertices, faces, _, _ = triangles(shape)
        return float(triangle_areas(vertices, faces).sum())
    row_ = _members(shape)
    if shape.kind == "sphere":
        return float(4.0 * np.pi * row_["radius"] ** 2)
    if shape.kind == "cylinder":
        return float(2.0 * np.pi * row_["radius"] * np.linalg.norm(row_["axis"]))
    parallelogram = float(np.linalg.norm(np.cross(row_["s"], row_["t"])))
    return (np.pi if shape.kind == "disk" else 4.0) * parallelogram


def bounds(shape: Shape) -> tuple[Points, Points]:
    """Return the corners (3,) float32 of a box around the shape [m]."""
    if shape.kind not in ANALYTIC:
        vertices = triangles(shape)[0]
        return vertices.min(axis=0), vertices.max(axis=0)
    row_ = _members(shape)
    if shape.kind == "sphere":
        ends, reach = row_["center"][None], np.full(3, row_["radius"])
    elif shape.kind == "disk":
        ends, reach = row_["center"][None], np.hypot(row_["s"], row_["t"])
    else:
        ends = np.stack([row_["p0"], row_["p0"] + row_["axis"]])
        reach = row_["radius"] * np.hypot(row_["x"], row_["y"])
    lo, hi = ends.min(axis=0) - reach, ends.max(axis=0) + reach
    pad = PADDING * max(np.ptp([lo, hi], axis=0).max(), np.abs([lo, hi]).max())
    return (lo - pad).astype(np.float32), (hi + pad).astype(np.float32)


def _members(shape: Shape) -> dict[str, NDArray[np.float64]]:
    """The members of a shape's row as float64."""
    record = RECORDS[shape.kind]
    values = row(shape).view(record.dtype)[0]
    return {m.name: np.asarray(values[m.name], np.float64) for m in record.members}


def local(shape: Shape) -> tuple[Points, Faces, Points | None, Points | None]:
    """Return vertices, faces, normals and uvs before the transform; raises as `triangles` does."""
    if isinstance(shape, shapes.Mesh):
        return _mesh(shape)
    if isinstance(shape, shapes.Curves):
        return tubes(shape, where(shape))
    if shape.kind == "rectangle":
        square = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
        halves = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
        return square, halves, None, (square[:, :2] + np.float32(1.0)) * np.float32(0.5)
    corners, faces, uvs = _cube()
    return corners.copy(), faces.copy(), None, uvs.copy()


@cache
def _cube() -> tuple[Points, Faces, Points]:
    """Vertices, faces and uvs of a cube from -1 to 1."""
    corners = [[{"+": 1, "-": -1}[c] for c in v] for side in _CUBE for v in side.split()]
    faces = 4 * np.arange(6)[:, None, None] + np.array(_CORNER_FACES)
    uvs = np.tile(np.array(_CORNER_UVS, np.float32), (6, 1))
    return np.array(corners, np.float32), faces.reshape(-1, 3).astype(np.uint32), uvs


def _mesh(shape: shapes.Mesh) -> tuple[Points, Faces, Points | None, Points | None]:
    if shape.vertices is None or shape.faces is None:
        raise SceneError("a mesh needs vertices and faces", where=where(shape))
    vertices = _array(shape, "vertices", 3)
    faces = np.asarray(on_host(shape.faces))
    if faces.size == 0 or len(vertices) == 0:
        raise SceneError("the mesh is empty: it has no triangle", where=where(shape))
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        found = f"{faces.shape} {faces.dtype}"
        raise SceneError(f"faces must be (m, 3) whole numbers, found {found}", where=where(shape))
    lowest, highest = int(faces.min()), int(faces.max())
    if lowest < 0 or highest >= len(vertices):
        wrong = lowest if lowest < 0 else highest
        raise SceneError(
            f"a face names vertex {wrong}, there are {len(vertices)}", where=where(shape)
        )
    normals = _normals(shape, vertices, faces)
    uvs = None if shape.uvs is None else _array(shape, "uvs", 2, len(vertices))
    return vertices, faces.astype(np.uint32, copy=False), normals, uvs


def _normals(shape: shapes.Mesh, vertices: Points, faces: NDArray[Any]) -> Points | None:
    """A mesh's normals as they were given, or the means of its triangles' by their areas."""
    if not smooth(shape):
        return None if shape.normals is None else _array(shape, "normals", 3, len(vertices))
    sums = np.zeros((len(vertices), 3))
    points = vertices.astype(np.float64)
    for first in range(0, len(faces), SUMMED):
        some = faces[first : first + SUMMED]
        crosses = _crosses(points, some)
        for axis in range(3):
            for corner in some.T:
                sums[:, axis] += np.bincount(corner, crosses[:, axis], len(vertices))
    lengths = np.linalg.norm(sums, axis=1, keepdims=True)
    return (sums / np.where(lengths > 0.0, lengths, 1.0)).astype(np.float32)


def points(shape: Shape) -> Points:
    """Return a mesh's vertices before the transform, (n, 3) float32.

    Raises SceneError for a wrong shape or values that are not finite.
    """
    return _array(shape, "vertices", 3)


def smooth(shape: Shape) -> bool:
    """Return whether a shape's normals follow from its triangles."""
    normals = getattr(shape, "normals", None)
    return isinstance(normals, str) and normals == shapes.SMOOTH


def _array(shape: Shape, name: str, columns: int, rows: int | None = None) -> Points:
    """A mesh's array as float32. Raises SceneError for a wrong shape or values not finite."""
    try:
        values = np.asarray(on_host(getattr(shape, name)), np.float32)
    except (TypeError, ValueError) as error:
        raise SceneError(f"{name} are not numbers: {error}", where=where(shape)) from error
    wanted = f"({'n' if rows is None else rows}, {columns})"
    if values.size == 0 and rows is None:
        raise SceneError(f"the mesh is empty: it has no {name}", where=where(shape))
    if values.ndim != 2 or values.shape[1] != columns or rows not in (None, len(values)):
        raise SceneError(f"{name} must be {wanted}, found {values.shape}", where=where(shape))
    wrong = ~np.isfinite(values).all(axis=1)
    if wrong.any():
        first = int(np.argmax(wrong))
        raise SceneError(
            f"{name}[{first}] is not finite: {values[first].tolist()}", where=where(shape)
        )
    return values


def placement(shape: Shape) -> NDArray[np.float64]:
    """Return a shape's transform. Raises SceneError if it is singular, or no affine 4x4 matrix."""
    try:
        matrix = np.asarray(on_host(shape.to_world), np.float64)
    except (TypeError, ValueError) as error:
        raise SceneError(f"to_world is not a matrix: {error}", where=where(shape)) from error
    if matrix.shape != (4, 4):
        raise SceneError(f"to_world must be (4, 4), found {matrix.shape}", where=where(shape))
    if transforms.is_singular(matrix):
        raise SceneError(
            "its transform is singular: it flattens space or is not finite", where=where(shape)
        )
    if not transforms.is_affine(matrix):
        raise SceneError("its transform is a projection, not affine", where=where(shape))
    return matrix


def _three(value: ArrayLike, name: str, shape: Shape) -> NDArray[np.float64]:
    values = np.asarray(value, np.float64)
    if values.shape != (3,) or not np.isfinite(values).all():
        message = f"{name} must be three finite numbers, found {value!r}"
        raise SceneError(message, where=where(shape))
    return values


def _positive(value: float, name: str, shape: Shape) -> float:
    if not (np.isfinite(value) and value > 0.0):
        raise SceneError(f"{name} must be above zero, found {value}", where=where(shape))
    return float(value)
