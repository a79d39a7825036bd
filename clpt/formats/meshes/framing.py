"""A bare mesh as a scene: it stands in the studio.

Up is +z for .stl, as in CAD, and +y for every other format.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from clpt.choices import Missing
from clpt.errors import SceneError
from clpt.formats.meshes import mesh
from clpt.scene import Scene, cameras, lights, shapes
from clpt.scene.studio import Up


def load(path: Path, missing: Missing = "error") -> Scene:
    """Read a bare mesh and put it into the studio, whatever its size and position.

    missing: see clpt.load.
    """
    file = mesh.read_mesh(path, missing=missing)
    if not any(mesh.has_area(part) for part in file.meshes):
        raise SceneError("none of its triangles has an area", file=path)
    scene = show(file.meshes, file=path, up="z" if path.suffix.lower() == ".stl" else "y")
    scene.warnings = file.warnings
    return scene


def show(
    things: Sequence[shapes.Shape],
    *,
    file: Path,
    camera: cameras.Camera | None = None,
    own_lights: Sequence[lights.Light] = (),
    up: Up = "y",
) -> Scene:
    """Return a scene of the shapes of a file; see `Scene.studio` for what is missing."""
    try:
        scene = Scene.studio(things, camera=camera, lights=own_lights, up=up, name=file.stem)
    except SceneError as error:
        raise SceneError(error.message, file=file) from None
    scene.extra["format"] = file.suffix.lower()[1:]
    return scene
