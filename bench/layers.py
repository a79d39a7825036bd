"""Costs of layers beside the picture: processor time of a render with and without them.

Two renderers of a scene in a process take the same samples in turns, from the first sample on; the
share is the median over pairs. `--layers` selects sets, `--spp` the number of samples: layers use
the first 64, which cost the most.
"""

from __future__ import annotations

import dataclasses
import statistics
import time
from contextlib import ExitStack

import click
from rich.table import Table

import clpt
from bench import machine
from clpt.errors import ClptError

FOR_DENOISERS = "denoising_albedo,denoising_normal,depth"
SCENES = ("cornell_box", "glass_caustics", "three_spheres")


def spent(renderer: clpt.Renderer, samples: int) -> float:
    """Processor time of a picture from its first sample on [s]."""
    renderer.reset().wait()
    start = time.process_time()
    renderer.run(samples)
    return time.process_time() - start


def compare(
    name: str, sets: tuple[str, ...], side: int, samples: int, rounds: int, mode: str
) -> list[dict[str, object]]:
    """A record for each set of layers of a scene."""
    scene = clpt.load(machine.ROOT / "scenes" / name)
    film = dataclasses.replace(scene.film, width=side, height=side, crop=None, mode=mode)
    with ExitStack() as stack:

        def renderer(layers: tuple[str, ...]) -> clpt.Renderer:
            plan = dataclasses.replace(scene, film=dataclasses.replace(film, layers=layers))
            opened = stack.enter_context(clpt.Renderer(plan))
            opened.run(1)
            return opened

        plain = renderer(())
        with_them = {names: renderer(tuple(names.split(","))) for names in sets}
        shares: dict[str, list[float]] = {names: [] for names in sets}
        for _ in range(rounds):
            for names, with_layers in with_them.items():
                before, layered, after = (spent(r, samples) for r in (plain, with_layers, plain))
                shares[names].append(2.0 * layered / (before + after) - 1.0)
    return [
        {
            "scene": name,
            "mode": mode,
            "figure": names,
            "spp": samples,
            "share": round(statistics.median(each), 4),
            "shares": [round(share, 4) for share in each],
        }
        for names, each in shares.items()
    ]


@click.command(help=__doc__)
@click.option("--scene", "scenes", multiple=True, default=SCENES)
@click.option("--layers", "sets", multiple=True, default=(FOR_DENOISERS,))
@click.option("--mode", "modes", multiple=True, default=("rgb", "spectral"))
@click.option("--size", default=256)
@click.option("--spp", default=32)
@click.option("--rounds", default=5)
@click.option("--json", "path", help="Append records to this file.")
def main(
    scenes: tuple[str, ...],
    sets: tuple[str, ...],
    modes: tuple[str, ...],
    size: int,
    spp: int,
    rounds: int,
    path: str | None,
) -> None:
    rows: list[dict[str, object]] = []
    for name in scenes:
        for mode in modes:
            try:
                medians = compare(name, sets, size, spp, rounds, mode)
            except ClptError as error:
                machine.console().print(f"{name}: {error}")
                continue
            rows += medians
            machine.append(path, "layers", [{**machine.circumstances(), **row} for row in medians])
    table = Table("scene", "mode", "layers", "share", "rounds")
    for row in rows:
        table.add_row(*(str(row[key]) for key in ("scene", "mode", "figure", "share", "shares")))
    machine.console().print(table)


if __name__ == "__main__":
    main()
