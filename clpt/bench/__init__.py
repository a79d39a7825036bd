"""The benchmark: pictures, rays, stages, builds and starts of any OpenCL device, from clpt alone.

`clpt bench` runs it; docs/benchmark.md explains the figures. `measure` yields each figure at once;
`refused` tells why a figure cannot be true.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from clpt import bvh, device
from clpt.bench import agreement, building, figures, pictures, rays, shading, stages, starting
from clpt.bench.figures import Figure
from clpt.bench.scenes import PICTURES, opened

__all__ = ["DEFAULT_PARTS", "PARTS", "Figure", "measure", "opened"]

PARTS = {
    "pictures": "fixed scenes rendered, each picture verified: points of each, and a total",
    "bandwidth": "a kernel that only copies, GB/s",
    "rays": "rays a second by layout, set and query, hits checked",
    "stages": "speed of each stage of a render, Mitems/s and GB/s; sort and film too",
    "shading": "every kind of material in a closed box, Mitems/s, beside diffuse; on request",
    "agreement": "each stage beside itself without optimisation; on request",
    "build": "trees built and refitted, Mtri/s",
    "start": "whole processes until a first picture, with empty caches and with full ones",
}
DEFAULT_PARTS = tuple(part for part in PARTS if part not in ("shading", "agreement"))
START_SCENE = "cornell"  # by default


def measure(
    on: device.Device,
    *,
    parts: Sequence[str] = DEFAULT_PARTS,
    only: Sequence[str] = (),
    kinds: Sequence[str] = (),
    scene: str | None = None,
    mode: str | None = None,
    layouts: Sequence[str] = bvh.TREES,
    rounds: int = 5,
    count: int | None = None,
    size: str = "standard",
) -> Iterator[Figure]:
    """Yield the figures of a device, whose queue must be profiling.

    parts: names of PARTS; only: names of stages, kinds: of materials, by default all; scene: see
    `opened`, by default the atrium, for starts the Cornell box; layouts: names of clpt.bvh.TREES;
    rounds: of each figure; count: rays of a set; size: of pictures, which are left out for other
    scenes. Raises SceneError, DeviceError.
    """
    if "pictures" in parts and (scene is None or scene in PICTURES):
        yield from pictures.measure(on, rounds, size, (scene,) if scene else ())
    if "bandwidth" in parts:
        yield from figures.measure(on, rounds)
    if {"rays", "stages", "agreement", "build"} & set(parts):
        plan = opened(scene or "atrium", mode)
        if "rays" in parts:
            yield from rays.measure(on, plan, rounds, layouts, count)
        if "stages" in parts:
            yield from stages.measure(on, plan, rounds, only)
        if "agreement" in parts:
            yield from agreement.measure(on, plan, only)
        if "build" in parts:
            yield from building.measure(on, plan, rounds, layouts)
    if "shading" in parts:
        yield from shading.measure(on, rounds, kinds, (mode,) if mode else shading.MODES)
    if "start" in parts:
        name = scene or START_SCENE
        which = on.info.label if on.info.index < 0 else on.info.index
        yield from starting.measure(name, mode, which, max(1, min(rounds, 3)), name)
