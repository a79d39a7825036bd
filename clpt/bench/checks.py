"""Checks of hits: each for consistency, some against all triangles, layouts with each other."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.render.flow.scene_to_tables import Lowered

LEAST = 0.9999  # share of rays that must agree
PAIRS = 1 << 24  # pairs of ray and triangle that are tested by brute force
AGREE = 2e-4  # largest relative difference of distances
EDGE = 1e-4  # barycentric distance to an edge below which a hit may be missed
MISS = -1
MOST = 1 << 22  # triangles; further instances are left out


class Truth:
    """Expected hits of a set of rays, to check a tree's hits.

    vertices: (n, 3) float32; faces: (m, 3) uint32; rays: a clpt.bench.rays.Rays.
    """

    def __init__(self, vertices: NDArray, faces: NDArray, rays: Any):
        self.corners = vertices[faces.astype(np.int64)].astype(np.float64)
        self.rays = rays
        self.scale = float(np.abs(vertices).max())
        v0 = self.corners[:, 0]
        self._e1, self._e2 = self.corners[:, 1] - v0, self.corners[:, 2] - v0
        self._n = np.cross(self._e1, self._e2)
        self._height = (self._n * v0).sum(1)
        self._e1_v0, self._e2_v0 = np.cross(self._e1, v0), np.cross(self._e2, v0)
        some = max(8, min(len(rays), PAIRS // len(faces)))
        self.sample = np.unique(np.linspace(0, len(rays) - 1, some).astype(int))
        self._nearest: list[tuple[float, float]] = [self._brute(i) for i in self.sample]

    def closest(self, hits: Mapping[str, NDArray]) -> str:
        """Check hits, with the names of clpt.rays.Hits; return a complaint, or ""."""
        prim, t = hits["primitive"], hits["t"]
        unknown = (prim < MISS) | (prim >= len(self.corners))
        if unknown.any():
            return f"{unknown.sum():,} of {len(prim):,} rays were not traced"
        met = prim >= 0
        if not np.isinf(t[~met]).all() or not np.isfinite(t[met]).all():
            return "distances do not fit what was met"
        off = ~self._on_triangles(hits, met)
        if off.mean() > 1.0 - LEAST:
            return f"{off.sum():,} of {len(off):,} hits are not on the triangles that they name"
        return self._against_all(prim, t)

    def _on_triangles(self, hits: Mapping[str, NDArray], met: NDArray) -> NDArray:
        """Return whether hits lie on their triangles."""
        v0, v1, v2 = self.corners[hits["primitive"][met]].transpose(1, 0, 2)
        u, v = hits["barycentrics"][met].astype(np.float64).T
        t = hits["t"][met].astype(np.float64)
        o, d = (a[met].astype(np.float64) for a in (self.rays.origins, self.rays.directions))
        point = v0 + u[:, None] * (v1 - v0) + v[:, None] * (v2 - v0)
        error = np.linalg.norm(o + t[:, None] * d - point, axis=1)
        inside = (u > -1e-3) & (v > -1e-3) & (u + v < 1 + 1e-3)
        return inside & (error <= 1e-4 * t + 1e-5 * self.scale) & (t <= self.rays.t_max[met])

    def _against_all(self, prim: NDArray, t: NDArray) -> str:
        """Compare the sample with brute force over all triangles, in float64."""
        wrong = 0
        for i, (nearest, sure) in zip(self.sample, self._nearest, strict=True):
            near = t[i] if prim[i] >= 0 else np.inf
            margin = AGREE * (nearest if np.isfinite(nearest) else 1.0) + 1e-5 * self.scale
            # not nearer than the nearest hit, nor farther than the nearest hit inside of an edge
            wrong += not (near >= nearest - margin and (near == sure or near <= sure + margin))
        if wrong:
            return f"{wrong} of {len(self.sample)} rays tried with every triangle met another one"
        return ""

    def _brute(self, i: int) -> tuple[float, float]:
        """Return a ray's nearest hit, and its nearest hit off edges [distance]; inf: none."""
        o, d = self.rays.origins[i].astype(np.float64), self.rays.directions[i].astype(np.float64)
        turned = np.cross(o, d)
        with np.errstate(all="ignore"):
            det = self._n @ d
            t = (self._height - self._n @ o) / det
            u = (self._e2_v0 @ d - self._e2 @ turned) / det
            v = (self._e1 @ turned - self._e1_v0 @ d) / det
            inner = np.minimum(np.minimum(u, v), 1.0 - u - v)
            far = float(self.rays.t_max[i])
            about = (inner > -EDGE) & (t > -1e-6 * self.scale) & (t < far * (1 + 1e-6))
            sure = (inner > EDGE) & (t > 1e-6 * self.scale) & (t < far * (1 - 1e-6))
        return (
            float(t[about].min(initial=np.inf)),
            float(t[sure].min(initial=np.inf)),
        )


def differ(hits: Mapping[str, NDArray], others: Mapping[str, NDArray]) -> str:
    """Compare the hits of the same rays in two layouts; return a complaint, or ""."""
    met, theirs = hits["primitive"] >= 0, others["primitive"] >= 0
    with np.errstate(invalid="ignore"):
        near = np.abs(hits["t"] - others["t"]) <= AGREE * others["t"]
    share = float(((met == theirs) & (near | ~met)).mean())
    return "" if share >= LEAST else f"only {share:.4%} of the hits are those of another layout"


def any_hit(met: NDArray, hits: Mapping[str, NDArray]) -> str:
    """Compare any-hit answers (n,), 0 or 1, with closest hits; return a complaint, or ""."""
    if (met > 1).any():
        return f"{(met > 1).sum():,} of {len(met):,} rays were not traced"
    share = float(((met != 0) == (hits["primitive"] >= 0)).mean())
    return "" if share >= LEAST else f"only {share:.4%} agree with the closest hits"


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
