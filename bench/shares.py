"""Where a render's time goes: each stage, beside what the same rays cost in a bare kernel.

Paths are run a stage at a time. Before `intersect` and `shadow` their rays are read back and traced
once more by the bare traversal, in the order of their slots. What a render takes beyond that, its
share of shading, sorting and bookkeeping, is what this is about. Milliseconds per million
closest-hit rays, by processor time; scenes with instances or analytic shapes have no bare figure.
"""

from __future__ import annotations

import dataclasses
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from typing import Any

import click
import numpy as np
import pyopencl as cl
from numpy.typing import NDArray
from rich.table import Table

import clpt
from bench import machine
from bench.renders import MODES, SCENES
from bench.traversal import HIT, KERNELS
from clpt import bvh, device
from clpt.bench.launches import Flight
from clpt.records import PATH, SHADOW

WARM, BOUNCES = 6, 24
SHORT = 1e-4  # of a shadow ray that is left out at its end


class Bare:
    """Kernels that only trace, with room for so many rays."""

    def __init__(self, on: device.Device, tree: bvh.Bvh, room: int):
        self.queue, self.room = on.queue, room
        self.rays = np.zeros((room, 8), np.float32)
        source = device.assemble("bench", {"bench": KERNELS.format(layout=tree.layout)})
        program = device.build(on, source)
        give = device.Buffers(on)
        self.buffer = give.allocate("the rays", self.rays.nbytes)
        shared = {**tree.buffers, "rays": self.buffer}
        self.kernels = {
            name: program.kernel(name).bind(**shared, hits=give.allocate("hits", size * room))
            for name, size in (("closest", HIT.itemsize), ("occluded", 4))
        }
        for name in self.kernels:  # PoCL compiles at the first launch that has items
            self.trace(name, np.zeros((room, 8), np.float32))

    def trace(self, name: str, traced: NDArray[np.float32]) -> float:
        """Trace rays (n, 8); return the seconds of processor time that it took."""
        self.rays[: len(traced)] = traced
        self.rays[len(traced) :, 7] = -1.0  # those that fill the last group meet nothing
        cl.enqueue_copy(self.queue, self.buffer, self.rays)
        start = time.process_time()
        self.kernels[name].enqueue(self.queue, (-(-len(traced) // 64) * 64,), (64,))
        self.queue.finish()
        return time.process_time() - start


def rays(flight: Flight, kernel: str) -> NDArray[np.float32]:
    """The rays (n, 8) that a stage is about to trace: origin, tmin, direction, tmax."""
    record, active = (PATH, flight.alive) if kernel == "intersect" else (SHADOW, flight.shadowed)
    o, d = (flight.read(record, name)[active] for name in "od")
    far = flight.read(SHADOW, "t")[active] * (1 - SHORT) if record is SHADOW else np.inf
    ends = np.zeros((len(o), 1)), np.broadcast_to(far, len(o))[:, None]
    return np.concatenate([o, ends[0], d, ends[1]], axis=1).astype(np.float32)


def measure(path: Path, mode: str, bounces: int = BOUNCES) -> dict[str, Any]:
    """A scene's stages, in milliseconds per million closest-hit rays."""
    scene = clpt.load(path)
    scene.film = dataclasses.replace(scene.film, mode=mode)
    on = device.choose()
    flight = Flight(on, scene)
    features = flight.wavefront.features
    tree = flight.wavefront.scene.trees.triangles
    plain = tree.layout != "brute" and not (
        features.geometry.instances or features.geometry.analytic
    )
    bare = Bare(on, tree, flight.slots) if plain else None
    seconds: dict[str, float] = defaultdict(float)
    counts = dict.fromkeys(("intersect", "shadow"), 0)

    for _ in range(WARM):
        flight.bounce()
    for step in flight.wavefront.stages * bounces:
        kernel = step.bound.kernel.name
        if kernel in counts:
            traced = rays(flight, kernel)
            counts[kernel] += len(traced)
            if bare and len(traced):
                name = {"intersect": "closest", "shadow": "occluded"}[kernel]
                seconds[f"bare {name}"] += bare.trace(name, traced)
        on.queue.finish()
        start = time.process_time()
        flight.stage(step)
        on.queue.finish()
        seconds[step.name] += time.process_time() - start

    alone = sum(s for name, s in seconds.items() if name.startswith("bare"))
    total = sum(seconds.values()) - alone
    millions = counts["intersect"] * 1e-6
    row: dict[str, Any] = {
        "scene": machine.scene_name(path),
        "mode": mode,
        "layout": tree.layout,
        "ms": {name: s * 1e3 / millions for name, s in seconds.items()},
        "shadow_rays": counts["shadow"] / counts["intersect"],
        "traced": (seconds["intersect"] + seconds["shadow"]) / total,
    }
    return row | ({"beyond": 1 - alone / total} if bare else {})


@click.command(help=__doc__)
@click.option(
    "--scene", "scenes", multiple=True, help="of bench.renders, or a file  [all of these]"
)
@click.option("--mode", "modes", multiple=True, type=click.Choice(MODES), default=("rgb",))
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(scenes: tuple[str, ...], modes: tuple[str, ...], json_file: str | None) -> None:
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in scenes or SCENES:
            path = SCENES[name](Path(folder)) if name in SCENES else Path(name)
            for mode in modes:
                rows.append(measure(path, mode))
                machine.append(json_file, "shares", rows[-1:])
    table = Table("scene", "mode", "stage", "ms per M rays", title=machine.processor())
    for row in rows:
        for stage, milliseconds in row["ms"].items():
            table.add_row(row["scene"], row["mode"], stage, f"{milliseconds:.1f}")
        for part in ("traced", "beyond"):
            if part in row:
                table.add_row(row["scene"], row["mode"], part, f"{row[part]:.0%}")
    machine.console().print(table)


if __name__ == "__main__":
    main()
