"""Makes the head of scene.json: a distance field of a few round bodies, as a mesh.

    python scenes/portrait/generate.py

The surface is seen whole from a point within the head: a ray in each direction meets it once.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
import making  # noqa: E402

Array = NDArray[np.float64]
ROWS, COLUMNS = 150, 116  # of directions
MIDDLE = np.array([0.0, -0.01, 0.0])  # from where all is seen; metres, the face toward +z


def ball(p: Array, center: ArrayLike, radii: ArrayLike, tilt: float = 0.0) -> Array:
    """Return about the distance to an ellipsoid, turned about x by degrees."""
    q = p - np.asarray(center, float)
    c, s = np.cos(np.radians(tilt)), np.sin(np.radians(tilt))
    q = np.stack([q[..., 0], c * q[..., 1] + s * q[..., 2], c * q[..., 2] - s * q[..., 1]], axis=-1)
    r = np.asarray(radii, float)
    near, grade = np.linalg.norm(q / r, axis=-1), np.linalg.norm(q / r**2, axis=-1)
    return np.asarray(near * (near - 1.0) / np.maximum(grade, 1e-9))


def join(a: Array, b: Array, soft: float) -> Array:
    """Return the distance to two bodies that flow into each other within `soft` metres."""
    h = np.maximum(soft - np.abs(a - b), 0.0) / soft
    return np.asarray(np.minimum(a, b) - h * h * soft / 4.0)


def carve(a: Array, b: Array, soft: float) -> Array:
    """Return the distance to `a` without `b`."""
    return -join(-a, b, soft)


def head(p: Array) -> Array:
    """Return about the distance to the head at points (..., 3)."""
    p = np.concatenate([np.abs(p[..., :1]), p[..., 1:]], axis=-1)  # left as right
    d = ball(p, [0, 0.035, -0.02], [0.074, 0.088, 0.095])  # skull
    d = join(d, ball(p, [0, -0.03, 0.025], [0.058, 0.085, 0.062]), 0.03)  # face
    d = join(d, ball(p, [0, -0.095, 0.052], [0.024, 0.02, 0.022]), 0.03)  # chin
    d = join(d, ball(p, [0.04, -0.065, 0.015], [0.026, 0.04, 0.04]), 0.03)  # jaw
    d = join(d, ball(p, [0.038, -0.018, 0.056], [0.022, 0.018, 0.018]), 0.03)  # cheek
    d = join(d, ball(p, [0.022, 0.03, 0.071], [0.021, 0.006, 0.01]), 0.022)  # brow
    d = carve(d, ball(p, [0.031, 0.007, 0.094], [0.019, 0.013, 0.019]), 0.022)  # eye socket
    d = join(d, ball(p, [0.031, 0.006, 0.063], [0.0155, 0.0125, 0.0145]), 0.004)  # closed eye
    d = join(d, ball(p, [0.031, -0.0005, 0.0735], [0.0145, 0.0022, 0.0045]), 0.004)  # lashes
    d = join(d, ball(p, [0, -0.002, 0.082], [0.0085, 0.03, 0.013], 24), 0.016)  # nose
    d = join(d, ball(p, [0, -0.027, 0.098], [0.0105, 0.0095, 0.0115]), 0.012)
    d = join(d, ball(p, [0.0115, -0.031, 0.089], [0.0065, 0.0065, 0.0085]), 0.007)  # its wings
    d = carve(d, ball(p, [0.006, -0.039, 0.095], [0.0035, 0.004, 0.005]), 0.004)
    d = join(d, ball(p, [0, -0.055, 0.079], [0.028, 0.022, 0.009]), 0.018)  # around the mouth
    d = carve(d, ball(p, [0, -0.0445, 0.094], [0.0028, 0.008, 0.005]), 0.006)
    d = join(d, ball(p, [0.007, -0.0525, 0.0865], [0.016, 0.0042, 0.0062]), 0.004)  # lips
    d = join(d, ball(p, [0.0, -0.0625, 0.0855], [0.017, 0.0056, 0.0075]), 0.004)
    d = carve(d, ball(p, [0, -0.0575, 0.0955], [0.024, 0.0011, 0.0075]), 0.003)
    d = join(d, ball(p, [0.074, -0.002, -0.012], [0.01, 0.03, 0.017], -12), 0.014)  # ear
    d = carve(d, ball(p, [0.087, 0.003, -0.008], [0.006, 0.017, 0.008], -12), 0.008)
    return join(d, ball(p, [0, -0.16, -0.03], [0.05, 0.16, 0.052], -8), 0.05)  # neck


def mesh() -> trimesh.Trimesh:
    """Return the surface of the head, with the neck's end closed."""
    turn = np.linspace(0.0, 2 * np.pi, COLUMNS + 1)
    turn -= 0.72 * np.sin(turn)  # finer toward +z, where the face is
    tilt = np.linspace(0.0, np.pi, ROWS)
    way = np.stack(
        [np.sin(tilt)[:, None] * np.sin(turn), np.cos(tilt)[:, None] + 0 * turn,
         np.sin(tilt)[:, None] * np.cos(turn)], axis=-1
    )  # fmt: skip
    steps = np.linspace(0.02, 0.4, 400)
    inside = np.zeros(way.shape[:2])
    outside = np.full(way.shape[:2], steps[-1])
    for step in steps[::-1]:  # from afar: the outermost surface, of ears too
        found = (head(MIDDLE + step * way) < 0.0) & (inside == 0.0)
        inside[found], outside[found] = step, step + steps[1] - steps[0]
    for _ in range(30):
        middle = 0.5 * (inside + outside)
        within = head(MIDDLE + middle[..., None] * way) < 0.0
        inside, outside = np.where(within, middle, inside), np.where(within, outside, middle)
    points = MIDDLE + inside[..., None] * way
    shift = 2e-4 * np.eye(3)
    grade = np.stack([head(points + e) - head(points - e) for e in shift], axis=-1)
    return making.surface(points, grade / np.linalg.norm(grade, axis=-1, keepdims=True))


if __name__ == "__main__":
    mesh().export(HERE / "head.ply")
