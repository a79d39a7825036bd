"""The only way in for files that are read: regular files alone, and only where they may lie.

A name in a scene may lead to a device or a pipe, where a reader would wait for ever, or out of the
folder that its format keeps to.

Programs write text in UTF-8, in UTF-16 with a byte order mark, or in Latin-1. Readers of words and
numbers in bulk take `plain` bytes and decode only the names that they keep.
"""

from __future__ import annotations

import codecs
import os
import re
import stat
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.files import budget

ANYWHERE, BELOW = "anywhere", "in its own folder and below"
# Where the files may lie that a file of a format names; what is not here names none.
REACH = {
    "json": ANYWHERE,
    "mitsuba": ANYWHERE,
    "pbrt": ANYWHERE,
    "gltf": BELOW,
    "materialx": ANYWHERE,
    "usd": ANYWHERE,
    "mesh": ANYWHERE,  # .obj, with its .mtl, and .ply
}
POINTER = b"version https://git-lfs.github.com/spec/"  # git-lfs docs/spec.md
LARGEST_POINTER = 1024  # bytes
_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)
_FLAGS = os.O_RDONLY | getattr(os, "O_BINARY", 0) | getattr(os, "O_CLOEXEC", 0)
_NO_WAITING = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)


def named(form: str, folder: Path, path: Path) -> Path:
    """Return the path of a regular file that a file names, links followed.

    form: of the file that names it, in REACH; folder: of that file. Raises SceneError without its
    name, for whoever reads it knows the line.
    """
    try:
        if REACH[form] == BELOW and not path.resolve().is_relative_to(folder.resolve()):
            raise SceneError(f"{path.name!r} leads out of the file's folder, so it is not read")
        kind = _other_kind(path.stat())
    except SceneError:
        raise
    except (OSError, ValueError, RuntimeError):  # no name of a file, or links in a circle
        raise SceneError(f"there is no file {path.name!r}") from None
    if kind:
        raise SceneError(f"{path.name!r} is {kind}, not a file")
    return path


def checked(path: Path) -> Path:
    """Return the path of a regular file, which counts as read now. Raises SceneError."""
    budget.reads(regular(path))
    return path


def regular(path: Path) -> os.stat_result:
    """Return what the system says of a regular file. Raises SceneError for anything else."""
    try:
        status = path.stat()
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from None
    if kind := _other_kind(status):
        raise SceneError(f"is {kind}, not a file", file=path)
    if status.st_size <= LARGEST_POINTER and _is_pointer(path):
        message = "is a Git LFS pointer in place of the file: run `git lfs pull` where it lies"
        raise SceneError(message, file=path)
    return status


def _is_pointer(path: Path) -> bool:
    """Return whether a file is what a clone without Git LFS has in its place."""
    try:
        handle = os.open(path, _FLAGS | _NO_WAITING)
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from None
    try:
        return os.read(handle, len(POINTER)) == POINTER
    except OSError as error:
        raise _unreadable(path, error) from None
    finally:
        os.close(handle)


def opened(path: Path) -> BinaryIO:
    """Open a regular file for reading. Raises SceneError."""
    checked(path)  # first: to open a device may do something
    try:
        handle = os.open(path, _FLAGS | _NO_WAITING)  # a pipe that has come since does not wait
    except (OSError, ValueError) as error:
        raise _unreadable(path, error) from None
    if kind := _other_kind(os.fstat(handle)):
        os.close(handle)
        raise SceneError(f"is {kind}, not a file", file=path)
    return os.fdopen(handle, "rb")


def read_bytes(path: Path) -> bytes:
    """Read a regular file whole. Raises SceneError where there is too little memory for it."""
    with opened(path) as file:
        return content(file, path)


def content(file: BinaryIO, path: Path) -> bytes:
    """Return all bytes of a file that `opened` has opened. Raises as `read_bytes` does."""
    size = os.fstat(file.fileno()).st_size
    budget.check(size, "reading it", path)
    try:
        file.seek(0)
        return file.read(size)  # no more: some files of the system have no end
    except OSError as error:
        raise _unreadable(path, error) from None


def _other_kind(status: os.stat_result) -> str:
    """Return the name of a file's kind; "" for a regular file."""
    if stat.S_ISREG(status.st_mode):
        return ""
    return next((name for is_kind, name in _KINDS if is_kind(status.st_mode)), "something else")


def _unreadable(path: Path, error: Exception) -> SceneError:
    return SceneError(f"cannot be read: {getattr(error, 'strerror', None) or error}", file=path)


UTF_16 = {codecs.BOM_UTF16_LE: "utf-16-le", codecs.BOM_UTF16_BE: "utf-16-be"}
FILLING = b"\0\x1a"  # what some programs write behind the end of a text
COMMA = re.compile(r"\d,\d")


def plain(data: bytes) -> bytes:
    """Return a text without byte order mark, in an encoding that contains ASCII.

    UTF-16 becomes UTF-8; anything else is returned as it is.
    """
    if data.startswith(codecs.BOM_UTF8):
        return data[len(codecs.BOM_UTF8) :]
    if data[:2] in UTF_16:
        return data[2:].decode(UTF_16[data[:2]], "replace").encode("utf-8", "replace")
    return data


def decode(data: bytes) -> str:
    """Decode a text, or a part of a plain text: UTF-8, or else Latin-1."""
    data = plain(data)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def read(path: str | Path) -> str:
    """Read a text file; ends of lines become "\\n". Raises SceneError if it is missing."""
    data = read_bytes(Path(path))
    budget.check(8 * len(data), "its text", Path(path))
    return decode(data).replace("\r\n", "\n").replace("\r", "\n")


def comma_message(line: str) -> str | None:
    """Return what is wrong with a line of numbers with decimal commas; None if it has none.

    For formats without commas between numbers.
    """
    if COMMA.search(line) is None:
        return None
    return f"write numbers with a decimal point, not a comma: {line.strip()[:60]!r}"


def numbers(data: bytes, start: int = 0) -> NDArray[np.float64]:
    """Return the numbers of a plain text from a byte on, divided by blanks and ends of lines.

    Raises SceneError with the line of the first word that is none.
    """
    try:
        return np.array(data[start:].split(), np.float64)
    except ValueError:
        first = 1 + len(data[:start].splitlines())
        first -= start > 0 and data[start - 1] not in b"\r\n"
        lines = data[start:].splitlines()
        number, line = next((i, line) for i, line in enumerate(lines, first) if not _all(line))
        shown = decode(line).strip()
        message = comma_message(shown) or f"not all words are numbers: {shown[:60]!r}"
        raise SceneError(message, line=number) from None


def _all(line: bytes) -> bool:
    """Return whether all words of a line are numbers."""
    try:
        np.array(line.split(), np.float64)
    except ValueError:
        return False
    return True
