"""Views, and files that a page saves: new files in the folder that was given at the start.

A view is a camera and the look of its picture, as JSON that is saved, copied and opened again. The
name of a file is taken by making the file, which fails where anything has that name, a link to
nowhere too. So two viewers that save in the same folder never get the same name.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError, UnknownKindError
from clpt.files import input_files, output_files
from clpt.formats import save as save_scene
from clpt.render.renderer import Renderer
from clpt.scene import Scene, kinds
from clpt.scene.cameras import Camera
from clpt.scene.params import fields_of, params
from clpt.view import panels, pictures
from clpt.view.messages import COMMANDS, CommandError, Request
from clpt.view.pictures import Display

MOST_FILES = 10_000
EXCLUSIVE = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0)

WriteExr = Callable[[Path, Renderer, float], None]  # path, renderer, seconds of rendering


def written(scene: Scene, display: Display) -> dict[str, Any]:
    """Return a view: its camera as scene.json has it, exposure and tone curve."""
    shown = {"exposure": display.exposure, "tone": display.tone}
    return {"camera": panels.written(scene.camera), "display": shown}


def camera_of(document: object, present: Camera | None = None) -> Camera:
    """Return the camera that a view has. Raises CommandError.

    present: gives what no view holds: a lens, the medium around, motion and shutter.
    """
    if not isinstance(document, dict):
        raise CommandError("the camera of a view is an object, as in scene.json")
    known, values = kinds("camera"), dict(document)
    kind = values.pop("type", None)
    if not isinstance(kind, str) or kind not in known:
        raise CommandError(str(UnknownKindError("camera", str(kind), known)))
    declared = params(known[kind])
    held = {name: param for name, param in declared.items() if panels.is_plain(param)}
    for name in values:
        if name not in held:
            raise CommandError(f"a view of a camera {kind} has no {name!r}")
    read = {name: panels.read(name, value, held[name]) for name, value in values.items()}
    had = {} if present is None else fields_of(present)
    kept = {name: had[name] for name in declared if name in had and name not in held}
    try:
        return cast(Camera, known[kind](**kept, **read))
    except SceneError as error:
        raise CommandError(str(error)) from None


def request(document: object) -> Request:
    """Return the command that opens a view. Raises CommandError."""
    if not isinstance(document, dict) or "camera" not in document:
        raise CommandError("this is no view: it has no camera")
    display = document.get("display")
    look = {"exposure": 0.0, "tone": "none", **(display if isinstance(display, dict) else {})}
    kinds_of = COMMANDS["open_view"].parameters
    values = {"camera": document["camera"], **look}
    checked = {name: kind.check(values[name]) for name, kind in kinds_of.items()}
    camera_of(checked["camera"])
    return Request("open_view", checked)


def load(path: Path) -> Request:
    """Return the command that opens the view of a file. Raises SceneError."""
    content = input_files.read(path)
    try:
        return request(json.loads(content))
    except (ValueError, CommandError) as error:
        raise SceneError(f"is no view: {error}", file=path) from error


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
        """Write a view, see clpt.view.saving."""
        with self._new_file(".view.json") as (path, partial):
            partial.write_text(json.dumps(view, indent=2) + "\n", "utf-8")
        return path

    @contextmanager
    def _new_file(self, suffix: str) -> Iterator[tuple[Path, Path]]:
        """Yield the path of a new file, and a path to write to, which gets that name at the end.

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
        """Return the first of the numbered paths that `make` can make."""
        for number in range(1, MOST_FILES):
            path = self.folder / f"{self.name}-{number:03d}{suffix}"
            try:
                make(path)
            except FileExistsError:
                continue
            return path
        raise CommandError(f"the folder has {MOST_FILES} files already")
