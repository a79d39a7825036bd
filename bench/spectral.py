"""What wavelengths cost a scene that needs none: spectral beside RGB, at equal samples.

The two modes take turns on the same cores, each in a process of its own. Errors are relative MSEs
against each mode's own reference (bench.reference has the formula); time is that of the render call
until the picture is on the host. The bounds that are asked for: 1.3 of the error, 1.4 of the time.
"""

from __future__ import annotations

import os
import statistics
import tempfile
from collections.abc import Sequence
from pathlib import Path

import click
from rich.table import Table

from bench import machine
from bench.peer_scenes import SCENES
from bench.reference import reference
from bench.renders import MODES, TRIM, ImpossibleError, figures
from bench.workers import Shot, Worker

DIFFUSE = ("cornell", "atrium")  # of bench.peer_scenes, those without a spectral effect
KEPT = ("seconds", "relmse", "relmse_trimmed")


def compare(
    scene: Path, spp: int, rounds: int, converged: int, cores: Sequence[int]
) -> dict[str, object]:
    """A row: the figures of both modes, and their ratios, spectral over RGB."""
    every = sorted(os.sched_getaffinity(0))
    against = {mode: reference(scene, mode, converged, every) for mode in MODES}
    workers = {mode: Worker("clpt", scene, mode, "sobol", cores) for mode in MODES}
    shots: dict[str, list[Shot]] = {mode: [] for mode in MODES}
    for number in range(rounds + 1):
        for mode, worker in workers.items():
            shot = worker.render(spp, number)
            if number > 0:  # the first compiles
                shots[mode].append(shot)
    results = {mode: figures(workers[mode], shots[mode], spp, against[mode]) for mode in MODES}
    for worker in workers.values():
        worker.close()
    row: dict[str, object] = {"scene": scene.stem, "spp": spp, "threads": len(cores)}
    row |= {f"{name}_{mode}": results[mode][name] for mode in MODES for name in KEPT}
    for name in ("relmse", "relmse_trimmed"):
        row[f"{name}_ratio"] = results["spectral"][name] / results["rgb"][name]
    pairs = list(zip(shots["spectral"], shots["rgb"], strict=True))
    row["time_ratio"] = statistics.median(a.seconds / b.seconds for a, b in pairs)
    row["cpu_ratio"] = statistics.median(a.cpu / b.cpu for a, b in pairs)
    return row


@click.command(help=__doc__)
@click.option("--scene", "scenes", multiple=True, type=click.Choice(list(SCENES)))
@click.option("--spp", default=64, show_default=True)
@click.option("--rounds", default=5, show_default=True, help="times that each mode has its turn")
@click.option("--threads", default=1, show_default=True, help="cores that each is held to")
@click.option("--first-core", default=0, show_default=True)
@click.option("--reference", "converged", default=1024, show_default=True, help="its spp")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    scenes: tuple[str, ...],
    spp: int,
    rounds: int,
    threads: int,
    first_core: int,
    converged: int,
    json_file: str | None,
) -> None:
    cores = range(first_core, first_core + threads)
    names = (f"relMSE RGB / spectral (trimmed {TRIM:.0%})", "error ratio", "time ratio", "by CPU")
    table = Table("scene", *names, title=f"{machine.processor()}, {threads} thread(s), {spp} spp")
    with tempfile.TemporaryDirectory() as folder:
        for name in scenes or DIFFUSE:
            try:
                row = compare(SCENES[name](Path(folder)), spp, rounds, converged, cores)
            except ImpossibleError as error:
                raise SystemExit(f"{name}: refused: {error}") from None
            machine.append(json_file, "spectral", [row])
            table.add_row(
                name,
                f"{row['relmse_rgb']:.4f} ({row['relmse_trimmed_rgb']:.4f}) / "
                f"{row['relmse_spectral']:.4f} ({row['relmse_trimmed_spectral']:.4f})",
                f"{row['relmse_ratio']:.2f} ({row['relmse_trimmed_ratio']:.2f})",
                f"{row['time_ratio']:.2f}",
                f"{row['cpu_ratio']:.2f}",
            )
    machine.console().print(table)


if __name__ == "__main__":
    main()
