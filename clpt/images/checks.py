"""Checks of image files before and during reading: existence, size, faults of libraries."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from clpt.errors import SceneError
from clpt.files import input_files

PIXELS = 1 << 29  # of an image


def check_there(path: Path) -> None:
    """Raise SceneError unless there is a regular file; it counts as read."""
    try:
        exists = path.exists()
    except (OSError, ValueError):  # no name of a file
        exists = False
    if not exists:
        raise SceneError("no such image file", file=path)
    input_files.checked(path)


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn every error inside into a SceneError about a file."""
    try:
        yield
    except SceneError as error:
        if error.file is not None:
            raise
        raise SceneError(error.message, file=path, where=error.where) from None
    except MemoryError:
        raise SceneError("reading it takes more memory than there is", file=path) from None
    except Exception as error:  # the libraries raise their own, from struct.error to RuntimeError
        message = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise SceneError(f"not a readable image: {message}", file=path) from error


def check_size(file: Path | None, width: int, height: int) -> None:
    """Raise SceneError for an image of more than PIXELS pixels.

    A file of a few kilobytes can announce gigabytes of pixels, so its header is checked before
    memory is taken. Readers ask `clpt.files.budget` for the memory itself.
    """
    if width * height > PIXELS:
        message = f"has {width}x{height} pixels, more than the {PIXELS} that are read"
        raise SceneError(message, file=file)
