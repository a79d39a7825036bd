"""Failures of libraries that read pictures, raised as errors of clpt."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from clpt.errors import SceneError
from clpt.files import input_files


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
