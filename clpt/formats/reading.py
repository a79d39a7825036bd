"""Readers of all formats share these: errors with a location, names of files, colours, progress.

While errors are collected, a reader goes on after each of them. Programs of other systems write
the names of files in other ways; `find` finds the files. Grey stands for images that are missing.
"""

from __future__ import annotations

import gzip
import os
import unicodedata
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from clpt.errors import SceneError
from clpt.files import budget, input_files
from clpt.scene.roles import REFLECTANCE, Spectral


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


class Once:
    """A document whose parts are made once."""

    def __init__(self) -> None:
        self._parts: dict[object, Any] = {}

    def once(self, key: object, make: Callable[[], T]) -> T:
        """Return make(), called once for each key."""
        if key not in self._parts:
            self._parts[key] = make()
        part: T = self._parts[key]
        return part


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


def find(folder: Path, name: str) -> Path | None:
    """Return the file that `name` means in `folder`, None where there is none.

    The name may be quoted; backslashes may precede its blanks and divide its folders. If no name
    matches exactly, a single name that differs in case is taken; for a path of another machine,
    the file of that name in the folder.
    """
    name = name.strip()
    if len(name) > 1 and name[0] == name[-1] and name[0] in "\"'":
        name = name[1:-1].strip()
    for known in dict.fromkeys((name, name.replace("\\ ", " "), name.replace("\\", "/"))):
        if known and (path := _resolved(folder, known)) is not None:
            return input_files.named("mesh", folder, path)
    last = name.replace("\\", "/").rpartition("/")[2]
    path = _resolved(folder, last) if last else None
    return None if path is None else input_files.named("mesh", folder, path)


def _resolved(folder: Path, name: str) -> Path | None:
    try:
        if (folder / name).is_file():
            return folder / name
        here = Path("/") if name.startswith("/") else folder
        for part in [part for part in name.split("/") if part not in ("", ".")]:
            if (here / part).exists():
                here /= part
                continue
            alike = [entry for entry in os.listdir(here) if _folded(entry) == _folded(part)]
            if len(alike) != 1:
                return None
            here /= alike[0]
        return here if here.is_file() else None
    except (OSError, ValueError):  # no folder, or no name of a file
        return None


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", name).casefold()


GREY = np.full((1, 1, 3), 0.5, np.float32)
EVEN = np.array([[[0.5, 0.5, 1.0]]], np.float32)  # a normal map that bends nothing
GREY.flags.writeable = EVEN.flags.writeable = False


def grey_for(name: object) -> str:
    """Return the warning of an image that GREY or EVEN replaces."""
    return f"there is no file {str(name)!r}; grey stands for it"


def colour(role: Spectral, rgb: Sequence[float]) -> Any:
    """Return linear Rec.709 as the spectrum of a role; its kind checks the limits."""
    if role is REFLECTANCE or role.colour is None:
        return tuple(rgb)
    return role.colour(*rgb)
