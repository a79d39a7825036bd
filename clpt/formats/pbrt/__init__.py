"""Scenes in the format of PBRT versions 2, 3 and 4."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from clpt.choices import Missing
from clpt.formats.reading import Progress

if TYPE_CHECKING:
    from clpt.scene import Scene

__all__ = ["load"]


def load(path: Path, progress: Progress | None = None, missing: Missing = "error") -> Scene:
    """Read a .pbrt file, see `clpt.formats.pbrt.scenes`."""
    from clpt.formats.pbrt import scenes  # here: Mitsuba's reader needs parts of this package

    return scenes.load(path, progress, missing)
