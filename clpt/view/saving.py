"""Files that a page saves: new ones in the folder that was given at the start, never elsewhere.

The name of a file is taken by making the file, which fails where anything has that name, a link to
nowhere too. So two viewers that save in one folder never get the same name.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.files import output_files
from clpt.formats import save as save_scene
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.view import pictures
from clpt.view.commands import CommandError

MOST_FILES = 10_000
EXCLUSIVE = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0)

WriteExr = Callable[[Path, Renderer, float], None]  # path, renderer, seconds of rendering


class Folder:
    """A folder that gets files `<name>-001.png`; name: of the scene. Nothing is replaced."""

    def __init__(self, folder: Path, name: str, write_exr: WriteExr):
        self.folder = folder.resolve()
        self.name = re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_-") or "scene"
        self.write_exr = write_exr

    def save_png(self, pixels: NDArray[np.uint8]) -> Path:
        """Write a picture (h, w, 3 or 4) as it is shown."""
        with self._new_file(".png") as (path, partial):
            partial.write_bytes(pictures.png(pixels))
        return path

    def save_exr(self, renderer: Renderer, seconds: float) -> Path:
        """Write the picture so far in linear colours, or with all its bands."""
        with self._new_file(".exr") as (path, partial):
            self.write_exr(partial, renderer, seconds)
        return path

    def save_scene(self, scene: Scene) -> Path:
        """Write the scene with all edits as scene.json in a folder of its own."""
        folder = self._new("", Path.mkdir)
        try:
            save_scene(scene, folder / "scene.json")
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        return folder / "scene.json"

    def save_view(self, view: dict[str, Any]) -> Path:
        """Write a view, see clpt.view.views."""
        with self._new_file(".view.json") as (path, partial):
            partial.write_text(json.dumps(view, indent=2) + "\n", "utf-8")
        return path

    @contextmanager
    def _new_file(self, suffix: str) -> Iterator[tuple[Path, Path]]:
        """Yield the path of a new file, and the one to write to, which gets that name at the end.

        Nothing stays if writing fails. Raises CommandError, OSError.
        """
        path = self._new(suffix, lambda path: os.close(os.open(path, EXCLUSIVE, 0o666)))
        try:
            with output_files.replacing(path, follow=False) as partial:
                yield path, partial
        except BaseException:
            path.unlink(missing_ok=True)
            raise

    def _new(self, suffix: str, make: Callable[[Path], object]) -> Path:
        """Return the first path of those that are numbered which `make` can make."""
        for number in range(1, MOST_FILES):
            path = self.folder / f"{self.name}-{number:03d}{suffix}"
            try:
                make(path)
            except FileExistsError:
                continue
            return path
        raise CommandError(f"the folder has {MOST_FILES} files already")
