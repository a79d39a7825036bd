"""Files that a command writes: names, checks, and `-o -` for the program behind a pipe."""

from __future__ import annotations

import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from clpt.files import output_files

from ...choices import WRITABLE
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
    """Return the name of a scene's files, without a suffix."""
    return default(scene)[0].stem


def is_film(path: Path) -> bool:
    """Whether a file has the name of a film."""
    return path.suffix.lower() == FILM or path.name.endswith(CHECKPOINT)


STANDARD = Path("-")
STANDARD_FORMATS = (*(suffix[1:] for suffix in WRITABLE), "film")
FOLDER = "clpt-picture-"  # begins the name of the folder that holds the file of a moment


def is_standard(path: Path) -> bool:
    """Whether this is the file that `standard_output` yields in the place of "-"."""
    return path.stem == STANDARD.name and path.parent.name.startswith(FOLDER)


@contextmanager
def standard_output(paths: tuple[Path, ...], form: str | None) -> Iterator[tuple[Path, ...]]:
    """Yield the paths, with a file in the place of "-"; at the end its content is printed.

    form: of FORMATS, png if None. Raises click.UsageError, SceneError where nobody reads it.
    """
    if STANDARD not in paths:
        if form is not None:
            raise click.UsageError("--format is for -o -; names of files have their own suffix")
        yield paths
        return
    if paths.count(STANDARD) > 1:
        raise click.UsageError("-o - can be given once")
    if sys.stdout.isatty():
        raise click.UsageError("a terminal shows no picture: send it on, as by -o - > picture.png")
    with tempfile.TemporaryDirectory(prefix=FOLDER) as folder:
        file = Path(folder) / f"{STANDARD}.{form or 'png'}"
        try:
            yield tuple(file if path == STANDARD else path for path in paths)
        finally:
            if file.exists():
                _print(file)


def _print(path: Path) -> None:
    """Copy a file to the standard output. Raises SceneError."""
    try:
        with path.open("rb") as file:
            shutil.copyfileobj(file, sys.stdout.buffer)
        sys.stdout.buffer.flush()
    except BrokenPipeError:
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, sys.stdout.fileno())  # what is left would be tried again at the exit
        raise SceneError("its reader is gone", file=STANDARD) from None
    except OSError as error:
        raise SceneError(f"cannot be written: {error}", file=STANDARD) from error
