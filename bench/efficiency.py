"""Scenes of others, as their files are: samples a second, error and efficiency beside Mitsuba's.

`python -m bench.efficiency [SCENE ...]`: names of `bench.renders`, or Mitsuba files; by default all
of both, the files of the folder `--assets` among them. Both renderers are whole processes, which
take turns. A figure is processor time of all their threads, which neighbours on the machine disturb
less than the clock; the time before a process's first sample is subtracted, and reported apart.
Efficiency is 1 / (relative MSE x seconds); the reference is the mean of a long render by each
renderer, with other seeds. Its error, a quarter of their difference, is subtracted; the worst .1 %
of the pixels are left out.

clpt renders in each of the ways of `--way`: `path` without light paths, `file` as `clpt render`
does where nothing is asked for, `auto` by that integrator, `guiding`, whose learning counts.
Mitsuba has the file's sampler and its best sampler (multijitter); clpt reads either as Sobol. Both
have a box filter; with `--as-file` the filter is the file's own. In spectral mode a metal's `eta`
and `k` by RGB are taken as values at 610, 550 and 460 nm: Mitsuba would cut them at 1, as if they
were reflectances. Images of numbers are `raw` there, because Mitsuba accepts no others for numbers.
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
NUMBERS = (  # numbers that may be images in a file
    "alpha", "alpha_u", "alpha_v", "anisotropic", "clearcoat", "clearcoat_gloss", "flatness",
    "metallic", "opacity", "roughness", "sheen", "sheen_tint", "spec_tint", "spec_trans", "weight",
)  # fmt: skip
METAL = (610, 550, 460)  # wavelengths for the red, green and blue of a metal's index [nm]
TRIM = 0.001
APART = 0.03  # of the two renderers' means: beyond, there is no common reference
SEEDS = (3, 4, 5)
SAMPLERS = {"file": None, "best": "multijitter"}  # of Mitsuba
PLAIN = ("--integrator", "path", "--light-paths", "0")
WAYS: dict[str, tuple[str, ...]] = {  # of clpt, and their options
    "path": PLAIN,
    "file": (),
    "auto": ("--integrator", "auto"),
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
    image: NDArray[np.float32]


@dataclass(frozen=True)
class Contender:
    """A renderer of a file in a mode, on some cores; its processes keep their caches.

    options: of `clpt render`; None for Mitsuba.
    """

    file: Path
    mode: str
    cores: Sequence[int]
    caches: Path
    options: tuple[str, ...] | None = None

    def render(self, spp: int, seed: int) -> Taken:
        """Return a picture. Raises RuntimeError with the process's last words if it fails twice."""
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / ("a.npy" if self.options is None else "a.exr")
            command = [sys.executable, *self._command(spp, seed, out)]
            try:
                cpu, seconds, peak = watched(command, self.cores, self.caches)
            except RuntimeError as error:
                print(f"once more: {error}", file=sys.stderr)
                cpu, seconds, peak = watched(command, self.cores, self.caches)
            image = np.load(out) if self.options is None else clpt.read_image(out)
        return Taken(cpu, seconds, peak, np.asarray(image, np.float32)[..., :3])

    def _command(self, spp: int, seed: int, out: Path) -> list[str]:
        if self.options is None:
            variant = f"llvm_ad_{self.mode}"
            return ["-c", MITSUBA, variant, str(self.file), str(spp), str(seed), str(out)]
        options = ["--mode", self.mode, "--spp", str(spp), "--seed", str(seed), "-o", str(out)]
        return ["-m", "clpt", "render", str(self.file), *self.options, *options, "--quiet"]


def watched(command: Sequence[str], cores: Sequence[int], caches: Path) -> tuple[float, float, int]:
    """Run a process on some cores; return its seconds of processor time and by the clock, and its
    largest resident set [bytes]. Raises RuntimeError with its last words if it fails."""
    folders = {name: str(caches / name) for name in ("XDG_CACHE_HOME", "POCL_CACHE_DIR")}
    for folder in folders.values():
        os.makedirs(folder, exist_ok=True)
    environment = {**os.environ, **folders, "POCL_MAX_PTHREAD_COUNT": str(len(cores))}
    report = caches / "report.json"
    watch = [sys.executable, "-I", "-S", "-c", WATCH, str(report)]
    held = ["taskset", "-c", ",".join(map(str, cores)), *watch, *command]
    with tempfile.TemporaryFile("w+") as words:
        done = subprocess.run(held, cwd=machine.ROOT, env=environment, stdout=words, stderr=words)
        if done.returncode:
            words.seek(0)
            last = (words.read().strip().splitlines() or [f"status {done.returncode}"])[-1]
            raise RuntimeError(f"{Path(command[0]).name}: {last[:300]}")
    clock, processor, memory = json.loads(report.read_text())
    return processor, clock, memory


def relative_mse(image: NDArray[np.floating], reference: NDArray[np.floating]) -> float:
    """Return the mean of squared error over squared picture plus a hundredth of the mean's square,
    without the worst pixels."""
    error = (image - reference) ** 2 / (reference**2 + 1e-2 * reference.mean() ** 2)
    error = np.sort(error.mean(-1).ravel())
    return float(error[: int(error.size * (1 - TRIM))].mean())


@dataclass(frozen=True)
class Settings:
    """What is compared: modes, numbers of cores, ways of clpt, samples a pixel of pictures and of
    references, the film's width, and whether it keeps the file's filter."""

    modes: Sequence[str]
    threads: Sequence[int]
    ways: Sequence[str]
    spp: int
    long: int
    width: int
    as_file: bool


def with_film(
    scene: Path, folder: Path, settings: Settings, mode: str, sampler: str | None
) -> tuple[Path, tuple[int, int]]:
    """Write a copy of a scene with the film of the settings to a folder; return it and its size.

    sampler: a kind to put in the place of its own. What lies beside the scene is linked.
    """
    width, as_file = settings.width, settings.as_file
    tree = ET.parse(scene)
    root = tree.getroot()
    values = {e.get("name", ""): e.get("value", "") for e in root.iter("default")}

    def value(element: ET.Element) -> str:
        text = element.get("value", "")
        return values.get(text[1:], text) if text.startswith("$") else text

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
    if sampler is not None:
        for element in root.iter("sampler"):
            element.set("type", sampler)
    if mode == "spectral":
        for_spectra(root)
    for integrator in root.iter("integrator"):
        name = integrator.get("type", "")
        if name.startswith("$") and name[1:] not in values:
            integrator.set("type", "path")
    folder.mkdir()
    for beside in scene.resolve().parent.iterdir():
        (folder / beside.name).symlink_to(beside)
    copy = folder / f"film-{scene.name}"
    tree.write(copy)
    return copy, (width, height)


def for_spectra(root: ET.Element) -> None:
    """Say in a scene what Mitsuba's spectral mode needs, see above."""
    for element in root.iter("rgb"):
        if element.get("name") in ("eta", "k"):
            values = element.get("value", "").replace(",", " ").split()
            pairs = sorted(zip(METAL, values, strict=True))
            element.tag = "spectrum"
            element.set("value", ", ".join(f"{nm}:{value}" for nm, value in pairs))
    for texture in root.iter("texture"):
        if texture.get("name") in NUMBERS:
            for old in texture.findall("boolean[@name='raw']"):
                texture.remove(old)
            ET.SubElement(texture, "boolean", name="raw", value="true")


def compare(scene: Path, settings: Settings) -> list[Row]:
    """Return a row for each mode, number of cores, way of clpt and sampler of Mitsuba."""
    return [row for mode in settings.modes for row in in_mode(scene, mode, settings)]


def in_mode(scene: Path, mode: str, settings: Settings) -> list[Row]:
    """Return the rows of a mode."""
    every = sorted(os.sched_getaffinity(0))
    rows: list[Row] = []
    copies: dict[str, Path] = {}
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for name, kind in SAMPLERS.items():
            copies[name], size = with_film(scene, folder / name, settings, mode, kind)

        def contenders(number: int) -> dict[str, Contender]:
            """Mitsuba by its samplers, and then clpt by its ways."""
            each = (mode, every[:number], folder / f"{number}")
            theirs = {f"mitsuba {name}": Contender(copies[name], *each) for name in SAMPLERS}
            return theirs | {w: Contender(copies["file"], *each, WAYS[w]) for w in settings.ways}

        long, means = long_renders(contenders(len(every)), settings)
        about = {
            "scene": machine.scene_name(scene),
            "runtime": device.choose().info.platform,
            "mode": mode,
            "as_file": settings.as_file,
            "size": [*size],
            "spp": settings.spp,
            "means": [round(mean, 6) for mean in means],
        }
        for number in settings.threads:
            measured = figures(contenders(number), settings.spp, long)
            rows += [{**about, "threads": number, **pair} for pair in pairs(measured)]
    return rows


def long_renders(
    contenders: dict[str, Contender], settings: Settings
) -> tuple[list[NDArray[np.float32]], list[float]]:
    """Return long renders by clpt, in the first of its ways, and by Mitsuba, and their means.

    Raises RuntimeError if the two are pictures of different means.
    """
    pair = contenders[settings.ways[0]], contenders["mitsuba best"]
    both = [
        contender.render(settings.long, seed).image
        for contender, seed in zip(pair, (77, 7777), strict=True)
    ]
    means = [float(image.mean()) for image in both]
    if abs(means[0] - means[1]) > APART * means[1]:
        raise RuntimeError(f"{pair[0].mode}: the two have other pictures, of means {means}")
    return both, means


def figures(
    contenders: dict[str, Contender], spp: int, long: Sequence[NDArray[np.float32]]
) -> dict[str, Row]:
    """Return what each took; the first sample of each pixel is not counted: its time is the
    start's. The start of guiding is that of `path`, because it learns before its first sample.
    busy: cores in the render that had most of them, with its start."""
    for contender in contenders.values():  # compiles
        contender.render(1, 1)
    machine.settle(next(iter(contenders.values())).caches)
    warm, full = (
        [{n: c.render(samples, seed) for n, c in contenders.items()} for seed in SEEDS]
        for samples in (1, spp)
    )
    reference = (long[0] + long[1]) / 2
    reference_error = relative_mse(long[0], reference)  # which is that of the reference
    pixels, figures_of_names = reference.shape[0] * reference.shape[1], {}
    for name in contenders:
        start = min(run["path" if name == "guiding" else name].cpu for run in warm)
        cpu = min(run[name].cpu for run in full) - start
        errors = [relative_mse(run[name].image, reference) for run in full]
        figures_of_names[name] = {
            "msamples": round(pixels * (spp - 1) / cpu / 1e6, 4),
            "relmse": round(float(np.mean(errors)) - reference_error, 6),
            "busy": round(max(run[name].cpu / run[name].seconds for run in full), 2),
            "first_warm": round(min(run[name].cpu for run in warm), 2),
            "peak_mib": round(max(run[name].peak for run in full) / 2**20),
        }
    return figures_of_names


def pairs(figures_by_name: dict[str, Row]) -> list[Row]:
    """Return a row for each way of clpt beside each sampler of Mitsuba; clpt first in lists."""
    rows = []
    for way in (name for name in figures_by_name if name in WAYS):
        for sampler in SAMPLERS:
            ours, theirs = figures_by_name[way], figures_by_name[f"mitsuba {sampler}"]
            rate = ours["msamples"] / theirs["msamples"]
            rows.append({
                "way": way,
                "sampler": sampler,
                "rate_ratio": round(rate, 3),
                "efficiency_ratio": round(rate * theirs["relmse"] / ours["relmse"], 3),
                **{name: [ours[name], theirs[name]] for name in ours},
            })  # fmt: skip
    return rows


HEADINGS = (
    "scene", "mode", "threads", "way", "Mitsuba's sampler", "Msamples/s", "rate : Mitsuba",
    "relMSE", "efficiency : Mitsuba", "busy", "first sample", "peak MiB", "means",
)  # fmt: skip


def cells(row: Row) -> list[str]:
    """Return a row's cells; clpt's figure before Mitsuba's."""

    def two(name: str) -> str:
        return " / ".join(f"{value:g}" for value in row[name])

    return [
        row["scene"],
        row["mode"],
        str(row["threads"]),
        row["way"],
        row["sampler"],
        two("msamples"),
        f"{row['rate_ratio']:.2f}",
        two("relmse"),
        f"{row['efficiency_ratio']:.2f}",
        *(two(name) for name in ("busy", "first_warm", "peak_mib", "means")),
    ]


def with_path(_context: click.Context, _option: click.Parameter, ways: Any) -> tuple[str, ...]:
    """Return ways, by default all. Raises click.BadParameter for guiding whose start is unknown."""
    if "guiding" in ways and "path" not in ways:
        raise click.BadParameter("the start of guiding is that of path: give --way path, too")
    return tuple(ways or WAYS)


way_option = click.option(
    "--way", "ways", multiple=True, type=click.Choice(list(WAYS)), callback=with_path,
    help="of clpt  [all]",
)  # fmt: skip


@click.command(help=__doc__)
@click.argument("scenes", nargs=-1)
@click.option("--assets", type=click.Path(path_type=Path, file_okay=False), envvar="ASSETS")
@click.option("--width", default=200, show_default=True, help="of the film [pixels]")
@click.option("--mode", "modes", multiple=True, type=click.Choice(["rgb", "spectral"]))
@click.option("--threads", multiple=True, type=int, help="cores that both are held to  [1, 2]")
@way_option
@click.option("--spp", default=64, show_default=True)
@click.option("--long", default=512, show_default=True, help="samples a pixel of the references")
@click.option("--as-file", is_flag=True, help="with each file's own pixel filter")
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
def main(
    scenes: tuple[str, ...], assets: Path | None, json_file: str | None, **options: Any
) -> None:
    find_llvm()
    every = list(scenes) or list(SCENES)
    if assets is not None:
        every += [str(path) for path in sorted(assets.glob("mitsuba/*/*.xml"))]
    usual = {"modes": ("rgb", "spectral"), "threads": (1, 2)}
    settings = Settings(
        **{name: value or usual.get(name, value) for name, value in options.items()}
    )
    table = Table(*HEADINGS, title=f"{machine.processor()}; clpt / Mitsuba")
    with tempfile.TemporaryDirectory() as folder:
        for name in every:
            path = SCENES[name](Path(folder)) if name in SCENES else Path(name)
            try:
                rows = compare(path, settings)
            except (RuntimeError, OSError, ET.ParseError) as error:
                print(f"{name}: {error}", file=sys.stderr)
                continue
            machine.append(json_file, "efficiency", rows)
            for row in rows:
                table.add_row(*cells(row))
                print(" | ".join(cells(row)), file=sys.stderr, flush=True)
    machine.console().print(table)


if __name__ == "__main__":
    main()
