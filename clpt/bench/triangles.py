"""A scene's triangles as a single mesh, including placed instances."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from clpt.render.flow.scene_to_tables import Lowered

MOST = 1 << 22  # triangles; further instances are left out


def world(lowered: Lowered) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return vertices (n, 3) and faces (m, 3), without analytic shapes."""
    instances = lowered.instances
    world_count = len(lowered.faces) - sum(instances.triangles)
    ends = world_count + np.cumsum([0, *instances.triangles])
    vertices, faces = [lowered.vertices], [lowered.faces[:world_count]]
    count, total = len(lowered.vertices), world_count
    groups = []
    for begin, end in pairwise(ends.tolist()):
        used, inside = np.unique(lowered.faces[begin:end], return_inverse=True)
        groups.append((lowered.vertices[used].astype(np.float64), inside.reshape(-1, 3)))
    for row, prototype in zip(instances.rows, instances.prototypes, strict=True):
        points, inside = groups[prototype]
        total += len(inside)
        if total > MOST:
            break
        inverse = np.linalg.inv(np.stack([row["x"], row["y"], row["z"]]).astype(np.float64))
        vertices.append((points @ inverse.T + row["origin"]).astype(np.float32))
        faces.append((inside + count).astype(np.uint32))
        count += len(points)
    return np.concatenate(vertices), np.concatenate(faces)
