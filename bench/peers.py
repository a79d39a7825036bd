"""Scenes of others as their files are: time and error of clpt, of its commits, and of Mitsuba.

`python -m bench.peers SCENE.xml...` renders each file by clpt as `clpt render` does, by each way of
`--way`, by each checkout of `--checkout NAME=FOLDER`, and by Mitsuba with the file's sampler and
with its best sampler (multijitter; clpt reads either as Sobol). Renderers are whole processes that
take turns with each seed. `--film preview` is 200 pixels wide and has 32 samples, `final` 640 and
96. Time is processor time of all threads, which neighbours on the machine disturb less than the
clock: the least of all seeds, and of previews a quarter of four times the samples. The time of a
picture of single samples is subtracted, and reported apart (of guiding that of `path`, since a
guide is learnt before the first sample).

The error of a picture is the mean over its pixels of (p - r)^2 / (r^2 + m^2 / 100), for the
reference's pixel r and mean m, averaged over three channels, without the worst thousandth of the
pixels. The reference of a picture is the mean of all contenders' pictures of the other seeds, each
with the weight of its contender's inverse error; the reference's own error is subtracted. A ratio
of costs, error times seconds, has the standard error of the errors over the seeds.

In spectral mode a metal's `eta` and `k` by RGB are taken as values at 610, 550 and 460 nm: Mitsuba
would cut them at 1, as if they were reflectances. Images of numbers are `raw` there, because
Mitsuba accepts no others for numbers.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.table import Table

import clpt
from bench import machine
from bench.peer_figures import Picture, errors, gain, rate
from bench.peer_films import with_film
from bench.starting import WATCH
from bench.workers import find_llvm
from clpt import device

MITSUBA = """
import os, sys
import drjit, mitsuba, numpy
variant, file, spp, seed, out = sys.argv[1:]
mitsuba.set_variant(variant)
mitsuba.set_log_level(mitsuba.LogLevel.Error)
cores = len(os.sched_getaffinity(0))
drjit.set_thread_count(max(2, cores))  # one thread alone waits for ever for an EXR file
scene = mitsuba.load_file(file)
drjit.set_thread_count(cores)
total, done, spp = 0, 0, int(spp)
while done < spp:
    some = min(128, spp - done)
    image = mitsuba.render(scene, spp=some, seed=int(seed) + done)
    total, done = total + numpy.array(image)[..., :3] * some, done + some
numpy.save(out, total / spp)
"""
APART = 0.03  # of two renderers' means: beyond, they have no common reference
FIRST_SEED = 1000  # Mitsuba adds the samples to it
SAMPLERS = {"mitsuba": None, "mitsuba best": "multijitter"}
FILMS = {"preview": (200, 32, 4), "final": (640, 96, 1)}
"""Width, samples a pixel, and how many times as many are timed."""
PLAIN = ("--integrator", "path", "--light-paths", "0")
WAYS: dict[str, tuple[str, ...]] = {  # of clpt, and their options
    "file": (),
    "auto": ("--integrator", "auto"),
    "path": PLAIN,
    "eighth": ("--integrator", "path", "--light-paths", "0.125"),
    "quarter": ("--integrator", "path", "--light-paths", "0.25"),
    "whole": ("--integrator", "path", "--light-paths", "1"),
    "vcm": ("--integrator", "vcm"),
    "guiding": (*PLAIN, "--guiding"),
}

Row = dict[str, Any]


@dataclass(frozen=True)
class Taken:
    """What a render took: seconds of processor time and by the clock, and its largest resident set
    [bytes]; and the picture, (h, w, 3) float32."""

    cpu: float
    seconds: float
    peak: int
    image: Picture


@dataclass(frozen=True)
class Contender:
    """A renderer of a file in a mode, on some cores; its processes keep their caches.

    options: of `clpt render`; None for Mitsuba; checkout: the folder of the clpt that renders.
    """

    file: Path
    mode: str
    cores: Sequence[int]
    caches: Path
    options: tuple[str, ...] | None = None
    checkout: Path = machine.ROOT

    def render(self, spp: int, seed: int) -> Taken:
        """Return a picture. Raises RuntimeError with the process's last words if it fails twice."""
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / ("a.npy" if self.options is None else "a.exr")
            command = self.command(spp, seed, out)
            where = (self.cores, self.caches, self.checkout)
            try:
                cpu, seconds, peak = watched(command, *where)
            except RuntimeError as error:
                print(f"once more: {error}", file=sys.stderr)
                cpu, seconds, peak = watched(command, *where)
            image = np.load(out) if self.options is None else clpt.read_image(out)
        return Taken(cpu, seconds, peak, np.asarray(image, np.float32)[..., :3])

    def command(self, spp: int, seed: int, out: Path) -> list[str]:
        """Return a process that writes a picture to `out`."""
        if self.options is None:
            variant = f"llvm_ad_{self.mode}"
            program = [sys.executable, "-c", MITSUBA, variant]
            return [*program, str(self.file), str(spp), str(seed), str(out)]
        options = ["--mode", self.mode, "--spp", str(spp), "--seed", str(seed), "-o", str(out)]
        program = [sys.executable, "-m", "clpt", "render", str(self.file)]
        return [*program, *self.options, *options, "--quiet"]


def watched(
    command: Sequence[str], cores: Sequence[int], caches: Path, checkout: Path = machine.ROOT
) -> tuple[float, float, int]:
    """Run a process on some cores; return its seconds of processor time and by the clock, and its
    largest resident set [bytes]. Raises RuntimeError with its last words if it fails."""
    folders = {name: str(caches / name) for name in ("XDG_CACHE_HOME", "POCL_CACHE_DIR")}
    for folder in folders.values():
        os.makedirs(folder, exist_ok=True)
    places = {**folders, "PYTHONPATH": str(checkout), "POCL_MAX_PTHREAD_COUNT": str(len(cores))}
    environment = {**os.environ, **places}
    report = caches / "report.json"
    watch = [sys.executable, "-I", "-S", "-c", WATCH, str(report)]
    held = ["taskset", "-c", ",".join(map(str, cores)), *watch, *command]
    with tempfile.TemporaryFile("w+") as words:
        done = subprocess.run(held, cwd=checkout, env=environment, stdout=words, stderr=words)
        if done.returncode:
            words.seek(0)
            last = (words.read().strip().splitlines() or [f"status {done.returncode}"])[-1]
            raise RuntimeError(f"{Path(command[0]).name}: {last[:300]}")
    clock, processor, memory = json.loads(report.read_text())
    return processor, clock, memory


@dataclass
class Record:
    """What a contender took, and its pictures: a picture for each seed.

    start: seconds of a picture of single samples; seconds: of a picture, without its start; peak:
    the largest resident set [bytes].
    """

    start: float = math.inf
    seconds: float = math.inf
    peak: int = 0
    images: list[Picture] = field(default_factory=list)


def compare(
    scene: Path, contenders: Mapping[str, Contender], spp: int, times: int, seeds: int
) -> tuple[dict[str, Record], list[str]]:
    """Return what each contender took and made with each seed, and what failed, as sentences."""
    records: dict[str, Record] = {}
    failures = []
    for name, contender in contenders.items():
        try:
            contender.render(1, 1)  # compiles
            if contender.options is not None:
                contender.render(spp, 1)  # a long film of clpt has programs of its own
            machine.settle(contender.caches)
            records[name] = Record()
        except RuntimeError as error:
            failures.append(f"{scene}: {name}: {error}")
    for seed in range(FIRST_SEED, FIRST_SEED * (seeds + 1), FIRST_SEED):
        for name, record in records.items():
            record.start = min(record.start, contenders[name].render(1, seed).cpu)
            taken = contenders[name].render(spp, seed)
            record.images.append(taken.image)
            record.peak = max(record.peak, taken.peak)
            if times > 1:
                taken = contenders[name].render(spp * times, seed)
            record.seconds = min(record.seconds, taken.cpu)
    if "guiding" in records and "path" in records:
        records["guiding"].start = records["path"].start
    for record in records.values():
        record.seconds = (record.seconds - record.start) / times
    return records, failures


def rows_of(
    records: Mapping[str, Record], spp: int, relmse: Mapping[str, Sequence[float]]
) -> list[Row]:
    """Return a row for each contender: its time, and its error of each seed."""
    rows = []
    for name, record in records.items():
        height, width, _ = record.images[0].shape
        rows.append({
            "contender": name,
            "size": [width, height],
            "spp": spp,
            "start": round(record.start, 3),
            "seconds": round(record.seconds, 4),
            "relmse": [round(value, 7) for value in relmse[name]],
            "mean": round(float(np.mean(record.images)), 6),
            "peak_mib": round(record.peak / 2**20),
        })  # fmt: skip
    return rows


HEADINGS = ("scene", "film", "mode", "", "Msamples/s", "relMSE", "first [s]", "efficiency over")


def table_cells(rows: Sequence[Row]) -> list[list[str]]:
    """Return cells for the rows of one film of a scene: clpt's efficiency over each contender."""
    first = next((row for row in rows if row["contender"] == "file"), rows[0])
    cells = []
    for row in rows:
        over, error = gain(first, row)
        cells.append([
            row["scene"],
            row["film"],
            row["mode"],
            row["contender"],
            f"{rate(row):.3f}",
            f"{np.mean(row['relmse']):.5f}",
            f"{row['start']:.2f}",
            "" if row is first else f"{over:.3f} ± {error:.3f}",
        ])  # fmt: skip
    return cells


def checkouts(_: click.Context, _option: click.Parameter, texts: Any) -> dict[str, Path]:
    """Return folders by name. Raises click.BadParameter for another form than NAME=FOLDER."""
    pairs = [text.partition("=") for text in texts]
    for name, _equals, folder in pairs:
        if not name or not (Path(folder) / "clpt").is_dir():
            raise click.BadParameter(f"{name}={folder}: want a name and a folder with clpt in it")
    return {name: Path(folder).resolve() for name, _equals, folder in pairs}


way_option = click.option(
    "--way", "ways", multiple=True, type=click.Choice(list(WAYS)), help="of clpt  [file]"
)


@dataclass(frozen=True)
class Settings:
    """What is compared: ways of clpt and other checkouts of it, on some cores.

    as_file: whether each film keeps its filter; caches: the folder of the programs.
    """

    ways: Sequence[str]
    checkouts: Mapping[str, Path]
    cores: Sequence[int]
    as_file: bool
    caches: Path

    def contenders(self, scene: Path, width: int, mode: str, folder: Path) -> dict[str, Contender]:
        """Return all contenders for a scene, whose copies are written to a folder."""
        each = (mode, self.cores)
        copies = {
            kind: with_film(
                scene, folder / f"{kind}", width, mode, as_file=self.as_file, sampler=kind
            )[0]
            for kind in SAMPLERS.values()
        }
        own = copies[None]
        return {
            **{way: Contender(own, *each, self.caches / "clpt", WAYS[way]) for way in self.ways},
            **{
                name: Contender(own, *each, self.caches / name, (), folder)
                for name, folder in self.checkouts.items()
            },
            **{
                name: Contender(copies[kind], *each, self.caches / "mitsuba")
                for name, kind in SAMPLERS.items()
            },
        }

    def rows(self, scene: Path, mode: str, film: str, seeds: int) -> list[Row]:
        """Return a row for each contender. Raises OSError, ET.ParseError, RuntimeError."""
        width, spp, times = FILMS[film]
        with tempfile.TemporaryDirectory() as temporary:
            contenders = self.contenders(scene, width, mode, Path(temporary))
            records, failures = compare(scene, contenders, spp, times, seeds)
        print(*failures, sep="\n", end="\n" * bool(failures), file=sys.stderr)
        means = {name: float(np.mean(record.images)) for name, record in records.items()}
        if max(means.values()) - min(means.values()) > APART * max(means.values()):
            raise RuntimeError(f"{mode}: the pictures have other means: {means}")
        about = {
            "scene": machine.scene_name(scene),
            "film": film,
            "mode": mode,
            "threads": len(self.cores),
            "as_file": self.as_file,
            "runtime": device.choose().info.platform,
        }
        relmse = errors({name: record.images for name, record in records.items()})
        return [{**about, **row} for row in rows_of(records, spp, relmse)]


@click.command(help=__doc__)
@click.argument("scenes", nargs=-1, type=click.Path(path_type=Path, exists=True))
@click.option("--film", "films", multiple=True, type=click.Choice(list(FILMS)), help="[preview]")
@click.option("--mode", "modes", multiple=True, type=click.Choice(["rgb", "spectral"]))
@click.option("--threads", default=1, show_default=True, help="cores that all are held to")
@way_option
@click.option("--checkout", "others", multiple=True, callback=checkouts, metavar="NAME=FOLDER")
@click.option("--seeds", type=click.IntRange(min=2), default=8, show_default=True)
@click.option("--caches", type=click.Path(path_type=Path), help="of programs  [a new folder]")
@click.option("--as-file", is_flag=True, help="with each file's own pixel filter")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    scenes: Sequence[Path],
    films: Sequence[str],
    modes: Sequence[str],
    threads: int,
    ways: Sequence[str],
    others: Mapping[str, Path],
    seeds: int,
    caches: Path | None,
    as_file: bool,
    json_file: str | None,
) -> None:
    find_llvm()
    cores = sorted(os.sched_getaffinity(0))[-threads:]
    table = Table(*HEADINGS, title=machine.processor())
    cases = [(s, m, f) for s in scenes for m in modes or ["rgb"] for f in films or ["preview"]]
    with tempfile.TemporaryDirectory() as temporary:
        kept = caches or Path(temporary)
        settings = Settings(ways or ["file"], others, cores, as_file, kept)
        for scene, mode, film in cases:
            try:
                rows = settings.rows(scene, mode, film, seeds)
            except (RuntimeError, OSError, ET.ParseError) as error:
                print(f"{scene}: {error}", file=sys.stderr)
                continue
            machine.append(json_file, "peers", rows)
            for cells in table_cells(rows):
                table.add_row(*cells)
                print(" | ".join(cells), file=sys.stderr, flush=True)
    machine.console().print(table)


if __name__ == "__main__":
    main()
