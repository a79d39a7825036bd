"""What a page saves: new files in the folder that was given at the start, never elsewhere."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import output_files
from clpt.formats import save as save_scene
from clpt.render.renderer import Renderer
from clpt.scene import Scene
from clpt.view import pictures
from clpt.view.commands import CommandError

MOST_FILES = 10_000

WriteExr = Callable[[Path, Renderer, float], None]  # path, renderer, seconds of rendering


class Folder:
    """A folder that gets files `<name>-001.png`; name: of the scene. Nothing is replaced."""

    def __init__(self, folder: Path, name: str, write_exr: WriteExr):
        self.folder = folder.resolve()
        self.name = re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_-") or "scene"
        self.write_exr = write_exr

    def new(self, suffix: str) -> Path:
        """Return a path that does not exist yet. Raises CommandError."""
        for number in range(1, MOST_FILES):
            path = self.folder / f"{self.name}-{number:03d}{suffix}"
            if not path.exists():
                return path
        raise CommandError(f"the folder has {MOST_FILES} files already")

    def save_png(self, pixels: NDArray[np.uint8]) -> Path:
        """Write a picture (h, w, 3 or 4) as it is shown."""
        path = self.new(".png")
        output_files.write(path, pictures.png(pixels))
        return path

    def save_exr(self, renderer: Renderer, seconds: float) -> Path:
        """Write the picture so far in linear colours, or with all its bands."""
        path = self.new(".exr")
        self.write_exr(path, renderer, seconds)
        return path

    def save_scene(self, scene: Scene) -> Path:
        """Write the scene with all edits as scene.json in a folder of its own."""
        folder = self.new("")
        folder.mkdir()
        path = folder / "scene.json"
        save_scene(scene, path)
        return path

    def save_view(self, view: dict[str, Any]) -> Path:
        """Write a view, see clpt.view.views."""
        path = self.new(".view.json")
        output_files.write_text(path, json.dumps(view, indent=2) + "\n")
        return path
