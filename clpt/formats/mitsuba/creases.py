"""Mitsuba 0.6's `maxSmoothAngle`: normals of a mesh that stays sharp at its creases."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.scene.shapes import Mesh

MOST_TURNS = 64  # groups of triangles around a vertex; what is left after them stays together


def creased(mesh: Mesh, angle: float) -> Mesh:
    """Return a mesh without normals whose triangles share a vertex where they lie within an angle.

    angle: of the triangles' normals [degrees]. As src/librender/trimesh.cpp (rebuildTopology):
    around each place the first triangle without a group begins one, which takes all triangles
    within the angle to it.
    """
    faces = np.asarray(mesh.faces, np.int64)
    corners = faces.reshape(-1)
    places = _places(mesh)[corners]
    points = np.asarray(mesh.vertices, np.float64)[faces]
    normals = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.repeat(normals / np.where(lengths > 0.0, lengths, 1.0), 3, axis=0)
    group = np.full(len(corners), -1)
    least = np.cos(np.radians(min(angle, 180.0)))
    for turn in range(MOST_TURNS):
        waiting = np.flatnonzero(group < 0)
        if not len(waiting):
            break
        kept, first = np.unique(places[waiting], return_index=True)
        seeds = waiting[first][np.searchsorted(kept, places[waiting])]
        near = np.einsum("ij,ij->i", normals[waiting], normals[seeds]) >= least
        group[waiting[near | (waiting == seeds)]] = turn
    keys = np.stack([places, group], axis=1)
    _, first, joined = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    kept = corners[first]
    return replace(
        mesh,
        vertices=mesh.vertices[kept],
        faces=joined.reshape(-1, 3).astype(np.uint32),
        normals=None,
        uvs=None if mesh.uvs is None else mesh.uvs[kept],
        attributes={
            name: values[kept] if name.startswith("vertex_") else values
            for name, values in mesh.attributes.items()
        },
    )


def _places(mesh: Mesh) -> NDArray[Any]:
    """Return for each vertex the number of its place: its position, and uv if it has any."""
    parts = [np.asarray(mesh.vertices, np.float32)]
    if mesh.uvs is not None:
        parts.append(np.asarray(mesh.uvs, np.float32))
    return np.unique(np.concatenate(parts, axis=1), axis=0, return_inverse=True)[1].reshape(-1)
