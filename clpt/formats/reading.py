"""Readers of all formats share these: errors with a location, collected errors, packed files.

While errors are collected, a reader goes on after each of them.
"""

from __future__ import annotations

import gzip
import os
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeVar

from clpt.errors import SceneError
from clpt.files import budget, input_files


class Located(ABC):
    """A part of a file that errors can name."""

    @abstractmethod
    def location(self) -> dict[str, Any]:
        """Return `file`, `line` and `where`, as SceneError takes them."""

    def error(self, message: str) -> SceneError:
        """Return an error that says `message` about this part."""
        return SceneError(message, **self.location())

    @contextmanager
    def locating(self) -> Iterator[None]:
        """Give errors that name no file this location."""
        try:
            yield
        except SceneError as error:
            if error.file is not None:
                raise
            raise self.relocated(error) from None

    def relocated(self, error: SceneError) -> SceneError:
        """Return an error at this location; what `error` named is kept in the message."""
        return self.error(f"{error.where}: {error.message}" if error.where else error.message)


T = TypeVar("T")
Progress = Callable[[float, str], None]  # called with the share that is read, and a text
MOST = 200  # errors that are kept
_found: ContextVar[list[SceneError] | None] = ContextVar("blockers", default=None)


def attempt(make: Callable[[], T], grey: T) -> T:
    """Return make(). While errors are collected, return `grey` in place of a SceneError."""
    try:
        return make()
    except SceneError as error:
        if not note(error):
            raise
        return grey


def note(error: SceneError) -> bool:
    """Keep an error while errors are collected; else return False."""
    errors = _found.get()
    if errors is None or len(errors) >= MOST:
        return False
    errors.append(error)
    return True


@contextmanager
def collecting() -> Iterator[list[SceneError]]:
    """Collect the errors of readers that run inside; the list grows with each error."""
    errors: list[SceneError] = []
    token = _found.set(errors)
    try:
        yield errors
    finally:
        _found.reset(token)


CHUNK = 1 << 22
WHAT = "unpacking it"


def read_bytes(path: Path) -> bytes:
    """Read a file, unpacked if it is gzip's.

    Raises SceneError for a file that is broken, or takes too much memory.
    """
    with input_files.opened(path) as file:
        if file.read(2) != b"\x1f\x8b":
            return input_files.content(file, path)
        try:
            file.seek(-4, os.SEEK_END)
            budget.check(2 * int.from_bytes(file.read(4), "little"), WHAT, path)  # as it says
            file.seek(0)
            with gzip.open(file) as stream:
                parts, size = [], 0
                while part := stream.read(CHUNK):
                    parts.append(part)
                    size += len(part)
                    budget.check(2 * size, WHAT, path)
            return b"".join(parts)
        except SceneError:
            raise
        except (OSError, EOFError, ValueError, zlib.error) as error:
            reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
            raise SceneError(f"cannot be read: {reason}", file=path) from None
