"""Costs of effects of wavelengths: a ball with an effect, beside the same ball without.

The scenes differ in a material, light or film, and take turns in a process: seconds as a
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
from clpt.scene.cameras import Perspective, ThinLens
from clpt.scene.integrators import Path
from clpt.scene.lights import Area, Constant
from clpt.scene.shapes import Rectangle, Sphere
from clpt.scene.textures import Bitmap

SIDE = 192  # pixels
UP = np.array([0.0, 1.0, 0.0])


def ball(material: materials.Material, lamp_spectrum: Any = (12.0, 12.0, 12.0)) -> Scene:
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
                emission=Area(radiance=lamp_spectrum),
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


def through_lens(glass: Any) -> Scene:
    """The ball of grey paint seen through a lens."""
    scene = ball(materials.Diffuse())
    lens = ThinLens(
        to_world=scene.camera.to_world, fov=32.0, aperture_radius=0.05, focus_distance=3.1,
        glass=glass, focal_length=0.5,
    )  # fmt: skip
    return dataclasses.replace(scene, camera=lens)


def chart(image: Any) -> Scene:
    """The ball painted with a texture of noise."""
    return ball(materials.Diffuse(reflectance=Bitmap(image=image)))


SOAP = (materials.Layer(eta="water", thickness=400.0),)
MIRROR = tuple(
    materials.Layer(eta=n, thickness=137.5 / n) for n in (2.4, 1.46, 2.4, 1.46, 2.4, 1.46, 2.4)
)
DYE = spectra.Fluorophore(
    absorption=spectra.Tabulated((380.0, 460.0, 520.0), (0.0, 0.9, 0.0)),
    emission=spectra.Tabulated((480.0, 540.0, 640.0), (0.0, 1.0, 0.0)),
    quantum_yield=0.9,
)
NOISE = np.random.default_rng(1).random((64, 64, 16), np.float32)
BANDS = np.linspace(400.0, 700.0, 16)
SF11 = spectra.glass("sf11")
EVEN = float(SF11.sample(550.0))
ETA, K = spectra.metal("Al")

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
    "absorption": lambda: (
        ball(materials.Dielectric(absorption=(0.2, 0.5, 1.5))),
        ball(materials.Dielectric()),
    ),
    "thin film on glass": lambda: (
        ball(materials.Dielectric(layers=SOAP)),
        ball(materials.Dielectric()),
    ),
    "thin film on rough metal": lambda: (
        ball(materials.RoughConductor(eta=ETA, k=K, layers=SOAP)),
        ball(materials.RoughConductor(eta=ETA, k=K)),
    ),
    "7 films on rough metal": lambda: (
        ball(materials.RoughConductor(eta=ETA, k=K, layers=MIRROR)),
        ball(materials.RoughConductor(eta=ETA, k=K)),
    ),
    "fluorescence": lambda: (
        ball(materials.Fluorescent(reflectance=0.1, reradiation=DYE)),
        ball(materials.Diffuse(reflectance=0.6)),
    ),
    "grating": lambda: (
        ball(materials.Grating(eta=ETA, k=K)),
        ball(materials.Conductor(eta=ETA, k=K)),
    ),
    "lens of glass": lambda: (through_lens(SF11), through_lens(1.5)),
    "sodium light": lambda: (
        ball(materials.Diffuse(), spectra.illuminant("sodium", 12.0)),
        ball(materials.Diffuse(), spectra.illuminant("D65", 12.0)),
    ),
    "spectral texture": lambda: (
        chart(clpt.SpectralImage(NOISE, BANDS, emissive=False)),
        chart(NOISE[:, :, :3]),
    ),
    "film of 32 bands": lambda: (
        with_film(ball(materials.Diffuse()), bands=32),
        ball(materials.Diffuse()),
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
            renderer._wavefront.clear()
            start = time.perf_counter()
            renderer.run(spp)
            image = renderer.image()
            if number > 0:  # the first warms up
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
