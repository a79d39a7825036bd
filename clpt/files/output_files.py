"""Files that other processes see whole or not at all: clpt writes files only this way.

A file is written under a name that begins with PARTIAL, and then renamed. The writer holds its
lock. So a killed process left such a file if its lock is free. The next process that writes into
the folder removes it.

Other users of the machine may be able to change a path: its ownership is followed as the system
follows the path, a folder and a link at a time.
"""

from __future__ import annotations

import errno
import hashlib
import os
import platform
import secrets
import stat
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

if sys.platform != "win32":
    import fcntl

MOST_LINKS = 40  # on the way to a file, as Linux has it
OTHERS = stat.S_IWGRP | stat.S_IWOTH
PARTIAL = ".clpt-partial-"  # begins the name of a file that is not complete
LONGEST = 255  # bytes of a file's name

# Some network file systems keep locks within a machine. The name tells a file of another machine.
_HERE = f"{PARTIAL}{hashlib.sha256(platform.node().encode()).hexdigest()[:8]}-"
_FORGOTTEN = 86400.0  # [s] without a change after which nobody writes a file that has no lock
_looked_at: set[Path] = set()  # folders whose leftover files have been removed


def way(path: str | Path) -> Iterator[tuple[Path, bool]]:
    """Yield each folder, link and file on the way to a path, and whether it is a link.

    The last path is the target, which may be missing. Raises OSError for links in a
    circle.
    """
    at, links = Path(os.path.abspath(os.sep)), 0
    whole = Path(path) if os.path.isabs(path) else Path(os.getcwd(), path)
    left = [*reversed(whole.parts)]
    while left:
        part = left.pop()
        at = Path(part) if os.path.isabs(part) else at.parent if part == ".." else at / part
        try:
            target = os.readlink(at)
        except OSError:  # no link, or nothing
            yield at, False
            continue
        yield at, True
        links += 1
        if links > MOST_LINKS:
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
        at = at.parent
        left += reversed(Path(target).parts)


def followed(path: str | Path) -> Path:
    """Return where a path leads to, for a file that is written.

    The rule is that of Linux's fs.protected_symlinks and protected_fifos, whatever these are set
    to: in a sticky folder that all can write, such as /tmp, no link of another user is followed
    unless the folder is that user's too, and nothing is written into a pipe or a device like that.

    Raises PermissionError by the rule, else OSError for links in a circle.
    """
    if os.name != "posix":
        return Path(os.path.realpath(path))
    at = Path(path)
    for at, is_link in way(path):
        if is_link and not _is_trusted(at):
            message = "a link of another user, in a folder that all can write, is not followed"
            raise PermissionError(errno.EACCES, message, str(at))
    if at.exists() and not at.is_file() and not at.is_dir() and not _is_trusted(at):
        message = "a pipe of another user, in a folder that all can write, is not written"
        raise PermissionError(errno.EACCES, message, str(at))
    return at


def _is_trusted(at: Path) -> bool:
    """Return whether a link or a pipe may be followed, by its owner and its folder."""
    folder, link = at.parent.stat(), at.lstat()
    shared = stat.S_ISVTX | stat.S_IWOTH
    return folder.st_mode & shared != shared or link.st_uid in (os.geteuid(), folder.st_uid)


def ownership_fault(path: str | Path) -> str | None:
    """Return how other users could put something in the place of a folder; None if they cannot.

    The folder and those above it up to the root, links followed, are to be of this user or the
    system's, and to be written by nobody else. A sticky folder above is allowed to be: there nobody
    takes away what is another user's. What is missing is left out. Raises OSError.
    """
    if os.name != "posix":
        return None
    steps = list(way(path))
    for number, (at, is_link) in enumerate(steps):
        try:
            facts = at.lstat()
        except FileNotFoundError:
            return None
        last = number == len(steps) - 1
        where = "" if last else f"lies in {at}, which "
        if facts.st_uid not in _trusted():
            return f"{where}belongs to another user"
        above = facts.st_mode & stat.S_ISVTX and not last
        if not is_link and not above and others_write(facts):
            return f"{where}can be written by others (see: chmod go-w {at})"
    return None


def others_write(facts: os.stat_result) -> bool:
    """Return whether others than the owner can write; a group of this user alone is no other."""
    if facts.st_mode & stat.S_IWOTH:
        return True
    return bool(facts.st_mode & stat.S_IWGRP) and facts.st_gid != _own_group()


@cache
def _own_group() -> int | None:
    """Return the group with this user's name if it has no other member."""
    try:
        import grp
        import pwd

        user = pwd.getpwuid(os.getuid())
        group = grp.getgrgid(user.pw_gid)
    except (ImportError, KeyError):
        return None
    alone = group.gr_name == user.pw_name and not {*group.gr_mem} - {user.pw_name}
    return user.pw_gid if alone else None


def _trusted() -> set[int]:
    """Return the users whose folders are safe: this user, and the system's.

    Where root has no number, as in a container without privileges, its folders have the number of
    nobody.
    """
    return {0, os.getuid(), *_of_nobody()}


@cache
def _of_nobody() -> tuple[int, ...]:
    """Return the number of users that this namespace does not have; none where it has all."""
    try:
        rows = Path("/proc/self/uid_map").read_text("ascii").split("\n")
        outside = [int(row.split()[1]) for row in rows if row.strip()]
        if 0 in outside:
            return ()
        return (int(Path("/proc/sys/kernel/overflowuid").read_text("ascii")),)
    except (OSError, ValueError, IndexError):
        return ()


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
    link: the file that it names is replaced, but for some links of other users, see `followed`. A
    pipe, or another file that is not regular, is yielded itself. suffixed: whether the new file has
    the suffix of `path`: libraries choose a format by it, and other programs find files to read.
    follow: False lets the new file take the place of a link or a pipe too. Raises OSError.
    """
    path = followed(path) if follow else Path(path)
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
    path = followed(path)
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
        path = followed(path)
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
