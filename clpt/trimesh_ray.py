"""Ray queries for trimesh: the methods of its own `mesh.ray`, with the same results.

>>> mesh.ray = clpt.trimesh_ray.RayMeshIntersector(mesh)
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from trimesh.caching import Cache, cache_decorator
from trimesh.ray.ray_util import contains_points
from trimesh.util import unitize

from clpt import device
from clpt.errors import SceneError
from clpt.rays import Accel

SAME = 1e-6  # of the mesh's scale: hits nearer to each other, of one facing, are one surface
GRAZING = 1e-9  # cosine below which the plane of a triangle does not locate a hit

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True)
class _DeviceMesh:
    """A mesh on the device: translated by -centre, then scaled."""

    accel: Accel
    centre: Floats
    scale: float


class RayMeshIntersector:
    """Answers ray queries about a `trimesh.Trimesh`, also as its attribute `ray`.

    queue: a `pyopencl.CommandQueue` to run on; by default that of the first device that works. The
    tree is built on first use, and again when the mesh has changed. The mesh is translated to the
    origin in float64 first, so that its coordinates may be large; hits are located in float64.
    """

    def __init__(self, geometry: Any, queue: Any = None):
        self.mesh = geometry
        self.queue = queue
        self._cache = Cache(id_function=geometry.__hash__)

    def intersects_location(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True
    ) -> tuple[Floats, Integers, Integers]:
        """Where rays meet the surface: locations (k, 3), index_ray (k,), index_tri (k,).

        The parameters are those of `intersects_id`.
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

        ray_origins, ray_directions: (n, 3), directions of any length. multiple_hits: all hits of a
        ray, up to max_hits, ray by ray in the order of their distance; else the first. A ray
        through an edge between two triangles that face it alike meets one of them.

        Raises SceneError for arrays of other shapes.
        """
        origins, directions = _rays(ray_origins, ray_directions)
        scaled = self._scaled(origins, directions)
        if multiple_hits:
            hits = self._on_device.accel.intersect_all(*scaled)
            rays, triangles, t = hits.ray, hits.primitive.astype(np.int64), hits.t
        else:
            first = self._on_device.accel.intersect(*scaled)
            rays = np.flatnonzero(first.primitive >= 0)
            triangles, t = first.primitive[rays].astype(np.int64), first.t[rays]
        if multiple_hits or return_locations:
            cosines, distances = self._planes(triangles, origins[rays], directions[rays], t)
        if multiple_hits:
            distinct = _distinct(rays, cosines < 0, distances, SAME * self.mesh.scale, max_hits)
            rays, triangles, distances = rays[distinct], triangles[distinct], distances[distinct]
        if not return_locations:
            return triangles, rays
        return triangles, rays, origins[rays] + distances[:, None] * directions[rays]

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> Integers:
        """Return the triangle that each ray meets first: (n,), -1 for none."""
        scaled = self._scaled(*_rays(ray_origins, ray_directions))
        return self._on_device.accel.intersect(*scaled).primitive.astype(np.int64)

    def intersects_any(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike
    ) -> NDArray[np.bool_]:
        """Return whether each ray meets anything: (n,)."""
        scaled = self._scaled(*_rays(ray_origins, ray_directions))
        return np.asarray(self._on_device.accel.occluded(*scaled), np.bool_)

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return whether points (n, 3) are inside of a closed mesh, by rays from them."""
        return np.asarray(contains_points(self, points), np.bool_)

    @cache_decorator  # type: ignore[untyped-decorator]
    def _on_device(self) -> _DeviceMesh:
        """The mesh on the device; a power of two scales without rounding."""
        empty = not len(self.mesh.faces)
        size = 1.0 if empty else float(self.mesh.scale)
        scale = 2.0 ** -round(math.log2(size)) if 0 < size < math.inf else 1.0
        centre = np.zeros(3) if empty else np.mean(self.mesh.bounds, axis=0)
        vertices = (np.asarray(self.mesh.vertices, np.float64) - centre) * scale
        queue = device.choose().queue if self.queue is None else self.queue
        return _DeviceMesh(Accel(queue, vertices, np.asarray(self.mesh.faces)), centre, scale)

    def _scaled(self, origins: Floats, directions: Floats) -> tuple[Floats, Floats]:
        return (origins - self._on_device.centre) * self._on_device.scale, directions

    def _planes(
        self, triangles: Integers, origins: Floats, directions: Floats, t: NDArray[np.float32]
    ) -> tuple[Floats, Floats]:
        """n . d, and the distance to the triangle's plane; t where the ray is parallel to it."""
        normals = self.mesh.face_normals[triangles]
        corners = self.mesh.vertices[self.mesh.faces[triangles, 0]]
        cosines = (normals * directions).sum(axis=1)
        crosses = np.abs(cosines) > GRAZING
        heights = ((corners - origins) * normals).sum(axis=1)
        distances = np.where(
            crosses, heights / np.where(crosses, cosines, 1.0), t / self._on_device.scale
        )
        return cosines, distances

    def __getstate__(self) -> dict[str, Any]:
        """Only the mesh: an unpickled intersector has the default queue."""
        return {"mesh": self.mesh}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["mesh"])  # type: ignore[misc]

    def __deepcopy__(self, memo: Any) -> RayMeshIntersector:
        return RayMeshIntersector(self.mesh, self.queue)


def _rays(origins: ArrayLike, directions: ArrayLike) -> tuple[Floats, Floats]:
    """Rays (n, 3) in float64, directions of unit length or zero. Raises SceneError."""
    o, d = (np.asarray(part, np.float64) for part in (origins, directions))
    if not o.size and not d.size:
        return np.zeros((0, 3)), np.zeros((0, 3))
    if o.shape != d.shape or o.ndim != 2 or o.shape[1] != 3:
        raise SceneError(f"(n, 3) both are wanted, not {o.shape} and {d.shape}", where="rays")
    return o, unitize(d)


def _distinct(
    rays: Integers, facing: NDArray[np.bool_], distances: Floats, same: float, most: int
) -> Integers:
    """Indices of distinct hits by ray and distance: of equal ones that face alike the first.

    rays: sorted; same: distance below which hits are equal; most: of each ray.
    """
    order = np.lexsort((distances, rays))
    ray, face, distance = rays[order], facing[order], distances[order]
    new = np.ones(len(ray), np.bool_)
    new[1:] = (np.diff(ray) > 0) | (np.diff(distance) > same) | (face[1:] != face[:-1])
    order, ray = order[new], ray[new]
    rank = np.arange(len(ray)) - np.searchsorted(ray, ray)
    return order[rank < most]
