"""What a program that renders by clpt pays: time of its own thread for each call, and updates.

A renderer on the program's queue; a ball of 100,000 triangles and a floor, 64x48 pixels. `python`
is the time of the calling thread [us]; `done` is from the call to the end of its last command [ms],
with nothing else on the queue. Medians.
"""

from __future__ import annotations

import dataclasses
import statistics
import time
from collections.abc import Callable
from typing import Any

import click
import numpy as np
import pyopencl as cl
import pyopencl.array as cl_array
from rich.table import Table

import clpt
from bench import machine
from bench.instancing import bumpy
from clpt import device
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Constant
from clpt.scene.materials import Diffuse
from clpt.scene.shapes import Rectangle

SIDE = 224  # of the ball: 2 SIDE^2 triangles
PAINT = Diffuse(reflectance=(0.8, 0.3, 0.2))


def scene() -> Scene:
    ball = dataclasses.replace(bumpy(SIDE), material=PAINT, name="ball")
    down = tf.translate([0, -1.1, 0]) @ tf.rotate([1, 0, 0], -90) @ tf.scale(5.0)
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 1, 5], [0, 0, 0], [0, 1, 0])),
        shapes=[ball, Rectangle(to_world=down, material=Diffuse())],
        lights=[Constant(radiance=1.0)],
        film=Film(width=64, height=48, mode="rgb"),
    )


def calls(renderer: clpt.Renderer) -> dict[str, Callable[[int], cl.Event]]:
    """What is timed, given how often it was called before."""
    now, queue = renderer.scene, renderer._wavefront.stream.queue
    still = now.shapes[0].vertices
    points = [cl_array.to_device(queue, still * np.float32(s)) for s in (1.0, 0.9)]

    def turned(i: int) -> Perspective:
        return dataclasses.replace(now.camera, fov=40.0 + i % 10)

    def painted(i: int) -> dict[Any, Diffuse]:
        return {PAINT: Diffuse(reflectance=(0.1 * (i % 9), 0.3, 0.2))}

    return {
        "step": lambda i: renderer.step(),
        "reset": lambda i: renderer.reset(),
        "update a camera": lambda i: renderer.update(camera=turned(i)),
        "update a colour": lambda i: renderer.update(materials=painted(i)),
        "update a transform": lambda i: renderer.update(
            transforms={"ball": tf.rotate([0, 1, 0], i)}
        ),
        "update vertices": lambda i: renderer.update(vertices={"ball": points[i % 2]}),
        "lower again": lambda i: renderer.update(scene=dataclasses.replace(now, seed=i)),
    }


def measure(call: Callable[[int], cl.Event], rounds: int) -> tuple[float, float]:
    """Medians of the thread's time [us] and of the time until it is done [ms]."""
    python, done = [], []
    for i in range(rounds + 2):
        start, thread_seconds = time.perf_counter(), time.thread_time()
        event = call(i)
        python.append(time.thread_time() - thread_seconds)
        event.wait()
        done.append(time.perf_counter() - start)
    return 1e6 * statistics.median(python[2:]), 1e3 * statistics.median(done[2:])


@click.command(help=__doc__)
@click.option("--rounds", default=300, show_default=True)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(rounds: int, json_file: str | None) -> None:
    chosen = device.choose()
    table = Table("call", "python [us]", "done [ms]", title=machine.processor())
    renderer = clpt.Renderer(scene(), queue=chosen.queue)
    for name, call in calls(renderer).items():
        python, done = measure(call, rounds)
        table.add_row(name, f"{python:.0f}", f"{done:.2f}")
        row = {"device": chosen.info.label, "query": name, "python_us": python, "done_ms": done}
        machine.append(json_file, "embedding", [row])
    machine.console().print(table)


if __name__ == "__main__":
    main()
