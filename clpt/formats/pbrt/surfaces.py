"""Spheres, disks and tubes as pbrt cuts and parametrises them, as they are or as meshes.

u is the azimuth's share of phimax. v: from zmin to zmax on spheres (in the polar angle) and tubes
(in z), from the rim to the middle on disks.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.errors import SceneError
from clpt.formats.pbrt.params import Parameters
from clpt.scene import shapes

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
    corners = points.astype(np.float32).astype(np.float64)[faces]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
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
