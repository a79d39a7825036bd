"""Rules of cameras: their planes, matrices and lenses."""

from __future__ import annotations

from clpt.render.analysis import cameras, lens
from clpt.scene.cameras import Camera, Lens


def check_camera(camera: Camera, width: int, height: int) -> None:
    """Raise SceneError for a camera that sees nothing of a film of that size [pixels]."""
    if isinstance(camera, Lens):
        cameras.rigid(camera)
        lens.focused(camera, height / width)
    else:
        cameras.members(camera, width, height)
