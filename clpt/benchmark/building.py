"""How fast trees are built of triangles on the device, and follow them when they move."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

import numpy as np

from clpt import bvh, device
from clpt.scene import Scene

from .bandwidth import Copying
from .figures import Figure, rates
from .rays import Sets, sets

BEND = 0.02  # of the scene's height, by which vertices move


def measure(
    on: device.Device,
    scene: Scene,
    rounds: int,
    layouts: Sequence[str] = bvh.TREES,
    count: int | None = None,
) -> Iterator[Figure]:
    """Figures of builds and refits, in Mtri/s by the host's clock, from arrays on the device."""
    given, copying = sets(on, scene, count), Copying(on)
    for layout in layouts:
        yield from _layout(on, given, copying, layout, rounds, scene.name)


def _layout(
    on: device.Device, given: Sets, copying: Copying, layout: str, rounds: int, scene: str
) -> Iterator[Figure]:
    give, count = device.Buffers(on), len(given.faces)
    points = give.upload("vertices", given.vertices, np.float32)
    corners = give.upload("faces", given.faces, np.uint32)
    seconds = []
    for _ in range(rounds + 1):  # the first one compiles
        start = time.perf_counter()
        tree = bvh.build(on, points, corners, layout=layout)
        seconds.append(time.perf_counter() - start)
    more = {"layout": layout, "triangles": count, "bytes": tree.bytes, **tree.stats}
    more.pop("seconds")
    least = given.vertices.nbytes + given.faces.nbytes + tree.bytes
    figure = Figure("build", f"build {layout}", "Mtri/s", rates(count, seconds[1:]), scene, more)
    yield figure.refuse(copying.complaint(least, min(seconds[1:]), least))

    building = bvh.Building(on)
    height = float(np.ptp(given.vertices[:, 1]))
    wave = np.sin(given.vertices[:, [1, 2, 0]] * (12.0 / max(height, 1e-6)))
    moved = give.upload("vertices", given.vertices + BEND * height * wave, np.float32)
    seconds = []
    for i in range(rounds + 1):
        start = time.perf_counter()
        bvh.refit(building, tree, (points, moved)[(rounds - i + 1) % 2], corners)
        building.stream.wait()
        seconds.append(time.perf_counter() - start)
    more = {"layout": layout, "triangles": count}
    figure = Figure("build", f"refit {layout}", "Mtri/s", rates(count, seconds[1:]), scene, more)
    yield figure.refuse(copying.complaint(least, min(seconds[1:]), least))
