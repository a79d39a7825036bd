"""Starts of processes: a first picture with empty caches, with other scenes' caches, and again.

    python -m bench.starting [SCENE ...] [--json FILE]

Each start is `clpt render SCENE --size 64x64 --spp 1`. Cold: all caches are empty folders. Another:
the caches hold the scenes before it in the list, so the first scene has none. Warm: they hold the
scene. Mitsuba is measured too, cold and warm, if the scene is an XML file: `llvm_ad_rgb`, or
`scalar_rgb`, which compiles nothing, if this LLVM does not support this processor.

Seconds are processor time of the whole tree of processes, even after the command's end; in brackets
by the clock, until the command's end. Instructions are of user mode, where perf counts them. Memory
is the largest resident set of a process, with and without compiling. Python's bytecode exists
before the first start.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from rich.table import Table

from bench import machine
from bench.peer_scenes import write_atrium, write_cornell, write_glass
from bench.workers import find_llvm
from clpt import device
from clpt.bench.starting import CACHES

MITSUBA = """
import sys
import mitsuba
variant, scene, size, out = sys.argv[1:]
mitsuba.set_variant(variant)
image = mitsuba.render(mitsuba.load_file(scene, res=size, spp="1"), spp=1)
mitsuba.Bitmap(image).write(out)
"""
VARIANTS = ("llvm_ad_rgb", "scalar_rgb")
# A small process that starts another: a process counts its starter's memory. It gets
# the other's children too (PR_SET_CHILD_SUBREAPER), and waits for all.
WATCH = """
import ctypes, json, os, resource, sys, time
try:
    ctypes.CDLL(None).prctl(36, 1, 0, 0, 0)
except AttributeError:
    pass
start = time.perf_counter()
pid = os.posix_spawnp(sys.argv[2], sys.argv[2:], os.environ)
_, status = os.waitpid(pid, 0)
seconds = time.perf_counter() - start
try:
    while True:
        os.wait()
except ChildProcessError:
    pass
used = resource.getrusage(resource.RUSAGE_CHILDREN)
with open(sys.argv[1], "w") as file:
    json.dump([seconds, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024], file)
sys.exit(os.waitstatus_to_exitcode(status))
"""
SCENES = ("cornell.xml", "glass.xml", "atrium.xml")  # of bench.peer_scenes
OWN = ("cornell_box", "three_spheres", "table_glasses")  # of scenes/


@dataclass(frozen=True)
class Start:
    """A process and its children: by the clock [s], of processors [s], largest memory [bytes].

    instructions: of user mode; None where they are not counted.
    """

    clock: float
    processor: float
    memory: int
    instructions: int | None = None


def run(command: Sequence[str], caches: Path, checkout: Path = machine.ROOT) -> Start:
    """Run a command in a checkout, its caches in a folder. Raises RuntimeError with its words."""
    folders = {name: str(caches / name.lower()) for name in CACHES}
    for folder in folders.values():
        os.makedirs(folder, exist_ok=True)
    bytecode = {"PYTHONDONTWRITEBYTECODE": "", "PYTHONPYCACHEPREFIX": str(caches.parent / "pyc")}
    with tempfile.TemporaryDirectory() as kept, tempfile.TemporaryFile("w+") as words:
        report, counted = Path(kept) / "report.json", Path(kept) / "counted"
        watch = [sys.executable, "-I", "-S", "-c", WATCH, str(report), *command]
        counting = ["perf", "stat", "-x,", "-e", "instructions:u", "-o", str(counted)]
        done = subprocess.run(
            [*counting, *watch] if _counts() else watch,
            env={**os.environ, **folders, **bytecode}, cwd=checkout,
            stdout=words, stderr=words,
        )  # fmt: skip
        if done.returncode:
            words.seek(0)
            last = words.read().strip().splitlines()[-1:] or [f"status {done.returncode}"]
            raise RuntimeError(last[0])
        return Start(*json.loads(report.read_text()), _counted(counted))


def _counts() -> bool:
    """Whether perf counts instructions here."""
    if shutil.which("perf") is None:
        return False
    trial = ["perf", "stat", "-x,", "-e", "instructions:u", "true"]
    said = subprocess.run(trial, capture_output=True, text=True).stderr
    return said.split(",")[0].isdigit()


def _counted(file: Path) -> int | None:
    """The number in a file of `perf stat -x,`; None where there is none."""
    rows = file.read_text().splitlines() if file.is_file() else []
    numbers = [row.split(",")[0] for row in rows if "instructions" in row]
    return int(numbers[0]) if numbers and numbers[0].isdigit() else None


def measure(
    command: Sequence[str], folder: Path, rounds: int, checkout: Path = machine.ROOT
) -> dict[str, Any]:
    """Return the figures of a cold start, and the least of some warm starts."""
    caches = folder / "caches"
    shutil.rmtree(caches, ignore_errors=True)
    cold = run(command, caches, checkout)
    warm = [run(command, caches, checkout) for _ in range(rounds)]
    least = min(warm, key=lambda start: start.processor)
    return {**_figures("cold", cold), **_figures("warm", least)}


def _figures(kind: str, start: Start) -> dict[str, Any]:
    return {
        kind: start.processor,
        f"{kind}_clock": start.clock,
        f"{kind}_memory": start.memory,
        f"{kind}_instructions": start.instructions,
    }


def ours(scene: Path, size: int, out: Path) -> list[str]:
    """The command of clpt."""
    options = ["--size", f"{size}x{size}", "--spp", "1", "--quiet", "-o", str(out)]
    return [sys.executable, "-m", "clpt", "render", str(scene), *options]


def theirs(scene: Path, size: int, out: Path, folder: Path) -> tuple[str, list[str]] | None:
    """A variant of Mitsuba that renders here, and its command; None where none does."""
    for variant in VARIANTS:
        command = [sys.executable, "-c", MITSUBA, variant, str(scene), str(size), str(out)]
        try:
            run(command, folder / "trial")
        except RuntimeError:
            continue
        return variant, command
    return None


def rows_of(
    scenes: dict[str, Path], folder: Path, size: int, rounds: int, checkout: Path
) -> Iterator[dict[str, Any]]:
    """A row for each scene and renderer."""
    out = folder / "out.exr"
    find_llvm()
    bytecode = [sys.executable, "-m", "compileall", "-q", "clpt"]
    run(bytecode, folder / "bytecode", checkout)
    info = device.choose().info
    taken = f"{info.platform} {info.name}"
    for name, scene in scenes.items():
        which = {"scene": name, "size": size, "device": taken}
        command = ours(scene, size, out)
        row = which | {"renderer": "clpt"} | measure(command, folder, rounds, checkout)
        yield row | _figures("another", run(command, folder / "others", checkout))
        peer = theirs(scene, size, out, folder) if scene.suffix == ".xml" else None
        if peer is not None:
            beside = which | {"renderer": f"mitsuba {peer[0]}"}
            yield beside | measure(peer[1], folder, rounds)


def _scenes(paths: Sequence[Path], folder: Path) -> dict[str, Path]:
    """The scenes by their names: those that are given, else SCENES and OWN."""
    if paths:
        return {machine.scene_name(path): path.resolve() for path in paths}
    written = [write_cornell(folder), write_glass(folder), write_atrium(folder)]
    of_peers = dict(zip(SCENES, written, strict=True))
    return of_peers | {name: machine.ROOT / "scenes" / name for name in OWN}


@click.command(help=__doc__)
@click.argument("scenes", nargs=-1, type=click.Path(path_type=Path, exists=True))
@click.option("--size", default=64, show_default=True, help="Pixels of a side.")
@click.option("--rounds", default=3, show_default=True, help="Of warm starts, the least is taken.")
@click.option(
    "--checkout", type=click.Path(path_type=Path, exists=True), default=machine.ROOT,
    help="Of the clpt that is measured, such as one before a change.",
)  # fmt: skip
@click.option("--json", "json_file", type=click.Path(), help="Append the figures as JSON lines.")
def main(
    scenes: tuple[Path, ...], size: int, rounds: int, checkout: Path, json_file: str | None
) -> None:
    names = ("cold", "another", "warm")
    table = Table("scene", "renderer", *names, "memory cold, warm", title="Whole processes")
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        for row in rows_of(_scenes(scenes, folder), folder, size, rounds, checkout.resolve()):
            machine.append(json_file, "starting", [row])
            cells = [
                f"{row[name]:.2f} s ({row[f'{name}_clock']:.2f})" if name in row else ""
                for name in names
            ]
            memory = ", ".join(f"{row[f'{name}_memory'] / 2**20:.0f}" for name in ("cold", "warm"))
            table.add_row(row["scene"], row["renderer"], *cells, f"{memory} MiB")
    machine.console().print(table)


if __name__ == "__main__":
    main()
