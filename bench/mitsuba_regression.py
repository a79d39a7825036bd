"""Mitsuba's own regression scenes: does clpt make of them what Mitsuba makes?

`python -m bench.mitsuba_regression FOLDER [--only NAME] [--mode rgb|spectral]`; FOLDER is a
checkout of Mitsuba's repository of data files, or its tests/scenes. NAME_INTEGRATOR.xml there
has references refs/NAME_ref_MODE.exr and ..._var.exr, mean and variance of 32,000 samples a pixel;
where they are missing, or with --live, the installed Mitsuba renders. A picture passes when
Mitsuba's own test would accept it: a z-test of each pixel, by the reference's variance, in XYZ. It
agrees when a z-test of its blocks has a p above 1e-4, corrected for their number (Sidak 1967); that
is far stricter. Differences below 0.2 % are none there, for the two programs' colour tables differ
by as much, and so are those below 0.2 % of the picture's mean: what rare samples bring.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray
from rich.table import Table
from scipy import special

import clpt
from bench import machine
from bench.report import RESULTS
from clpt import images
from clpt.spectra.spaces import between

MODES = ("rgb", "spectral")
SPP = 32_000  # of the references
EXPOSURES = 16  # independent pictures, for clpt's noise
BLOCKS = 12  # along each side of a picture
SIGNIFICANCE = 1e-4
ALLOWED = 2e-3  # relative

Picture = NDArray[np.float64]
Row = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class Estimate:
    """A picture in XYZ, (h, w, 3), and the variance of a sample of each pixel.

    noise: the variance of the means of blocks.
    """

    mean: Picture
    variance: Picture
    noise: Picture


def scene_files(folder: Path, only: str) -> Iterator[Path]:
    """Yield the scenes of a folder; those with fragments lie deeper."""
    below = folder / "tests" / "scenes"
    for path in sorted((below if below.is_dir() else folder).glob("*/*.xml")):
        if only in path.stem:
            yield path


def blocks(image: Picture) -> Picture:
    """Means over BLOCKS x BLOCKS parts of (h, w, 3); the last rows and columns may be left over."""
    h, w = (max(size // BLOCKS, 1) for size in image.shape[:2])
    whole = image[: image.shape[0] // h * h, : image.shape[1] // w * w]
    return whole.reshape(whole.shape[0] // h, h, -1, w, 3).mean(axis=(1, 3))


def estimate(pictures: list[Picture], spp: int) -> Estimate:
    """What independent pictures of `spp` samples a pixel amount to."""
    parts = np.array([blocks(picture) for picture in pictures])
    variance = np.var(pictures, 0, ddof=1) * spp
    return Estimate(np.mean(pictures, 0), variance, parts.var(0, ddof=1) / len(parts))


def ours(path: Path, mode: str, samples: int) -> tuple[Estimate, int, list[str]]:
    """Render with clpt: the picture, its samples a pixel, and what clpt warned of."""
    scene = clpt.load(path, integrator=path.stem.rsplit("_", 1)[-1])
    scene = dataclasses.replace(scene, film=dataclasses.replace(scene.film, mode=mode))
    spp = _spp(samples, scene.film.width * scene.film.height)
    pictures = []
    with clpt.Renderer(scene) as renderer:
        for seed in range(1, EXPOSURES + 1):
            renderer.reset(seed=seed)
            renderer.run(spp)
            pictures.append(_xyz(renderer.image()))
        warnings = [*scene.warnings, *renderer.warnings]
    return estimate(pictures, spp), spp * EXPOSURES, warnings


def reference(path: Path, mode: str) -> Estimate | None:
    """Return the references beside a scene; None if a file is missing."""
    stem = path.parent / "refs" / f"{path.stem.rsplit('_', 1)[0]}_ref_{mode}"
    files = [Path(f"{stem}{end}.exr") for end in ("", "_var")]
    if not all(file.is_file() for file in files):
        return None
    mean, variance = (_xyz(images.read(file)) for file in files)  # both went from XYZ to RGB
    variance, parts = np.maximum(variance, 0.0), blocks(variance)
    pixels = mean.shape[0] * mean.shape[1] / (parts.shape[0] * parts.shape[1])
    return Estimate(mean, variance, np.maximum(parts, 0.0) / (SPP * pixels))


def live(path: Path, mode: str, samples: int) -> Estimate:
    """What the installed Mitsuba makes of a scene."""
    import mitsuba as mi

    mi.set_variant(f"scalar_{mode}")
    scene = mi.load_file(str(path), integrator=path.stem.rsplit("_", 1)[-1])
    size = scene.sensors()[0].film().crop_size()
    spp = _spp(samples, size[0] * size[1])
    rendered = (mi.render(scene, spp=spp, seed=seed) for seed in range(EXPOSURES))
    return estimate([_xyz(np.array(picture)[:, :, :3]) for picture in rendered], spp)


def accepted(picture: Estimate, spp: int, against: Estimate) -> float:
    """The share of pixels that Mitsuba's test_renders.py accepts; it asks for 0.9975 of them."""
    z = np.abs(picture.mean - against.mean) * np.sqrt(spp / np.maximum(against.variance, 1e-4))
    level = -np.expm1(np.log1p(-0.01) / (z.shape[0] * z.shape[1]))
    return float((special.erfc(z / 2**0.5) > level).mean())


def compare(picture: Estimate, spp: int, against: Estimate) -> Row:
    """How far two pictures are apart: ratios in linear Rec. 709, z and p of blocks in XYZ."""
    means = [e.mean.mean((0, 1)) @ between("xyz", "rec709").T for e in (picture, against)]
    parts = [blocks(e.mean) for e in (picture, against)]
    size = np.abs(parts[1]) + parts[1].mean((0, 1))
    noise = np.sqrt(picture.noise + against.noise) + 1e-6 * size
    z = np.maximum(np.abs(parts[0] - parts[1]) - ALLOWED * size, 0.0) / noise
    p = float(-np.expm1(z.size * np.log1p(-min(special.erfc(z.max() / 2**0.5), 1.0 - 1e-12))))
    worst = np.unravel_index(z.argmax(), z.shape)
    pixels = accepted(picture, spp, against)
    return {
        "ratio": (means[0] / np.where(means[1] == 0.0, np.nan, means[1])).round(4).tolist(),
        "z": round(float(z.max()), 2),
        "p": float(f"{p:.2g}"),
        "worst_block": [int(worst[1]), int(worst[0])],
        "worst_ratio": round(float(parts[0][worst] / max(parts[1][worst], 1e-12)), 4),
        "pixels": round(pixels, 4),
        "passes": pixels >= 0.9975,
        "agrees": p > SIGNIFICANCE,
    }


def measure(path: Path, mode: str, samples: int, rendered: bool) -> Row:
    """A row for a scene and a mode."""
    row: Row = {"scene": path.stem, "mode": mode}
    start = time.perf_counter()
    try:
        picture, spp, warnings = ours(path, mode, samples)
    except clpt.ClptError as error:
        return {**row, "refused": str(error).replace(f"{path.parent}/", "")}
    row["seconds"] = round(time.perf_counter() - start, 1)
    stored = None if rendered else reference(path, mode)
    row["against"] = "Mitsuba" if stored is None else "reference"
    against = live(path, mode, samples) if stored is None else stored
    return {**row, **compare(picture, spp, against), "warnings": warnings}


def _spp(samples: int, pixels: int) -> int:
    return max(round(samples / (EXPOSURES * pixels)), 1)


def _xyz(image: NDArray[Any]) -> Picture:
    return np.asarray(image, np.float64)[:, :, :3] @ between("rec709", "xyz").T


@click.command(help=__doc__)
@click.argument("folder", type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--only", default="", help="Scenes whose name holds this.")
@click.option("--mode", type=click.Choice(MODES), help="One mode; both else.")
@click.option(
    "--samples", default=2_000_000, show_default=True, help="Samples of a picture in all."
)
@click.option("--live", "rendered", is_flag=True, help="Let Mitsuba render, whatever is stored.")
@click.option(
    "--json",
    "json_file",
    type=click.Path(path_type=Path),
    show_default=True,
    default=RESULTS / "mitsuba_regression.jsonl",
)
def main(
    folder: Path, only: str, mode: str | None, samples: int, rendered: bool, json_file: Path
) -> None:
    about, console = machine.circumstances(), machine.console()
    table = Table("scene", "mode", "r, g, b", "z", "p", "worst", "pixels", "", "s")
    for path in scene_files(folder, only):
        for each in (mode,) if mode else MODES:
            row = measure(path, each, samples, rendered)
            machine.append(json_file, "mitsuba_regression", [{**about, **row}])
            if "refused" in row:
                cells = ["", "", "", "", "", f"refused: {row['refused']}", ""]
            else:
                ratios = " ".join(f"{value:.4f}" for value in row["ratio"])
                worst = f"{row['worst_ratio']:.3f} at {row['worst_block']}"
                verdict = "agrees" if row["agrees"] else "passes" if row["passes"] else "differs"
                cells = [ratios, f"{row['z']:.1f}", f"{row['p']:.2g}", worst]
                cells += [f"{row['pixels']:.4f}", verdict, f"{row['seconds']:.0f}"]
            table.add_row(path.stem, each, *cells)
            console.print(path.stem, each, *cells, markup=False)
    console.print(table)


if __name__ == "__main__":
    main()
