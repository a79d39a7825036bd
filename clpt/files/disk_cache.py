"""Files in the user's cache folder, which may be deleted at any time.

Several processes may use the folder at once: each file is written whole or not at all. Links and
files of other users count as missing. The least recently used files are deleted if all together
take more than LIMIT.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import pickle
import re
import stat
import sys
import tempfile
import time
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import platformdirs

from clpt.files import output_files

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
WORTH = 5e-3  # [s] a value that is made in less time is not kept
WAIT = 300.0  # [s] for another process's build
_STEP = LIMIT // 16  # bytes that a process writes between two checks of the folder's size
_LARGEST = LIMIT // 8  # bytes of a value that is kept
_FRESH = 2.0  # [s] a younger file may be written again without a trace in its times

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
        whole = read(path)
    except FileNotFoundError:
        return None
    except OSError:
        whole = b""
    with suppress(OSError):
        os.utime(path)  # marks the last use, which many systems do not note
    if hashlib.sha256(memoryview(whole)[65:]).hexdigest().encode() != whole[:64]:
        _warn(f"a file in {path.parent} is damaged or of another user: its program is built again")
        return None
    end = whole.index(b"\n", 65)
    return whole[65:end].decode(), whole[end + 1 :]


@functools.cache
def _digest(files: tuple[str | Path, ...]) -> bytes:
    """Return a hash of files, and of the versions that a pickle depends on."""
    numpy = sys.modules.get("numpy")
    digest = hashlib.sha256(repr((sys.version, numpy and numpy.__version__)).encode())
    for file in files:
        digest.update(Path(file).read_bytes())
    return digest.digest()


def entry_of(code: Iterable[str | Path], content: Iterable[Any]) -> str:
    """Return the key of a value. code: the program's files; content: bytes, contiguous arrays."""
    digest = hashlib.sha256(_digest(tuple(code)))
    for part in content:
        digest.update(memoryview(part).nbytes.to_bytes(8, "little"))
        digest.update(part)
    return digest.hexdigest()


def _keep_value(entry: str, value: object) -> None:
    packed = pickle.dumps(value, pickle.HIGHEST_PROTOCOL)
    if len(packed) <= _LARGEST:
        store(entry, "value", packed)


def remembered(code: Iterable[str | Path], content: Iterable[Any], make: Callable[[], Any]) -> Any:
    """Return a value that can be pickled; read it if a process has stored it.

    code: the files whose program makes it; content: bytes and C-contiguous arrays on which it
    depends besides; make: returns it anew, and is worth an entry if it takes WORTH. The last bits
    may come from another processor that shares the folder.
    """
    entry = entry_of(code, content)
    stored = load(entry)
    if stored is not None:
        return pickle.loads(stored[1])
    start = time.perf_counter()
    value = make()
    if time.perf_counter() - start >= WORTH:
        _keep_value(entry, value)
    return value


class OfFiles:
    """Values made of many files, kept in a single entry for the next process.

    code: the files whose program makes them; name: of the entry, None to keep nothing.
    """

    def __init__(self, code: Iterable[str | Path] = (), name: str | None = None):
        self._entry = None if name is None else entry_of(code, [name.encode()])
        self._used: dict[Any, Any] = {}
        self._changed = False

    @functools.cached_property
    def _stored(self) -> dict[Any, Any]:
        stored = None if self._entry is None else load(self._entry)
        return {} if stored is None else pickle.loads(stored[1])

    def get(self, status: os.stat_result, by: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        """Return a value made of a file, and whether it was made now.

        status: of the file; by: what else the value depends on.
        """
        times = status.st_mtime_ns, status.st_ctime_ns
        key = status.st_dev, status.st_ino, status.st_size, *times, *by
        known = self._used if key in self._used else self._stored
        if key in known:
            self._used[key] = known[key]
            return known[key], False
        value = make()
        if time.time() - max(times) / 1e9 > _FRESH:
            self._used[key], self._changed = value, True
        return value, True

    def store(self) -> None:
        """Keep the values that were asked for, if one of them is new."""
        if self._changed and self._entry is not None:
            _keep_value(self._entry, self._used)


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


def keep_failed(name: str, text: str) -> str | None:
    """Write the text of a program that failed to build; return its path, None on failure."""
    digest = hashlib.sha256(text.encode()).hexdigest()[:12]
    stem = re.sub(r"\W", "_", name.removesuffix(".cl"))
    path = folder() / "failed" / f"{stem}-{digest}.cl"
    try:
        _keep(path, text.encode())
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
    _written += len(content)
    if _written >= _STEP:
        _written = 0
        prune(path.parent.parent)
