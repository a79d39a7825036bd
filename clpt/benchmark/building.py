"""How fast trees are built of triangles on the device, and follow them when they move."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from clpt import bvh, device
from clpt.bvh.layouts import Quality
from clpt.rays import Accel
from clpt.scene import Scene

from .bandwidth import Copying
from .checks import Truth
from .figures import Figure, rates
from .rays import Sets, Traced, sets

BEND = 0.02  # of the scene's height, by which vertices move


def measure(
    on: device.Device,
    scene: Scene,
    rounds: int,
    layouts: Sequence[str] = bvh.TREES,
    count: int | None = None,
    accel: Any = Accel,
) -> Iterator[Figure]:
    """Figures of builds and refits, in Mtri/s by the host's clock, from arrays on the device.

    count: rays by which the trees are checked; accel: what answers them, called as Accel is.
    """
    work = _Work(on, sets(on, scene, count), scene.name, accel)
    for layout in layouts:
        for quality in get_args(Quality):
            yield work.build(layout, quality, rounds)
        yield work.refit(layout, rounds)


class _Work:
    """Triangles on the device, where they are and where they move to, and rays among them."""

    def __init__(self, on: device.Device, given: Sets, scene: str, accel: Any):
        self.device, self.given, self.scene, self.accel = on, given, scene, accel
        height = float(np.ptp(given.vertices[:, 1]))
        wave = np.sin(given.vertices[:, [1, 2, 0]] * (12.0 / max(height, 1e-6)))
        self.bent = (given.vertices + BEND * height * wave).astype(np.float32)
        self.rays = given.rays.get("diffuse") or given.rays["primary"]
        self.copying, give = Copying(on), device.Buffers(on)
        self.points, self.moved = (
            give.upload("vertices", points, np.float32) for points in (given.vertices, self.bent)
        )
        self.faces = give.upload("faces", given.faces, np.uint32)

    def build(self, layout: str, quality: Quality, rounds: int) -> Figure:
        """A build of a layout from the beginning."""
        kept: list[bvh.Bvh] = []

        def once(_: int) -> None:
            kept[:] = [
                bvh.build(self.device, self.points, self.faces, layout=layout, quality=quality)
            ]

        seconds = _timed(once, rounds)
        tree = kept[0]
        more = {"quality": quality, "bytes": tree.bytes, **tree.stats}
        del more["seconds"]
        name = f"build {layout}" + (" fast" if quality == "fast" else "")
        wrong = self._answers(layout, quality, moves=False)
        return self._figure(name, layout, seconds, more, tree.bytes).refuse(wrong)

    def refit(self, layout: str, rounds: int) -> Figure:
        """A tree that follows its vertices there and back."""
        tree = bvh.build(self.device, self.points, self.faces, layout=layout)
        building = bvh.Building(self.device)

        def once(number: int) -> None:
            bvh.refit(building, tree, (self.moved, self.points)[number % 2], self.faces)
            building.stream.wait()

        seconds = _timed(once, rounds)
        wrong = self._answers(layout, "high", moves=True)
        return self._figure(f"refit {layout}", layout, seconds, {}, tree.bytes).refuse(wrong)

    @cached_property
    def _truths(self) -> tuple[Truth, Truth]:
        """What is known of the rays before triangles move, and after."""
        faces, rays = self.given.faces, self.rays
        return Truth(self.given.vertices, faces, rays), Truth(self.bent, faces, rays)

    def _answers(self, layout: str, quality: Quality, *, moves: bool) -> str:
        """What is wrong with what such a tree answers; "" if nothing."""
        queue, given = self.device.queue, self.given
        tree = self.accel(queue, given.vertices, given.faces, layout=layout, quality=quality)
        if moves:
            tree.update(self.bent)
        hits, _ = Traced(self.device, self.rays).closest(tree, 1)
        return self._truths[int(moves)].closest(hits)

    def _figure(
        self, name: str, layout: str, seconds: list[float], more: dict[str, Any], size: int
    ) -> Figure:
        count = len(self.given.faces)
        about = {"layout": layout, "triangles": count, **more}
        least = _bytes(self.given.vertices, self.given.faces) + size
        figure = Figure("build", name, "Mtri/s", rates(count, seconds), self.scene, about)
        return figure.refuse(self.copying.complaint(least, min(seconds), least))


def _bytes(*arrays: NDArray) -> int:
    return sum(array.nbytes for array in arrays)


def _timed(once: Callable[[int], None], rounds: int) -> list[float]:
    """Seconds of each round, after one that compiles."""
    seconds = []
    for number in range(rounds + 1):
        start = time.perf_counter()
        once(number)
        seconds.append(time.perf_counter() - start)
    return seconds[1:]
