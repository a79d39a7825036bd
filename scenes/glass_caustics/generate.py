"""Turns a chess pawn and a ring on a lathe: pawn.ply and ring.ply.

    python scenes/glass_caustics/generate.py

A profile of (radius, height) goes through given points as a Catmull-Rom curve and round the axis y.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

Array = NDArray[np.float64]

# From the middle of the foot, up the outside to the top of the head.
PAWN = [
    (0.00, 0.000), (0.35, 0.000), (0.66, 0.003), (0.72, 0.040), (0.70, 0.16), (0.62, 0.24),
    (0.55, 0.29), (0.52, 0.35), (0.40, 0.45), (0.29, 0.62), (0.235, 0.85), (0.215, 1.05),
    (0.25, 1.12), (0.37, 1.165), (0.385, 1.20), (0.30, 1.235), (0.26, 1.29),
    *((0.42 * math.sin(t), 1.66 - 0.42 * math.cos(t)) for t in (0.85, 1.25, 1.65, 2.05, 2.45)),
    (0.12, 2.063), (0.00, 2.08),
]  # fmt: skip
RING = [
    (1.00, 0.00), (1.05, 0.02), (1.07, 0.10), (1.07, 0.34), (1.05, 0.42), (1.00, 0.44),
    (0.97, 0.42), (0.96, 0.34), (0.96, 0.10), (0.97, 0.02), (1.00, 0.00),
]  # fmt: skip


def curve(points: list[tuple[float, float]], steps: int, closed: bool) -> Array:
    """Points (n, 2) on a Catmull-Rom curve through `points`, `steps` from each to the next."""
    p = np.array(points)
    before, after = (p[-2], p[1]) if closed else (p[0] * [-1, 1], p[-1] * [-1, 1])
    p = np.vstack([before, p, after])
    t = np.linspace(0, 1, steps, endpoint=False)[:, None]
    a, b, c, d = (p[i : len(p) - 3 + i, None] for i in range(4))
    inner = 0.5 * (
        2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3
    )
    return np.vstack([inner.reshape(-1, 2), p[-2]])


def lathe(profile: Array, around: int) -> trimesh.Trimesh:
    """The surface that a profile (n, 2) sweeps around y, smooth; its right side is outside."""
    turn = np.linspace(0, 2 * np.pi, around + 1)
    radius, height = np.maximum(profile[:, 0], 0.0)[:, None], profile[:, 1][:, None]
    tangent = np.gradient(profile, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    out, up = tangent[:, 1][:, None], -tangent[:, 0][:, None]

    def swept(r: Array, y: Array) -> Array:
        points = np.broadcast_arrays(r * np.cos(turn), y, r * np.sin(turn))
        return np.stack(points, -1).reshape(-1, 3)

    index = np.arange(len(profile) * (around + 1)).reshape(len(profile), around + 1)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    points = swept(radius, height)
    corners = points[faces]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    return trimesh.Trimesh(points, faces[area > 1e-9], vertex_normals=swept(out, up), process=False)


def main() -> None:
    here = Path(__file__).parent
    for name, points, closed in (("pawn", PAWN, False), ("ring", RING, True)):
        mesh = lathe(curve(points, 3 if closed else 4, closed), 72)
        mesh.export(here / f"{name}.ply", vertex_normal=True)
        print(f"{name}.ply: {len(mesh.faces):,} triangles")


if __name__ == "__main__":
    main()
