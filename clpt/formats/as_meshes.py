"""Shapes as triangles, for files of other programs that lack clpt's kinds."""

from __future__ import annotations

import math

import numpy as np

from clpt.arrays import Faces, Points
from clpt.geometry import analytic, triangles
from clpt.scene.shapes import Cylinder, Disk, Shape, Sphere

CORNERS = 256  # of a disk


def local(shape: Shape) -> tuple[Points, Faces, Points | None, Points | None]:
    """Return vertices (n, 3), faces (m, 3), normals (n, 3) and uvs (n, 2) before `to_world`."""
    if isinstance(shape, Disk):
        return _disk()
    if isinstance(shape, (Sphere, Cylinder)):
        shape = analytic.tessellate(shape)
    return triangles.local(shape)


def _disk() -> tuple[Points, Faces, Points | None, Points | None]:
    """Return the unit disk as triangles, whose area is that of the disk."""
    angle = 2.0 * np.pi * np.arange(CORNERS) / CORNERS
    radius = math.sqrt(np.pi / (0.5 * CORNERS * math.sin(2.0 * np.pi / CORNERS)))
    rim = radius * np.stack([np.cos(angle), np.sin(angle), np.zeros(CORNERS)], axis=1)
    vertices = np.vstack([rim, np.repeat([[0.0, 0.0, 0.0]], CORNERS, axis=0)])
    i = np.arange(CORNERS)
    faces = np.stack([CORNERS + i, i, (i + 1) % CORNERS], axis=1)
    uvs = np.vstack(
        [
            np.stack([np.ones(CORNERS), i / CORNERS], 1),
            np.stack([np.zeros(CORNERS), (i + 0.5) / CORNERS], 1),
        ]
    )
    return vertices.astype(np.float32), faces.astype(np.uint32), None, uvs.astype(np.float32)
