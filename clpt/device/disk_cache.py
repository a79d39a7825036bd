"""Files in the user's cache folder, all of which may be deleted at any time.

Several processes may use the folder at once: each file is written whole or not at all, and a file
that another process has deleted is one that is missing. So is a link, or a file that another user
has written. The files that were used longest ago are deleted where all together take more than
LIMIT.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import stat
import sys
import tempfile
import threading
import time
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import platformdirs

from clpt.device import forking
from clpt.files import output_files, ownership

from .source import Source

if sys.platform != "win32":
    import fcntl

log = logging.getLogger(__name__)

LIMIT = 2**30  # bytes
_PARTS = ("programs", "failed")  # the folders that are kept within LIMIT
_TEMPORARY = () if os.name != "posix" else (Path("/tmp"), Path("/var/tmp"))  # beside Python's own
# Folders in the user's cache folder whose files drivers and libraries run: of PyOpenCL, of PoCL,
# Intel, Mesa, AMD and NVIDIA.
_OF_OTHERS = (
    "pytools", "pyopencl", "pocl", "neo_compiler_cache", "mesa_shader_cache",
    "mesa_shader_cache_db", "rusticl", "comgr", "nvidia",
)  # fmt: skip
WAIT = 300.0  # [s] for what another process makes
_STEP = LIMIT // 16  # bytes that a process writes before it looks at the folder's size again

_lock = forking.renewed(threading.Lock())
_written = _STEP  # bytes since the folder's size was looked at: a process looks at its first file


def folder() -> Path:
    """Return clpt's folder in the user's cache folder, or a temporary one in its place.

    The user's folder is passed over, with one warning, where it cannot be written, or where others
    can write: a driver runs what the folder holds.
    """
    return private_folder(user_folder("clpt"))


def user_folder(name: str | None = None) -> Path:
    """Return the user's folder for caches, or that of a program in it.

    It is a temporary one, with one warning, for a user without a home, and where other users could
    put something into it: drivers and PyOpenCL run what they find there. XDG_CACHE_HOME, by which
    they find it, is set so then.
    """
    try:
        wanted = platformdirs.user_cache_path(appauthor=False)
        chosen = _safe_home(wanted)
    except RuntimeError:  # HOME is not set, and the system has no entry for the user
        return _without_home() / (name or "")
    if chosen != wanted:
        os.environ["XDG_CACHE_HOME"] = str(chosen)
    return platformdirs.user_cache_path(name, appauthor=False)


@functools.cache
def _safe_home(wanted: Path) -> Path:
    """Return the user's folder for caches, or a temporary one if it cannot be used."""
    reason = unfit(wanted, _OF_OTHERS)
    if reason is None:
        return wanted
    other = temporary_folder() / "xdg"
    log.warning("the cache folder %s %s; %s is used instead", wanted, reason, other)
    return other


def has_home() -> bool:
    """Whether there is a folder for this user's caches."""
    try:
        platformdirs.user_cache_path()
    except RuntimeError:
        return False
    return True


@functools.cache
def _without_home() -> Path:
    other = temporary_folder()
    log.warning("this user has no home folder: caches go to %s; set HOME to keep them", other)
    return other


@functools.cache
def private_folder(wanted: Path) -> Path:
    """Return `wanted`, made where it is missing, or a temporary folder if it cannot be used."""
    reason = unfit(wanted)
    if reason is None:
        return wanted
    other = temporary_folder() / wanted.name
    log.warning("the cache folder %s %s; %s is used instead", wanted, reason, other)
    return other


@functools.cache
def temporary_folder() -> Path:
    """Return a temporary folder for caches, which only this user can write."""
    user = os.getuid() if hasattr(os, "getuid") else "user"
    first = Path(tempfile.gettempdir())
    for root in (first, *_TEMPORARY):
        if unfit(root / f"clpt-{user}") is None:
            return root / f"clpt-{user}"
    safe = (root for root in (first, *_TEMPORARY) if _why_unsafe(root / "new") is None)
    return Path(tempfile.mkdtemp(prefix="clpt-", dir=next(safe, first)))


def _why_unsafe(path: Path) -> str | None:
    """Return how other users could put something in the place of a folder, or why none can tell."""
    try:
        return ownership.fault(path)
    except OSError as error:
        return f"cannot be read ({error.strerror or error})"


def unfit(path: Path, parts: Collection[str] | None = None) -> str | None:
    """Return why a folder cannot hold a cache; None if it can. It is made where it is missing.

    Folders in it are to be safe too: all of them, or those of the names in `parts`.
    """
    try:
        if reason := ownership.fault(path):
            return reason
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        output_files.check_folder(path)
        if os.name != "posix":
            return None
        inside = path.iterdir() if parts is None else (path / name for name in parts)
        for part in (path, *(one for one in inside if one.is_dir())):
            if {part.lstat().st_uid, part.stat().st_uid} != {os.getuid()}:
                return "belongs to another user"
            if ownership.others_write(part.stat()):
                return f"can be written by others (see: chmod go-w {part})"
    except OSError as error:
        return f"cannot be written ({error.strerror or error})"
    return None


def store(entry: str, header: str, binary: bytes, root: Path | None = None) -> None:
    """Write a program's binary under a key, with a line of text; a full disk is no error.

    root: the cache folder, where another process tells it.
    """
    content = header.encode() + b"\n" + binary
    check = hashlib.sha256(content).hexdigest().encode()
    try:
        _keep((root or folder()) / "programs" / entry, check + b"\n" + content)
    except OSError as error:
        _warn(f"the cache cannot be written, so programs are compiled again: {error}")


def holds(entry: str) -> bool:
    """Return whether something was written under a key, perhaps damaged since."""
    return (folder() / "programs" / entry).exists()


def load(entry: str) -> tuple[str, bytes] | None:
    """Return header and binary that `store` wrote; None if they are missing or damaged.

    The checksum is needed, since drivers crash on a damaged binary.
    """
    path = folder() / "programs" / entry
    try:
        check, _, content = read(path).partition(b"\n")
    except FileNotFoundError:
        return None
    except OSError:
        check, content = b"", b""
    with suppress(OSError):
        os.utime(path)  # it was used now; many systems do not note that
    if hashlib.sha256(content).hexdigest().encode() != check:
        _warn(f"a file in {path.parent} is damaged or of another user: its program is built again")
        return None
    header, _, binary = content.partition(b"\n")
    return header.decode(), binary


@contextmanager
def alone(entry: str) -> Iterator[None]:
    """Keep other processes from making an entry meanwhile; first wait for one that is at it.

    Nobody waits for longer than WAIT, nor where files have no locks.
    """
    path, handle = _lock_of(entry), None
    with suppress(OSError):
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        handle = os.open(path, os.O_CREAT | os.O_RDWR, 0o600)
    if handle is None:
        yield
        return
    try:
        _wait_for(handle)
        yield
    finally:
        with suppress(OSError):
            path.unlink()
        os.close(handle)


def _wait_for(handle: int) -> None:
    """Lock a file as soon as no other process has, or go on without after WAIT."""
    end, told = time.monotonic() + WAIT, False
    while not _locks(handle) and time.monotonic() < end:
        if not told:
            log.info("another process builds the same program: waiting for it")
        told = True
        time.sleep(0.05)


def is_being_made(entry: str) -> bool:
    """Return whether another process is making an entry, see `alone`."""
    try:
        handle = os.open(_lock_of(entry), os.O_RDWR)
    except OSError:
        return False
    try:
        return not _locks(handle)
    finally:
        os.close(handle)


def _lock_of(entry: str) -> Path:
    return folder() / "locks" / entry


def _locks(handle: int) -> bool:
    """Lock a file; False if another process has done so. True where files have no locks."""
    if sys.platform != "win32":
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError as error:
            log.debug("no lock keeps processes from the same work: %s", error)
    return True


@functools.cache
def _warn(text: str) -> None:
    """Log a warning, once."""
    log.warning("%s", text)


def keep_failed(source: Source) -> str | None:
    """Write the text of a program that did not build; return its path, None if that fails."""
    digest = hashlib.sha256(source.text.encode()).hexdigest()[:12]
    stem = source.name.replace("/", "_").removesuffix(".cl")
    path = folder() / "failed" / f"{stem}-{digest}.cl"
    try:
        _keep(path, source.text.encode())
    except OSError:
        return None
    return str(path)


def prune(root: Path, limit: int = LIMIT, *, parts: tuple[str, ...] = _PARTS) -> None:
    """Delete the files that were used longest ago, until all take at most `limit` bytes.

    parts: their folders in `root`.
    """
    found = []
    for path in (path for part in parts for path in (root / part).glob("*")):
        if path.name.startswith(output_files.PARTIAL):
            continue
        with suppress(OSError):  # another process has deleted it
            facts = path.lstat()
            found.append((facts.st_mtime, facts.st_size, path))
    used = sum(size for _, size, _ in found)
    for _, size, path in sorted(found):
        if used <= limit:
            break
        try:
            path.unlink(missing_ok=True)
        except OSError as error:  # on Windows a file that is open stays
            log.debug("%s stays in the cache: %s", path, error)
            continue
        used -= size


def read(path: Path) -> bytes:
    """Return the content of a file that this user has written. Raises OSError for any other."""
    with open(own_file(path), "rb") as file:
        return file.read()


def own_file(path: Path) -> int:
    """Open a file of this user for reading; return its handle.

    Raises OSError for a link, a folder or a pipe, and for a file of another user.
    """
    flags = os.O_RDONLY | getattr(os, "O_BINARY", 0)
    if os.name != "posix":
        return os.open(path, flags)
    handle = os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK)  # a pipe has no end
    facts = os.fstat(handle)
    if stat.S_ISREG(facts.st_mode) and facts.st_uid == os.getuid():
        return handle
    os.close(handle)
    raise PermissionError(f"{path} is no file of this user")


def write(path: Path, content: bytes) -> None:
    """Write a file in a cache, in the place of a link or a pipe too. Raises OSError."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    if path.is_symlink() or (path.exists() and not path.is_file()):
        path.unlink()
    output_files.write(path, content)


def _keep(path: Path, content: bytes) -> None:
    """Write a file of the cache, and keep the cache within its limit."""
    global _written
    write(path, content)
    with _lock:
        _written += len(content)
        due = _written >= _STEP
        _written = 0 if due else _written
    if due:
        prune(path.parent.parent)
