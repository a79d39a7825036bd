"""What an effect of wavelengths costs: a ball with it, beside the same ball without.

The same scene but for one material, light or film, in the same process, taking turns: seconds as a
ratio, and, at equal samples, the ratio of the variances of the two pictures, each relative to its
own squared brightness. The ball stands on a table under a lamp and a sky.
"""

from __future__ import annotations

import dataclasses
import statistics
import time
from collections.abc import Callable
from typing import Any

import click
import numpy as np
from rich.table import Table

import clpt
from bench import machine
from clpt import spectra
from clpt import transforms as tf
from clpt.scene import Film, Scene, materials
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path
from clpt.scene.lights import Area, Constant
from clpt.scene.shapes import Rectangle, Sphere

SIDE = 192  # pixels
UP = np.array([0.0, 1.0, 0.0])


def ball(material: materials.Material) -> Scene:
    """A ball of a material on a grey table under a lamp and a dim sky."""
    lamp = tf.translate([0.5, 3.0, 0.5]) @ tf.rotate([1, 0, 0], 90) @ tf.scale(0.7)
    floor = tf.translate([0, -1, 0]) @ tf.rotate([1, 0, 0], -90) @ tf.scale(4.0)
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 1, 4], [0, 0, 0], UP), fov=32.0),
        shapes=[
            Sphere(material=material),
            Rectangle(material=materials.Diffuse(), to_world=floor),
            Rectangle(
                material=materials.Diffuse(reflectance=0.0),
                emission=Area(radiance=(12.0, 12.0, 12.0)),
                to_world=lamp,
            ),
        ],
        lights=[Constant(radiance=(0.4, 0.4, 0.4))],
        integrator=Path(max_depth=8),
        film=Film(width=SIDE, height=SIDE),
    )


def with_film(scene: Scene, **changes: Any) -> Scene:
    """The scene with another film."""
    return dataclasses.replace(scene, film=dataclasses.replace(scene.film, **changes))


SF11 = spectra.glass("sf11")
EVEN = float(SF11.sample(550.0))

# name: the scene with the effect, and without
EFFECTS: dict[str, Callable[[], tuple[Scene, Scene]]] = {
    "dispersion, smooth": lambda: (
        ball(materials.Dielectric(int_ior=SF11)),
        ball(materials.Dielectric(int_ior=EVEN)),
    ),
    "dispersion, rough": lambda: (
        ball(materials.RoughDielectric(int_ior=SF11)),
        ball(materials.RoughDielectric(int_ior=EVEN)),
    ),
}


def noise(images: np.ndarray) -> float:
    """Mean over the pixels of the variance between exposures over the squared brightness."""
    bright = images.mean(axis=(0, -1)) ** 2
    return float((images.var(axis=0, ddof=1).mean(axis=-1) / np.maximum(bright, 1e-4)).mean())


def compare(name: str, spp: int, rounds: int) -> dict[str, object]:
    """A record: what the effect costs in time, and in variance at equal samples."""
    renderers = [clpt.Renderer(scene) for scene in EFFECTS[name]()]
    images: list[list[np.ndarray]] = [[], []]
    seconds: list[list[float]] = [[], []]
    for number in range(rounds + 1):
        for renderer, taken, spent in zip(renderers, images, seconds, strict=True):
            renderer.wavefronts[0].clear()
            start = time.perf_counter()
            renderer.step(spp)
            image = renderer.image()
            if number > 0:  # the first one warms up
                taken.append(image)
                spent.append(time.perf_counter() - start)
    with_it, without = (noise(np.array(taken)) for taken in images)
    pixels = SIDE * SIDE * spp * 1e-6
    return {
        "effect": name,
        "msamples": pixels / statistics.median(seconds[0]),
        "msamples_without": pixels / statistics.median(seconds[1]),
        "time_ratio": statistics.median(a / b for a, b in zip(*seconds, strict=True)),
        "variance_ratio": with_it / without,
    }


@click.command(help=__doc__)
@click.option("--effect", "effects", multiple=True, type=click.Choice(list(EFFECTS)))
@click.option("--spp", default=16, show_default=True)
@click.option("--rounds", default=8, show_default=True, help="times that each one has its turn")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(effects: tuple[str, ...], spp: int, rounds: int, json_file: str | None) -> None:
    table = Table("effect", "Msamples/s", "without", "time", "variance", title=machine.processor())
    for name in effects or EFFECTS:
        row = compare(name, spp, rounds)
        machine.append(json_file, "effects", [row])
        table.add_row(name, *(f"{value:.3f}" for value in list(row.values())[1:]))
    machine.console().print(table)


if __name__ == "__main__":
    main()
