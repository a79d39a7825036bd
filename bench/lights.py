"""A tree over lights beside choosing them by their power, in rooms full of small lamps.

Rooms stand in a row, each with its share of triangles that shine under its ceiling; the camera
looks at a single room. The two take turns in a process: samples a second, and noise, which is the
variance relative to the squared brightness, at equal samples and at equal time.
"""

from __future__ import annotations

import statistics
import time

import click
import numpy as np
from rich.table import Table

import clpt
from bench import machine
from bench.effects import noise
from clpt import transforms as tf
from clpt.scene import Film, Scene, materials
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path
from clpt.scene.lights import Area
from clpt.scene.shapes import Cube, Mesh, Rectangle, Sphere

SIDE = 96  # pixels
ROOMS = 16
WIDTH = 4.0  # of a room [m]


def lamps(count: int) -> Mesh:
    """Triangles of 5 cm in all rooms, below the ceiling, of uneven power; they face downward."""
    rng = np.random.default_rng(1)
    place = rng.uniform([-WIDTH / 2, 2.2, -1.9], [WIDTH * (ROOMS - 0.5), 2.7, 1.9], (count, 3))
    corners = np.array([(0, 0, 0), (0.05, 0, 0), (0, 0, 0.05)])
    turned = np.stack([corners @ tf.rotate([0, 1, 0], a)[:3, :3] for a in (0, 90, 180, 270)])
    size = rng.uniform(0.5, 2, (count, 1, 1))
    vertices = place[:, None] + turned[rng.integers(0, 4, count)] * size
    return Mesh(
        vertices=vertices.reshape(-1, 3).astype(np.float32),
        faces=np.arange(3 * count).reshape(count, 3),
        material=materials.Diffuse(reflectance=0.0),
        emission=Area(radiance=[1e4 / count * ROOMS / 4] * 3),
    )


def rooms(count: int) -> Scene:
    """So many lamps in ROOMS rooms with a table and a ball each."""
    grey, length = materials.TwoSided(front=materials.Diffuse(reflectance=0.6)), WIDTH * ROOMS
    middle = (length - WIDTH) / 2

    def wall(place: list[float], turn: tuple[list[float], float], size: list[float]) -> Rectangle:
        matrix = tf.translate(place) @ tf.rotate(*turn) @ tf.scale([*size, 1.0])
        return Rectangle(to_world=matrix, material=grey)

    shapes: list = [
        wall([middle, 0, 0], ([1, 0, 0], -90), [length / 2, 2]),
        wall([middle, 3, 0], ([1, 0, 0], 90), [length / 2, 2]),
        wall([middle, 1.5, -2], ([1, 0, 0], 0), [length / 2, 1.5]),
        wall([middle, 1.5, 2], ([1, 0, 0], 0), [length / 2, 1.5]),
        lamps(count),
    ]
    for i in range(ROOMS):
        x = WIDTH * i
        shapes.append(wall([x - WIDTH / 2, 1.5, 0], ([0, 1, 0], 90), [2, 1.5]))
        table = tf.translate([x, 0.4, 0]) @ tf.scale([0.8, 0.4, 0.5])
        shapes.append(Cube(to_world=table, material=materials.Diffuse(reflectance=0.4)))
        shapes.append(Sphere(center=(x, 1.1, 0), radius=0.3, material=materials.RoughPlastic()))
    shapes.append(wall([length - WIDTH / 2, 1.5, 0], ([0, 1, 0], 90), [2, 1.5]))
    x = WIDTH * (ROOMS // 2)
    view = tf.look_at([x - 1.5, 1.6, 1.8], [x, 0.9, 0], [0, 1, 0])
    return Scene(
        camera=Perspective(to_world=view, fov=70.0),
        shapes=shapes,
        integrator=Path(max_depth=4),
        film=Film(width=SIDE, height=SIDE, mode="rgb"),
    )


def renderer(scene: Scene, tree: bool) -> clpt.Renderer:
    """A renderer that uses the tree, or not, whatever the number of lights."""
    usual, scene.TREE_FROM = scene.TREE_FROM, 1 if tree else 1 << 30
    try:
        return clpt.Renderer(scene)
    finally:
        scene.TREE_FROM = usual


def compare(count: int, spp: int, rounds: int) -> dict[str, object]:
    """A record: what the tree costs in time and saves in noise."""
    scene = rooms(count)
    both = [renderer(scene, tree) for tree in (True, False)]
    images: list[list[np.ndarray]] = [[], []]
    seconds: list[list[float]] = [[], []]
    for number in range(rounds + 1):
        for way, taken, spent in zip(both, images, seconds, strict=True):
            way._wavefront.clear()
            start = time.perf_counter()
            way.run(spp)
            image = way.image()
            if number > 0:  # the first warms up
                taken.append(image)
                spent.append(time.perf_counter() - start)
    noises = [noise(np.array(taken)) for taken in images]
    taken_s = [statistics.median(spent) for spent in seconds]
    millions = SIDE * SIDE * spp * 1e-6
    return {
        "lights": count,
        "msamples_tree": millions / taken_s[0],
        "msamples_power": millions / taken_s[1],
        "noise_tree": noises[0],
        "noise_power": noises[1],
        "equal_time": noises[1] * taken_s[1] / (noises[0] * taken_s[0]),
    }


@click.command(help=__doc__)
@click.option("--lights", "counts", multiple=True, type=int)
@click.option("--spp", default=16, show_default=True)
@click.option("--rounds", default=6, show_default=True, help="times that each one has its turn")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(counts: tuple[int, ...], spp: int, rounds: int, json_file: str | None) -> None:
    headings = ("lights", "Msamples/s, tree", "power", "noise, tree", "power", "at equal time")
    table = Table(*headings, title=machine.processor())
    for count in counts or (16, 64, 256, 1024, 10240):
        row = compare(count, spp, rounds)
        machine.append(json_file, "lights", [row])
        table.add_row(*(f"{value:.4g}" for value in row.values()))
    machine.console().print(table)


if __name__ == "__main__":
    main()
