"""Pictures against Mitsuba's: samples a second, error, and how far they bring each other.

The same scene in the same run, both renderers held to the same cores, taking turns, so that a noisy
minute meets both. Time is that of the render call until the picture is on the host, with everything
compiled before. Efficiency is 1 / (relative MSE x seconds), over all pixels; "trimmed" leaves out
the worst 1 % of them (bench.reference has the formula). A result that cannot be true, not finite or
with a mean 2 % off, is refused.
"""

from __future__ import annotations

import os
import statistics
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import click
import numpy as np
from rich.table import Table

from bench import machine
from bench.peer_scenes import SCENES as PLAIN
from bench.reference import Reference, mean_error, reference
from bench.varied import SCENES as VARIED
from bench.workers import Shot, Worker

MODES = ("rgb", "spectral")
SCENES = {**PLAIN, **VARIED}
CONTENDERS = (
    ("clpt", "sobol"),
    ("mitsuba", "multijitter"),
    ("clpt", "independent"),
    ("mitsuba", "independent"),
)
RIVAL = {"sobol": "multijitter", "independent": "independent"}  # each renderer's best, and the same
TRIM = 0.01


class ImpossibleError(Exception):
    """A measured picture that cannot be right."""


def figures(worker: Worker, shots: Sequence[Shot], spp: int, against: Reference) -> dict:
    """What a renderer's shots of the same settings amount to."""
    images = np.stack([shot.image for shot in shots]).astype(np.float64)
    who = f"{worker.about} ({worker.sampler})"
    if not np.isfinite(images).all():
        raise ImpossibleError(f"{who}: the picture holds values that are not finite")
    radiance = images.mean((0, 1, 2))
    ratio = radiance / against.radiance
    error = against.radiance_se / against.radiance
    if len(shots) > 1:
        noise = mean_error(images.var(0, ddof=1) / len(shots)) / radiance
        error = ratio * np.hypot(error, noise)
    if (np.abs(ratio - 1) > 0.02).any():
        raise ImpossibleError(f"{who}: mean radiance is {ratio.round(4)} of the reference's")
    seconds = statistics.median(shot.seconds for shot in shots)
    full = float(np.mean([against.relative_mse(image) for image in images]))
    trimmed = float(np.mean([against.relative_mse(image, TRIM) for image in images]))
    pixels = images.shape[1] * images.shape[2]
    return {
        "renderer": worker.renderer,
        "version": worker.about,
        "sampler": worker.sampler,
        "spp": spp,
        "seconds": seconds,
        "cpu_seconds": statistics.median(shot.cpu for shot in shots),
        "msamples": spp * pixels / seconds * 1e-6,
        "relmse": full,
        "relmse_trimmed": trimmed,
        "efficiency": 1 / (full * seconds),
        "efficiency_trimmed": 1 / (trimmed * seconds),
        "mean": radiance.round(5).tolist(),
        "mean_ratio": ratio.round(5).tolist(),
        "mean_ratio_se": error.round(5).tolist(),
    }


def compare(
    scene: Path, mode: str, spp: int, rounds: int, against: Reference, cores: Sequence[int]
) -> list[dict]:
    """A row for each renderer and sampler, clpt's with `ratio` to its rival's figures."""
    workers = [Worker(who, scene, mode, sampler, cores) for who, sampler in CONTENDERS]
    shots: list[list[Shot]] = [[] for _ in workers]
    for number in range(rounds + 1):
        for worker, taken in zip(workers, shots, strict=True):
            shot = worker.render(spp, number)
            if number > 0:  # the first compiles
                taken.append(shot)
    rows = [figures(w, taken, spp, against) for w, taken in zip(workers, shots, strict=True)]
    for row, ours in zip(rows, shots, strict=True):
        if row["renderer"] == "clpt":
            index = CONTENDERS.index(("mitsuba", RIVAL[row["sampler"]]))
            rival, pairs = rows[index], list(zip(ours, shots[index], strict=True))
            faster = statistics.median(b.seconds / a.seconds for a, b in pairs)
            row["speed_ratio"] = faster
            row["cpu_ratio"] = statistics.median(b.cpu / a.cpu for a, b in pairs)
            for which in ("", "_trimmed"):
                gain = rival[f"relmse{which}"] / row[f"relmse{which}"]
                row[f"efficiency{which}_ratio"] = faster * gain
    rows[0]["stages"] = workers[0].stages(min(spp, 16))
    for worker in workers:
        worker.close()
    about = {"scene": scene.stem, "mode": mode, "threads": len(cores)}
    return [{**about, **row} for row in rows]


def shown(rows: Sequence[dict]) -> Iterator[list[str]]:
    """Rows as cells of a table."""
    for row in rows:
        ratio = [row.get(key) for key in ("speed_ratio", "cpu_ratio", "efficiency_ratio")]
        off = np.subtract(row["mean_ratio"], 1) * 100
        worst = int(np.abs(off).argmax())
        yield [
            row["scene"],
            row["mode"],
            row["renderer"],
            row["sampler"],
            f"{row['msamples']:.3f}",
            f"{row['relmse']:.4f}",
            f"{row['relmse_trimmed']:.4f}",
            f"{row['efficiency']:.2f}",
            *("" if value is None else f"{value:.2f}" for value in ratio),
            f"{off[worst]:+.2f} ± {row['mean_ratio_se'][worst] * 100:.2f} %",
        ]


HEADINGS = (
    "scene", "mode", "renderer", "sampler", "Msamples/s", "relMSE", "trimmed", "efficiency",
    "speed : Mitsuba", "by CPU time", "efficiency : Mitsuba", "mean - reference",
)  # fmt: skip


@click.command(help=__doc__)
@click.option("--scene", "scenes", multiple=True, type=click.Choice(list(SCENES)))
@click.option("--mode", "modes", multiple=True, type=click.Choice(MODES))
@click.option("--spp", default=64, show_default=True)
@click.option("--rounds", default=3, show_default=True, help="times that each one has its turn")
@click.option("--threads", default=1, show_default=True, help="cores that each is held to")
@click.option("--first-core", default=0, show_default=True)
@click.option("--reference", "converged", default=1024, show_default=True, help="its spp")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    scenes: tuple[str, ...],
    modes: tuple[str, ...],
    spp: int,
    rounds: int,
    threads: int,
    first_core: int,
    converged: int,
    json_file: str | None,
) -> None:
    cores = range(first_core, first_core + threads)
    every = sorted(os.sched_getaffinity(0))
    table = Table(*HEADINGS, title=f"{machine.processor()}, {threads} thread(s), {spp} spp")
    with tempfile.TemporaryDirectory() as folder:
        for name in scenes or SCENES:
            path = SCENES[name](Path(folder))
            for mode in modes or MODES:
                against = reference(path, mode, converged, every)
                try:
                    rows = compare(path, mode, spp, rounds, against, cores)
                except ImpossibleError as error:
                    raise SystemExit(f"{name}, {mode}: refused: {error}") from None
                machine.append(json_file, "renders", rows)
                for cells in shown(rows):
                    table.add_row(*cells)
    machine.console().print(table)


if __name__ == "__main__":
    main()
