"""Spheres, disks, tubes and curves as pbrt cuts and parametrises them.

Spheres, disks and tubes stay as they are or become meshes. u is the azimuth's share of phimax. v:
from zmin to zmax on spheres (in the polar angle) and tubes (in z), from the rim to the middle on
disks. Round curves are joined as `Curves`, ribbons become strips of a mesh.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import groupby, pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.errors import SceneError
from clpt.formats.pbrt.params import Parameters
from clpt.scene import shapes
from clpt.scene.shapes import Curves, Shape
from clpt.transforms import unit_vectors

Parts = dict[str, Any]
AROUND, ALONG = 256, 128  # pieces of a mesh around a whole turn, and from pole to pole
UNEVEN = 1e-5  # relative difference of a matrix's axes that deforms a sphere or a tube
UPWARD = transforms.scale([1.0, 1.0, -1.0])  # ours counts a sphere's v from above


def phi_max(params: Parameters) -> float:
    """Take the part of a turn [degrees] that there is."""
    values = float(params.one("phimax", "float", 360.0))
    if not 0.0 < values <= 360.0:
        raise SceneError(f"'phimax' must lie between 0 and 360, not {values:g}")
    return values


def is_even(matrix: transforms.Matrix, axes: int) -> bool:
    """Return whether the axes stay orthogonal, and the first `axes` of equal length."""
    turned = matrix[:3, :3]
    squares = turned.T @ turned
    scale = squares[0, 0]
    wanted = np.diag([*([scale] * axes), *np.diag(squares)[axes:]])
    lengths = np.sqrt(np.outer(np.diag(squares), np.diag(squares)))
    return bool((np.abs(squares - wanted) <= UNEVEN * lengths).all())


def sphere_mesh(radius: float, low: float, high: float, turn: float) -> Parts:
    """A sphere between two polar angles, from below [radians], over `turn` [degrees]."""
    u, v, faces = _grid(turn, ALONG)
    phi, theta = np.radians(turn) * u, low + (high - low) * v
    normals = np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1
    )
    return _parts(radius * normals, faces, normals, u, v)


def disk_mesh(radius: float, inner: float, height: float, turn: float) -> Parts:
    """A ring, or a disk, facing +z."""
    u, v, faces = _grid(turn, 1)
    phi, r = np.radians(turn) * u, radius + (inner - radius) * v
    points = np.stack([r * np.cos(phi), r * np.sin(phi), np.full_like(u, height)], axis=1)
    return _parts(points, faces, None, u, v)


def cylinder_mesh(radius: float, low: float, high: float, turn: float) -> Parts:
    """A tube around the z axis."""
    u, v, faces = _grid(turn, 1)
    phi = np.radians(turn) * u
    normals = np.stack([np.cos(phi), np.sin(phi), np.zeros_like(u)], axis=1)
    points = radius * normals
    points[:, 2] = low + (high - low) * v
    return _parts(points, faces, normals, u, v)


def revolved_mesh(profile: NDArray[np.float64], turn: float) -> Parts:
    """The surface that a line of points (n, 3) sweeps over `turn` [degrees] around the z axis.

    v runs along the line. The front is where u cross v points, as pbrt's quadrics have it.
    """
    u, v, faces = _grid(turn, len(profile) - 1)
    row = np.round(v * (len(profile) - 1)).astype(np.intp)
    phi = np.radians(turn) * u
    steps = np.gradient(profile, axis=0)
    middles = profile + np.where(np.hypot(*profile.T[:2]) > 0.0, 0.0, 0.5)[:, None] * _inward(steps)
    points, along = _turned(profile[row], phi), _turned(steps[row], phi)
    around = np.cross([0.0, 0.0, 1.0], _turned(middles[row], phi))
    normals = np.cross(around, along)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return _parts(points, faces, normals, u, v)


def _inward(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return steps of a line away from its first end, toward it at its last."""
    signs = np.ones(len(steps))
    signs[len(steps) // 2 :] = -1.0
    return signs[:, None] * steps


def _turned(points: NDArray[np.float64], phi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Turn points (n, 3) around the z axis by angles (n,) [radians]."""
    cos, sin = np.cos(phi), np.sin(phi)
    x, y, z = points.T
    return np.stack([x * cos - y * sin, x * sin + y * cos, z], axis=1)


def _grid(turn: float, rows: int) -> tuple[Any, Any, NDArray[np.uint32]]:
    """u and v of a grid's vertices, and its triangles, counter-clockwise where u cross v is up."""
    columns = max(3, math.ceil(AROUND * turn / 360.0))
    return grid(columns, rows)


def grid(columns: int, rows: int) -> tuple[Any, Any, NDArray[np.uint32]]:
    """u and v (n,) of a grid's vertices, and its triangles (m, 3), from u toward v."""
    v, u = np.meshgrid(
        np.linspace(0.0, 1.0, rows + 1), np.linspace(0.0, 1.0, columns + 1), indexing="ij"
    )
    index = np.arange(u.size, dtype=np.uint32).reshape(u.shape)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.stack([np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)], axis=2)
    return u.reshape(-1), v.reshape(-1), faces.reshape(-1, 3)


def _parts(points: Any, faces: Any, normals: Any, u: Any, v: Any) -> Parts:
    """A mesh's arrays, without the triangles that have no area at poles and centres."""
    sides = transforms.edge_crosses(points.astype(np.float32), faces)
    size = np.abs(points).max() ** 2
    return {
        "vertices": points.astype(np.float32),
        "faces": np.ascontiguousarray(faces[np.linalg.norm(sides, axis=1) > 1e-9 * size]),
        "normals": None if normals is None else normals.astype(np.float32),
        "uvs": np.stack([u, v], axis=1).astype(np.float32),
    }


def area(kind: type[shapes.Shape], parts: Parts) -> float:
    """The area of a sphere, disk or tube [m^2], in the world."""
    to_world = parts["to_world"]
    size = float(np.linalg.norm(to_world[:3, 0]))
    if kind is shapes.Disk:
        return float(np.pi * np.linalg.norm(np.cross(to_world[:3, 0], to_world[:3, 1])))
    radius = parts["radius"] * size
    if kind is shapes.Sphere:
        return float(4.0 * np.pi * radius**2)
    axis = to_world[:3, :3] @ (np.asarray(parts["p1"]) - np.asarray(parts["p0"]))
    return float(2.0 * np.pi * radius * np.linalg.norm(axis))


TYPES = ("flat", "ribbon", "cylinder")
PIECES = 16  # of a ribbon, for each cubic


def curve(params: Parameters) -> tuple[type[Shape] | None, Parts]:
    """Read a curve: the kind that it becomes, None for a ribbon's mesh, and its parts.

    Raises SceneError.
    """
    kind = params.choice("type", "flat", TYPES)
    bezier = _bezier(params)
    both = params.one("width", "float", 1.0)
    ends = [params.one(name, "float", both) for name in ("width0", "width1")]
    if min(ends) < 0.0 or max(ends) <= 0.0:
        raise SceneError("the widths must be positive")
    normals = params.several("N", "normal")
    share = np.linspace(0.0, 1.0, len(bezier))[:, None]
    widths = ends[0] + (ends[1] - ends[0]) * share
    if kind == "ribbon":
        return None, _ribbon(bezier, widths, normals)
    points = np.hstack([bezier, 0.5 * widths]).astype(np.float32)
    return Curves, {"points": points, "lengths": (len(points),), "basis": "bezier"}


def _bezier(params: Parameters) -> NDArray[np.float64]:
    """The points (3 n + 1, 3) of the curve's cubics in Bezier form."""
    points, degree = params.several("P", "point3"), params.one("degree", "integer", 3)
    basis = params.choice("basis", "bezier", ("bezier", "bspline"))
    if degree not in (2, 3):
        raise SceneError(f"'degree' must be 2 or 3, not {degree}")
    if points is None:
        raise SceneError("needs the parameter 'point3 P'")
    step = degree if basis == "bezier" else 1
    if len(points) <= degree or (len(points) - degree - 1) % step:
        more = f" and {step} for each piece more" if step > 1 else " or more"
        raise SceneError(f"'P' needs {degree + 1} points{more}, not {len(points)}")
    at = np.arange(0, len(points) - degree, step)
    spans = np.asarray(points, np.float64)[at[:, None] + np.arange(degree + 1)]
    if degree == 2:
        a, b, c = (spans[:, i] for i in range(3))
        if basis == "bspline":
            a, c = 0.5 * (a + b), 0.5 * (b + c)
        spans = np.stack([a, (a + 2.0 * b) / 3.0, (2.0 * b + c) / 3.0, c], axis=1)
    elif basis == "bspline":
        a, b, c, d = (spans[:, i] for i in range(4))
        ends = [(a + 4.0 * b + c) / 6.0, (b + 4.0 * c + d) / 6.0]
        spans = np.stack([ends[0], (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, ends[1]], axis=1)
    return np.concatenate([spans[:, :3].reshape(-1, 3), spans[-1:, 3]])


def _ribbon(bezier: NDArray[Any], widths: NDArray[Any], normals: Any) -> Parts:
    """A strip across whose middle the curve runs, turned as the normals at the ends of pieces."""
    count = len(bezier) // 3
    if normals is None or len(normals) != count + 1:
        matches = 0 if normals is None else len(normals)
        raise SceneError(f"a ribbon of {count} pieces needs {count + 1} normals 'N', not {matches}")
    u = np.linspace(0.0, count, PIECES * count + 1)
    piece = np.minimum(u.astype(np.int64), count - 1)
    t = (u - piece)[:, None]
    points = [bezier[3 * piece + i] for i in range(4)]
    while len(points) > 2:
        points = [a + (b - a) * t for a, b in pairwise(points)]
    center, along = (
        points[0] + (points[1] - points[0]) * t,
        unit_vectors(points[1] - points[0]),
    )
    ends = unit_vectors(np.asarray(normals, np.float64))
    first, second = ends[piece], ends[piece + 1]
    angle = np.arccos(np.clip(np.einsum("ij,ij->i", first, second), -1.0, 1.0))[:, None]
    flat = np.sin(angle) < 1e-6
    sine = np.where(flat, 1.0, np.sin(angle))
    low = np.where(flat, 1.0 - t, np.sin((1.0 - t) * angle) / sine)
    high = np.where(flat, t, np.sin(t * angle) / sine)
    across = unit_vectors(np.cross(low * first + high * second, along))
    width = np.interp(u, np.linspace(0.0, count, len(widths)), widths[:, 0])[:, None]
    sides = np.stack([center - 0.5 * width * across, center + 0.5 * width * across], axis=1)
    a = 2 * np.arange(len(u) - 1)[:, None]
    uvs = np.stack(np.broadcast_arrays((u / count)[:, None], [0.0, 1.0]), axis=-1)
    return {
        "points": sides.reshape(-1, 3),
        "faces": (a[:, :, None] + [[0, 2, 3], [0, 3, 1]]).reshape(-1, 3),
        "normals": np.repeat(np.cross(along, across), 2, axis=0),
        "uvs": uvs.reshape(-1, 2),
    }


def areas(parts: Parts) -> NDArray[np.float64]:
    """Return the area of each cubic of a curve, seen flat: length times mean width [m^2]."""
    points, cubics = parts["points"].astype(np.float64), len(parts["points"]) // 3
    matrix = np.asarray(parts["to_world"])[:3, :3]
    t = np.linspace(0.0, 1.0, PIECES + 1)[:, None]
    matches = []
    for i in range(cubics):
        span = [points[3 * i + k, :3] @ matrix.T for k in range(4)]
        while len(span) > 1:
            span = [a + (b - a) * t for a, b in pairwise(span)]
        length = np.linalg.norm(np.diff(span[0], axis=0), axis=1).sum()
        scale = abs(np.linalg.det(matrix)) ** (1.0 / 3.0)
        width = scale * (points[3 * i, 3] + points[3 * i + 3, 3])
        matches.append(length * width)
    return np.array(matches)


def joined(items: Iterable[Shape]) -> Iterator[Shape]:
    """Return the shapes; neighbouring curves that differ only in their points are joined."""
    for key, run in groupby(items, _shared):
        several = list(run)
        if key is None or len(several) == 1:
            yield from several
        else:
            curves = [item for item in several if isinstance(item, Curves)]
            points = np.concatenate([item.points for item in curves])
            yield replace(
                curves[0], points=points, lengths=tuple(n for item in curves for n in item.lengths)
            )


def _shared(shape: Shape) -> tuple[Any, ...] | None:
    """Return the values that are equal in all curves that may be joined; None for other shapes."""
    if not isinstance(shape, Curves) or shape.motion is not None:
        return None
    placed = np.asarray(shape.to_world).tobytes()
    return id(shape.material), id(shape.emission), shape.flip_normals, placed
