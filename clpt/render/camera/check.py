"""Rules of cameras: their planes, matrices and lenses."""

from __future__ import annotations

from clpt.render.camera import find as cameras
from clpt.render.camera import lens
from clpt.scene.cameras import Camera, Lens
from clpt.scene.indices import check_index
from clpt.scene.integrators import Film


def check_camera(camera: Camera, film: Film) -> None:
    """Raise SceneError for a camera that cannot be set as it says, with a film."""
    if isinstance(camera, Lens):
        cameras.rigid(camera)
        lens.focused(camera, film.height / film.width)
    else:
        cameras.members(camera, film.width, film.height)
    for glass in cameras.dispersive_glasses(camera):
        check_index(glass, film, f"{camera.kind}.glass")
