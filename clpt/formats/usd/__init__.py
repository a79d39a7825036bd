"""Universal Scene Description (`pip install 'clpt[usd]'`): its stages as scenes, and back."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt.choices import Missing
from clpt.errors import SceneError

if TYPE_CHECKING:
    from clpt.scene import Scene

__all__ = ["load", "save"]


def load(path: Path, missing: Missing = "error", /, **variables: Any) -> Scene:
    """Read a .usd, .usda, .usdc or .usdz file; see `clpt.formats.usd.scenes`.

    missing: see clpt.load; a texture without a file has its own fallback color whatever it says.
    Raises SceneError, also where OpenUSD's Python package is not installed.
    """
    scene: Scene = _module("scenes", path).load(path, **variables)
    return scene


def save(scene: Scene, path: Path) -> list[str]:
    """Write a scene as a stage, see `clpt.formats.usd.export`; return what was lost.

    Raises SceneError, also where OpenUSD's Python package is not installed.
    """
    lost: list[str] = _module("export", path).save(scene, path)
    return lost


def _module(name: str, path: Path) -> Any:
    """Import a module of this package that needs OpenUSD."""
    try:
        return importlib.import_module(f"clpt.formats.usd.{name}")
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "pxr":
            raise
        message = "needs OpenUSD: pip install 'clpt[usd]'"
        raise SceneError(message, file=path) from None
