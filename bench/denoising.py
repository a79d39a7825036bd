"""How much error denoisers take away, in colours and in bands, and how long they take.

Error is the mean of (picture - reference)^2 / (light^2 + dark^2), where light is the mean of the
reference's channels in a pixel and dark a tenth of the picture's. A gain is the noisy picture's
error over the denoised picture's. Bands are compared by the same error, by their rms relative to
the reference's, and by the mean CIEDE2000 of the colours that they make (white: 4 times the mean).
Noisy pictures and references are of different seeds; references have noise too, which makes gains
smaller than they are.
"""

from __future__ import annotations

import dataclasses
import time
from pathlib import Path

import click
import colour
import numpy as np
from rich.table import Table

import clpt
from bench import machine
from clpt.scene import integrators
from clpt.spectra import cie

SCENES = ("cornell_box", "glass_caustics", "three_spheres", "color_checker", "soap_bubble")
WIDTH, BANDS, SEED, REFERENCE_SEED = 320, 16, 1, 99


def prepared(name: str, seed: int) -> clpt.Scene:
    """A scene of the repository, small, with bands; glass_caustics without merging."""
    scene = clpt.load(machine.ROOT / "scenes" / name)
    scale = min(1.0, WIDTH / scene.film.width)
    size = {axis: int(getattr(scene.film, axis) * scale) for axis in ("width", "height")}
    scene.film = dataclasses.replace(scene.film, **size, bands=BANDS)
    if isinstance(scene.integrator, integrators.Vcm):
        depths = {key: getattr(scene.integrator, key) for key in ("max_depth", "rr_depth")}
        scene.integrator = integrators.Path(**depths)
    scene.seed = seed
    return scene


def reference(name: str, samples: int, folder: Path) -> dict[str, np.ndarray]:
    """A picture of many samples, from the folder or put there."""
    path = folder / f"{name}.npz"
    if not path.is_file():
        folder.mkdir(parents=True, exist_ok=True)
        with clpt.Renderer(prepared(name, REFERENCE_SEED), denoise="statistical") as renderer:
            renderer.run(samples)
            np.savez(path, rgb=renderer.colours(), bands=renderer.image())
    return dict(np.load(path))


def error(image: np.ndarray, truth: np.ndarray) -> float:
    light = truth.mean(axis=2, keepdims=True)
    return float(np.mean((image - truth) ** 2 / (light**2 + (0.1 * truth.mean()) ** 2)))


def colour_difference(bands: np.ndarray, truth: np.ndarray, centres: np.ndarray) -> float:
    """The mean CIEDE2000 between the colours of two pictures of bands."""
    colours = [clpt.SpectralImage(b, centres, emissive=True).to_rgb() for b in (bands, truth)]
    white = 4.0 * colours[1].mean()
    xyz = [cie.rgb_to_xyz(np.clip(c / white, 0.0, 1.0)) for c in colours]
    labs = [colour.XYZ_to_Lab(each) for each in xyz]
    return float(np.mean(colour.delta_E(*labs, method="CIE 2000")))


def compare(name: str, samples: int, truth: dict[str, np.ndarray]) -> list[dict[str, object]]:
    """Return the records of a scene, for each denoiser."""
    with clpt.Renderer(prepared(name, SEED), denoise="statistical") as renderer:
        renderer.run(samples)
        noisy, bands = renderer.colours(), renderer.image()
        centres = renderer.scene.film.band_centres
        size = float(np.sqrt(np.mean(truth["bands"] ** 2)))

        def of_bands(image: np.ndarray) -> tuple[float, float, float]:
            rms = float(np.sqrt(np.mean((image - truth["bands"]) ** 2))) / size
            difference = colour_difference(image, truth["bands"], centres)
            return error(image, truth["bands"]), rms, difference

        before, before_bands = error(noisy, truth["rgb"]), of_bands(bands)
        rows: list[dict[str, object]] = []
        for method in ("oidn", "statistical"):
            start = time.process_time()
            denoised = clpt.DenoisedPicture(renderer, method)
            seconds = time.process_time() - start
            after, after_bands = error(denoised.colours(), truth["rgb"]), of_bands(denoised.image())
            rows.append({
                "scene": name, "figure": f"{method}, {samples} spp",
                "noisy": before, "error": after, "gain": before / after,
                "bands_gain": before_bands[0] / after_bands[0],
                "noisy_rms": before_bands[1], "rms": after_bands[1],
                "noisy_delta_e": before_bands[2], "delta_e": after_bands[2],
                "cpu_seconds": seconds, "pixels": noisy.shape[0] * noisy.shape[1],
            })  # fmt: skip
    return rows


@click.command(help=__doc__)
@click.option("--scene", "scenes", multiple=True, default=SCENES)
@click.option("--spp", "numbers", multiple=True, type=int, default=(16, 64))
@click.option("--reference-spp", default=2048)
@click.option(
    "--references", type=click.Path(path_type=Path), default=Path(".bench-references"),
    help="Folder of references, which are rendered where they are not there.",
)  # fmt: skip
@click.option("--json", "path", help="Append records to this file.")
def main(
    scenes: tuple[str, ...],
    numbers: tuple[int, ...],
    reference_spp: int,
    references: Path,
    path: str | None,
) -> None:
    table = Table("scene", "figure", "gain", "gain of bands", "rms", "Delta E", "CPU s")
    for name in scenes:
        truth = reference(name, reference_spp, references)
        for samples in numbers:
            rows = compare(name, samples, truth)
            machine.append(path, "denoising", rows)
            for row in rows:
                rms, delta = (
                    f"{row[f'noisy_{key}']:.3f} : {row[key]:.3f}" for key in ("rms", "delta_e")
                )
                table.add_row(
                    name, str(row["figure"]), f"{row['gain']:.1f}",
                    f"{row['bands_gain']:.1f}", rms, delta, f"{row['cpu_seconds']:.1f}",
                )  # fmt: skip
    machine.console().print(table)


if __name__ == "__main__":
    main()
