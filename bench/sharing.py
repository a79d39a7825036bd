"""Programs that scenes share: what the first picture of another scene takes, and the rate.

`python -m bench.sharing SCENE.xml...` renders each Mitsuba file 200 pixels wide, in the order of
the command, by programs of the scene's own and by shared programs (`--programs`). Each has caches
that are empty at first and then hold the programs of the files before. Figures are seconds of
processor time of whole processes until a picture of a single sample is written, the same once more
with all programs cached, and the rate of shared programs over that of own programs.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import click
from rich.table import Table

from bench import machine
from bench.peer_films import with_film
from bench.peers import Contender

PROGRAMS = ("own", "shared")
WIDTH, SAMPLES, TURNS = 200, 65, 2
Row = dict[str, object]


def figures(contenders: Mapping[str, Contender]) -> Row:
    """Return the figures of a scene, of both kinds of programs."""
    first = {name: contender.render(1, 1) for name, contender in contenders.items()}
    for contender in contenders.values():
        machine.settle(contender.caches)
    again = {name: contender.render(1, 2).cpu for name, contender in contenders.items()}
    full = {name: float("inf") for name in contenders}
    for turn in range(TURNS):
        for name, contender in contenders.items():
            full[name] = min(full[name], contender.render(SAMPLES, turn).cpu - again[name])
    row: Row = {"rate": round(full["own"] / full["shared"], 3)}
    for name in contenders:
        row[f"{name} first"] = round(first[name].cpu, 2)
        row[f"{name} first, clock"] = round(first[name].seconds, 2)
        row[f"{name} cached"] = round(again[name], 2)
    return row


@click.command(help=__doc__)
@click.argument("scenes", nargs=-1, type=click.Path(path_type=Path, exists=True))
@click.option("--mode", type=click.Choice(["rgb", "spectral"]), default="rgb", show_default=True)
@click.option("--threads", default=1, show_default=True, help="cores that all are held to")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(scenes: Sequence[Path], mode: str, threads: int, json_file: str | None) -> None:
    cores = sorted(os.sched_getaffinity(0))[-threads:]
    rows: list[Row] = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for number, scene in enumerate(scenes):
            copy, _ = with_film(scene, folder / str(number), WIDTH, mode)
            contenders = {
                name: Contender(copy, mode, cores, folder / name, ("--programs", name))
                for name in PROGRAMS
            }
            try:
                row = {"scene": machine.scene_name(scene), "mode": mode, **figures(contenders)}
            except RuntimeError as error:
                print(f"{scene}: {error}", file=sys.stderr)
                continue
            print(row, file=sys.stderr, flush=True)
            rows.append(row)
            machine.append(json_file, "sharing", [row])
    if rows:
        table = Table(*rows[0], title=machine.processor())
        for row in rows:
            table.add_row(*map(str, row.values()))
        machine.console().print(table)


if __name__ == "__main__":
    main()
