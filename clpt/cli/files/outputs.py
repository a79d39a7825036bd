"""The files that `clpt render` writes."""

from __future__ import annotations

import os
import secrets
import tempfile
from contextlib import suppress
from pathlib import Path

from clpt.files import output_files
from clpt.render.film import film_file, layers
from clpt.render.film.pictures import DenoisedPicture

from ...errors import ClptError, SceneError
from ...files import disk_cache
from ...render.film.film_file import SavedFilm
from ...render.resumable import ResumableRenderer
from ...version import VERSION
from ..display import Display
from ..options.grading import Grading
from .targets import FILM, is_standard

Film = ResumableRenderer | SavedFilm  # what can be saved
Source = Film | DenoisedPicture  # what pictures are taken of


def metadata(
    renderer: ResumableRenderer, scene: Path, seconds: float
) -> dict[str, str | int | float]:
    """Return the metadata of an .exr: how it was made. spp is the mean over all pixels.

    seconds: of this session; the seconds of former sessions are added.
    """
    plan = renderer.scene
    return {
        "software": f"clpt {VERSION}",
        "scene": os.fsencode(scene).decode("utf-8", "replace"),
        "mode": plan.film.mode,
        "integrator": plan.integrator.kind,
        "sampler": plan.sampler.kind,
        "seed": plan.seed,
        "spp": renderer.counts.samples / renderer._wavefront.paths.pixels,
        "device": renderer._device_text,
        "seconds": round(seconds + renderer._former_seconds, 3),
    }


def write_all(
    paths: tuple[Path, ...],
    film: Film,
    stats: dict[str, str | int | float],
    grading: Grading,
    shown: Display,
    denoise: str | None = None,
) -> None:
    """Write the picture so far to every path, denoised where that was asked for; note each.

    denoise: a denoiser, by default that of the film.

    A picture that cannot be written goes to another folder, and if that fails too the film does.
    Raises SceneError at the end, which says where it is.
    """
    failures = []
    picture: Source = film
    denoise = denoise or film.denoise
    if denoise is not None and any(path.suffix.lower() != FILM for path in paths):
        try:
            picture = DenoisedPicture(film, denoise)
            stats = {**stats, "denoised": picture.text}
        except ClptError as error:  # the picture is worth more
            shown.note(f"clpt: warning: not denoised: {error}")
    for path in paths:
        source = film if path.suffix.lower() == FILM else picture
        try:
            write(path, source, stats, grading)
            name = "standard output" if is_standard(path) else path
            shown.note(str(name))
        except FAILURES as error:
            rescued = _rescue(path, film, source, stats, grading)
            failures.append(f"{failure(path, error)}; {rescued}")
    if failures:
        raise SceneError("; ".join(failures))


FAILURES = (ClptError, OSError, MemoryError)  # of writing a file


def _rescue(
    path: Path, film: Film, source: Source, stats: dict[str, str | int | float], grading: Grading
) -> str:
    """Write a picture, or else its film, where there is room for it; return what to say."""
    label = f"-{secrets.token_hex(4)}"
    folders = Path(tempfile.gettempdir()), disk_cache.folder()
    for folder in folders:
        other = output_files.beside(folder / path.name, f"{label}{path.suffix}")
        with suppress(*FAILURES):
            write(other, source, stats, grading)
            return f"the picture is in {other}"
    for folder in folders:
        other = output_files.beside(folder / path.name, f"{label}{FILM}")
        with suppress(*FAILURES):
            film_file.write(other, film.saved_film())
            return f"the film is in {other}, of which clpt merge makes the picture"
    return f"nor can it in {' or '.join(map(str, folders))}"


def failure(path: Path, error: Exception) -> str:
    """Return what to say of a file that cannot be written: it names the file."""
    if isinstance(error, SceneError):
        return str(error)
    why = str(error) or "memory has run out"  # which a MemoryError does not say
    return f"{path}: cannot be written: {why}"


def write(
    path: Path, source: Source, stats: dict[str, str | int | float], grading: Grading
) -> None:
    """Write the picture so far, or the film. Raises SceneError, OSError."""
    if path.suffix.lower() == FILM and not isinstance(source, DenoisedPicture):
        saved = source.saved_film(held=True)
        if not saved.film.taken:
            raise SceneError("no pass has come to its end: there is no film yet", file=path)
        film_file.write(path, saved)
    else:
        layers.write_picture(
            path, source, names=grading.names, metadata=stats, exposure=grading.exposure,
            tone=grading.tone, view=grading.view,
        )  # fmt: skip
