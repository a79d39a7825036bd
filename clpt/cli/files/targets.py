"""Names of the files that a command writes, and whether they can be written."""

from __future__ import annotations

from pathlib import Path

from clpt.files import output_files

from ...errors import SceneError

FILM = ".film"  # suffix of films, which hold all that a picture was made of
CHECKPOINT = ".resume.exr"  # ends the name of the film that a render goes on from


def default(scene: Path) -> tuple[Path, ...]:
    """Return where a scene's picture is written by default: in this folder, by the scene's name."""
    path = scene.resolve()
    stem = path.name.removesuffix(".gz").rpartition(".")[0] or path.name
    name = path.parent.name if stem == "scene" else stem
    return Path(f"{name}.exr"), Path(f"{name}.png")


def checked(paths: tuple[Path, ...]) -> tuple[Path, ...]:
    """Return the paths if files of these names can be written there. Raises SceneError."""
    from ... import images  # here: help needs no numpy

    for path in paths:
        if path.suffix.lower() != FILM:
            images.check_output(path)
        try:
            output_files.check_writable(path)
        except OSError as error:
            raise SceneError(f"cannot be written: {error}", file=path) from error
    return paths


def name_of(scene: Path) -> str:
    """Return the name by which a scene's files are called."""
    return default(scene)[0].stem


def is_film(path: Path) -> bool:
    """Whether a file has the name of a film."""
    return path.suffix.lower() == FILM or path.name.endswith(CHECKPOINT)
