"""Noise of a coloured medium beside the noise of grey media.

`python -m bench.media.colours`

The ball of the scene `chroma`, whose extinction is 2, 6 and 9 per metre in red, green and blue,
beside three grey balls with these extinctions: variances over the square of the mean,
at equal samples, without the worst hundredth of the ball's pixels. Ratios of a channel to
the grey ball of its extinction, and of the channels' mean to the grey balls' geometric mean; the
same for luminance. All channels of a grey ball share their paths; in the coloured ball a path's
flights suit a channel best: if they suit no other, a channel's ratio is 3.
"""

from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray

import clpt
from bench import machine
from bench.media.__main__ import HERE, TRIM

OWN = ("0.2", "0.6", "0.9")
LUMINANCE = (0.2126, 0.7152, 0.0722)  # of Rec. 709
BALL = 0.45  # its radius over half of the picture


def variances(file: Path, mode: str, spp: int, passes: int) -> NDArray[np.float64]:
    """The relative variances of the channels, of their mean, and of the luminance (5,)."""
    scene = clpt.load(file)
    scene.film = dataclasses.replace(scene.film, mode=mode)
    pictures = []
    with clpt.Renderer(scene, threads=1) as renderer:
        for seed in range(passes):
            renderer.reset(seed=seed)
            renderer.run(spp)
            pictures.append(np.asarray(renderer.image(), float)[..., :3])
    size = scene.film.height
    y, x = np.mgrid[:size, :size] / (size / 2.0) - 1.0
    ball = np.hypot(x, y) < BALL
    values = np.array(pictures)[:, ball]
    sums = np.stack([values.mean(axis=-1), values @ LUMINANCE], axis=-1)
    values = np.concatenate([values, sums], axis=-1)
    ordered = np.sort(values.var(axis=0, ddof=1), axis=0)
    return ordered[: int(len(ordered) * (1.0 - TRIM))].mean(axis=0) / values.mean(axis=(0, 1)) ** 2


@click.command(help=__doc__)
@click.option("--spp", default=64, show_default=True)
@click.option("--passes", default=48, show_default=True)
@click.option("--mode", "modes", multiple=True, type=click.Choice(["rgb", "spectral"]))
@click.option("--json", "path", type=click.Path(), help="append the figures as JSON lines")
def main(spp: int, passes: int, modes: tuple[str, ...], path: str | None) -> None:
    text = (
        (HERE / "scenes" / "chroma.xml")
        .read_text()
        .replace('"res" value="128"', '"res" value="64"')
    )
    with tempfile.TemporaryDirectory() as folder_name:
        file = Path(folder_name) / "ball.xml"
        for mode in modes or ("rgb", "spectral"):
            rows = []
            for sigma in (", ".join(OWN), *(", ".join([number] * 3) for number in OWN)):
                file.write_text(text.replace(", ".join(OWN), sigma))
                rows.append(variances(file, mode, spp, passes))
            ratios = [rows[0][c] / rows[1 + c][c] for c in range(3)]
            grey = np.exp(np.log(rows[1:]).mean(axis=0))
            row = {
                "mode": mode,
                "channels": [round(float(r), 3) for r in ratios],
                "mean": round(float(rows[0][3] / grey[3]), 3),
                "luminance": round(float(rows[0][4] / grey[4]), 3),
            }
            machine.console().print(row)
            machine.append(path, "colours", [{**machine.circumstances(), **row}])


if __name__ == "__main__":
    main()
