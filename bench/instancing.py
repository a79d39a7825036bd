"""Instances of a mesh of 80,000 triangles: memory, time to build and rays, beside copies of it."""

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


def scene(things: list[Shape]) -> Scene:
    """The things under an even sky, seen from above."""
    view = tf.look_at([0, 40, 60], [0, 0, 0], [0, 1, 0])
    return Scene(
        camera=Perspective(to_world=view, fov=40),
        shapes=things,
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


def measure(name: str, things: list[Shape]) -> dict[str, object]:
    """Render twice; rays are counted the second time."""
    renderer = clpt.Renderer(scene(things))
    renderer.step(SPP)
    before = renderer.wavefronts[0].counts.rays
    start = time.perf_counter()
    renderer.step(SPP)
    rays = (renderer.wavefronts[0].counts.rays - before) / (time.perf_counter() - start)
    facts = renderer.facts
    return {
        "scene": name,
        "triangles seen": facts.triangles_instanced,
        "MiB": (sum(facts.trees.values()) + sum(facts.tables.values())) / 2**20,
        "seconds to lower": facts.seconds["lower"],
        "seconds for trees": facts.seconds["trees"],
        "Mrays/s": rays / 1e6,
    }


@click.command(help=__doc__)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(json_file: str | None) -> None:
    mesh = bumpy()
    group = Group((mesh,))
    cases: dict[str, list[Shape]] = {"one mesh": [mesh]}
    for count in (100, 1000, 20000):
        cases[f"{count} instances"] = [Instance(group=group, to_world=m) for m in spread(count)]
    cases["100 copies"] = [dataclasses.replace(mesh, to_world=m) for m in spread(100)]
    rows = []
    for name, things in cases.items():
        rows.append(measure(name, things))
        machine.append(json_file, "instancing", rows[-1:])
    table = Table(*rows[0], title=machine.processor())
    for row in rows:
        table.add_row(*(f"{v:,.4g}" if isinstance(v, float) else str(v) for v in row.values()))
    machine.console().print(table)


if __name__ == "__main__":
    main()
