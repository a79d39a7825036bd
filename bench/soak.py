"""Does a renderer that is changed for hours keep its memory, its speed and its picture?

`python -m bench.soak MINUTES` changes a renderer without a pause: shapes move and are deformed,
colours and cameras change, the scene is lowered again, runs are cancelled and resumed, with and
without a limit of noise. Every round ends with the first scene again, whose picture must have the
bits of the first. Sixty records tell what the process takes: resident memory and device memory
[MiB], processor time [s], programs in the cache and built so far, rounds, unequal pictures.
"""

from __future__ import annotations

import dataclasses
import datetime
import math
import os
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.table import Table

import clpt
from bench import machine, report
from clpt import device
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path as PathTracing
from clpt.scene.lights import Constant, Point
from clpt.scene.materials import Diffuse, RoughConductor
from clpt.scene.shapes import Mesh, Rectangle, Sphere

RECORDS = 60  # of a whole run
SPP = 4  # of the picture that ends a round
NOISY = 64  # samples per pixel, at most, where noise ends a run
MIB = 2.0**20
CORNERS = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], np.float32)
FACES = np.array([[0, 2, 1], [0, 3, 2]], np.uint32)
PAINT = Diffuse(reflectance=(0.8, 0.3, 0.2))
CAMERA = Perspective(to_world=tf.look_at([0, 2, 5], [0, 0, 0], [0, 1, 0]))


def scene() -> Scene:
    """Return the scene that begins and ends every round: a sheet, a ball and a floor."""
    floor = tf.translate([0, -1, 0]) @ tf.rotate([1, 0, 0], -90) @ tf.scale(4.0)
    return Scene(
        camera=CAMERA,
        shapes=[
            Mesh(vertices=CORNERS, faces=FACES, material=PAINT, name="sheet"),
            Sphere(radius=0.5, material=RoughConductor(), name="ball"),
            Rectangle(to_world=floor, material=Diffuse(), name="floor"),
        ],
        lights=[Constant(radiance=0.5), Point(position=(1, 3, 2), intensity=4.0)],
        film=Film(width=64, height=48, mode="rgb"),
        integrator=PathTracing(max_depth=4),
    )


def cancel_and_resume(renderer: clpt.Renderer, i: int) -> None:
    """Stop a run from another thread, at another moment each time, and let it go on."""
    timer = threading.Timer(0.002 * (i % 20), renderer.cancel)
    timer.start()
    renderer.run(NOISY)
    timer.join()
    renderer.run(SPP)


def save_and_merge(renderer: clpt.Renderer, i: int) -> None:
    """Take the film out, empty it, and put it in again."""
    state = renderer.film_state()
    renderer.reset()
    renderer.merge(state)
    renderer.run(SPP)


def run_until_noise_is_low(renderer: clpt.Renderer, i: int) -> None:
    """Run with a limit of noise, twice, the second lower."""
    renderer.run(NOISY // 2, noise=0.2 + 0.01 * (i % 10))
    renderer.run(NOISY // 2, noise=0.1)


def lower_again(renderer: clpt.Renderer, i: int) -> None:
    """Take away a shape, and change a light."""
    plan = scene()
    plan.shapes = plan.shapes[: 2 + i % 2]
    plan.lights = [Constant(radiance=0.1 * (1 + i % 9))]
    renderer.update(scene=plan)


CHANGES: dict[str, Callable[[clpt.Renderer, int], Any]] = {
    "move": lambda r, i: r.update(transforms={"sheet": tf.rotate([0, 1, 0], i % 360)}),
    "deform": lambda r, i: r.update(vertices={"sheet": CORNERS * np.float32(1 + 0.001 * (i % 99))}),
    "step": lambda r, i: r.step(1 + i % 3),
    "paint": lambda r, i: r.update(materials={PAINT: Diffuse(reflectance=0.1 * (1 + i % 9))}),
    "zoom": lambda r, i: r.update(camera=dataclasses.replace(CAMERA, fov=20.0 + i % 60)),
    "noise": run_until_noise_is_low,
    "reset": lambda r, i: r.reset(seed=i),
    "cancel": cancel_and_resume,
    "merge": save_and_merge,
    "lower again": lower_again,
}  # fmt: skip


def resident() -> float:
    """Return the memory of this process that is in use [MiB]; NaN where Linux does not tell."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except OSError:
        return math.nan
    return pages * os.sysconf("SC_PAGE_SIZE") / MIB


class Soak:
    """A renderer, how often it was changed, and how often its picture was another than at first."""

    def __init__(self, chosen: device.Device):
        self.device = chosen
        self.first = scene()
        self.renderer = clpt.Renderer(self.first, chosen)
        self.picture = self._picture()
        self.rounds = self.unequal = 0
        for _ in range(2):  # which build all programs; what they leave is the start
            self.round()
        self.began, self.cpu = time.perf_counter(), time.process_time()

    def round(self) -> None:
        """Change the renderer in each way, and compare the picture of the first scene."""
        for change in CHANGES.values():
            change(self.renderer, self.rounds)
        self.renderer.update(scene=self.first)
        self.renderer.reset(seed=self.first.seed)
        self.unequal += not np.array_equal(self._picture(), self.picture)
        self.rounds += 1

    def row(self) -> dict[str, Any]:
        """Return what the process takes now."""
        return {
            "device": self.device.info.label,
            "query": "changes of one renderer",
            "seconds": time.perf_counter() - self.began,
            "cpu_seconds": time.process_time() - self.cpu,
            "rounds": self.rounds,
            "unequal": self.unequal,
            "rss_mib": resident(),
            "used_mib": self.renderer._wavefront.buffers.used / MIB,
            "programs": len(self.device.programs),
            "builds": self.device.builds.programs,
        }

    def _picture(self) -> np.ndarray:
        self.renderer.run(SPP)
        return self.renderer.image()


@click.command(help=__doc__)
@click.argument("minutes", type=click.FloatRange(0.0, min_open=True), default=60.0)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(minutes: float, json_file: str | None) -> None:
    today = datetime.datetime.now(datetime.timezone.utc).date()
    target = json_file or str(report.RESULTS / f"{today}-{machine.kind()}.jsonl")
    soak = Soak(device.choose())
    rows: list[dict[str, Any]] = []
    for i in range(RECORDS + 1):
        while time.perf_counter() - soak.began < 60.0 * minutes * i / RECORDS:
            soak.round()
        rows.append(soak.row())
        machine.append(target, "soak", rows[-1:])
    table = Table("minute", "rounds", "RSS [MiB]", "device [MiB]", "programs", "builds", "unequal")
    for row in rows[:: RECORDS // 10]:
        sizes = [f"{row[name]:.2f}" for name in ("rss_mib", "used_mib")]
        counts = [str(row[name]) for name in ("programs", "builds", "unequal")]
        table.add_row(f"{row['seconds'] / 60:.1f}", str(row["rounds"]), *sizes, *counts)
    machine.console().print(table)
    grown = [name for name in ("used_mib", "builds") if rows[-1][name] > rows[0][name]]
    if grown or rows[-1]["unequal"]:
        raise SystemExit(f"grown: {', '.join(grown)}; unequal pictures: {rows[-1]['unequal']}")


if __name__ == "__main__":
    main()
