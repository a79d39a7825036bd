"""Compiling: processor time of a scene's kernels, with `path`, with light paths, with photons.

`python -m bench.compiling [SCENE ...]`. A figure is the time of a process with empty caches, which
compiles all kernels and renders a sample of a small picture, less the time with full caches.
Aimed at: light paths take 1.6 times what `path` alone takes, photons 1.2 times what these take.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
from rich.table import Table

from bench import machine
from clpt.bench.starting import run

INTEGRATORS = {
    "path": "Path(light_paths=0)",
    "light paths": "Path(light_paths=1)",
    "photons": "Vcm()",
}
CHILD = """
import dataclasses, sys
import clpt
from clpt.scene.integrators import Path, Vcm
scene = clpt.load(sys.argv[1])
film = dataclasses.replace(scene.film, width=16, height=12, crop=None)
renderer = clpt.Renderer(dataclasses.replace(scene, film=film, integrator=eval(sys.argv[2])))
renderer.run(1)
"""


def measure(scene: str, rounds: int) -> Iterator[dict[str, Any]]:
    """Yield a row for each integrator; processor time in seconds, the median of all rounds."""
    taken: dict[str, list[float]] = {name: [] for name in INTEGRATORS}
    for _ in range(rounds):
        for name, integrator in INTEGRATORS.items():
            command = [sys.executable, "-c", CHILD, scene, integrator]
            with tempfile.TemporaryDirectory() as caches:
                cold, warm = (run(command, Path(caches))[1] for _ in range(2))
            taken[name].append(cold - warm)
    for name, seconds in taken.items():
        yield {"scene": scene, "integrator": name, "cpu": round(statistics.median(seconds), 2)}


@click.command(help=__doc__)
@click.argument("scenes", nargs=-1)
@click.option("--rounds", default=3, show_default=True)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(scenes: tuple[str, ...], rounds: int, json_file: str | None) -> None:
    table = Table("scene", "integrator", "processor time", "of path", title="Compiling")
    for scene in scenes or ("scenes/bulb",):
        rows = list(measure(scene, rounds))
        machine.append(json_file, "compiling", rows)
        for row in rows:
            share = row["cpu"] / rows[0]["cpu"]
            table.add_row(scene, row["integrator"], f"{row['cpu']:.1f} s", f"{share:.2f}")
    machine.console().print(table)


if __name__ == "__main__":
    main()
