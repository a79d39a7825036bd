"""Shapes of triangles: rectangles, cubes, meshes and tubes of curves in world space."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.arrays import Faces, Points, Words, on_host, single
from clpt.errors import SceneError
from clpt.files import budget
from clpt.geometry import distance_grids, refining
from clpt.geometry.shapes import ONE_OF, placement, where
from clpt.geometry.tubes import tubes
from clpt.scene import shapes, subdivision
from clpt.scene.motion import Deformation
from clpt.scene.params import fields_of
from clpt.scene.shapes import Mesh, Shape

SUMMED = 1 << 20  # triangles whose normals are summed at a time

FAR = 2.0**61  # from where on the product of two edges may be beyond float32
LEAST_CROSS = 2.0**-75  # squares up to this are zero in float32
PER_KEY = 32  # bytes of a vertex at each time: place, normal, uv
CHUNK = 1 << 16  # rows that are looked at at a time: what is made of them stays in the cache

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
    """A count of a shape's triangles that have no area."""

    where: str
    count: int
    of: int


def triangulate(
    shape: Shape, flat: list[Flat] | None = None
) -> tuple[Points, Faces, Points | None, Points | None]:
    """Return a rectangle, cube, mesh or tubes in world space: vertices, faces, normals and uvs.

    vertices (n, 3) float32 [m], faces (m, 3) uint32 counter-clockwise seen from the front, normals
    (n, 3) float32 or None, uvs (n, 2) float32 or None. Triangles without an area are left out, and
    counted in `flat`.

    Raises SceneError for a mesh that is empty, not finite or inconsistent, or a singular transform.
    """
    vertices, faces, normals, uvs = _in_world(shape)
    solid = _solid(vertices, faces)
    if not shape.flattens and not solid.all() and flat is not None:
        flat.append(Flat(where(shape), int(len(solid) - solid.sum()), len(solid)))
    faces = faces if solid.all() else faces[solid]
    return vertices, np.ascontiguousarray(faces), normals, uvs


def counted(shape: Shape) -> tuple[Points, Faces, Points | None, Points | None, tuple[Flat, ...]]:
    """Return what `triangulate` does, and whether it left some out."""
    flat: list[Flat] = []
    return *triangulate(shape, flat), tuple(flat)


def keyed(
    shape: Shape, times: Sequence[float]
) -> tuple[Points, Faces, Points | None, Points | None, tuple[Flat, ...]]:
    """Return what `counted` does at k times [s]: a row of each vertex for every time, together.

    vertices, normals (k n, 3), uvs (k n, 2) float32; faces (m, 3) uint32 name the first row of a
    vertex. Triangles are left out that have no area at any time. Raises as `triangulate` does.
    """
    count = len(times)
    if shape.deformation is None:
        at_all = [_in_world(shape)] * count
    else:
        alike = [shape.at_time(time) for time in times]
        at_all = [_in_world(surface, alike) for surface in alike]
    vertices, faces, _, uvs = at_all[0]
    budget.check(PER_KEY * count * len(vertices), f"{where(shape)} at {count:,} times")
    if any(not np.array_equal(surface[1], faces) for surface in at_all):
        raise SceneError("its triangles are others at other times", where=where(shape))
    solid = np.any([_solid(surface[0], faces) for surface in at_all], axis=0)
    flat = [] if solid.all() else [Flat(where(shape), int((~solid).sum()), len(solid))]
    normals: Points | None = None
    if at_all[0][2] is not None:
        normals = np.stack([np.asarray(surface[2]) for surface in at_all], axis=1).reshape(-1, 3)
    return (
        np.stack([surface[0] for surface in at_all], axis=1).reshape(-1, 3),
        np.ascontiguousarray(faces[solid] * np.uint32(count)),
        normals,
        None if uvs is None else np.repeat(uvs, count, axis=0),
        tuple(flat),
    )


def kept(shape: Shape, times: Sequence[float] = ()) -> NDArray[np.bool_]:
    """Return which of a shape's triangles `triangulate`, or at `times` [s] `keyed`, keeps, (m,)."""
    alike = [shape] if shape.deformation is None else [shape.at_time(time) for time in times]
    at_all = [_in_world(surface, alike if times else ()) for surface in alike]
    return np.asarray(np.any([_solid(surface[0], surface[1]) for surface in at_all], axis=0))


def check_deformation(shape: Shape) -> None:
    """Raise SceneError for a deformation that does not fit the shape's points."""
    deformation, place = shape.deformation, f"{where(shape)}.deformation"
    if not isinstance(deformation, Deformation):
        raise SceneError(f"must be a Deformation, not {deformation!r}", where=place)
    name = shape.deformed_field
    points = fields_of(shape)[name]
    if points is None:
        raise SceneError(f"a {shape.kind} that deforms needs {name} too", where=place)
    expected = np.shape(on_host(points))
    with_radii = shape.kind == "spheres" and deformation.points.shape[1:] == (*expected[:1], 4)
    if deformation.points.shape[1:] != expected and not with_radii:
        message = f"its keys have {deformation.points.shape[1:]} where {name} are {expected}"
        raise SceneError(message, where=place)
    if not isinstance(shape, Mesh):
        if deformation.normals is not None:
            raise SceneError(f"{shape.kind} take no normals", where=place)
        return
    if deformation.normals is None and shape.normals is not None and not smooth(shape):
        message = "needs normals at each time, as the mesh has some; or give it normals='smooth'"
        raise SceneError(message, where=place)
    if shape.displacement is not None:
        raise SceneError("a mesh with displacement cannot deform", where=place)


def warnings_of(flat: Sequence[Flat]) -> list[str]:
    """Return a single warning about all triangles that were left out, if there are any."""
    if not flat:
        return []
    head = flat[0]
    of = "all" if head.count == head.of else f"{head.count} of {head.of}"
    first = f"{head.where}: {of} triangles have no area, left out"
    if len(flat) == 1:
        return [first]
    total = sum(flat_triangles.count for flat_triangles in flat)
    return [f"{first}; with those of {len(flat) - 1} more shapes {total:,} in all"]


def tangents(shape: shapes.Mesh) -> Points:
    """Return a mesh's tangents in world space (n, 4) float32: unit vectors, and the side of v.

    The side is that of the shading normal x tangent. A tangent without length stays zero. Raises
    SceneError for a mesh without normals, and for an array of another shape or not finite.
    """
    if shape.normals is None:
        message = "tangents need normals: a frame has both; leave them out, or give normals"
        raise SceneError(message, where=where(shape))
    declared = _array(shape, "tangents", 4, len(_array(shape, "vertices", 3)))
    matrix = placement(shape)
    rotated = np.empty_like(declared)
    rotated[:, :3] = declared[:, :3] @ matrix[:3, :3].T
    rotated[:, :3] = transforms.unit_vectors(rotated[:, :3])
    turned = transforms.flips_handedness(matrix) != shape.flip_normals
    rotated[:, 3] = np.where(declared[:, 3] < 0.0, -1.0, 1.0) * (-1.0 if turned else 1.0)
    return rotated


def per_face(name: str) -> bool:
    """Return whether an attribute has a value for each face, by its name."""
    return name.startswith("face_")


def attribute(shape: Shape, name: str) -> Points:
    """Return an attribute of a mesh, (n, 1 or 3) float32 per vertex, or per face of `triangulate`.

    Raises SceneError for an array of another shape, or with values that are not finite.
    """
    by_face = per_face(name)
    if shape.kind in ONE_OF:
        count = len(shape.centers)  # type: ignore[attr-defined]
        if by_face:
            message = f"attribute {name!r}: spheres have no faces, its name must begin with vertex_"
            raise SceneError(message, where=where(shape))
    else:
        vertices, faces, _, _ = _in_world(shape)
        count = len(faces) if by_face else len(vertices)
    values = np.asarray(on_host(shape.attributes[name]), np.float32)
    values = values[:, None] if values.ndim == 1 else values
    if values.shape not in ((count, 1), (count, 3)):
        message = f"attribute {name!r} must be ({count}, 1 or 3), found {values.shape}"
        raise SceneError(message, where=where(shape))
    if not np.isfinite(values).all():
        raise SceneError(f"attribute {name!r} is not finite", where=where(shape))
    return values[_solid(vertices, faces)] if by_face else values


def _in_world(
    shape: Shape, alike: Sequence[Any] = ()
) -> tuple[Points, Faces, Points | None, Points | None]:
    """Vertices, faces, normals and uvs after the transform; alike: the shape at several times."""
    matrix = placement(shape)
    vertices, faces, normals, uvs = local(shape, alike)
    if not np.array_equal(matrix, transforms.IDENTITY):
        vertices = _moved(transforms.transform_points, matrix, vertices)
        if not np.isfinite(vertices).all():
            raise SceneError("its transform moves vertices out of float32", where=where(shape))
        if normals is not None:
            normals = _moved(transforms.transform_normals, matrix, normals)
    if normals is not None and shape.flip_normals:
        normals = -normals
    if transforms.flips_handedness(matrix) != shape.flip_normals:
        faces = faces[:, ::-1]
    return vertices, faces, normals, uvs


def _moved(
    move: Callable[[ArrayLike, ArrayLike], NDArray[Any]], matrix: NDArray[Any], rows: Points
) -> Points:
    """Return rows (n, 3) as a matrix moves them; a chunk at a time, whose memory is used again."""
    moved = np.empty(rows.shape, np.float32)
    for first in range(0, len(rows), CHUNK):
        moved[first : first + CHUNK] = single(move(matrix, rows[first : first + CHUNK]))
    return moved


def _solid(vertices: Points, faces: Faces) -> NDArray[np.bool_]:
    """Return which faces have a cross product whose square is not zero in float32."""
    has_area, columns = np.empty(len(faces), np.bool_), _columns(vertices)
    for first in range(0, len(faces), CHUNK):
        x, y, z = np.abs(_crosses(columns, faces[first : first + CHUNK])) > LEAST_CROSS
        has_area[first : first + CHUNK] = x | y | z
    return has_area


def _columns(vertices: NDArray[Any]) -> NDArray[Any]:
    """Return vertices as columns (3, n), since numpy is slow along short axes.

    Far away they are float64, so that their products do not overflow.
    """
    far = np.abs(vertices).max(initial=0.0) > FAR
    return np.array(vertices.T, np.float64 if far else vertices.dtype, order="C")


def _crosses(columns: NDArray[Any], faces: Faces) -> NDArray[Any]:
    """Cross products of the edges at each triangle's first vertex, (3, m) like the `_columns`."""
    first, second, third = (columns.take(faces[:, i], axis=1) for i in range(3))
    (ax, ay, az), (bx, by, bz) = second - first, third - first
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def triangle_areas(vertices: Points, faces: Faces) -> NDArray[np.float64]:
    """Return the area of every triangle [m^2], (m,) float64."""
    return 0.5 * np.linalg.norm(_crosses(_columns(vertices), faces).astype(np.float64), axis=0)


def triangle_rows(vertices: Points, faces: Faces) -> Words:
    """Return a row of `Triangle` per face, (m, 10) uint32; the front is on the winding's side."""
    v0, v1, v2 = (vertices[faces[:, i]] for i in range(3))
    side = np.ones((len(faces), 1), np.float32)
    return np.ascontiguousarray(np.hstack([v0, v1 - v0, v2 - v0, side])).view(np.uint32)


def local(
    shape: Shape, alike: Sequence[Any] = ()
) -> tuple[Points, Faces, Points | None, Points | None]:
    """Return vertices, faces, normals and uvs before the transform, as `triangulate` does.

    alike: the shape at several times; its faces are the same at all times.
    """
    if isinstance(shape, shapes.Mesh):
        return _mesh(shape)
    if isinstance(shape, shapes.Curves):
        return tubes(shape, where(shape), alike)
    if isinstance(shape, shapes.SdfGrid):
        return distance_grids.surface(shape, where(shape))
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
        form = f"{faces.shape} {faces.dtype}"
        raise SceneError(f"faces must be (m, 3) whole numbers, found {form}", where=where(shape))
    shapes.check_faces(faces, len(vertices), where(shape))
    normals = _normals(shape, vertices, faces)
    uvs = None if shape.uvs is None else _array(shape, "uvs", 2, len(vertices))
    parts = vertices, faces.astype(np.uint32, copy=False), normals, uvs
    return refining.refined(shape, parts, where(shape)) if refining.is_refined(shape) else parts


def sources(shape: shapes.Mesh, count: int) -> NDArray[np.int64]:
    """Return the row in a mesh's `faces` of each of its `count` triangles before any is left out.

    It differs from their own where a mesh is subdivided or displaced.
    """
    if not refining.is_refined(shape):
        return np.arange(count)
    parts = _array(shape, "vertices", 3), np.asarray(on_host(shape.faces)), None, None
    return refining.sources(shape, parts, count)


def _normals(shape: shapes.Mesh, vertices: Points, faces: NDArray[Any]) -> Points | None:
    """A mesh's normals as they were given, or the means of its triangles' by their areas."""
    if not smooth(shape):
        return None if shape.normals is None else _array(shape, "normals", 3, len(vertices))
    sums = np.zeros((len(vertices), 3))
    points = vertices.astype(np.float64)
    for first in range(0, len(faces), SUMMED):
        sums += subdivision.vertex_normals(points, faces[first : first + SUMMED])
    return transforms.unit_vectors(sums).astype(np.float32)


def points(shape: Shape) -> Points:
    """Return a mesh's vertices before the transform, (n, 3) float32.

    Raises SceneError for a wrong shape or values that are not finite.
    """
    return _array(shape, "vertices", 3)


def smooth(shape: Shape) -> bool:
    """Return whether a shape's normals follow from its triangles."""
    return isinstance(shape.normals, str) and shape.normals == shapes.SMOOTH


def _array(shape: Shape, name: str, columns: int, rows: int | None = None) -> Points:
    """A mesh's array as float32. Raises SceneError for a wrong shape or values not finite."""
    try:
        values = single(on_host(fields_of(shape)[name]))
    except (TypeError, ValueError) as error:
        raise SceneError(f"{name} are not numbers: {error}", where=where(shape)) from error
    wanted = f"({'n' if rows is None else rows}, {columns})"
    if values.size == 0 and rows is None:
        raise SceneError(f"the mesh is empty: it has no {name}", where=where(shape))
    if values.ndim != 2 or values.shape[1] != columns or rows not in (None, len(values)):
        raise SceneError(f"{name} must be {wanted}, found {values.shape}", where=where(shape))
    finite = np.isfinite(values)
    if not finite.all():
        first = int(np.argmin(finite.all(axis=1)))
        raise SceneError(
            f"{name}[{first}] is not finite: {values[first].tolist()}", where=where(shape)
        )
    return values
