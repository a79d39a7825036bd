"""Spheres and tubes as triangles, for transforms after which they are none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clpt.errors import SceneError
from clpt.files import budget
from clpt.geometry.analytic import across, row
from clpt.scene.shapes import Cylinder, Mesh, Shape, Sphere

AROUND, ALONG = 96, 48  # steps of the azimuth, and of a sphere's polar angle


@dataclass(frozen=True, kw_only=True, eq=False)
class Tessellated(Mesh):
    """A sphere or a tube as triangles, which layers still count as one primitive."""


def keeps_its_kind(shape: Shape) -> bool:
    """Whether rays can meet an analytic shape as it is; not where its transform stretches it."""
    try:
        row(shape)
    except SceneError:
        return False
    return True


def tessellate(shape: Sphere | Cylinder) -> Tessellated:
    """Return the shape as a mesh with normals and uvs, under the same transform."""
    along = ALONG if isinstance(shape, Sphere) else 1
    u, v = np.meshgrid(np.arange(AROUND + 1) / AROUND, np.arange(along + 1) / along)
    uvs = np.column_stack([u.ravel(), v.ravel()])
    circle = np.column_stack([np.cos(2.0 * np.pi * uvs[:, 0]), np.sin(2.0 * np.pi * uvs[:, 0])])
    if isinstance(shape, Sphere):
        polar = np.pi * uvs[:, 1:]
        normals = np.hstack([circle * np.sin(polar), np.cos(polar)])
        vertices = np.asarray(shape.center) + shape.radius * normals
    else:
        axis = np.subtract(shape.p1, shape.p0)
        normals = circle @ np.stack(across(axis / np.linalg.norm(axis)))
        vertices = np.asarray(shape.p0) + uvs[:, 1:] * axis + shape.radius * normals
    faces = _quads(along)
    budget.take_arrays((vertices, normals, uvs, faces), f"{shape.kind} {shape.name}, in triangles")
    budget.check_time()
    if isinstance(shape, Sphere):  # v runs down; at the poles a half of each quad has no area
        centre = faces[1:-1].reshape(-1, 3)
        faces = np.concatenate([faces[0, :, 1], centre, faces[-1, :, 0]])
        faces = faces[:, ::-1]
    return Tessellated(
        vertices=vertices.astype(np.float32),
        faces=faces.reshape(-1, 3).astype(np.uint32),
        normals=normals.astype(np.float32),
        uvs=uvs.astype(np.float32),
        material=shape.material,
        emission=shape.emission,
        interior=shape.interior,
        exterior=shape.exterior,
        priority=shape.priority,
        to_world=shape.to_world,
        flip_normals=shape.flip_normals,
        name=shape.name,
    )


def _quads(along: int) -> np.ndarray:
    """Two triangles a quad of the grid, (along, AROUND, 2, 3), counter-clockwise in u and v."""
    first = np.arange(along)[:, None] * (AROUND + 1) + np.arange(AROUND)
    halves = np.array([[0, 1, AROUND + 2], [0, AROUND + 2, AROUND + 1]])
    return first[..., None, None] + halves
