"""Meshes that lowering makes finer: Loop subdivision, and displacement by an image.

Coincident vertices count as the same vertex, so that seams of texture coordinates do not tear.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Floats, Integers
from clpt.errors import SceneError
from clpt.files import budget
from clpt.geometry.shapes import where
from clpt.scene import subdivision
from clpt.scene.roles import REAL
from clpt.scene.shapes import Mesh
from clpt.scene.textures import Bitmap

Parts = tuple[Any, Any, Any, Any]
DEEPEST = 10
MOST_TRIANGLES = 1 << 25
PER_TRIANGLE = 350  # bytes of memory for each displaced triangle, while it is computed


def is_refined(mesh: Mesh) -> bool:
    """Return whether a mesh becomes finer than its arrays."""
    return mesh.subdivision > 0 or mesh.displacement is not None


def refined(mesh: Mesh, parts: Parts, name: str) -> Parts:
    """Return vertices, faces, normals and uvs of a finer mesh.

    name: for messages. `check` must accept the mesh. Raises SceneError for a surface that is not a
    manifold, and for a mesh that gets too large.
    """
    vertices, faces, normals, uvs = parts
    points, faces = vertices.astype(np.float64), faces.astype(np.int64)
    smooth = None if normals is None else normals.astype(np.float64)
    uvs = None if uvs is None else uvs.astype(np.float64)
    if mesh.subdivision:
        points, faces, smooth, uvs = _subdivided(points, faces, uvs, mesh.subdivision, name)
    if mesh.displacement is not None:
        points, faces, smooth, uvs = _displaced(mesh, (points, faces, smooth, uvs), name)
    singles = (
        None if values is None else values.astype(np.float32) for values in (points, smooth, uvs)
    )
    vertices, normals, uvs = singles
    return vertices, faces.astype(np.uint32), normals, uvs


def check(mesh: Mesh) -> None:
    """Raise SceneError for a mesh that cannot be subdivided or displaced."""
    if mesh.subdivision == 0 and mesh.displacement is None:
        return
    name = where(mesh)
    if not 0 <= mesh.subdivision <= DEEPEST:
        message = f"subdivision must be 0 to {DEEPEST}, not {mesh.subdivision}"
        raise SceneError(message, where=name)
    action = "subdivided" if mesh.displacement is None else "displaced"
    for present, array in (
        (mesh.attributes, "attributes"),
        (mesh.tangents is not None, "tangents"),
    ):
        if present:
            raise SceneError(f"a mesh that is {action} has no {array}", where=name)
    if mesh.displacement is None:
        return
    image = mesh.displacement
    if mesh.uvs is None or not isinstance(image, Bitmap) or image.mapping != "uv":
        message = "displacement needs uvs, and a bitmap that is laid out by them"
        raise SceneError(message, where=name)
    if not (math.isfinite(mesh.displacement_scale) and mesh.displacement_edge > 0.0):
        message = "displacement_scale must be finite, and displacement_edge above 0"
        raise SceneError(message, where=name)


def _welded(points: Floats, faces: Integers) -> tuple[Floats, Integers, Integers]:
    """The places (k, 3) of vertices, faces of these, and which place each vertex has."""
    places, inverse = np.unique(points, axis=0, return_inverse=True)
    inverse = inverse.reshape(-1)
    return places, inverse[faces], inverse


def sources(mesh: Mesh, parts: Parts, count: int) -> Integers:
    """Return the original face of each of the `count` faces of `refined`, (count,)."""
    vertices, faces = parts[0].astype(np.float64), parts[1].astype(np.int64)
    kept = np.arange(len(faces))
    if mesh.subdivision:
        kept = kept[_whole(_welded(vertices, faces)[1])]
    return np.repeat(kept, count // max(len(kept), 1))


def _whole(welded: Integers) -> NDArray[np.bool_]:
    """Which faces have three places."""
    return np.asarray((np.roll(welded, 1, axis=1) != welded).all(axis=1))


def _halved(faces: Integers, count: int) -> tuple[Integers, Integers]:
    """The edges (e, 2) of faces, and the four faces of each; a new vertex stands behind `count`."""
    halves = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    low, high = halves.min(axis=1), halves.max(axis=1)
    keys, inverse = np.unique(low * count + high, return_inverse=True)
    ab, bc, ca = inverse.reshape(3, -1) + count
    a, b, c = faces.T
    four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    finer = np.stack([np.stack(corners, axis=1) for corners in four], axis=1).reshape(-1, 3)
    return np.stack([keys // count, keys % count], axis=1), finer


def _grown(values: Floats, edges: Integers) -> Floats:
    return np.concatenate([values, values[edges].mean(axis=1)])


def _subdivided(
    points: Floats, faces: Integers, uvs: Floats | None, levels: int, name: str
) -> tuple[Floats, Integers, Floats, Floats | None]:
    """Points and normals of the limit surface; uvs are linear on each triangle."""
    places, welded, _ = _welded(points, faces)
    whole = _whole(welded)
    welded, faces = welded[whole], faces[whole]
    try:
        limit, finer, normals = subdivision.loop(places, welded, levels)
    except SceneError as error:
        raise SceneError(error.message, where=name) from None
    count = len(points)
    for _ in range(levels):
        edges, faces = _halved(faces, count)
        uvs = None if uvs is None else _grown(uvs, edges)
        count += len(edges)
    origin = np.zeros(count, np.int64)
    origin[faces.reshape(-1)] = finer.reshape(-1)
    return limit[origin], faces, normals[origin], uvs


def _displaced(mesh: Mesh, parts: Parts, name: str) -> Parts:
    """Edges no longer than `displacement_edge` in the world, moved along smooth normals."""
    points, faces, normals, uvs = parts
    linear = np.asarray(mesh.to_world, np.float64)[:3, :3]
    ends = points[faces] @ linear.T
    longest = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2).max(initial=0.0)
    levels = max(math.ceil(math.log2(max(longest, 1e-30) / mesh.displacement_edge)), 0)
    if len(faces) * 4.0**levels > MOST_TRIANGLES:
        message = f"edges of {mesh.displacement_edge:g} m make more than {MOST_TRIANGLES:,} "
        raise SceneError(message + "triangles; raise displacement_edge", where=name)
    budget.check(PER_TRIANGLE * len(faces) * 4**levels, f"{name}: its displacement")
    if normals is None:
        places, welded, numbers = _welded(points, faces)
        normals = _smooth(places, welded)[numbers]
    for _ in range(levels):
        budget.check_time()
        edges, faces = _halved(faces, len(points))
        points, normals, uvs = (_grown(values, edges) for values in (points, normals, uvs))
    normals = transforms.unit_vectors(normals)
    image = mesh.displacement
    assert image is not None
    moved = points + mesh.displacement_scale * heights(image, uvs)[:, None] * normals
    _, welded, numbers = _welded(points, faces)
    shares = np.bincount(numbers)
    mean = np.stack([np.bincount(numbers, moved[:, i]) / shares for i in range(3)], axis=1)
    return mean[numbers], faces, _smooth(mean, welded)[numbers], uvs


def _smooth(points: Floats, faces: Integers) -> Floats:
    """Unit normals of vertices: of the triangles around them, by their areas."""
    return transforms.unit_vectors(subdivision.vertex_normals(points, faces))


def heights(image: Bitmap, uvs: Floats) -> Floats:
    """Return what an image says at uvs (n, 2), as textures/kinds/bitmap.cl reads numbers: (n,)."""
    values = image.pixels(REAL)[..., 0].astype(np.float64)
    to_uv = np.asarray(image.to_uv, np.float64)
    x, y = ((np.c_[uvs, np.ones(len(uvs))] @ to_uv.T)[:, :2] * [1.0, -1.0] + [0.0, 1.0]).T
    x, y = x * values.shape[1], y * values.shape[0]
    if image.filter == "nearest":
        return _texel(image, values, np.floor(y), np.floor(x))
    x, y = x - 0.5, y - 0.5
    i, j = np.floor(x), np.floor(y)
    total = np.zeros(len(uvs))
    for dx in (0, 1):
        for dy in (0, 1):
            weight = np.abs(1 - dx - (x - i)) * np.abs(1 - dy - (y - j))
            total += weight * _texel(image, values, j + dy, i + dx)
    return total


def _texel(image: Bitmap, values: Floats, row: Floats, column: Floats) -> Floats:
    """Return values of texels; texels beyond the image follow its wrap modes."""
    height, width = values.shape
    y, down = _wrapped(row, height, image.wrap_v or image.wrap)
    x, along = _wrapped(column, width, image.wrap)
    return np.where(down & along, values[y, x], 0.0)


def _wrapped(index: Floats, size: int, wrap: str) -> tuple[Integers, NDArray[np.bool_]]:
    """Columns or rows within an image, and whether there is something."""
    whole = index.astype(np.int64)
    there = (whole >= 0) & (whole < size) if wrap == "zero" else np.ones(len(whole), bool)
    if wrap == "repeat":
        return whole % size, there
    if wrap == "mirror":
        turn = whole % (2 * size)
        return np.where(turn < size, turn, 2 * size - 1 - turn), there
    return np.clip(whole, 0, size - 1), there
