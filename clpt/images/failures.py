"""What goes wrong in a library that reads a picture, told as one of our errors."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from clpt.errors import SceneError


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
