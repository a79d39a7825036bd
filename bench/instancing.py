"""Instances: memory, time to build and rays.

A mesh of 80,000 triangles, beside copies of it; tufts of grass of 5,000 triangles whose boxes stand
side by side, or so that twenty of them are over a point. Rays are counted by processor time.
"""

from __future__ import annotations

import dataclasses
import time

import click
import numpy as np
from rich.table import Table

import clpt
from bench import machine
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path
from clpt.scene.lights import Constant
from clpt.scene.shapes import Group, Instance, Mesh, Shape

SPP = 4
WIDE = 1.6  # of a tuft's box [m]


def bumpy(side: int = 200) -> Mesh:
    """A ball with bumps of 2 side^2 triangles."""
    u, v = np.meshgrid(
        np.linspace(0, 2 * np.pi, side + 1), np.linspace(0.01, np.pi - 0.01, side + 1)
    )
    radius = 1.0 + 0.1 * np.sin(9 * u) * np.sin(7 * v)
    ring = np.stack([np.sin(v) * np.cos(u), np.cos(v), np.sin(v) * np.sin(u)], axis=-1)
    first = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).reshape(-1, 1)
    corners = np.array([0, 1, side + 2, 0, side + 2, side + 1])
    vertices = (radius[..., None] * ring).reshape(-1, 3).astype(np.float32)
    return Mesh(vertices=vertices, faces=(first + corners).reshape(-1, 3).astype(np.uint32))


def tuft(blades: int = 500, points: int = 6) -> Mesh:
    """Bent blades of grass, 2 (points - 1) triangles each, 1 m high and WIDE across in all."""
    rng = np.random.default_rng(1)
    along = np.linspace(0, 1, points)[:, None]

    def around(low: float, high: float) -> np.ndarray:
        angle, radius = rng.uniform(0, 2 * np.pi, blades), rng.uniform(low, high, blades)
        return np.stack([radius * np.cos(angle), 0 * angle, radius * np.sin(angle)], axis=1)[
            :, None
        ]

    lean, height = around(0.05, 0.5), rng.uniform(0.4, 1.0, (blades, 1, 1)) * [0, 1, 0]
    middle = around(0, 0.3) + lean * along**2 + height * along
    across = 0.008 * np.cross(lean, [0, 1, 0]) / np.linalg.norm(lean, axis=2, keepdims=True)
    width = across * (1.02 - along)
    first = 2 * (np.arange(blades)[:, None] * points + np.arange(points - 1)).reshape(-1, 1)
    return Mesh(
        vertices=np.stack([middle - width, middle + width], axis=2).reshape(-1, 3),
        faces=(first + np.array([0, 1, 3, 0, 3, 2])).reshape(-1, 3).astype(np.uint32),
    )


def meadow(deep: float, count: int = 10000) -> tuple[list[np.ndarray], float]:
    """Where tufts stand, `deep` boxes over a point or in a square grid, and the side [m]."""
    side = WIDE * np.sqrt(count / deep)
    if deep == 1:
        step = np.arange(round(np.sqrt(count))) * WIDE - side / 2
        return [tf.translate([x, 0, z]) for x in step for z in step], side
    rng = np.random.default_rng(3)
    return [
        tf.translate(rng.uniform([-side / 2, 0, -side / 2], [side / 2, 1e-6, side / 2]))
        @ tf.rotate([0, 1, 0], rng.uniform(0, 360))
        @ tf.scale(rng.uniform(0.8, 1.2))
        for _ in range(count)
    ], side


def scene(shapes: list[Shape], side: float = 50.0) -> Scene:
    """The things under an even sky, seen from above; `side` [m] of them fill the picture."""
    view = tf.look_at([0, 0.8 * side, 1.2 * side], [0, 0, 0], [0, 1, 0])
    return Scene(
        camera=Perspective(to_world=view, fov=40),
        shapes=shapes,
        lights=[Constant(radiance=1.0)],
        film=Film(width=160, height=120, mode="rgb"),
        integrator=Path(max_depth=4),
    )


def spread(count: int) -> list[np.ndarray]:
    rng = np.random.default_rng(7)
    return [
        tf.translate(rng.uniform([-25, -2, -25], [25, 2, 25]))
        @ tf.rotate(rng.normal(size=3), rng.uniform(0, 360))
        for _ in range(count)
    ]


def placed(group: Group, matrices: list[np.ndarray]) -> list[Shape]:
    return [Instance(group=group, to_world=matrix) for matrix in matrices]


def measure(name: str, shapes: list[Shape], side: float = 50.0) -> dict[str, object]:
    """Render twice; rays are counted the second time."""
    renderer = clpt.Renderer(scene(shapes, side))
    renderer.run(SPP)
    before = renderer._wavefront.counts.rays
    start = time.process_time()
    renderer.run(SPP)
    rays = (renderer._wavefront.counts.rays - before) / (time.process_time() - start)
    stats = renderer.stats
    return {
        "scene": name,
        "triangles seen": stats.triangles_instanced,
        "MiB": (sum(stats.trees.values()) + sum(stats.tables.values())) / 2**20,
        "seconds to lower": stats.seconds["lower"],
        "seconds for trees": stats.seconds["trees"],
        "Mrays/s a core": rays / 1e6,
    }


@click.command(help=__doc__)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(json_file: str | None) -> None:
    mesh = bumpy()
    group = Group((mesh,))
    cases: dict[str, tuple[list[Shape], float]] = {"one mesh": ([mesh], 50.0)}
    for count in (100, 1000, 20000):
        cases[f"{count} instances"] = placed(group, spread(count)), 50.0
    cases["100 copies"] = [dataclasses.replace(mesh, to_world=m) for m in spread(100)], 50.0
    grass = Group((tuft(),))
    for name, deep in {"side by side": 1, "20 deep": 20}.items():
        matrices, side = meadow(deep)
        cases[f"10000 tufts, {name}"] = placed(grass, matrices), side
    rows = []
    for name, (shapes, side) in cases.items():
        rows.append(measure(name, shapes, side))
        machine.append(json_file, "instancing", rows[-1:])
    table = Table(*rows[0], title=machine.processor())
    for row in rows:
        table.add_row(*(f"{v:,.4g}" if isinstance(v, float) else str(v) for v in row.values()))
    machine.console().print(table)


if __name__ == "__main__":
    main()
