"""Affine and projective transforms: 4x4 float64 matrices that act on column vectors.

`a @ b` applies `b` first. Points carry w = 1 and are divided by the resulting w, vectors carry
w = 0, normals go through the inverse transpose.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Matrix as Matrix
from clpt.errors import SceneError

IDENTITY: Matrix = np.eye(4)
IDENTITY.setflags(write=False)

# Relative to the product of the columns' lengths, so that tiny but regular scales pass.
LARGE = 1e150  # from where on squares are beyond float64
SINGULAR_BELOW = 1e-12


def translate(*offset: ArrayLike) -> Matrix:
    """Move by three numbers, or by an `offset` (3,)."""
    matrix = np.eye(4)
    matrix[:3, 3] = _triple(_single(offset), "translate")
    return matrix


def scale(*factors: ArrayLike) -> Matrix:
    """Scale by a factor, or by three factors along the axes: numbers, or an array (3,)."""
    values = np.asarray(_single(factors), np.float64)
    if values.ndim == 0:
        values = np.full(3, values)
    return np.diag([*_triple(values, "scale"), 1.0])


def rotate(axis: ArrayLike, degrees: float) -> Matrix:
    """Rotate by `degrees` about `axis` (3,), counter-clockwise seen from its tip (Rodrigues).

    Raises SceneError for an axis of no length.
    """
    x, y, z = _unit(_triple(axis, "rotate"), "rotate: the axis has no length")
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = np.radians(float(degrees))
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
    return matrix


def look_at(origin: ArrayLike, target: ArrayLike, up: ArrayLike) -> Matrix:
    """Camera-to-world matrix of a camera at `origin` that looks at `target` along its +z axis.

    Mitsuba's convention: x = up cross z points to the viewer's left, y upwards, so the frame is
    right-handed while an image's columns run against x.

    Raises SceneError when origin and target coincide or `up` is parallel to the view.
    """
    origin = _triple(origin, "look_at")
    z = _unit(_triple(target, "look_at") - origin, "look_at: origin and target coincide")
    x = np.cross(_unit(_triple(up, "look_at"), "look_at: up has no length"), z)
    x = _unit(x, "look_at: up is parallel to the viewing direction; choose another up")
    matrix = np.eye(4)
    matrix[:3, :] = np.column_stack([x, np.cross(z, x), z, origin])
    return matrix


def perspective(fov_degrees: float, near: float, far: float) -> Matrix:
    """Camera space to clip space: [-1, 1]^2 spans `fov_degrees`, z goes from 0 at near to 1 at far.

    Raises SceneError for a field of view outside (0, 180) or clipping planes out of order.
    """
    if not 0.0 < fov_degrees < 180.0:
        raise SceneError(f"perspective: the field of view {fov_degrees} is not between 0 and 180")
    _check_planes(near, far, "perspective", lowest=0.0)
    cot = 1.0 / np.tan(np.radians(fov_degrees) / 2.0)
    depth = far / (far - near)
    return np.array(
        [[cot, 0, 0, 0], [0, cot, 0, 0], [0, 0, depth, -near * depth], [0, 0, 1, 0]], np.float64
    )


def orthographic(near: float, far: float) -> Matrix:
    """Camera space to clip space without foreshortening: x, y stay, z goes from 0 to 1.

    Raises SceneError for clipping planes out of order.
    """
    _check_planes(near, far, "orthographic", lowest=-np.inf)
    return scale([1.0, 1.0, 1.0 / (far - near)]) @ translate([0.0, 0.0, -near])


def transform_points(matrix: ArrayLike, points: ArrayLike) -> Matrix:
    """Apply to points (..., 3), dividing by w where the matrix is projective."""
    matrix, points = np.asarray(matrix, np.float64), np.asarray(points, np.float64)
    moved = points @ matrix[:3, :3].T + matrix[:3, 3]
    if is_affine(matrix):
        return moved
    return moved / (points @ matrix[3, :3] + matrix[3, 3])[..., None]


def transform_vectors(matrix: ArrayLike, vectors: ArrayLike) -> Matrix:
    """Apply to directions (..., 3): no translation, lengths are not kept."""
    return np.asarray(vectors, np.float64) @ np.asarray(matrix, np.float64)[:3, :3].T


def transform_normals(matrix: ArrayLike, normals: ArrayLike) -> Matrix:
    """Apply the inverse transpose to normals (..., 3) and renormalise; zero normals stay zero.

    Raises SceneError for a singular matrix.
    """
    turned = np.asarray(normals, np.float64) @ inverse(matrix)[:3, :3]
    x, y, z = np.moveaxis(turned, -1, 0)
    length = np.sqrt(x * x + y * y + z * z)[..., None]
    return turned / np.where(length > 0.0, length, 1.0)


def unit_vectors(vectors: NDArray[Any]) -> NDArray[Any]:
    """Return vectors (..., n) of length 1; those of length 0 stay."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(lengths > 0.0, lengths, 1.0))


def crosses(first: NDArray[Any], second: NDArray[Any]) -> NDArray[Any]:
    """Return cross products (n, 3) of vectors (n, 3), bit by bit those of numpy.cross.

    Of a few vectors numpy takes ten times as long.
    """
    a, b = first.T, second.T
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]], axis=1
    )


def edge_crosses(vertices: ArrayLike, faces: ArrayLike) -> Matrix:
    """Return cross products (m, 3) of triangles' edges: normals whose lengths are twice the areas.

    vertices: (n, 3); faces: (m, 3) whole numbers.
    """
    a, b, c = np.asarray(vertices, np.float64)[np.asarray(faces)].swapaxes(0, 1)
    return crosses(b - a, c - a)


def inverse(matrix: ArrayLike) -> Matrix:
    """Inverse of a transform. Raises SceneError for a singular or non-finite matrix."""
    if is_singular(matrix):
        raise SceneError("the transform cannot be inverted: it flattens space or is not finite")
    return np.linalg.inv(np.asarray(matrix, np.float64))


def length(vector: ArrayLike) -> float:
    """Return the length of a finite vector (n,), also where its square is beyond float64."""
    vector = np.asarray(vector, np.float64)
    size = float(np.abs(vector).max())
    return (
        float(np.linalg.norm(vector / size)) * size
        if size > LARGE
        else float(np.linalg.norm(vector))
    )


def is_affine(matrix: Matrix) -> bool:
    """Whether the last row of a 4x4 matrix is 0 0 0 1."""
    return bool(matrix[3].tolist() == [0.0, 0.0, 0.0, 1.0])


def is_singular(matrix: ArrayLike) -> bool:
    """Whether a 4x4 matrix flattens space (or holds inf or nan), whatever its overall scale."""
    matrix = np.asarray(matrix, np.float64)
    if matrix.tobytes() == IDENTITY.tobytes():  # of most files of meshes
        return False
    if not np.isfinite(matrix).all():
        return True
    if is_affine(matrix) and np.abs(matrix).max() <= LARGE:
        columns = matrix[:3, :3].T.tolist()
        sides = [math.sqrt(sum(x * x for x in column)) for column in columns]
        if 0.0 in sides:
            return True
        units = [[x / side for x in column] for column, side in zip(columns, sides, strict=True)]
        return abs(_determinant(units)) < SINGULAR_BELOW
    linear = matrix if matrix[3, :3].any() else matrix[:3, :3]
    size = np.abs(linear).max()
    linear = linear / size if size > LARGE else linear
    lengths = np.linalg.norm(linear, axis=0)
    if not lengths.all() or not (matrix[3].any()):
        return True
    return bool(abs(np.linalg.det(linear / lengths)) < SINGULAR_BELOW)


def are_singular(matrices: ArrayLike) -> NDArray[np.bool_]:
    """Return which affine matrices (n, 4, 4) flatten space, (n,), as `is_singular` says."""
    linear = np.asarray(matrices, np.float64)[:, :3, :3]
    columns = unit_vectors(linear.swapaxes(1, 2))
    return np.abs(np.linalg.det(columns)) < SINGULAR_BELOW


def rigid(matrix: ArrayLike) -> Matrix:
    """Return a transform without its scale: the nearest rotation, and the translation, (4, 4)."""
    affine = np.asarray(matrix, np.float64)
    u, _, v = np.linalg.svd(affine[:3, :3])
    nearest = np.eye(4)
    nearest[:3, :3] = u @ np.diag([1.0, 1.0, np.linalg.det(u @ v)]) @ v
    nearest[:3, 3] = affine[:3, 3]
    return nearest


def flips_handedness(matrix: ArrayLike) -> bool:
    """Whether the transform mirrors space, so that the winding of triangles is reversed."""
    return _determinant(np.asarray(matrix, np.float64)[:3, :3].tolist()) < 0.0


def _determinant(rows: list[list[float]]) -> float:
    """Return the determinant of a matrix (3, 3); numpy takes ten times as long."""
    (a, b, c), (d, e, f), (g, h, i) = rows
    return a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)


def unmirrored(matrix: ArrayLike) -> Matrix:
    """Return a transform without its scale, (4, 4); along x it is turned back if it mirrors."""
    turned = np.diag([-1.0, 1.0, 1.0, 1.0]) if flips_handedness(matrix) else np.eye(4)
    return rigid(np.asarray(matrix, np.float64) @ turned)


def _single(arguments: tuple[ArrayLike, ...]) -> Any:
    """Return the only argument, or all arguments."""
    return arguments[0] if len(arguments) == 1 else arguments


def _triple(values: ArrayLike, name: str) -> Matrix:
    values = np.asarray(values, np.float64)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise SceneError(f"{name}: expected three finite numbers, found {values.tolist()}")
    return values


def _unit(vector: Matrix, complaint: str) -> Matrix:
    distance = length(vector)
    if distance < 1e-12:
        raise SceneError(complaint)
    return vector / distance


def _check_planes(near: float, far: float, name: str, lowest: float) -> None:
    if not lowest < near < far:
        raise SceneError(f"{name}: the clipping planes {near} and {far} are out of order")
