"""Cameras. Camera space: +z forward, +x left, +y up (as look_at makes it, see clpt.transforms)."""

from clpt.scene.cameras.calibrated import Calibrated, Matrix, Rays
from clpt.scene.cameras.camera import (
    Camera,
    Lens,
    Orthographic,
    Perspective,
    Spherical,
    ThinLens,
)

KINDS = (Perspective, ThinLens, Lens, Orthographic, Spherical, Matrix, Rays, Calibrated)
_CONNECTED = [camera.kind for camera in KINDS if camera.connects]
CONNECTED = f"{', '.join(_CONNECTED[:-1])} and {_CONNECTED[-1]}"  # names, for messages

__all__ = [
    "CONNECTED", "KINDS", "Calibrated", "Camera", "Lens", "Matrix", "Orthographic", "Perspective",
    "Rays", "Spherical", "ThinLens",
]  # fmt: skip
