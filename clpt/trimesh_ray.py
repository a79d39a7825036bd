"""Ray queries for trimesh: what its own `mesh.ray` answers, with the same names and results.

>>> mesh.ray = clpt.trimesh_ray.RayMeshIntersector(mesh)
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from trimesh.caching import Cache, cache_decorator
from trimesh.ray.ray_util import contains_points
from trimesh.util import unitize

from clpt import device
from clpt.rays import Accel

SAME = 1e-6  # of the mesh's scale: hits that are nearer to each other are of one surface

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class RayMeshIntersector:
    """Answers ray queries of a `trimesh.Trimesh`; it may stand in its attribute `ray`.

    queue: a `pyopencl.CommandQueue` to run on; by default that of the first device that works. The
    tree is built on first use, and again after the mesh has changed. Rays may begin anywhere; the
    mesh is moved to the origin in float64 first, so that its own coordinates may be large.
    """

    def __init__(self, geometry: Any, queue: Any = None):
        self.mesh = geometry
        self.queue = queue
        self._cache = Cache(id_function=geometry.__hash__)

    def intersects_location(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True
    ) -> tuple[Floats, Integers, Integers]:
        """Where rays meet the surface: locations (k, 3), index_ray (k,), index_tri (k,).

        The other parameters are those of `intersects_id`.
        """
        index_tri, index_ray, locations = self.intersects_id(
            ray_origins, ray_directions, multiple_hits, return_locations=True
        )
        return locations, index_ray, index_tri

    def intersects_id(
        self,
        ray_origins: ArrayLike,
        ray_directions: ArrayLike,
        multiple_hits: bool = True,
        max_hits: int = 100,
        return_locations: bool = False,
    ) -> tuple[NDArray[Any], ...]:
        """Which triangles rays meet: index_tri (k,), index_ray (k,), and locations (k, 3) if asked.

        ray_origins, ray_directions: (n, 3); directions of any length. multiple_hits: all hits of a
        ray, up to max_hits, in the order of their distance, ray by ray; else the first. Where a
        ray goes through an edge between triangles, that is one hit.

        Raises SceneError for arrays of other shapes.
        """
        origins, directions = np.asarray(ray_origins, np.float64), unitize(ray_directions)
        scaled = self._scaled(origins, directions)
        if multiple_hits:
            hits = self._accel.intersect_all(*scaled)
            triangles, rays = hits.primitive.astype(np.int64), hits.ray
        else:
            first = self._accel.intersect(*scaled).primitive
            rays = np.flatnonzero(first >= 0)
            triangles = first[rays].astype(np.int64)
        if not multiple_hits and not return_locations:
            return triangles, rays
        facing, distances = self._distances(triangles, origins[rays], directions[rays])
        if multiple_hits:
            kept = _first_of_each(rays, facing, distances, SAME * self.mesh.scale, max_hits)
            triangles, rays, distances = triangles[kept], rays[kept], distances[kept]
        if not return_locations:
            return triangles, rays
        return triangles, rays, origins[rays] + distances[:, None] * directions[rays]
