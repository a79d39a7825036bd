"""Scenes of others, as their files are: samples a second, error and efficiency beside Mitsuba's.

`python -m bench.efficiency [SCENE ...]`: names of `bench.renders`, or Mitsuba files; by default all
of both, the files of the folder `--assets` among them. Both renderers are whole processes. A figure
is processor time of all their threads, which neighbours on the machine disturb less than the clock;
what a process takes until its first sample is taken out, and told by itself. Efficiency is 1 /
(relative MSE x seconds); the reference is the mean of two long renders, one of each renderer, with
other seeds; the worst .1 % of the pixels are left out.

Each renderer has its best sampler (Sobol, multijitter) and both a box filter; with `--as-file` the
filter and the sampler are the file's own. In spectral mode a metal's `eta` and `k` by RGB are taken
as values at 610, 550 and 460 nm: Mitsuba would cut them at 1, as if they were reflectances.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray
from rich.table import Table

import clpt
from bench import machine
from bench.renders import SCENES
from bench.starting import WATCH
from bench.workers import find_llvm

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
METAL = (610, 550, 460)  # wavelengths for the red, green and blue of a metal's index [nm]
TRIM = 0.001
APART = 0.03  # of the means of what the two render: beyond, there is no common reference
SEEDS = (3, 4, 5)
BEST = "multijitter"  # which clpt reads as Sobol

Row = dict[str, Any]


@dataclass(frozen=True)
class Taken:
    """What a render took: seconds of processor time and by the clock, and its largest resident set
    [bytes]; and the picture, (h, w, 3) float32."""

    cpu: float
    seconds: float
    peak: int
    image: NDArray[np.float32]


@dataclass(frozen=True)
class Contender:
    """A renderer of one file in one mode, held to some cores; its processes keep their caches."""

    name: str
    file: Path
    mode: str
    cores: Sequence[int]
    caches: Path

    def render(self, spp: int, seed: int) -> Taken:
        """Return a picture. Raises RuntimeError with the process's last words if it fails."""
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / ("a.exr" if self.name == "clpt" else "a.npy")
            cpu, seconds, peak = self._run(self._command(spp, seed, out))
            image = clpt.read_image(out) if self.name == "clpt" else np.load(out)
        return Taken(cpu, seconds, peak, np.asarray(image, np.float32)[..., :3])

    def _command(self, spp: int, seed: int, out: Path) -> list[str]:
        if self.name == "mitsuba":
            variant = f"llvm_ad_{self.mode}"
            return ["-c", MITSUBA, variant, str(self.file), str(spp), str(seed), str(out)]
        options = {"--mode": self.mode, "--spp": spp, "--seed": seed, "-o": out}
        flat = [str(part) for pair in options.items() for part in pair]
        return ["-m", "clpt", "render", str(self.file), *flat, "--quiet"]

    def _run(self, arguments: list[str]) -> tuple[float, float, int]:
        caches = {name: str(self.caches / name) for name in ("XDG_CACHE_HOME", "POCL_CACHE_DIR")}
        for folder in caches.values():
            os.makedirs(folder, exist_ok=True)
        threads = {"POCL_MAX_PTHREAD_COUNT": str(len(self.cores))}
        cores = ",".join(map(str, self.cores))
        report = self.caches / "report.json"
        watch = [sys.executable, "-I", "-S", "-c", WATCH, str(report)]
        command = ["taskset", "-c", cores, *watch, sys.executable, *arguments]
        with tempfile.TemporaryFile("w+") as words:
            done = subprocess.run(
                command, cwd=machine.ROOT, env={**os.environ, **caches, **threads},
                stdout=words, stderr=words,
            )  # fmt: skip
            if done.returncode:
                words.seek(0)
                last = (words.read().strip().splitlines() or [f"status {done.returncode}"])[-1]
                raise RuntimeError(f"{self.name}: {last[:300]}")
        clock, processor, memory = json.loads(report.read_text())
        return processor, clock, memory


def relative_mse(image: NDArray[np.floating], reference: NDArray[np.floating]) -> float:
    """Return the mean over all but the worst pixels of the squared error over the squared picture,
    to which a hundredth of the mean's square is added."""
    error = (image - reference) ** 2 / (reference**2 + 1e-2 * reference.mean() ** 2)
    error = np.sort(error.mean(-1).ravel())
    return float(error[: int(error.size * (1 - TRIM))].mean())


def with_film(scene: Path, width: int, mode: str, as_file: bool) -> tuple[Path, tuple[int, int]]:
    """Write a copy of a scene beside it with a film of that width; return it and the film's size.

    as_file: leave its pixel filter and sampler as they are.
    """
    tree = ET.parse(scene)
    root = tree.getroot()
    given = {e.get("name", ""): e.get("value", "") for e in root.iter("default")}

    def value(element: ET.Element) -> str:
        text = element.get("value", "")
        return given.get(text[1:], text) if text.startswith("$") else text

    (film, *_) = root.iter("film")
    old = {e.get("name"): int(value(e)) for e in film if e.get("name") in ("width", "height")}
    height = max(1, round(width * old.get("height", 512) / old.get("width", 512)))
    for film in root.iter("film"):
        for element in list(film):
            filtered = element.tag == "rfilter" and not as_file
            if element.get("name") in ("width", "height") or filtered:
                film.remove(element)
        ET.SubElement(film, "integer", name="width", value=str(width))
        ET.SubElement(film, "integer", name="height", value=str(height))
        if not as_file:
            ET.SubElement(film, "rfilter", type="box")
    if not as_file:
        for sampler in root.iter("sampler"):
            sampler.set("type", BEST)
    if mode == "spectral":
        for element in root.iter("rgb"):
            if element.get("name") in ("eta", "k"):
                values = element.get("value", "").replace(",", " ").split()
                pairs = sorted(zip(METAL, values, strict=True))
                element.tag = "spectrum"
                element.set("value", ", ".join(f"{nm}:{value}" for nm, value in pairs))
    for integrator in root.iter("integrator"):
        name = integrator.get("type", "")
        if name.startswith("$") and name[1:] not in given:
            integrator.set("type", "path")
    copy = scene.with_name(f".efficiency-{os.getpid()}-{scene.name}")
    tree.write(copy)
    return copy, (width, height)


def compare(
    scene: Path, modes: Sequence[str], threads: Sequence[int], spp: int, long: int, film: Row
) -> list[Row]:
    """Return a row for each mode and number of threads. film: as `with_film` takes it."""
    return [row for mode in modes for row in in_mode(scene, mode, threads, spp, long, film)]


def in_mode(
    scene: Path, mode: str, threads: Sequence[int], spp: int, long: int, film: Row
) -> list[Row]:
    """Return a row for each number of threads."""
    copy, (w, h) = with_film(scene, mode=mode, **film)
    every = sorted(os.sched_getaffinity(0))
    rows = []
    try:
        with tempfile.TemporaryDirectory() as folder:

            def pair(number: int, what: str) -> list[Contender]:
                cores, where = every[:number], Path(folder) / what
                return [Contender(name, copy, mode, cores, where) for name in ("clpt", "mitsuba")]

            both = [
                one.render(long, seed).image
                for one, seed in zip(pair(len(every), "reference"), (77, 7777), strict=True)
            ]
            means = [float(image.mean()) for image in both]
            if abs(means[0] - means[1]) > APART * means[1]:
                raise RuntimeError(f"{mode}: the two have other pictures, of means {means}")
            reference = (both[0] + both[1]) / 2
            about = {
                "scene": name_of(scene),
                "mode": mode,
                "as_file": film["as_file"],
                "size": [w, h],
                "spp": spp,
                "means": [round(mean, 6) for mean in means],
            }
            for number in threads:
                measured = figures(pair(number, f"{number}"), spp, w * h, reference)
                rows.append({**about, "threads": number, **measured})
    finally:
        copy.unlink()
    return rows


def name_of(scene: Path) -> str:
    """Return what a scene is called: its file or, where that is `scene.xml`, its folder."""
    return scene.parent.name if scene.stem == "scene" else scene.stem


def figures(
    pair: Sequence[Contender], spp: int, pixels: int, reference: NDArray[np.floating]
) -> Row:
    """Return what both took beside each other; clpt first in lists. The first sample of each pixel
    is not counted: its time is the start's."""
    cold = [one.render(1, 1) for one in pair]
    machine.settle(pair[0].caches)
    warm = [[one.render(1, seed) for one in pair] for seed in SEEDS]
    full = [[one.render(spp, seed) for one in pair] for seed in SEEDS[:2]]
    start = [min(run[i].cpu for run in warm) for i in range(2)]
    clock = [min(run[i].seconds for run in warm) for i in range(2)]
    cpu = [min(run[i].cpu for run in full) - start[i] for i in range(2)]
    seconds = [min(run[i].seconds for run in full) - clock[i] for i in range(2)]
    errors = [
        float(np.mean([relative_mse(run[i].image, reference) for run in full])) for i in range(2)
    ]
    return {
        "msamples": [round(pixels * (spp - 1) / t / 1e6, 4) for t in cpu],
        "rate_ratio": round(cpu[1] / cpu[0], 3),
        "relmse": [round(e, 6) for e in errors],
        "efficiency_ratio": round(errors[1] * cpu[1] / (errors[0] * cpu[0]), 3),
        "busy": [round(t / max(s, 1e-3), 2) for t, s in zip(cpu, seconds, strict=True)],
        "first_cold": [round(run.cpu, 2) for run in cold],
        "first_cold_clock": [round(run.seconds, 2) for run in cold],
        "first_warm": [round(t, 2) for t in start],
        "peak_mib": [round(max(run[i].peak for run in full) / 2**20) for i in range(2)],
    }


HEADINGS = (
    "scene", "mode", "threads", "Msamples/s", "rate : Mitsuba", "relMSE", "efficiency : Mitsuba",
    "busy", "first sample, cold", "by the clock", "with caches", "peak MiB", "means",
)  # fmt: skip


def cells(row: Row) -> list[str]:
    """Return a row's cells; clpt's figure before Mitsuba's."""

    def two(name: str) -> str:
        return " / ".join(f"{value:g}" for value in row[name])

    return [
        row["scene"],
        row["mode"],
        str(row["threads"]),
        two("msamples"),
        f"{row['rate_ratio']:.2f}",
        two("relmse"),
        f"{row['efficiency_ratio']:.2f}",
        *(two(name) for name in ("busy", "first_cold", "first_cold_clock", "first_warm")),
        two("peak_mib"),
        two("means"),
    ]


@click.command(help=__doc__)
@click.argument("scenes", nargs=-1)
@click.option("--assets", type=click.Path(path_type=Path, file_okay=False), envvar="ASSETS")
@click.option("--width", default=200, show_default=True, help="of the film [pixels]")
@click.option("--mode", "modes", multiple=True, type=click.Choice(["rgb", "spectral"]))
@click.option("--threads", multiple=True, type=int, help="cores that both are held to  [1, 2]")
@click.option("--spp", default=64, show_default=True)
@click.option("--long", default=512, show_default=True, help="samples a pixel of the references")
@click.option("--as-file", is_flag=True, help="with each file's own pixel filter and sampler")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    scenes: tuple[str, ...],
    assets: Path | None,
    width: int,
    modes: tuple[str, ...],
    threads: tuple[int, ...],
    spp: int,
    long: int,
    as_file: bool,
    json_file: str | None,
) -> None:
    find_llvm()
    every = list(scenes) or list(SCENES)
    if assets is not None:
        every += [str(path) for path in sorted(assets.glob("mitsuba/*/*.xml"))]
    film = {"width": width, "as_file": as_file}
    table = Table(*HEADINGS, title=f"{machine.processor()}; clpt / Mitsuba")
    all_rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name in every:
            path = SCENES[name](Path(folder)) if name in SCENES else Path(name)
            try:
                rows = compare(
                    path, modes or ("rgb", "spectral"), threads or (1, 2), spp, long, film
                )
            except (RuntimeError, OSError, ET.ParseError) as error:
                print(f"{name}: {error}", file=sys.stderr)
                continue
            machine.append(json_file, "efficiency", rows)
            all_rows += rows
            for row in rows:
                table.add_row(*cells(row))
                print(" | ".join(cells(row)), file=sys.stderr, flush=True)
    machine.console().print(table)
    if all_rows:
        ratios = [row["efficiency_ratio"] for row in all_rows]
        mean = np.exp(np.mean(np.log(ratios)))
        print(f"efficiency : Mitsuba, geometric mean {mean:.2f}, least {min(ratios):.2f}")


if __name__ == "__main__":
    main()
