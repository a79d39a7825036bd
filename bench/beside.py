"""Two checkouts of clpt beside each other: what a change costs, stage by stage.

`python -m bench.beside CHECKOUT` renders the scenes of `bench.peer_scenes` with that checkout and
with this checkout, in two processes that take turns on a core. A figure is the median of the ratios
of neighbouring runs, this checkout's seconds over the other's: below 1 this checkout is faster. The
device times kernels, so other work on it counts in both.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import click
from rich.table import Table

from bench import machine
from bench.peer_scenes import SCENES

CHILD = """
import dataclasses, json, sys, clpt
path, mode, spp = sys.argv[1], sys.argv[2], int(sys.argv[3])
scene = clpt.load(path)
scene = dataclasses.replace(scene, spp=spp, film=dataclasses.replace(scene.film, mode=mode))
renderer = clpt.Renderer(scene, profiling=True, looped=False)
timings = renderer._wavefront.timings
while True:
    renderer.run(spp)
    print(json.dumps({name: t.seconds for name, t in timings.collect().items()}), flush=True)
    if not sys.stdin.readline():
        break
"""


class Side:
    """A checkout that renders a scene again and again, when it is asked."""

    def __init__(self, checkout: Path, scene: Path, mode: str, spp: int):
        self.process = subprocess.Popen(
            [sys.executable, "-c", CHILD, str(scene), mode, str(spp)],
            cwd=checkout,
            env={**os.environ, "PYTHONPATH": str(checkout), "POCL_MAX_PTHREAD_COUNT": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self.sums = self._read()

    def run(self) -> dict[str, float]:
        """Render once more; return the seconds of each stage."""
        assert self.process.stdin is not None
        self.process.stdin.write("again\n")
        self.process.stdin.flush()
        before, self.sums = self.sums, self._read()
        return {name: self.sums[name] - before[name] for name in before}

    def close(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait()

    def _read(self) -> dict[str, float]:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise click.ClickException("a checkout does not render; run it by hand to see why")
        sums: dict[str, float] = json.loads(line)
        return sums


def compare(other: Path, scene: Path, mode: str, spp: int, rounds: int) -> dict[str, float]:
    """Return the ratio of each stage, and of all, this checkout over the other."""
    sides = [Side(checkout, scene, mode, spp) for checkout in (other, machine.ROOT)]
    pairs = [[side.run() for side in sides] for _ in range(rounds)]
    for side in sides:
        side.close()
    stages = [name for name in pairs[0][0] if name in pairs[0][1]]
    ratios = {n: statistics.median(new[n] / old[n] for old, new in pairs) for n in stages}
    whole = (sum(new.values()) / sum(old.values()) for old, new in pairs)
    return {"all": statistics.median(whole), **ratios}


@click.command(help=__doc__)
@click.argument("checkout", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--scene", "names", multiple=True, type=click.Choice(list(SCENES)))
@click.option("--mode", "modes", multiple=True, default=["rgb"], show_default=True)
@click.option("--spp", default=16, show_default=True)
@click.option("--rounds", default=20, show_default=True)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    checkout: Path,
    names: tuple[str, ...],
    modes: tuple[str, ...],
    spp: int,
    rounds: int,
    json_file: str | None,
) -> None:
    if hasattr(os, "sched_setaffinity"):  # both on a single core
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    commit = ["git", "-C", str(checkout), "rev-parse", "--short", "HEAD"]
    process = subprocess.run(commit, capture_output=True, text=True)
    table = Table("scene", "mode", "stage", "seconds, new / old")
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        for name in names or SCENES:
            path = SCENES[name](Path(folder))
            for mode in modes:
                ratios = compare(checkout.resolve(), Path(path), mode, spp, rounds)
                stages = ", ".join(f"{n} {r:.3f}" for n, r in ratios.items() if n != "all")
                about = {"scene": name, "mode": mode, "spp": spp, "rounds": rounds}
                about |= {"other": process.stdout.strip()}
                rows.append({**about, "ratio": ratios["all"], "stages": stages})
                for stage, ratio in ratios.items():
                    table.add_row(name, mode, stage, f"{ratio:.3f}")
    machine.console().print(table)
    machine.append(json_file, "beside", rows)


if __name__ == "__main__":
    main()
