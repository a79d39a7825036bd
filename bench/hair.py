"""Exact curves beside the same curves as tubes of triangles: time and memory.

    python -m bench.hair

Fur on a ball (short strands of a cubic each), a lock of long curled hair, a lawn of straight
blades. Both forms of a scene take turns with the same samples; the time is the processor's for a
sample of all pixels, the memory is of trees and tables of geometry. `work` is time times variance,
the cost of an equal picture.
"""

from __future__ import annotations

import statistics
import time
from typing import Any

import click
import numpy as np
from rich.table import Table

import clpt
from bench import machine
from clpt import transforms as tf
from clpt.geometry.tubes import as_tubes
from clpt.scene import Scene, cameras, integrators, lights, materials
from clpt.scene.shapes import Curves, Rectangle

SIZE, ROUNDS, SPP = 160, 5, 4
TABLES = ("vertices", "normals", "uvs", "faces", "spheres", "geometry", "shapes")


def fur(count: int) -> Curves:
    """Strands of a cubic each, from a ball of radius .8."""
    rng = np.random.default_rng(1)
    root = rng.normal(size=(count, 3))
    root /= np.linalg.norm(root, axis=1, keepdims=True)
    lean = 0.5 * np.cross(root, [0.0, 1.0, 0.0]) + 0.15 * rng.normal(size=(count, 3))
    points = np.zeros((count, 4, 4))
    for i, t in enumerate(np.linspace(0.0, 1.0, 4)):
        points[:, i, :3] = 0.8 * root + 0.25 * (root * t + lean * t * t)
        points[:, i, 3] = 0.0015 * (1.0 - 0.8 * t)
    hair = materials.Hair(sigma_a=(0.3, 0.6, 1.2))
    lengths = (4,) * count
    return Curves(points=points.reshape(-1, 4), lengths=lengths, basis="bezier", material=hair)


def lock(count: int) -> Curves:
    """Long hair in curls, 24 points a strand."""
    rng = np.random.default_rng(2)
    t = np.linspace(0.0, 1.0, 24)
    at = rng.normal(size=(count, 2)) * [0.45, 0.12]
    turn = rng.uniform(0.0, 2.0 * np.pi, count)[:, None] + 14.0 * t
    wide = rng.uniform(0.03, 0.09, count)[:, None] * t
    points = np.zeros((count, 24, 4))
    points[..., 0] = at[:, :1] + wide * np.cos(turn)
    points[..., 1] = 0.9 - 1.8 * t
    points[..., 2] = at[:, 1:] + wide * np.sin(turn)
    points[..., 3] = 0.0008
    hair = materials.Hair(sigma_a=(1.2, 1.8, 2.6))
    return Curves(points=points.reshape(-1, 4), lengths=(24,) * count, material=hair)


def lawn(count: int) -> Curves:
    """Straight blades that end in a point, 3 points each."""
    rng = np.random.default_rng(3)
    points = np.zeros((count, 3, 4))
    root = rng.uniform(-1.0, 1.0, (count, 2))
    lean = 0.1 * rng.normal(size=(count, 2))
    for i, t in enumerate((0.0, 0.5, 1.0)):
        points[:, i, 0], points[:, i, 2] = (root + lean * t * t).T
        points[:, i, 1] = -0.6 + 0.4 * t
        points[:, i, 3] = 0.004 * (1.0 - 0.95 * t)
    green = materials.Diffuse(reflectance=(0.15, 0.4, 0.08))
    lengths = (3,) * count
    return Curves(points=points.reshape(-1, 4), lengths=lengths, basis="linear", material=green)


def scene(curves: Curves) -> Scene:
    """Curves before a grey wall, under a lamp and a sky."""
    view = tf.look_at((0, 0.3, 3), (0, 0, 0), (0, 1, 0))
    wall = tf.translate([0.0, 0.0, -1.5]) @ tf.scale(4.0)
    return Scene(
        camera=cameras.Perspective(fov=42.0, to_world=view),
        film=integrators.Film(width=SIZE, height=SIZE, mode="rgb"),
        integrator=integrators.Path(max_depth=12),
        shapes=[curves, Rectangle(to_world=wall)],
        lights=[
            lights.Constant(radiance=(0.4, 0.45, 0.5)),
            lights.Directional(direction=(-1.0, -1.0, -0.8), irradiance=(4.0, 3.7, 3.2)),
        ],
    )


def compare(name: str, curves: Curves) -> dict[str, Any]:
    """Return figures of a scene in both forms, and their ratios to tubes."""
    forms = {"exact": curves, "tubes": as_tubes(curves)}
    renderers = {form: clpt.Renderer(scene(strands)) for form, strands in forms.items()}
    seconds: dict[str, list[float]] = {form: [] for form in forms}
    sums = {form: [np.zeros((SIZE, SIZE, 3)) for _ in range(2)] for form in forms}
    for round_ in range(ROUNDS + 1):
        for form, renderer in renderers.items():
            before = renderer.image().astype(np.float64) * round_ if round_ else 0.0
            began = time.process_time()
            renderer.run(SPP)
            spent = time.process_time() - began
            sample = renderer.image().astype(np.float64) * (round_ + 1) - before
            sums[form][0] += sample
            sums[form][1] += sample**2
            if round_:
                seconds[form].append(spent / SPP)
    record: dict[str, Any] = {"scene": name}
    work = {}
    for form, renderer in renderers.items():
        total, squares = (s / (ROUNDS + 1) for s in sums[form])
        spent, stats = statistics.median(seconds[form]), renderer.stats
        variance = float((squares - total**2).clip(0.0).mean())
        memory = sum(stats.trees.values()) + sum(stats.tables.get(t, 0) for t in TABLES)
        work[form] = spent * variance
        record |= {f"{form} s": round(spent, 4), f"{form} MB": round(memory / 1e6, 1)}
        record[f"{form} mean"] = round(float(total.mean()), 4)
    record["time"] = round(record["exact s"] / record["tubes s"], 3)
    record["work"] = round(work["exact"] / work["tubes"], 3)
    record["memory"] = round(record["exact MB"] / record["tubes MB"], 3)
    return record


@click.command(help=__doc__)
@click.option("--json", "path", help="Append records to this file.")
@click.option("--share", default=1.0, help="Of the strands.")
@click.option("--only", default="", help="Part of a scene's name.")
def main(path: str | None, share: float, only: str) -> None:
    kinds = {"fur": (fur, 50_000), "lock": (lock, 6_000), "lawn": (lawn, 40_000)}
    rows = [
        compare(name, make(int(count * share)))
        for name, (make, count) in kinds.items()
        if only in name
    ]
    machine.append(path, "hair", [{**machine.circumstances(), **row} for row in rows])
    table = Table(*rows[0])
    for row in rows:
        table.add_row(*(str(value) for value in row.values()))
    machine.console().print(table)


if __name__ == "__main__":
    main()
