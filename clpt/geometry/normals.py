"""Normals of triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

SUMMED = 1 << 20  # triangles whose normals are summed at a time


def smooth_normals(vertices: NDArray[Any], faces: NDArray[Any]) -> NDArray[np.float32]:
    """Return vertex normals (n, 3): of the faces, weighted by angle (Thuermer, Wuethrich 1998)."""
    total = np.zeros((len(vertices), 3))
    for first in range(0, len(faces), SUMMED):
        _add_normals(total, vertices, faces[first : first + SUMMED])
    return _unit(total).astype(np.float32)


def _add_normals(total: NDArray[Any], vertices: NDArray[Any], faces: NDArray[Any]) -> None:
    corners = vertices[faces].astype(np.float64)
    normals = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    for i in range(3):
        a = _unit(corners[:, (i + 1) % 3] - corners[:, i])
        b = _unit(corners[:, (i + 2) % 3] - corners[:, i])
        angles = np.arccos(np.clip((a * b).sum(axis=1), -1.0, 1.0))
        for axis in range(3):
            weights = angles * normals[:, axis]
            total[:, axis] += np.bincount(faces[:, i], weights, len(vertices))


def _unit(vectors: NDArray[Any]) -> NDArray[Any]:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)
