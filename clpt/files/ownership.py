"""Who can change what lies at a path: other users of the machine, by the folders on the way to it.

A path is followed here as the system does it, a folder and a link at a time.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from functools import cache
from pathlib import Path

MOST_LINKS = 40  # on the way to a file, as Linux has it
OTHERS = stat.S_IWGRP | stat.S_IWOTH


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


def fault(path: str | Path) -> str | None:
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
