"""Adaptive sampling beside as many samples everywhere: what error a second of rendering leaves.

The three scenes of `bench.peer_scenes` in RGB, both in turns in a process: squares of 16x16 pixels
get samples until their noise is below a limit, then every pixel gets their mean number. The
variance over several seeds gives the relative mean squared error of the picture, and of its
noisiest squares (the 99th percentile). Efficiency is 1 over error and time, as a ratio.
"""

from __future__ import annotations

import dataclasses
import statistics
import tempfile
import time
from pathlib import Path

import click
import numpy as np
from rich.table import Table

import clpt
from bench import machine
from bench.peer_scenes import SCENES
from clpt.formats import load
from clpt.render.wavefront.path_buffers import SIDE
from clpt.scene import Scene

WORST = 99  # percentile of the squares


def scene(name: str, size: int, folder: Path) -> Scene:
    """Return a scene in RGB."""
    loaded = load(SCENES[name](folder), res=size)
    return dataclasses.replace(loaded, film=dataclasses.replace(loaded.film, mode="rgb"))


def errors(pictures: list[np.ndarray]) -> tuple[float, float]:
    """The relative mean squared error of luminance: of the picture, and of its noisiest squares.

    pictures: (h, w, 3) each, of several seeds; the sides are multiples of that of a square.
    """
    luminance = np.array(pictures) @ [0.2126, 0.7152, 0.0722]
    mean = luminance.mean(axis=0)
    relative = luminance.var(axis=0, ddof=1) / (mean + 0.01 * mean.mean()) ** 2
    rows, columns = (n // SIDE for n in relative.shape)
    squares = relative.reshape(rows, SIDE, columns, SIDE).mean(axis=(1, 3))
    return float(squares.mean()), float(np.percentile(squares, WORST))


def compare(name: str, size: int, most: int, limit: float, seeds: int) -> dict[str, object]:
    """A record: both ways' time, and errors at as many samples in the mean."""
    with tempfile.TemporaryDirectory() as folder:
        plan = scene(name, size, Path(folder))
        renderer = clpt.Renderer(plan)
    pictures: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    seconds: tuple[list[float], list[float]] = ([], [])
    drawn: list[float] = []
    for seed in range(seeds + 1):
        spp = 16
        for way in (0, 1):
            renderer.update(scene=dataclasses.replace(plan, seed=seed))
            start = time.process_time()
            renderer.run(most if way == 0 else spp, noise=limit if way == 0 else None)
            image = renderer.image()
            spent = time.process_time() - start
            if way == 0:
                spp = max(1, round(renderer._wavefront.counts.samples / size**2))
            if seed > 0:  # the first warms up
                pictures[way].append(image)
                seconds[way].append(spent)
                drawn.append(spp)
    adaptive, uniform = (errors(taken) for taken in pictures)
    ratio = statistics.median(u / a for a, u in zip(*seconds, strict=True))
    return {
        "scene": name,
        "limit": limit,
        "spp": statistics.mean(drawn),
        "seconds": statistics.median(seconds[0]),
        "time": ratio,
        "error": adaptive[0],
        "error_uniform": uniform[0],
        "efficiency": ratio * uniform[0] / adaptive[0],
        "worst": adaptive[1],
        "worst_uniform": uniform[1],
        "efficiency_worst": ratio * uniform[1] / adaptive[1],
    }


@click.command(help=__doc__)
@click.option("--scene", "names", multiple=True, type=click.Choice(list(SCENES)))
@click.option(
    "--limit", default=0.08, show_default=True, help="noise below which a square is finished"
)
@click.option("--most", default=1024, show_default=True, help="samples of a pixel")
@click.option("--size", default=128, show_default=True, help="pixels of a side")
@click.option("--seeds", default=6, show_default=True, help="pictures from which errors are told")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    names: tuple[str, ...],
    limit: float,
    most: int,
    size: int,
    seeds: int,
    json_file: str | None,
) -> None:
    headings = ["scene", "limit", "spp", "seconds", "uniform's time", "error", "uniform", "better"]
    headings += ["worst squares", "uniform", "better"]
    table = Table(*headings, title=machine.processor())
    for name in names or SCENES:
        row = compare(name, size, most, limit, seeds)
        machine.append(json_file, "noise", [row])
        table.add_row(name, *(f"{value:.3g}" for value in list(row.values())[1:]))
    machine.console().print(table)


if __name__ == "__main__":
    main()
