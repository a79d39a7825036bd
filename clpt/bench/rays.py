"""Speed of each layout for the scene's rays, and checks of its hits.

`primary`: camera rays, in tiles of 4 x 4 pixels; `diffuse`: cosine-distributed from their hits;
`shadow`: from their hits to lights that the integrator samples. `closest` asks for the nearest
triangle, `any` for any hit. All hits are checked for consistency, some against all triangles, and
layouts with each other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import bvh, device
from clpt.arrays import Faces, Points
from clpt.bench.figures import Copying, Figure, Taken, clock_complaint, rates, timed
from clpt.bench.launches import Flight
from clpt.errors import SceneError
from clpt.rays import Accel, Hits
from clpt.records import HIT, PATH, SHADOW
from clpt.render.flow.scene_to_tables import Lowered
from clpt.scene import Scene

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


CPU_RAYS, GPU_RAYS = 1 << 16, 1 << 20
RAY_BYTES = 28  # that a kernel reads for each ray, at least
ANSWER_BYTES = {"closest": 16, "any": 1}  # that it writes
POISON = -7  # an invalid primitive


@dataclass(frozen=True)
class Rays:
    """Rays: origins and directions (n, 3) float32, far ends (n,) float32 in units of directions."""

    origins: NDArray[np.float32]
    directions: NDArray[np.float32]
    t_max: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.origins)


def sets(
    on: device.Device, scene: Scene, count: int | None = None
) -> tuple[Points, Faces, dict[str, Rays]]:
    """Return a scene's vertices (n, 3) and faces (m, 3), and about `count` rays of each set.

    Rays come from a render's stages; empty sets are left out.

    Raises SceneError for a scene without triangles.
    """
    count = count or (CPU_RAYS if on.info.is_cpu else GPU_RAYS)
    flight = Flight(on, scene, count)
    vertices, faces = world(flight.wavefront.scene.lowered)
    if not len(faces):
        raise SceneError("rays are measured on triangles, and the scene has none")
    rays_by_set: dict[str, Rays] = {}

    for step in flight.wavefront.stages:
        flight.stage(step)
        name = step.bound.kernel.name
        if name in ("generate", "emit"):
            rays_by_set["primary"] = _path_rays(flight)
        elif name == "intersect":
            rays_by_set["diffuse"] = _diffuse(flight)
        elif name == "shade":
            rays_by_set["shadow"] = _shadow_rays(flight)
    return vertices, faces, {name: rays for name, rays in rays_by_set.items() if len(rays)}


def _path_rays(flight: Flight) -> Rays:
    which = flight.alive
    far = np.full(which.sum(), np.inf, np.float32)
    return Rays(flight.read(PATH, "o")[which], flight.read(PATH, "d")[which], far)


def _shadow_rays(flight: Flight) -> Rays:
    which = flight.shadowed
    return Rays(*(flight.read(SHADOW, name)[which] for name in ("o", "d", "t")))


def _diffuse(flight: Flight) -> Rays:
    """Return diffuse rays from hits, with a small offset from the surface."""
    which = flight.met
    o, d, n = (
        flight.read(record, name)[which].astype(np.float64)
        for record, name in ((PATH, "o"), (PATH, "d"), (HIT, "n"))
    )
    t = flight.read(HIT, "t")[which][:, None]
    n /= np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-30)
    n = np.where((n * d).sum(1, keepdims=True) > 0.0, -n, n)
    w = np.random.default_rng(1).normal(size=n.shape)
    onward = n + 0.9999 * w / np.linalg.norm(w, axis=1, keepdims=True)
    onward /= np.linalg.norm(onward, axis=1, keepdims=True)
    radius = float(flight.wavefront.scene.lowered.settings["scene_radius"])
    origins = (o + t * d + 3e-5 * radius * n).astype(np.float32)
    return Rays(origins, onward.astype(np.float32), np.full(len(o), np.inf, np.float32))


class Traced:
    """A set of rays on the device, for queries of layouts."""

    def __init__(self, on: device.Device, rays: Rays):
        self.device, self.count = on, len(rays)
        self.named = {
            name: self._filled(getattr(rays, name)) for name in ("origins", "directions", "t_max")
        }

    def _filled(self, array: NDArray) -> device.DeviceArray:
        copy = device.DeviceArray(self.device.queue, array.shape, array.dtype)
        copy.set(array)
        return copy

    def closest(self, tree: Any) -> tuple[dict[str, NDArray], Taken]:
        """Return the hits by name, and their time."""
        n = self.count
        out = Hits(
            t=self._filled(np.full(n, np.nan, np.float32)),
            primitive=self._filled(np.full(n, POISON, np.int32)),
            barycentrics=self._filled(np.full((n, 2), np.nan, np.float32)),
            instance=None,
            event=None,
        )
        taken = timed(self.device, lambda: [tree.intersect(**self.named, out=out).event])
        return {k: getattr(out, k).get() for k in ("t", "primitive", "barycentrics")}, taken

    def occluded(self, tree: Any) -> tuple[NDArray[np.uint8], Taken]:
        """Return whether each ray hits anything, and the time."""
        out = self._filled(np.full(self.count, 0xEE, np.uint8))
        taken = timed(self.device, lambda: tree.occluded(**self.named, out=out).events[-1:])
        return out.get(), taken


def measure(
    on: device.Device,
    scene: Scene,
    rounds: int,
    layouts: Sequence[str] = bvh.TREES,
    count: int | None = None,
    accel: Any = Accel,
) -> Iterator[Figure]:
    """Yield figures of every layout, set and query, in Mrays/s. Raises like `sets`.

    accel: the measured class, with the parameters of clpt.rays.Accel.
    """
    vertices, faces, ray_sets = sets(on, scene, count)
    copying = Copying(on)
    trees = {name: accel(on.queue, vertices, faces, layout=name) for name in layouts}
    for name, rays in ray_sets.items():
        traced, truth = Traced(on, rays), Truth(vertices, faces, rays)
        taken: dict[str, list[Taken]] = {}
        hits: dict[str, dict[str, NDArray]] = {}
        wrong: dict[str, str] = {}
        for _ in range(rounds + 1):  # taking turns, so that a noisy second meets all
            for layout, tree in trees.items():
                closest, either = f"{layout} {name} closest", f"{layout} {name} any"
                hits[layout], seconds = traced.closest(tree)
                taken.setdefault(closest, []).append(seconds)
                met, seconds = traced.occluded(tree)
                taken.setdefault(either, []).append(seconds)
                wrong[either] = wrong.get(either) or any_hit(met, hits[layout])
        first = next(iter(hits.values()))
        for layout, answers in hits.items():
            complaint = truth.closest(answers) or differ(answers, first)
            wrong[f"{layout} {name} closest"] = complaint
        for figure, each in taken.items():
            yield _figure(figure, each, wrong[figure], copying, scene.name, len(rays))


def _figure(
    name: str, taken: list[Taken], wrong: str, copying: Copying, scene: str, count: int
) -> Figure:
    taken = taken[1:]  # the first compiles
    seconds = [t.device for t in taken]
    layout, rays, query = name.split()
    nbytes = count * (RAY_BYTES + ANSWER_BYTES[query])
    slow = clock_complaint(taken) or copying.complaint(nbytes, min(seconds), nbytes)
    more = {"layout": layout, "rays": rays, "query": query, "count": count}
    figure = Figure("rays", name, "Mrays/s", rates(count, seconds), scene, more)
    return figure.refuse(wrong, slow)
