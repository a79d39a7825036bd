"""What motion costs: rays a second beside the same scene that stands still.

    python -m bench.motion

1,000 copies of a ball with bumps (20,000 triangles) that turn by 30 degrees while the shutter is
open, the same that move by half their size, and a camera that moves before copies that do not. Then
a ball of half a million triangles beside the same that swells to 1.5 of its size and twists, by two
keys. Rays are counted by processor time; pictures of the two kinds take turns.
"""

from __future__ import annotations

import dataclasses
import statistics
import time
from typing import Any

import click
import numpy as np
from rich.table import Table

import clpt
from bench import machine
from bench.instancing import bumpy, scene
from clpt import transforms as tf
from clpt.scene import Scene
from clpt.scene.motion import Deformation, Keys, Shutter
from clpt.scene.shapes import Group, Instance

COUNT, ROUNDS, SPP = 1000, 5, 8


def copies(motion: Keys | None) -> Scene:
    """Balls at random places, each with a motion of its own about its middle."""
    rng = np.random.default_rng(5)
    group = Group((bumpy(100),))
    shapes: list[Any] = []
    for _ in range(COUNT):
        place = tf.translate(rng.uniform([-20, 0, -20], [20, 6, 20]))
        keys = None
        if motion is not None:
            keys = Keys(motion.times, [place @ matrix for matrix in motion.transforms])
        shapes.append(Instance(group=group, to_world=np.eye(4) if keys else place, motion=keys))
    plan = scene(shapes)
    return dataclasses.replace(
        plan, camera=dataclasses.replace(plan.camera, shutter=Shutter(0.0, 1.0))
    )


def one_ball(deforms: bool) -> Scene:
    """A large ball, which swells and twists about its axis while the shutter is open, or not."""
    ball = bumpy(500)
    if deforms:
        points = np.asarray(ball.vertices)
        angles = 0.4 * points[:, 1]
        c, s = np.cos(angles), np.sin(angles)
        twisted = [c * points[:, 0] + s * points[:, 2], points[:, 1]]
        twisted.append(c * points[:, 2] - s * points[:, 0])
        last = 1.5 * np.stack(twisted, axis=1)
        ball = dataclasses.replace(ball, deformation=Deformation([0.0, 1.0], [points, last]))
    else:  # the other ball's mean size
        ball = dataclasses.replace(ball, to_world=tf.scale(1.25))
    plan = scene([ball], side=3.0)
    return dataclasses.replace(
        plan, camera=dataclasses.replace(plan.camera, shutter=Shutter(0.0, 1.0))
    )


def rates(scenes: list[Scene]) -> list[float]:
    """Rays for each second of processor time, the median of rounds in turn."""
    renderers = [clpt.Renderer(plan) for plan in scenes]
    speeds: list[list[float]] = [[] for _ in scenes]
    for round_ in range(ROUNDS + 1):
        for renderer, values in zip(renderers, speeds, strict=True):
            before, began = renderer._wavefront.counts.rays, time.process_time()
            renderer.run(SPP)
            rate = (renderer._wavefront.counts.rays - before) / (time.process_time() - began)
            if round_:
                values.append(rate)
    return [statistics.median(values) for values in speeds]


@click.command(help=__doc__)
@click.option("--json", "path", help="Append records to this file.")
def main(path: str | None) -> None:
    turn = Keys([0.0, 1.0], [tf.rotate([0, 1, 0], a) for a in (0, 30)])
    slide = Keys([0.0, 1.0], [np.eye(4), tf.translate([1.0, 0, 0])])
    still = copies(None)
    matrix = np.asarray(still.camera.to_world)
    keys = Keys([0.0, 1.0], [matrix, tf.translate([0.5, 0, 0]) @ matrix])
    camera = dataclasses.replace(still.camera, to_world=np.eye(4), motion=keys)
    scenes = {
        "still": still,
        "turning": copies(turn),
        "moving": copies(slide),
        "camera": dataclasses.replace(still, camera=camera),
    }
    balls = {"one ball": one_ball(False), "deforming": one_ball(True)}
    rows: list[dict[str, object]] = []
    for some in (scenes, balls):
        speeds = rates(list(some.values()))
        rows += [
            {"scene": name, "Mrays/s": round(rate / 1e6, 2), "of still": round(rate / speeds[0], 3)}
            for name, rate in zip(some, speeds, strict=True)
        ]
    machine.append(path, "motion", [{**machine.circumstances(), **row} for row in rows])
    table = Table("scene", "Mrays/s", "of still")
    for row in rows:
        table.add_row(*(str(value) for value in row.values()))
    machine.console().print(table)


if __name__ == "__main__":
    main()
