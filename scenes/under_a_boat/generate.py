"""Makes the sand of the sea's floor, ripples over dunes, and a boat's hull: sand.ply, hull.ply.

python scenes/under_a_boat/generate.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh

sys.path.append(str(Path(__file__).parents[1]))
from making import surface

HERE = Path(__file__).parent
ACROSS = np.linspace(-14.0, 14.0, 57)
ALONG = np.linspace(-18.0, 8.0, 61)


def height(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Height of the sand [m]."""
    dunes = 0.5 * np.sin(0.31 * x + 0.4) * np.cos(0.27 * z) + 0.3 * np.sin(0.6 * z + 0.35 * x)
    return dunes + 0.05 * np.sin(2.6 * z + 1.4 * np.sin(0.7 * x))


def hull() -> trimesh.Trimesh:
    """A hull 7 m long, pointed at its bow, +z, and with a keel."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    x, y, z = ball.vertices.T
    narrow = np.sqrt(np.clip(1.0 - 0.75 * np.maximum(z, 0.0), 0.0, 1.0))
    keel = np.where(y < 0.0, 1.0 - 0.35 * np.abs(x), 0.3)
    points = np.stack([1.15 * x * narrow, 0.95 * y * keel, 3.5 * z], axis=1)
    return trimesh.Trimesh(points, ball.faces, process=False)


def main() -> None:
    x, z = np.meshgrid(ACROSS, ALONG)
    y, step = height(x, z), 1e-4
    slopes = [(height(x + step, z) - y) / step, (height(x, z + step) - y) / step]
    normals = np.stack([-slopes[0], np.ones_like(y), -slopes[1]], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    sand = surface(np.stack([x, y, z], axis=-1), normals)
    sand.export(HERE / "sand.ply", vertex_normal=True)
    boat = hull()
    boat.export(HERE / "hull.ply", vertex_normal=True)
    print(len(sand.faces) + len(boat.faces), "triangles")


if __name__ == "__main__":
    main()
