"""Final pictures by the extension."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np

from clpt import images


def final(folder: Path, size: tuple[int, int], samples: int) -> np.ndarray:
    """Return the final picture (h, w, 3) of Blender's scene in RGB; size: width and height."""
    bpy: Any = importlib.import_module("bpy")
    scene = bpy.context.scene
    scene.render.engine, scene.clpt.samples, scene.clpt.mode = "CLPT", samples, "rgb"
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.render.filepath = str(folder / "final.exr")
    bpy.ops.render.render(write_still=True)
    return np.asarray(images.read(scene.render.filepath))[..., :3]
