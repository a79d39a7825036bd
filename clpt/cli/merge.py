"""`clpt merge`: films of different samples of a scene are added, and make its picture."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..errors import SceneError
from ..formats import locate
from ..version import VERSION
from .files.targets import checked
from .options.grading import GradingOptions, grading_options, names_option
from .options.records import with_records
from .options.scene_options import denoise_option

if TYPE_CHECKING:
    from ..render.film.film_file import SavedFilm


@click.command()
@click.argument("films", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o", "--output", "paths", multiple=True, required=True, type=click.Path(path_type=Path),
    help="Where to write: .film .exr .png .jpg .webp .hdr .pfm .npy; may be given several times.",
)  # fmt: skip
@denoise_option
@grading_options
@names_option
@click.option("--quiet", is_flag=True, help="Print no warnings.")
@with_records(graded=GradingOptions)
def merge(
    films: tuple[Path, ...],
    paths: tuple[Path, ...],
    denoise: str | None,
    quiet: bool,
    graded: GradingOptions,
) -> None:
    """Add FILMS, of `clpt render --samples FIRST:END -o NAME.film`, and write the picture.

    The order does not matter: the film is to the bit that of a single render of all samples.
    Checkpoints (NAME.resume.exr) are films too. Films of another scene, setting or version are
    refused, and films that share a sample. No device is needed.
    """
    for film in films:
        locate(film)
    from ..render.film.film_file import other_devices  # here: help needs no OpenCL
    from .display import display
    from .files import checkpoints, outputs

    how = graded.grading
    targets = checked(paths)

    shown = display(quiet, None)
    if text := how.unused(targets):
        shown.note(f"clpt: warning: {text}")
    total = added(films)
    for change in other_devices(total.sessions, total.sessions[0].device):
        shown.note(f"clpt: warning: the films are of several classes of devices: {change}")
    stats = _figures(total) | {"films": len(films)}
    denoiser = denoise or total.denoise
    with shown.phase(f"denoising ({denoiser})") if denoiser else nullcontext():
        outputs.write_all(targets, total, stats, how, shown, denoise)
    shown.note(checkpoints.summary(total))


def _figures(total: SavedFilm) -> dict[str, str | int | float]:
    """Return what a picture's file says of how it was made."""
    origin = total.origin.scene.values
    return {
        "software": f"clpt {VERSION}",
        "integrator": str(origin["integrator.type"]),
        "sampler": str(origin["sampler.type"]),
        "seed": int(origin["seed"] or 0),
        "spp": float(total.samples_per_pixel().mean(dtype=float)),
        "seconds": round(total.seconds, 3),
    }


def added(films: tuple[Path, ...]) -> SavedFilm:
    """Return the film of the samples of all. Raises SceneError, which names files."""
    from ..render.film import film_file

    total = film_file.read(films[0])
    for path in films[1:]:
        try:
            total = total.merged(film_file.read(path))
        except SceneError as error:
            if error.file is not None:
                raise
            others = films[0] if path is films[1] else f"those before, such as {films[0]}"
            message = f"cannot be added to {others}: {error.message}"
            raise SceneError(message, file=path, where=error.where) from None
    return total
