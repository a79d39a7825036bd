"""Files in the user's cache folder, which may be deleted at any time.

Several processes may use the folder at once: each file is written whole or not at all. Links and
files of other users count as missing. The least recently used files are deleted if all together
take more than LIMIT.
"""

from __future__ import annotations

import functools
import hashlib
import json
import logging
import os
import re
import stat
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import platformdirs

from clpt.device import forking
from clpt.files import output_files

from .source import Source

if sys.platform != "win32":
    import fcntl

log = logging.getLogger(__name__)

LIMIT = 2**30  # bytes
_PARTS = ("programs", "failed")  # the folders within LIMIT
_TEMPORARY = (
    () if os.name != "posix" else (Path("/tmp"), Path("/var/tmp"))
)  # besides Python's folder
# Folders in the user's cache folder with code that drivers and libraries run: PyOpenCL, PoCL,
# Intel, Mesa, AMD and NVIDIA.
_OF_OTHERS = (
    "pytools", "pyopencl", "pocl", "neo_compiler_cache", "mesa_shader_cache",
    "mesa_shader_cache_db", "rusticl", "comgr", "nvidia",
)  # fmt: skip
WAIT = 300.0  # [s] for another process's build
_STEP = LIMIT // 16  # bytes that a process writes between two checks of the folder's size

_lock = forking.renewed(threading.Lock())
_written = _STEP  # bytes since the last check: the first file triggers a check


def folder() -> Path:
    """Return clpt's folder in the user's cache folder, or a temporary folder.

    The temporary folder is used, with a warning, if the user's folder cannot be written or other
    users can write to it: a driver runs code from the folder.
    """
    return private_folder(user_folder("clpt"))


def user_folder(name: str | None = None) -> Path:
    """Return the user's folder for caches, or a program's folder in it.

    For a user without a home, and if other users could write to the folder, it is a temporary
    folder, with a warning: drivers and PyOpenCL run code from it. XDG_CACHE_HOME then points
    there.
    """
    try:
        wanted = platformdirs.user_cache_path(appauthor=False)
        chosen = _safe_home(wanted)
    except RuntimeError:  # HOME is unset, and the system has no entry for the user
        return _without_home() / (name or "")
    if chosen != wanted:
        os.environ["XDG_CACHE_HOME"] = str(chosen)
    return platformdirs.user_cache_path(name, appauthor=False)


@functools.cache
def _safe_home(wanted: Path) -> Path:
    """Return the user's folder for caches, or a temporary folder if it is unfit."""
    reason = unfit(wanted, _OF_OTHERS)
    if reason is None:
        return wanted
    other = temporary_folder() / "xdg"
    log.warning("the cache folder %s %s; %s is used instead", wanted, reason, other)
    return other


def has_home() -> bool:
    """Return whether this user has a folder for caches."""
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
    """Return `wanted`, created if missing, or a temporary folder if it is unfit."""
    reason = unfit(wanted)
    if reason is None:
        return wanted
    other = temporary_folder() / wanted.name
    log.warning("the cache folder %s %s; %s is used instead", wanted, reason, other)
    return other


@functools.cache
def temporary_folder() -> Path:
    """Return a temporary folder for caches that only this user can write."""
    user = os.getuid() if hasattr(os, "getuid") else "user"
    first = Path(tempfile.gettempdir())
    for root in (first, *_TEMPORARY):
        if unfit(root / f"clpt-{user}") is None:
            return root / f"clpt-{user}"
    safe = (root for root in (first, *_TEMPORARY) if _why_unsafe(root / "new") is None)
    return Path(tempfile.mkdtemp(prefix="clpt-", dir=next(safe, first)))


def _why_unsafe(path: Path) -> str | None:
    """Return how other users could replace a folder, or why this is unknown; None if safe."""
    try:
        return output_files.ownership_fault(path)
    except OSError as error:
        return f"cannot be read ({error.strerror or error})"


def unfit(path: Path, parts: Collection[str] | None = None) -> str | None:
    """Return why a folder cannot hold a cache; None if it can. Create it if missing.

    Folders in it must be safe too: all of them, or the names in `parts`.
    """
    try:
        if reason := output_files.ownership_fault(path):
            return reason
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        output_files.check_folder(path)
        if os.name != "posix":
            return None
        inside = path.iterdir() if parts is None else (path / name for name in parts)
        for part in (path, *(entry for entry in inside if entry.is_dir())):
            if {part.lstat().st_uid, part.stat().st_uid} != {os.getuid()}:
                return "belongs to another user"
            if output_files.others_write(part.stat()):
                return f"can be written by others (see: chmod go-w {part})"
    except OSError as error:
        return f"cannot be written ({error.strerror or error})"
    return None


def store(entry: str, header: str, binary: bytes, root: Path | None = None) -> None:
    """Write a program's binary and a line of text under a key; a full disk is no error.

    root: the cache folder, if another process chose it.
    """
    content = header.encode() + b"\n" + binary
    check = hashlib.sha256(content).hexdigest().encode()
    try:
        _keep((root or folder()) / "programs" / entry, check + b"\n" + content)
    except OSError as error:
        _warn(f"the cache cannot be written, so programs are compiled again: {error}")


def holds(entry: str) -> bool:
    """Return whether an entry exists for a key; it may be damaged."""
    return (folder() / "programs" / entry).exists()


def forget(entry: str) -> None:
    """Remove what `store` has written."""
    with suppress(OSError):
        (folder() / "programs" / entry).unlink()


def load(entry: str) -> tuple[str, bytes] | None:
    """Return the header and binary of `store`; None if they are missing or damaged.

    Drivers crash on a damaged binary, so a checksum is compared.
    """
    path = folder() / "programs" / entry
    try:
        check, _, content = read(path).partition(b"\n")
    except FileNotFoundError:
        return None
    except OSError:
        check, content = b"", b""
    with suppress(OSError):
        os.utime(path)  # marks the last use, which many systems do not note
    if hashlib.sha256(content).hexdigest().encode() != check:
        _warn(f"a file in {path.parent} is damaged or of another user: its program is built again")
        return None
    header, _, binary = content.partition(b"\n")
    return header.decode(), binary


def remembered(code: Iterable[str], texts: Iterable[bytes], make: Callable[[], Any]) -> Any:
    """Return a value of JSON; read it if a process has stored it.

    code: the files whose program makes it; texts: what else it depends on; make: returns it anew.
    """
    sources = (Path(file).read_bytes() for file in code)
    entry = hashlib.sha256(b"\0".join([*sources, *texts])).hexdigest()
    stored = load(entry)
    if stored is not None:
        return json.loads(stored[0])
    value = make()
    store(entry, json.dumps(value), b"")
    return value


@contextmanager
def exclusive(entry: str) -> Iterator[None]:
    """Hold the lock of an entry; wait at most WAIT for another process that holds it.

    Does not wait if the file system has no locks.
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
    """Lock a file when no other process holds it, or continue without a lock after WAIT."""
    end, reported = time.monotonic() + WAIT, False
    while not _locks(handle) and time.monotonic() < end:
        if not reported:
            log.info("another process builds the same program: waiting for it")
        reported = True
        time.sleep(0.05)


def is_being_built(entry: str) -> bool:
    """Return whether another process holds the lock of an entry, see `exclusive`."""
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
    """Lock a file; return False if another process holds it. True without file locks."""
    if sys.platform != "win32":
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError as error:
            log.debug("files have no locks, so processes may build the same program: %s", error)
    return True


@functools.cache
def _warn(text: str) -> None:
    """Log a warning once a process."""
    log.warning("%s", text)


def keep_failed(source: Source) -> str | None:
    """Write the text of a program that failed to build; return its path, None on failure."""
    digest = hashlib.sha256(source.text.encode()).hexdigest()[:12]
    stem = re.sub(r"\W", "_", source.name.removesuffix(".cl"))
    path = folder() / "failed" / f"{stem}-{digest}.cl"
    try:
        _keep(path, source.text.encode())
    except OSError:
        return None
    return str(path)


def prune(root: Path, limit: int = LIMIT, *, parts: tuple[str, ...] = _PARTS) -> None:
    """Delete the least recently used files until all take at most `limit` bytes.

    parts: folders in `root`.
    """
    files = []
    for path in (path for part in parts for path in (root / part).glob("*")):
        if path.name.startswith(output_files.PARTIAL):
            continue
        with suppress(OSError):  # another process deleted it
            status = path.lstat()
            files.append((status.st_mtime, status.st_size, path))
    used = sum(size for _, size, _ in files)
    for _, size, path in sorted(files):
        if used <= limit:
            break
        try:
            path.unlink(missing_ok=True)
        except OSError as error:  # on Windows an open file stays
            log.debug("%s stays in the cache: %s", path, error)
            continue
        used -= size


def read(path: Path) -> bytes:
    """Return the content of a file of this user. Raises OSError for any other file."""
    with open(own_file(path), "rb") as file:
        return file.read()


def own_file(path: Path) -> int:
    """Open a file of this user for reading; return its handle.

    Raises OSError for a link, a folder or a pipe, and for a file of another user.
    """
    flags = os.O_RDONLY | getattr(os, "O_BINARY", 0)
    if os.name != "posix":
        return os.open(path, flags)
    handle = os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK)  # a pipe would block
    status = os.fstat(handle)
    if stat.S_ISREG(status.st_mode) and status.st_uid == os.getuid():
        return handle
    os.close(handle)
    raise PermissionError(f"{path} is no file of this user")


def write(path: Path, content: bytes) -> None:
    """Write a file in a cache; it replaces a link or a pipe too. Raises OSError."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    if path.is_symlink() or (path.exists() and not path.is_file()):
        path.unlink()
    output_files.write(path, content)


def _keep(path: Path, content: bytes) -> None:
    """Write a file of the cache, and prune the cache from time to time."""
    global _written
    write(path, content)
    with _lock:
        _written += len(content)
        due = _written >= _STEP
        _written = 0 if due else _written
    if due:
        prune(path.parent.parent)
