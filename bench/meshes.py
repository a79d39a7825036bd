"""Finer meshes, and mesh files written by numpy: trimesh takes minutes for large meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

CHUNK = 1 << 20  # triangles that are written at a time


def write_ply(path: Path, vertices: NDArray, faces: NDArray, uvs: NDArray | None = None) -> None:
    """Write vertices (n, 3), faces (m, 3) and perhaps uvs (n, 2) as a binary PLY file."""
    columns = ["x", "y", "z", *(() if uvs is None else ("u", "v"))]
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
        + "".join(f"property float {name}\n" for name in columns)
        + f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    points = vertices if uvs is None else np.hstack([vertices, uvs])
    with open(path, "wb") as file:
        file.write(header.encode())
        file.write(np.ascontiguousarray(points, "<f4").data)
        for first in range(0, len(faces), CHUNK):
            some = faces[first : first + CHUNK]
            rows = np.empty(len(some), [("n", "u1"), ("corners", "<i4", 3)])
            rows["n"], rows["corners"] = 3, some
            file.write(rows.data)


def ball(side: int, bumps: float = 0.1) -> tuple[NDArray, NDArray, NDArray]:
    """A bumpy ball of 2 side^2 triangles: vertices, faces, and uvs by angles."""
    u, v = np.meshgrid(np.linspace(0, 1, side + 1), np.linspace(0.01, 0.99, side + 1))
    around, down = 2 * np.pi * u, np.pi * v
    radius = 1 + bumps * np.sin(9 * around) * np.sin(7 * down)
    out = np.stack([np.sin(down) * np.cos(around), np.cos(down), np.sin(down) * np.sin(around)], -1)
    first = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).reshape(-1, 1)
    corners = first + np.array([0, 1, side + 2, 0, side + 2, side + 1])
    vertices = (radius[..., None] * out).reshape(-1, 3)
    return vertices.astype(np.float32), corners.reshape(-1, 3), np.stack([u, v], -1).reshape(-1, 2)


def finer(vertices: np.ndarray, faces: np.ndarray, times: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """The same surface of four times as many triangles, `times` times over."""
    corners = vertices[faces]
    for _ in range(times):
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        corners = np.concatenate([np.stack(part, 1) for part in parts])
    return corners.reshape(-1, 3), np.arange(3 * len(corners), dtype=np.uint32).reshape(-1, 3)
