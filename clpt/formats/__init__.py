"""Scene files: `load(path)` returns the plain-data Scene that a file of any format describes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from clpt.errors import SceneError
from clpt.formats import gltf, mesh, mitsuba, native, pbrt, studio
from clpt.scene import Scene

FORMATS: dict[str, Callable[..., Scene]] = {
    ".json": native.load,
    ".xml": mitsuba.load,
    ".pbrt": pbrt.load,
    ".pbrt.gz": pbrt.load,
    **dict.fromkeys(gltf.SUFFIXES, gltf.load),
    **dict.fromkeys(mesh.SUFFIXES, studio.load),
}

IN_FOLDERS = ("scene.json", "scene.xml", "scene.pbrt", "scene-v4.pbrt")

__all__ = ["FORMATS", "load"]


def load(
    path: str | Path, /, *, progress: Callable[[float, str], None] | None = None, **variables: Any
) -> Scene:
    """Read a scene or a bare mesh; a folder means the scene.json, .xml or .pbrt in it.

    `variables` set the `$names` of Mitsuba's XML; of glTF they choose camera, scene and
    time. `progress` is called with how much is read, from 0 to 1, and what, while files of many
    shapes are. Raises SceneError with the file and, where it is known, the line.
    """
    path = _existing(Path(path))
    name = path.name.lower()
    loader = next((load for suffix, load in FORMATS.items() if name.endswith(suffix)), None)
    if loader is None:
        known = " ".join(FORMATS)
        raise SceneError(f"unknown format {path.suffix!r}; known: {known}", file=path)
    if variables and loader not in (mitsuba.load, gltf.load):
        raise SceneError(
            f"only .xml and glTF have variables, so {min(variables)!r} means nothing", file=path
        )
    if loader is pbrt.load:
        return pbrt.load(path, progress)
    return loader(path, **variables)


def _existing(path: Path) -> Path:
    try:
        if path.is_dir():
            inside = [path / name for name in IN_FOLDERS]
            found = next((file for file in inside if file.is_file()), None)
            if found is None:
                raise SceneError(f"this folder holds none of {', '.join(IN_FOLDERS)}", file=path)
            return found
        if path.is_file():
            return path
    except (OSError, ValueError) as error:
        raise SceneError(f"cannot be read: {error}", file=path) from None
    raise SceneError("there is no such file", file=path)
