"""Universal Scene Description (`pip install 'clpt[usd]'`): `load(path)` returns a stage's Scene."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

from clpt.choices import Missing
from clpt.errors import SceneError

if TYPE_CHECKING:
    from clpt.scene import Scene

__all__ = ["load"]


def load(path: Path, missing: Missing = "error", /, **variables: Any) -> Scene:
    """Read a .usd, .usda, .usdc or .usdz file; see `clpt.formats.usd.scenes`.

    missing: see clpt.load; a texture without a file has its own fallback color whatever it says.
    Raises SceneError, also where OpenUSD's Python package is not installed.
    """
    try:
        scenes = importlib.import_module("clpt.formats.usd.scenes")
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "pxr":
            raise
        message = "is read by OpenUSD: pip install 'clpt[usd]'"
        raise SceneError(message, file=path) from None
    scene: Scene = scenes.load(path, **variables)
    return scene
