"""Speed of builds of trees on the device, and of refits to moved triangles."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import get_args

import numpy as np

from clpt import bvh, device
from clpt.arrays import Faces, Points
from clpt.bench.figures import Copying, Figure, rates
from clpt.bench.rays import Rays, Traced, Truth, sets
from clpt.choices import Quality
from clpt.rays import Accel
from clpt.scene import Scene

BEND = 0.02  # of the scene's height: the move of vertices


def measure(
    on: device.Device,
    scene: Scene,
    rounds: int,
    layouts: Sequence[str] = bvh.TREES,
    count: int | None = None,
    accel: type[Accel] = Accel,
) -> Iterator[Figure]:
    """Yield figures of builds and refits, in Mtri/s by the host's clock, from device arrays.

    count: rays that check the trees; accel: class to trace them, with the parameters of Accel.
    """
    work = _Work(on, *sets(on, scene, count), scene.name, accel)
    builds = [(layout, quality) for layout in layouts for quality in get_args(Quality)]
    trees: dict[tuple[str, Quality], bvh.Bvh] = {}
    seconds: dict[str, list[float]] = {}
    for number in range(rounds + 1):  # taking turns, so that a noisy second meets all
        for layout, quality in builds:
            start = time.perf_counter()
            trees[layout, quality] = work.build(layout, quality)
            seconds.setdefault(_name(layout, quality), []).append(time.perf_counter() - start)
        for layout in layouts:
            start = time.perf_counter()
            work.refit(trees[layout, "high"], number)
            seconds.setdefault(f"refit {layout}", []).append(time.perf_counter() - start)
    for layout, quality in builds:
        tree, name = trees[layout, quality], _name(layout, quality)
        yield work.figure(name, layout, quality, seconds[name], tree, moves=False)
        if quality == get_args(Quality)[-1]:
            name = f"refit {layout}"
            yield work.figure(
                name, layout, "high", seconds[name], trees[layout, "high"], moves=True
            )


def _name(layout: str, quality: Quality) -> str:
    return f"build {layout}" + (" fast" if quality == "fast" else "")


class _Work:
    """Triangles on the device in two positions, and rays to check trees."""

    def __init__(
        self, on: device.Device, vertices: Points, faces: Faces,
        ray_sets: dict[str, Rays], scene: str, accel: type[Accel],
    ):  # fmt: skip
        self.device, self.scene, self.accel = on, scene, accel
        self.triangles = vertices, faces
        height = float(np.ptp(vertices[:, 1]))
        wave = np.sin(vertices[:, [1, 2, 0]] * (12.0 / max(height, 1e-6)))
        self.bent = (vertices + BEND * height * wave).astype(np.float32)
        self.rays = ray_sets.get("diffuse") or ray_sets["primary"]
        self.copying, give = Copying(on), device.Buffers(on)
        self._building = bvh.Building(on)
        self.points, self.moved = (
            give.upload("vertices", points, np.float32) for points in (vertices, self.bent)
        )
        self.faces = give.upload("faces", faces, np.uint32)

    def build(self, layout: str, quality: Quality) -> bvh.Bvh:
        """Build a tree."""
        return bvh.build(self.device, self.points, self.faces, layout=layout, quality=quality)

    def refit(self, tree: bvh.Bvh, number: int) -> None:
        """Refit a tree to the moved vertices or, for even numbers, back."""
        bvh.refit(self._building, tree, (self.moved, self.points)[number % 2], self.faces)
        self._building.stream.wait()

    def figure(
        self, name: str, layout: str, quality: Quality, seconds: list[float], tree: bvh.Bvh,
        *, moves: bool,
    ) -> Figure:  # fmt: skip
        """Return the speed of the rounds after the first, which compiles; check hits."""
        vertices, faces = self.triangles
        count = len(faces)
        stats = {} if moves else {k: v for k, v in tree.stats.items() if k != "seconds"}
        more = {"layout": layout, "quality": quality, "triangles": count, **stats}
        least = vertices.nbytes + faces.nbytes + tree.bytes
        rounds = rates(count, seconds[1:])
        figure = Figure("build", name, "Mtri/s", rounds, self.scene, {**more, "bytes": tree.bytes})
        slow = self.copying.complaint(least, min(seconds[1:]), least)
        return figure.refuse(slow, self._answers(layout, quality, moves=moves))

    @cached_property
    def _truths(self) -> tuple[Truth, Truth]:
        """The expected hits of the rays, before and after the triangles move."""
        (vertices, faces), rays = self.triangles, self.rays
        return Truth(vertices, faces, rays), Truth(self.bent, faces, rays)

    def _answers(self, layout: str, quality: Quality, *, moves: bool) -> str:
        """Trace the rays through such a tree; return a complaint on its hits, or ""."""
        tree = self.accel(self.device.queue, *self.triangles, layout=layout, quality=quality)
        if moves:
            tree.update(self.bent)
        hits, _ = Traced(self.device, self.rays).closest(tree)
        return self._truths[int(moves)].closest(hits)
