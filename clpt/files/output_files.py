"""Files that other processes see whole or not at all: the only way in which clpt writes a file.

A file is written under a name that begins with PARTIAL, and then renamed. The writer holds its
lock. So a killed process left such a file if its lock is free. The next process that writes into
the folder removes it.
"""

from __future__ import annotations

import hashlib
import os
import platform
import secrets
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from clpt.files import ownership

if sys.platform != "win32":
    import fcntl

PARTIAL = ".clpt-partial-"  # begins the name of a file that is not complete

LONGEST = 255  # bytes of a file's name

# Some network file systems keep locks within a machine. The name tells a file of another machine.
_HERE = f"{PARTIAL}{hashlib.sha256(platform.node().encode()).hexdigest()[:8]}-"
_FORGOTTEN = 86400.0  # [s] without a change after which nobody writes a file that has no lock
_looked_at: set[Path] = set()  # folders whose leftover files have been removed


def beside(path: Path, ending: str, most: int = LONGEST) -> Path:
    """Return the name of a file beside another: its name without suffix, and an ending.

    A name that would have more than `most` bytes is cut, and has a part of its checksum instead, so
    that different names stay different.
    """
    stem, room = path.stem, most - len(os.fsencode(ending))
    if len(os.fsencode(stem)) > room:
        mark = "-" + hashlib.sha256(os.fsencode(stem)).hexdigest()[:8]
        start = os.fsencode(stem)[: room - len(mark)]
        stem = start.decode("utf-8", "ignore") + mark
    return path.with_name(stem + ending)


@contextmanager
def replacing(path: str | Path, *, suffixed: bool = True, follow: bool = True) -> Iterator[Path]:
    """Yield the path of a new, empty file, which takes the place of `path` afterwards.

    The new file is in the same folder, and its content is on the disk before the old file goes. So
    an error, Ctrl-C, a full disk or a killed process leaves the old file as it was. A link stays a
    link: the file that it names is replaced, but for some links of other users, see
    `ownership.followed`. What is no regular file, such as a pipe, is yielded itself. suffixed:
    whether the new file has the suffix of `path`, by which libraries choose a format, and others
    find files to read. follow: False lets the new file take the place of a link or a pipe too.
    Raises OSError.
    """
    path = ownership.followed(path) if follow else Path(path)
    if follow and path.exists() and not path.is_file():
        yield path
        return
    if path.parent not in _looked_at:
        remove_left(path.parent)
        _looked_at.add(path.parent)
    with _partial(path, path.suffix if suffixed else "") as partial:
        yield partial
        with partial.open("rb") as file:
            os.fsync(file.fileno())
        os.replace(partial, path)
    _sync_folder(path.parent)


def write(path: str | Path, content: bytes) -> None:
    """Write a file as `replacing` does. Raises OSError."""
    with replacing(path, suffixed=False) as partial:
        partial.write_bytes(content)


def write_text(path: str | Path, text: str) -> None:
    """Write a text in UTF-8 as `replacing` does. Raises OSError."""
    write(path, text.encode())


def append_text(path: str | Path, text: str) -> None:
    """Add a text in UTF-8 at the end of a file, as `replacing` does. Raises OSError."""
    try:
        before = Path(path).read_bytes()
    except FileNotFoundError:
        before = b""
    write(path, before + text.encode())


def check_writable(path: str | Path) -> None:
    """Try whether `write` can write this file, and leave nothing behind. Raises OSError."""
    path = ownership.followed(path)
    if path.is_dir():
        raise IsADirectoryError("it is a folder")
    if path.exists() and not os.access(path, os.W_OK):
        raise PermissionError("the file is read-only")
    if not path.parent.is_dir():
        raise FileNotFoundError("its folder does not exist")
    if not path.exists() or path.is_file():
        try:
            with _partial(path, ""):
                pass
        except OSError as error:
            message = f"no file can be made there: {error.strerror}"
            raise PermissionError(message) from error


def check_folder(path: str | Path) -> None:
    """Try whether files can be made in a folder, and leave nothing behind. Raises OSError."""
    check_writable(_new_name(Path(path) / "file"))


def link(path: str | Path, other: str | Path) -> None:
    """Give the file at `path` a second name, so that it stays there when it is replaced.

    What had that name is gone. Nothing happens where there is no file, or no links can be made.
    """
    try:
        path = ownership.followed(path)
    except OSError:  # it is not this user's, or a circle
        return
    name = _new_name(path)
    try:
        if os.path.exists(other) and os.path.samefile(path, other):
            return  # a rename would do nothing
        os.link(path, name)
        os.replace(name, other)
    except OSError:  # a file system without links
        pass
    finally:
        with suppress(OSError):
            name.unlink()


def remove_left(folder: Path) -> None:
    """Remove the incomplete files that killed processes have left in a folder.

    Files of another user stay. A file of another machine, or of a file system without locks, stays
    for a day after its last change.
    """
    with suppress(OSError), os.scandir(folder) as entries:
        for path in [Path(entry.path) for entry in entries if entry.name.startswith(PARTIAL)]:
            with suppress(OSError):
                _remove_if_left(path)


def _remove_if_left(path: Path) -> None:
    """Remove a file if nobody writes it. Raises OSError."""
    facts = path.lstat()
    if not stat.S_ISREG(facts.st_mode) or (hasattr(os, "getuid") and facts.st_uid != os.getuid()):
        return
    forgotten = time.time() - facts.st_mtime > _FORGOTTEN
    handle = os.open(path, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    try:
        free = _lock(handle)
        if forgotten if free is None else free and (forgotten or path.name.startswith(_HERE)):
            path.unlink()
    finally:
        os.close(handle)


@contextmanager
def _partial(path: Path, suffix: str) -> Iterator[Path]:
    """Yield the path of a new, empty file beside `path`, which is removed if it is still there.

    It has the permissions of `path` if that exists. Raises OSError.
    """
    handle, partial = -1, _new_name(path, suffix)
    try:
        handle = os.open(partial, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
        while _lock(handle) is False or not partial.exists():  # another process removes it
            os.close(handle)
            partial = _new_name(path, suffix)
            handle = os.open(partial, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
        if path.exists():
            partial.chmod(path.stat().st_mode & 0o777)
        if sys.platform == "win32":  # which renames no open file
            os.close(handle)
            handle = -1
        yield partial
    except OSError as error:
        if str(error.filename) != str(partial):
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error  # a name that people know
    finally:
        with suppress(OSError):
            partial.unlink()
        if handle >= 0:
            with suppress(OSError):
                os.close(handle)


def _new_name(path: Path, suffix: str = "") -> Path:
    """Return an unused name beside `path`; all such names have the same length."""
    return path.with_name(f"{_HERE}{secrets.token_hex(8)}{suffix}")


def _lock(handle: int) -> bool | None:
    """Whether the lock of an open file could be taken; None where there are no locks."""
    if sys.platform == "win32":
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # some network file systems
        return None
    return True


def _sync_folder(folder: Path) -> None:
    """Bring a folder's new names to the disk, where the system can do that."""
    if os.name != "posix":
        return
    with suppress(OSError):  # a folder that cannot be read, some network file systems
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
