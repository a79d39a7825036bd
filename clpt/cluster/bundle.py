"""Scenes for other machines: files by the SHA-256 of their content, and a list of their names.

A bundle is bytes and JSON; nothing in it is executed. A receiver keeps the files in the cache
folder, so that a file travels once, and reads a file only if its digest is right.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeAlias

from clpt.errors import ClusterError
from clpt.files import disk_cache
from clpt.formats import native
from clpt.scene import Scene

VERSION = 1
LIMIT = 8 * 2**30  # bytes of kept files
SCENE = "scene.json"
FOLDER = "bundles"  # in clpt's cache folder
_OPENED = "opened-"  # prefix of the folder of an open scene
_STALE = 86400.0  # [s] after which the folder counts as abandoned
_NAME = re.compile(r"[A-Za-z0-9_][\w.-]{0,199}", re.ASCII)
_DIGEST = re.compile(r"[0-9a-f]{64}")


Bundle: TypeAlias = dict[str, str]  # digests of a scene's files by name, including scene.json


def to_json(bundle: Bundle) -> dict[str, Any]:
    """Return a bundle as JSON; `from_json` is the inverse."""
    return {"format": "clpt bundle", "version": VERSION, "files": bundle}


def from_json(document: object) -> Bundle:
    """Read a bundle's list.

    Raises ClusterError for an unknown version, a name that is no plain file name, and a text that
    is no digest.
    """
    if not isinstance(document, dict) or document.get("format") != "clpt bundle":
        raise ClusterError("this is no bundle of a scene")
    version, files = document.get("version"), document.get("files")
    if version != VERSION:
        raise ClusterError(f"the bundle has version {version!r}; this clpt reads {VERSION}")
    if not isinstance(files, dict) or SCENE not in files:
        raise ClusterError(f"the bundle has no {SCENE}")
    for name, digest in files.items():
        if not _NAME.fullmatch(name):
            raise ClusterError(f"the bundle names a file outside of its folder: {name!r}")
        check_digest(digest)
    return files


def pack(scene: Scene, folder: Path) -> Bundle:
    """Write a scene and all its files into a folder; return its bundle.

    Raises SceneError for a scene that cannot be written, and for custom materials: workers run
    nothing but clpt.
    """
    native.save(scene, folder / SCENE, copies=True)
    return {path.name: file_digest(path) for path in sorted(folder.iterdir())}


class Store:
    """Files by their digests, in clpt's cache folder or another; at most `limit` bytes.

    Several processes may use it at once.
    """

    def __init__(self, folder: Path | None = None, limit: int = LIMIT):
        self.folder, self.limit = folder or disk_cache.folder() / FOLDER, limit

    def lacks(self, bundle: Bundle) -> list[str]:
        """Return the digests of missing files; damaged files are deleted."""
        return sorted(digest for digest in {*bundle.values()} if not self._holds(digest))

    def add(self, digest: str, content: bytes) -> None:
        """Keep a file. Raises ClusterError if its digest is another, OSError."""
        check_digest(digest)
        actual = hashlib.sha256(content).hexdigest()
        if actual != digest:
            raise ClusterError(f"a file of the bundle is damaged: {actual[:12]} for {digest[:12]}")
        disk_cache.write(self.folder / digest, content)
        disk_cache.prune(self.folder.parent, self.limit, parts=(self.folder.name,))

    @contextmanager
    def opened(self, bundle: Bundle) -> Iterator[Scene]:
        """Yield the scene of a bundle, whose files exist until the end of the context.

        Raises ClusterError if a file is missing, SceneError for a file that cannot be read.
        """
        self._clear_old()
        with tempfile.TemporaryDirectory(prefix=_OPENED, dir=self.folder) as folder:
            for name, digest in bundle.items():
                try:
                    os.close(disk_cache.own_file(self.folder / digest))
                except OSError:
                    raise ClusterError(f"the file {name} of the bundle is missing") from None
                _link(self.folder / digest, Path(folder) / name)
            yield native.load(Path(folder) / SCENE, confined=True)

    def _clear_old(self) -> None:
        """Delete the folders of scenes that dead processes had open."""
        for path in self.folder.glob(f"{_OPENED}*"):
            with suppress(OSError):
                if time.time() - path.stat().st_mtime > _STALE:
                    shutil.rmtree(path)

    def _holds(self, digest: str) -> bool:
        path = self.folder / digest
        try:
            if file_digest(path) == digest:
                os.utime(path)  # marks the last use
                return True
            path.unlink()
        except OSError:
            pass
        return False


def check_digest(digest: object) -> None:
    """Raise ClusterError unless this is a SHA-256 in hexadecimal."""
    if not isinstance(digest, str) or not _DIGEST.fullmatch(digest):
        raise ClusterError(f"this is no digest: {str(digest)[:80]!r}")


def file_digest(path: Path) -> str:
    """Return the SHA-256 of the content of a file of this user. Raises OSError."""
    hashed = hashlib.sha256()
    with open(disk_cache.own_file(path), "rb") as file:
        while piece := file.read(1 << 20):
            hashed.update(piece)
    return hashed.hexdigest()


def canonical(document: object) -> str:
    """Return JSON that is the same for the same content."""
    return json.dumps(document, sort_keys=True, separators=(",", ":"))


def _link(source: Path, target: Path) -> None:
    """Give a file a second name, or copy it where the file system has no links."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copyfile(source, target)
