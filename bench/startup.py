"""Whole processes: seconds from the shell to a picture, with caches and without, and peak memory.

`clpt render` of the Cornell box at 256x256 with 16 samples, and the same by Mitsuba; cold is with
empty cache folders of everything involved but Python's bytecode. Memory is the largest resident
set of a process that renders the atrium, when it compiles kernels (cold) and when it finds them in
caches. What else is installed matters: trimesh imports scipy where it finds it, so `--python` names
the Python of an environment that has clpt and nothing more.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import click
from rich.table import Table

from bench import machine
from bench.scenes import write_atrium, write_cornell
from bench.workers import find_llvm

MITSUBA = """
import sys
import mitsuba
mitsuba.set_variant("llvm_ad_" + sys.argv[2])
scene = mitsuba.load_file(sys.argv[1], res=sys.argv[3])
image = mitsuba.render(scene, spp=int(sys.argv[4]))
mitsuba.Bitmap(image).write(sys.argv[5])
"""
SIZES = {"cornell": (256, 16), "atrium": (256, 16)}  # a side's pixels, spp


@dataclass(frozen=True)
class Process:
    """What a process took: seconds from start to end, of processor time, peak memory in bytes."""

    seconds: float
    cpu: float
    memory: int


def run(command: Sequence[str], caches: Path) -> Process:
    """Run a command whose caches lie in a folder. Raises SystemExit with its words if it fails."""
    variables = {
        "HOME": caches,
        "XDG_CACHE_HOME": caches / "xdg",
        "POCL_CACHE_DIR": caches / "pocl",
    }
    os.makedirs(variables["POCL_CACHE_DIR"], exist_ok=True)
    kept = {n: value for n, value in os.environ.items() if n != "PYTHONDONTWRITEBYTECODE"}
    environment = {**kept, **{name: str(path) for name, path in variables.items()}}
    with tempfile.TemporaryFile("w+") as output:
        start = time.perf_counter()
        process = subprocess.Popen(
            command, env=environment, cwd=machine.ROOT, stdout=output, stderr=output
        )
        _, status, usage = os.wait4(process.pid, 0)
        seconds = time.perf_counter() - start
        if status:
            output.seek(0)
            raise SystemExit(f"{' '.join(command)}: failed\n{output.read()}")
    process.returncode = 0
    return Process(seconds, usage.ru_utime + usage.ru_stime, usage.ru_maxrss * 1024)


def commands(scene: Path, mode: str, out: Path, python: str) -> dict[str, list[str]]:
    """What renders a scene, by renderer."""
    size, spp = SIZES[scene.stem]
    ours = ["-m", "clpt", "render", str(scene), "--mode", mode, "--size", f"{size}x{size}"]
    theirs = ["-c", MITSUBA, str(scene), mode, str(size), str(spp), str(out)]
    return {
        "clpt": [python, *ours, "--spp", str(spp), "--quiet", "-o", str(out)],
        "mitsuba": [sys.executable, *theirs],
    }


def measure(folder: Path, mode: str, rounds: int, python: str) -> list[dict]:
    """A row for each renderer."""
    find_llvm()
    cornell = commands(write_cornell(folder), mode, folder / "out.exr", python)
    atrium = commands(write_atrium(folder), mode, folder / "out.exr", python)
    rows = []
    for renderer in cornell:
        cold, warm = [], []
        for n in range(rounds):
            caches = folder / f"{renderer}{n}"
            cold.append(run(cornell[renderer], caches))
            warm.append(run(cornell[renderer], caches))
        rows.append(
            {
                "renderer": renderer,
                "mode": mode,
                "cold": statistics.median(process.seconds for process in cold),
                "warm": statistics.median(process.seconds for process in warm),
                "cold_cpu": statistics.median(process.cpu for process in cold),
                "warm_cpu": statistics.median(process.cpu for process in warm),
                "memory_cold": run(atrium[renderer], caches).memory,
                "memory": run(atrium[renderer], caches).memory,
            }
        )
    rows[0]["memory_ratio"] = rows[0]["memory"] / rows[1]["memory"]
    return rows


@click.command(help=__doc__)
@click.option("--mode", "modes", multiple=True, default=("rgb", "spectral"), show_default=True)
@click.option("--rounds", default=3, show_default=True)
@click.option("--python", default=sys.executable, help="which one runs clpt")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(modes: tuple[str, ...], rounds: int, python: str, json_file: str | None) -> None:
    table = Table("renderer", "mode", "cold", "warm", "memory", title="Whole processes (CPU time)")
    with tempfile.TemporaryDirectory() as folder:
        for mode in modes:
            rows = measure(Path(folder), mode, rounds, python)
            machine.append(json_file, "startup", rows)
            for row in rows:
                seconds = (
                    f"{row[name]:.2f} s ({row[f'{name}_cpu']:.2f} s)" for name in ("cold", "warm")
                )
                table.add_row(row["renderer"], mode, *seconds, f"{row['memory'] / 2**20:.0f} MiB")
    machine.console().print(table)


if __name__ == "__main__":
    main()
