"""Files that other processes see whole or not at all: the one way in which clpt writes a file."""

from __future__ import annotations

import hashlib
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

PARTIAL = ".clpt-partial-"  # begins the name of a file that is not complete


@contextmanager
def replacing(path: str | Path, follow: bool = True) -> Iterator[Path]:
    """Yield the path of a new, empty file, which takes the place of `path` afterwards.

    The new file is in the same folder, and its content is on the disk before the old file goes. So
    an error, a full disk or a killed process leaves the old file as it was. A link stays a link:
    the file that it names is replaced. What is no regular file, such as a pipe, is yielded itself.
    follow: False lets the new file take the place of a link or a pipe too. Raises OSError.
    """
    path = Path(os.path.realpath(path) if follow else path)
    if follow and path.exists() and not path.is_file():
        yield path
        return
    partial = _new_file(path)
    try:
        yield partial
        with partial.open("rb") as file:
            os.fsync(file.fileno())
        os.replace(partial, path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise
    _sync_folder(path.parent)


def write(path: str | Path, content: bytes) -> None:
    """Write a file as `replacing` does. Raises OSError."""
    with replacing(path) as partial:
        partial.write_bytes(content)


def write_text(path: str | Path, text: str) -> None:
    """Write a text in UTF-8 as `replacing` does. Raises OSError."""
    write(path, text.encode())


def check_writable(path: str | Path) -> None:
    """Try whether `write` can write this file, and leave nothing behind. Raises OSError."""
    path = Path(os.path.realpath(path))
    if path.is_dir():
        raise IsADirectoryError("it is a folder")
    if path.exists() and not os.access(path, os.W_OK):
        raise PermissionError("the file is read-only")
    if not path.parent.is_dir():
        raise FileNotFoundError("its folder does not exist")
    if not path.exists() or path.is_file():
        try:
            _new_file(path).unlink()
        except OSError as error:
            message = f"no file can be made there: {error.strerror}"
            raise PermissionError(message) from error


def link(path: str | Path, other: str | Path) -> None:
    """Give the file at `path` a second name, so that it stays there when it is replaced.

    What had that name is gone. Nothing happens where there is no file, or no links can be made.
    """
    path = Path(os.path.realpath(path))
    name = path.with_name(f"{_partial(path)}{secrets.token_hex(6)}")
    try:
        if os.path.exists(other) and os.path.samefile(path, other):
            return  # to rename one to the other would do nothing
        os.link(path, name)
        os.replace(name, other)
    except OSError:  # a file system without links
        name.unlink(missing_ok=True)


def remove_partials(path: str | Path) -> None:
    """Remove what processes that were killed have left of this file. Raises OSError."""
    path = Path(os.path.realpath(path))
    for partial in path.parent.glob(f"{_partial(path)}*"):
        partial.unlink(missing_ok=True)


def _partial(path: Path) -> str:
    """How the names begin of files that are to become this one: of one length for all names."""
    return f"{PARTIAL}{hashlib.sha256(os.fsencode(path.name)).hexdigest()[:12]}-"


def _new_file(path: Path) -> Path:
    """Make an empty file beside `path`, with its suffix and with its permissions if it exists."""
    partial = path.with_name(f"{_partial(path)}{secrets.token_hex(6)}{path.suffix}")
    os.close(os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
    if path.exists():
        partial.chmod(path.stat().st_mode & 0o777)
    return partial


def _sync_folder(folder: Path) -> None:
    """Bring a folder's new names to the disk, where the system can do that."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError:  # some network file systems refuse it; the file itself is safe
        pass
    finally:
        os.close(handle)
