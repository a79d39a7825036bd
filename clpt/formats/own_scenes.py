"""The scenes that come with clpt: names, subjects, and suggestions for a misspelled name."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

SCENES = "scenes"  # the first part of their paths
_ROW = re.compile(r"^\| \[(\w+)\]\(\1\) \| (.+) \|$", re.M)  # of the table in scenes/README.md
_LINK = re.compile(r"\[([^\]]+)\]\([^)]*\)")
CLOSE = 0.7  # how near a name is that is meant


def scenes_folder() -> Path:
    """Return the folder of clpt's own scenes: in the installed package, or of the checkout."""
    package = Path(__file__).resolve().parent.parent
    installed = package / SCENES
    return installed if installed.is_dir() else package.parent / SCENES


def paths() -> list[str]:
    """Return the paths of all that are there."""
    try:
        folders = sorted(scenes_folder().iterdir())
    except OSError:
        return []
    return [f"{SCENES}/{folder.name}" for folder in folders if _main_file(folder) is not None]


def rows() -> Iterator[dict[str, Any]]:
    """Yield a row for each that is there, in the order of their table.

    path: from any folder, as "scenes/prism"; size: (width, height) of its picture [pixels], None if
    its file does not say; text: its subject.
    """
    folder = scenes_folder()
    there = set(paths())
    for name, text in _ROW.findall((folder / "README.md").read_text(encoding="utf-8")):
        if f"{SCENES}/{name}" in there:
            plain = _LINK.sub(r"\1", text).replace("`", "")
            yield {"path": f"{SCENES}/{name}", "size": _size(folder / name), "text": plain}


def nearest_paths(path: Path) -> list[str]:
    """Return the paths that are spelled like a missing path."""
    known = {known_path.removeprefix(f"{SCENES}/"): known_path for known_path in paths()}
    parts = path.parts[1:] if path.parts[:1] == (SCENES,) else path.parts
    if not parts or path.is_absolute():
        return []
    near = difflib.get_close_matches(parts[0].split(".")[0], known, n=2, cutoff=CLOSE)
    return [known[name] for name in near]


def _main_file(folder: Path) -> Path | None:
    """Return the scene of a folder, None where it holds none."""
    names = "scene.json", f"{folder.name}.glb"
    return next((folder / name for name in names if (folder / name).is_file()), None)


def _size(folder: Path) -> tuple[int, int] | None:
    file = _main_file(folder)
    if file is None or file.suffix != ".json":
        return None
    film = json.loads(file.read_text(encoding="utf-8")).get("film", {})
    return (film["width"], film["height"]) if {"width", "height"} <= film.keys() else None
