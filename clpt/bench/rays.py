"""Speed of each layout for the scene's rays, and a check of its hits.

`primary`: camera rays, in tiles of 4 x 4 pixels; `diffuse`: cosine-distributed from their hits;
`shadow`: from their hits to lights that the integrator samples. `closest` asks for the nearest
triangle, `any` for any hit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import bvh, device
from clpt.bench import checks
from clpt.bench.bandwidth import Copying
from clpt.bench.figures import Figure, Taken, clock_complaint, rates, timed
from clpt.bench.flight import Flight
from clpt.errors import SceneError
from clpt.rays import Accel, Hits
from clpt.records import HIT, PATH, SHADOW
from clpt.scene import Scene

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


@dataclass(frozen=True)
class Sets:
    """A scene's vertices (n, 3) float32 and faces (m, 3) uint32, and its rays by set."""

    vertices: NDArray[np.float32]
    faces: NDArray[np.uint32]
    rays: Mapping[str, Rays]


def sets(on: device.Device, scene: Scene, count: int | None = None) -> Sets:
    """Return about `count` rays of each set, from a render's stages, without empty sets.

    Raises SceneError for a scene without triangles.
    """
    count = count or (CPU_RAYS if on.info.is_cpu else GPU_RAYS)
    flight = Flight(on, scene, count)
    vertices, faces = checks.world(flight.wavefront.scene.lowered)
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
    return Sets(vertices, faces, {name: rays for name, rays in rays_by_set.items() if len(rays)})


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
    ray_sets = sets(on, scene, count)
    copying = Copying(on)
    vertices, faces = ray_sets.vertices, ray_sets.faces
    trees = {name: accel(on.queue, vertices, faces, layout=name) for name in layouts}
    for name, rays in ray_sets.rays.items():
        traced, truth = Traced(on, rays), checks.Truth(vertices, faces, rays)
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
                wrong[either] = wrong.get(either) or checks.any_hit(met, hits[layout])
        first = next(iter(hits.values()))
        for layout, answers in hits.items():
            complaint = truth.closest(answers) or checks.differ(answers, first)
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
