"""Ray queries for trimesh: the methods of `mesh.ray`, with the same results.

>>> mesh.ray = clpt.rays.trimesh_ray.RayMeshIntersector(mesh)
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
from clpt.arrays import Floats, Integers
from clpt.errors import SceneError
from clpt.rays import Accel

ROUNDING = 1e-6  # of the reach: the largest distance of a ray to an edge that it hits
SAME = 1e-10  # of the reach: the largest distance of equal points on edges
CHUNK = 1 << 17  # hits compared at a time: they take 1 kB each
GRAZING = 1e-9  # cosine below which the plane of a triangle does not locate a hit


@dataclass(frozen=True)
class _DeviceMesh:
    """A mesh on the device: translated by -centre, then scaled."""

    accel: Accel
    centre: Floats
    scale: float


class RayMeshIntersector:
    """Answers ray queries about a `trimesh.Trimesh`, also as its attribute `ray`.

    queue: a `pyopencl.CommandQueue`; by default of the first working device. The tree is built on
    first use, and again after changes of the mesh. The mesh is first translated to the origin in
    float64, so that its coordinates may be large; hits are located in float64.
    scale_to_box: a parameter of trimesh's intersector, without effect.

    Raises SceneError for an object that is not a Trimesh. A copy of the mesh has trimesh's
    intersector.
    """

    def __init__(self, geometry: Any, queue: object = None, *, scale_to_box: bool = True):
        if not (hasattr(geometry, "faces") and hasattr(geometry, "vertices")):
            message = f"must be a trimesh.Trimesh, not {type(geometry).__name__}; "
            raise SceneError(message + "a trimesh.Scene gives one by its to_mesh()", where="mesh")
        self.mesh = geometry
        self.queue = queue
        self._cache = Cache(id_function=geometry.__hash__)

    def intersects_location(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike, multiple_hits: bool = True
    ) -> tuple[Floats, Integers, Integers]:
        """Return intersections: locations (k, 3), index_ray (k,), index_tri (k,).

        Parameters: see `intersects_id`.
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
        """Return hits: index_tri (k,), index_ray (k,), and locations (k, 3) if requested.

        ray_origins, ray_directions: (n, 3), directions of any length. multiple_hits: all hits of a
        ray, up to max_hits, ray by ray in the order of distance; else the first. At an edge or a
        corner only one of the triangles that face the ray alike counts.

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
            order = np.lexsort((distances, rays))
            duplicate = self._duplicates(rays, triangles, cosines < 0, order, origins, directions)
            order = order[~duplicate]
            rays, triangles, distances = rays[order], triangles[order], distances[order]
            few = np.arange(len(rays)) - np.searchsorted(rays, rays) < max_hits
            rays, triangles, distances = rays[few], triangles[few], distances[few]
        if not return_locations:
            return triangles, rays
        return triangles, rays, origins[rays] + distances[:, None] * directions[rays]

    def intersects_first(self, ray_origins: ArrayLike, ray_directions: ArrayLike) -> Integers:
        """Return the first triangle of each ray: (n,), -1 without a hit."""
        scaled = self._scaled(*_rays(ray_origins, ray_directions))
        return self._on_device.accel.intersect(*scaled).primitive.astype(np.int64)

    def intersects_any(
        self, ray_origins: ArrayLike, ray_directions: ArrayLike
    ) -> NDArray[np.bool_]:
        """Return whether each ray hits anything: (n,)."""
        scaled = self._scaled(*_rays(ray_origins, ray_directions))
        return np.asarray(self._on_device.accel.occluded(*scaled), np.bool_)

    def contains_points(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return whether points (n, 3) are inside a closed mesh, by rays from the points."""
        points = _floats(points, "points")
        if points.ndim != 2 or points.shape[1] != 3:
            raise SceneError(f"(n, 3) is wanted, not {points.shape}", where="points")
        if not len(self.mesh.faces):
            return np.zeros(len(points), np.bool_)
        return np.asarray(contains_points(self, points), np.bool_)

    @cache_decorator  # type: ignore[untyped-decorator]
    def _on_device(self) -> _DeviceMesh:
        """The mesh on the device, scaled by a power of two, which does not round."""
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
        """Return n . d, and the distance to the triangle's plane; t for parallel rays."""
        normals = self.mesh.face_normals[triangles]
        corners = self.mesh.vertices[self.mesh.faces[triangles, 0]]
        cosines = (normals * directions).sum(axis=1)
        crosses = np.abs(cosines) > GRAZING
        heights = ((corners - origins) * normals).sum(axis=1)
        distances = np.where(
            crosses, heights / np.where(crosses, cosines, 1.0), t / self._on_device.scale
        )
        return cosines, distances

    def _duplicates(
        self,
        rays: Integers,
        triangles: Integers,
        facing: NDArray[np.bool_],
        order: Integers,
        origins: Floats,
        directions: Floats,
    ) -> NDArray[np.bool_]:
        """Return for each hit in `order` whether an earlier hit is at the same edge or corner.

        The device finds all triangles around an edge or a corner on the ray. Among triangles that
        face the ray alike the first counts. Distances are not compared, since other surfaces may
        be as near.
        """
        duplicate = np.zeros(len(order), np.bool_)
        key = 2 * rays[order] + facing[order]
        places = np.flatnonzero(_shared(key))
        chunks = []
        for some in np.split(places, range(CHUNK, len(places), CHUNK)):
            hits = order[some]
            o, d = origins[rays[hits]], directions[rays[hits]]
            reach = self.mesh.scale + np.linalg.norm(o - self._on_device.centre, axis=1)
            corners = np.asarray(self.mesh.vertices)[np.asarray(self.mesh.faces)[triangles[hits]]]
            at, near = _borders(corners - o[:, None], d, ROUNDING * reach)
            there = near.any(axis=1)
            chunks.append((some[there], at[there], near[there], reach[there]))
        places, at, near, reach = (np.concatenate(part) for part in zip(*chunks, strict=True))
        together = np.argsort(key[places], kind="stable")
        places, at, near, reach = places[together], at[together], near[together], reach[together]
        for step in range(1, len(places)):
            first = np.flatnonzero(key[places[step:]] == key[places[:-step]])
            if not len(first):
                break
            second = first + step
            apart = np.linalg.norm(at[first, :, None] - at[second, None], axis=3)
            both = near[first, :, None] & near[second, None]
            same = (both & (apart < SAME * reach[first, None, None])).any(axis=(1, 2))
            duplicate[places[second[same]]] = True
        return duplicate

    def __getstate__(self) -> dict[str, Any]:
        """Return the mesh only: an unpickled intersector has the default queue."""
        return {"mesh": self.mesh}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["mesh"])  # type: ignore[misc]

    def __deepcopy__(self, memo: object) -> RayMeshIntersector:
        return RayMeshIntersector(self.mesh, self.queue)


def _rays(origins: ArrayLike, directions: ArrayLike) -> tuple[Floats, Floats]:
    """Return rays (n, 3) in float64, with unit or zero directions. Raises SceneError."""
    o, d = _floats(origins, "rays"), _floats(directions, "rays")
    if not o.size and not d.size:
        return np.zeros((0, 3)), np.zeros((0, 3))
    if o.shape != d.shape or o.ndim != 2 or o.shape[1] != 3:
        raise SceneError(f"(n, 3) both are wanted, not {o.shape} and {d.shape}", where="rays")
    return o, unitize(d)


def _floats(values: ArrayLike, where: str) -> Floats:
    try:
        return np.asarray(values, np.float64)
    except (TypeError, ValueError):
        raise SceneError("are not numbers, (n, 3) of them", where=where) from None


def _borders(
    corners: Floats, directions: Floats, rounding: Floats
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return rays' nearest points on triangles' edges (n, 3, 3), and whether within rounding.

    corners: (n, 3, 3) relative to the rays' origins; directions: (n, 3) unit; rounding: (n,). A
    point within rounding of a corner becomes the corner.
    """
    edges = np.roll(corners, -1, axis=1) - corners
    d = directions[:, None]
    across = corners - (corners * d).sum(axis=2, keepdims=True) * d
    along = edges - (edges * d).sum(axis=2, keepdims=True) * d
    square = (along**2).sum(axis=2)
    share = -(across * along).sum(axis=2) / np.where(square > 0.0, square, 1.0)
    snap = rounding[:, None] / np.sqrt(np.where(square > 0.0, square, 1.0))
    share = np.where(share < snap, 0.0, np.where(share > 1.0 - snap, 1.0, share))[..., None]
    missed = np.linalg.norm(across + share * along, axis=2)
    points = np.where(share == 1.0, np.roll(corners, -1, axis=1), corners + share * edges)
    return points, missed <= rounding[:, None]


def _shared(keys: Integers) -> NDArray[np.bool_]:
    """Return whether a key occurs more than once (n,)."""
    _, inverse, counts = np.unique(keys, return_inverse=True, return_counts=True)
    return np.asarray(counts[inverse] > 1)
