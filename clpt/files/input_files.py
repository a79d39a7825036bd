"""The only way in for files that are read: regular files alone, and only where they may lie.

A name in a scene may lead to a device or a pipe, where a reader would wait for ever, or out of the
folder that its format keeps to.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import BinaryIO

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
