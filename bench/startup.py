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
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import click
from rich.table import Table

from bench import machine
from bench.peer_scenes import write_atrium, write_cornell
from bench.workers import find_llvm
from clpt.benchmark.starting import run

MITSUBA = """
import sys
import mitsuba
mitsuba.set_variant("llvm_ad_" + sys.argv[2])
scene = mitsuba.load_file(sys.argv[1], res=sys.argv[3])
image = mitsuba.render(scene, spp=int(sys.argv[4]))
mitsuba.Bitmap(image).write(sys.argv[5])
"""
SMALL = """
import os, sys
pid = os.posix_spawnp(sys.argv[2], sys.argv[2:], os.environ)
_, status, usage = os.wait4(pid, 0)
open(sys.argv[1], "w").write(str(usage.ru_maxrss))
sys.exit(os.waitstatus_to_exitcode(status))
"""
SIZES = {"cornell": (256, 16), "atrium": (256, 16)}  # a side's pixels, spp


def peak(command: Sequence[str], caches: Path) -> int:
    """The largest resident set of a command [bytes]; raises as `run` does.

    A process counts what the one that started it held, so a small one starts it.
    """
    with tempfile.TemporaryDirectory() as folder:
        kilobytes = Path(folder) / "kilobytes"
        run([sys.executable, "-I", "-S", "-c", SMALL, str(kilobytes), *command], caches)
        return int(kilobytes.read_text()) * 1024


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
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    cornell = commands(write_cornell(folder), mode, folder / "out.exr", python)
    atrium = commands(write_atrium(folder), mode, folder / "out.exr", python)
    rows = []
    for renderer in cornell:
        cold, warm = [], []
        for n in range(rounds):
            caches = folder / f"{renderer}{n}"
            cold.append(run(cornell[renderer], caches))
            machine.settle(caches)
            warm.append(run(cornell[renderer], caches))
        rows.append(
            {
                "renderer": renderer,
                "mode": mode,
                "cold": statistics.median(process.seconds for process in cold),
                "warm": statistics.median(process.seconds for process in warm),
                "cold_cpu": statistics.median(process.cpu for process in cold),
                "warm_cpu": statistics.median(process.cpu for process in warm),
                "memory_cold": peak(atrium[renderer], caches),
                "memory": peak(atrium[renderer], caches),
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
