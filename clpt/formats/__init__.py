"""Scene files: `load(path)` returns the plain-data Scene that a file of any format describes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from clpt.errors import SceneError
from clpt.formats import gltf, mesh, mitsuba, native, studio
from clpt.scene import Scene

FORMATS: dict[str, Callable[..., Scene]] = {
    ".json": native.load,
    ".xml": mitsuba.load,
    **dict.fromkeys(gltf.SUFFIXES, gltf.load),
    **dict.fromkeys(mesh.SUFFIXES, studio.load),
}

__all__ = ["FORMATS", "load"]


def load(path: str | Path, **variables: Any) -> Scene:
    """Read a scene or a bare mesh; a folder means the scene.json or scene.xml in it.

    `variables` set the `$names` of Mitsuba's XML; of glTF they choose camera, scene and
    time. Raises SceneError with the file and, where it is known, the line.
    """
    path = _existing(Path(path))
    loader = FORMATS.get(path.suffix.lower())
    if loader is None:
        known = " ".join(FORMATS)
        raise SceneError(f"unknown format {path.suffix!r}; known: {known}", file=path)
    if variables and loader not in (mitsuba.load, gltf.load):
        raise SceneError(f"has no variables, so {min(variables)!r} means nothing", file=path)
    return loader(path, **variables)


def _existing(path: Path) -> Path:
    try:
        if path.is_dir():
            inside = [path / name for name in ("scene.json", "scene.xml")]
            found = next((file for file in inside if file.is_file()), None)
            if found is None:
                raise SceneError("this folder holds no scene.json and no scene.xml", file=path)
            return found
        if path.is_file():
            return path
    except (OSError, ValueError) as error:
        raise SceneError(f"cannot be read: {error}", file=path) from None
    raise SceneError("there is no such file", file=path)
