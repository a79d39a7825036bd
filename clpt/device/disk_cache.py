"""Files in the user's cache folder, all of which may be deleted at any time."""

from __future__ import annotations

import hashlib
import logging
import os
import tempfile
from pathlib import Path

import platformdirs

from .source import Source

log = logging.getLogger(__name__)


def folder() -> Path:
    """Return clpt's folder in the user's cache folder."""
    return Path(platformdirs.user_cache_dir("clpt", appauthor=False))


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file that other processes see whole or not at all. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, partial = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
        os.replace(partial, path)
    except BaseException:
        Path(partial).unlink(missing_ok=True)
        raise


def store(entry: str, header: str, binary: bytes) -> None:
    """Write a program's binary under a key, with a line of text; a full disk is no error."""
    content = header.encode() + b"\n" + binary
    check = hashlib.sha256(content).hexdigest().encode()
    try:
        write_atomically(folder() / "programs" / entry, check + b"\n" + content)
    except OSError as error:
        log.debug("the cache cannot be written: %s", error)


def load(entry: str) -> tuple[str, bytes] | None:
    """Return header and binary that `store` wrote; None if they are missing or damaged.

    The checksum is needed, since drivers crash on a damaged binary.
    """
    try:
        check, _, content = (folder() / "programs" / entry).read_bytes().partition(b"\n")
    except OSError:
        return None
    if hashlib.sha256(content).hexdigest().encode() != check:
        return None
    header, _, binary = content.partition(b"\n")
    return header.decode(), binary


def keep_failed(source: Source) -> str | None:
    """Write the text of a program that did not build; return its path, None if that fails."""
    digest = hashlib.sha256(source.text.encode()).hexdigest()[:12]
    stem = source.name.replace("/", "_").removesuffix(".cl")
    path = folder() / "failed" / f"{stem}-{digest}.cl"
    try:
        write_atomically(path, source.text.encode())
    except OSError:
        return None
    return str(path)
