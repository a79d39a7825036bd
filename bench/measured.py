"""Costs of measured materials: a picture beside a picture of the metal that was measured.

Both are rough metals of the same roughness, on a ball that fills the picture, in even light and by
a lamp. The measurement has the size of Dupuy and Jakob's: 8 viewers, 195
wavelengths, 32 x 32 directions; where it is anisotropic, 16 azimuths of each viewer, and 24
wavelengths. A table of MERL has 90 x 90 x 180. Two renderers in a process take the same samples
in turns; the share is the median over rounds of pairs.
"""

from __future__ import annotations

import statistics
import time
from contextlib import ExitStack

import click
import numpy as np
from numpy.typing import NDArray
from rich.table import Table

import clpt
from bench import machine
from clpt import measured
from clpt.measured.fit import Reflection
from clpt.scene import Scene, cameras, integrators, lights, materials, shapes

ROUGH = 0.3
NODES = np.linspace(360.0, 1000.0, 195)
HALF = np.linspace(-np.pi, 0.0, 16)

Array = NDArray[np.float64]


def metal(colours: int, across: float = ROUGH) -> Reflection:
    """GGX with Smith's masking, an even reflectance of .8 in so many colours."""

    def masked(w: Array) -> Array:
        slope = (ROUGH * w[:, 0]) ** 2 + (across * w[:, 1]) ** 2
        return 2.0 / (1.0 + np.sqrt(1.0 + slope / np.maximum(w[:, 2], 1e-6) ** 2))

    def f(wo: Array, wi: Array) -> Array:
        h = wo + wi
        h /= np.linalg.norm(h, axis=1, keepdims=True)
        stretched = (h[:, 0] / ROUGH) ** 2 + (h[:, 1] / across) ** 2 + h[:, 2] ** 2
        facets = 1.0 / (np.pi * ROUGH * across * stretched**2)
        both = np.maximum(4.0 * wo[:, 2] * wi[:, 2], 1e-9)
        return np.repeat((0.8 * facets * masked(wo) * masked(wi) / both)[:, None], colours, axis=1)

    return f


def scene(material: materials.Material, side: int, mode: str) -> Scene:
    """A ball in even light, and a lamp."""
    return Scene(
        camera=cameras.Perspective(
            fov=30.0, to_world=clpt.transforms.look_at((0, 0, 4), (0, 0, 0), (0, 1, 0))
        ),
        film=integrators.Film(width=side, height=side, mode=mode),
        shapes=[
            shapes.Sphere(material=material),
            shapes.Sphere(center=(3, 3, 3), radius=0.5, emission=lights.Area(radiance=20.0)),
        ],
        lights=[lights.Constant(radiance=1.0)],
    )


def spent(renderer: clpt.Renderer, samples: int) -> float:
    """Processor time of a picture from its first sample on [s]."""
    renderer.reset().wait()
    start = time.process_time()
    renderer.run(samples)
    return time.process_time() - start


def compare(side: int, samples: int, rounds: int, mode: str) -> list[dict[str, object]]:
    """A record for each kind of measurement."""
    isotropic = measured.fit(metal(len(NODES)), NODES, normals=128)
    stretched = measured.fit(metal(24, 0.15), NODES[::8][:24], phi_i=HALF, normals=64)
    pairs = {
        "isotropic": (ROUGH, materials.Measured(data=isotropic)),
        "anisotropic": (0.15, materials.Measured(data=stretched)),
        "merl": (ROUGH, materials.Merl(data=measured.tabulate(metal(3)))),
    }
    rows: list[dict[str, object]] = []
    for name, (across, material) in pairs.items():
        k = 2.0 * np.sqrt(0.8 / 0.2)
        plain = materials.RoughConductor(eta=1.0, k=k, alpha_u=ROUGH, alpha_v=across)
        with ExitStack() as stack:
            yardstick, other = (
                stack.enter_context(clpt.Renderer(scene(m, side, mode))) for m in (plain, material)
            )
            ratios = []
            for renderer in (yardstick, other):
                renderer.run(1)
            for _ in range(rounds):
                before, seconds, after = (spent(r, samples) for r in (yardstick, other, yardstick))
                ratios.append(2.0 * seconds / (before + after))
            means = [float(renderer.image().mean()) for renderer in (yardstick, other)]
        rows.append({
            "scene": "ball", "mode": mode, "figure": name, "spp": samples,
            "times": round(statistics.median(ratios), 3),
            "all": [round(ratio, 3) for ratio in ratios],
            "means": [round(mean, 4) for mean in means],
        })  # fmt: skip
    return rows


@click.command(help=__doc__)
@click.option("--mode", "modes", multiple=True, default=("rgb", "spectral"))
@click.option("--size", default=256)
@click.option("--spp", default=32)
@click.option("--rounds", default=5)
@click.option("--json", "path", help="Append records to this file.")
def main(modes: tuple[str, ...], size: int, spp: int, rounds: int, path: str | None) -> None:
    rows = [row for mode in modes for row in compare(size, spp, rounds, mode)]
    machine.append(path, "measured", [{**machine.circumstances(), **row} for row in rows])
    table = Table("mode", "measurement", "times the metal's", "rounds", "means")
    for row in rows:
        table.add_row(*(str(row[key]) for key in ("mode", "figure", "times", "all", "means")))
    machine.console().print(table)


if __name__ == "__main__":
    main()
