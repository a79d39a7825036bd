"""Poses of cameras in the conventions of other tools.

A convention has axes of camera space, and a matrix from the world to the camera or back. clpt's
`to_world` leads from camera space (x left, y up, z forward) to the world.

opencv, colmap   x right, y down, z forward   world to camera: R | t, the extrinsics
opengl           x right, y up, z back        world to camera: the view matrix
blender, nerf    x right, y up, z back        camera to world: matrix_world, transform_matrix
ros_optical      x right, y down, z forward   camera to world: pose of a camera_optical_frame
ros              x forward, y left, z up      camera to world: pose of a camera_link (REP 103)

The world's own axes stay as they are: no convention turns the scene.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from clpt import transforms
from clpt.arrays import Floats
from clpt.errors import SceneError, UnknownKindError
from clpt.scene.cameras import Calibrated, Camera, Perspective

_DOWN = np.diag([-1.0, -1.0, 1.0, 1.0])  # columns: the convention's axes in clpt's camera space
_BACK = np.diag([-1.0, 1.0, -1.0, 1.0])
_BODY = np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0, 0, 0, 1]])
CONVENTIONS = {
    "opencv": (_DOWN, True), "colmap": (_DOWN, True), "opengl": (_BACK, True),
    "blender": (_BACK, False), "nerf": (_BACK, False), "ros_optical": (_DOWN, False),
    "ros": (_BODY, False),
}  # fmt: skip  # axes, and whether matrices lead from the world to the camera


def to_world(pose: ArrayLike, convention: str) -> Floats:
    """Return clpt's camera-to-world matrix (4, 4) of a pose (4, 4) or (3, 4) in a convention.

    Raises UnknownKindError for a convention, SceneError for a matrix without an inverse.
    """
    axes, inverse = _convention(convention)
    matrix = np.asarray(pose, np.float64)
    if matrix.shape == (3, 4):
        matrix = np.vstack([matrix, [0.0, 0.0, 0.0, 1.0]])
    if matrix.shape != (4, 4) or transforms.is_singular(matrix):
        message = f"must be a (4, 4) or (3, 4) matrix with an inverse, not {matrix.shape}"
        raise SceneError(message, where="pose")
    return (np.linalg.inv(matrix) if inverse else matrix) @ axes.T


def pose(matrix: ArrayLike, convention: str) -> Floats:
    """Return the pose (4, 4) in a convention of clpt's camera-to-world matrix (4, 4).

    Raises UnknownKindError.
    """
    axes, inverse = _convention(convention)
    camera = np.asarray(matrix, np.float64) @ axes
    return np.asarray(np.linalg.inv(camera) if inverse else camera, np.float64)


def _convention(name: str) -> tuple[Floats, bool]:
    if name not in CONVENTIONS:
        raise UnknownKindError("convention", name, CONVENTIONS)
    return CONVENTIONS[name]


def calibrated(camera: Camera, width: int, height: int) -> Calibrated:
    """Return a camera with intrinsics, of a `calibrated` camera or a pinhole.

    width, height: of the film [pixels]. Raises SceneError for other cameras.
    """
    if isinstance(camera, Calibrated):
        return camera
    if type(camera) is not Perspective:
        message = f"a {camera.kind} camera has no intrinsics; a perspective or calibrated one has"
        raise SceneError(message, where="camera")
    focal = np.array([width, height]) / camera.extent(width, height)
    middle = [width * (0.5 - camera.offset_x) - 0.5, height * (0.5 - camera.offset_y) - 0.5]
    return Calibrated(
        intrinsics=(*map(float, focal), *map(float, middle)), to_world=camera.to_world,
        motion=camera.motion, shutter=camera.shutter, medium=camera.medium,
    )  # fmt: skip
