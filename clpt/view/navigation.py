"""Moves of a camera by drags. Cameras are plain data: each move returns another one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Floats
from clpt.scene.cameras import Camera, Matrix
from clpt.scene.viewpoint import Pose, pose

FARTHEST = 1e12  # [m] from the origin, as of vertices
POLE = math.radians(2.0)  # nearest to the pole that a turn ends


def rounded(point: Floats) -> list[float]:
    """Return a point (3,) with six digits, as somebody would write it."""
    return [float(f"{value:.6g}") for value in point]


def is_within_reach(camera: Camera) -> bool:
    """Return whether the numbers of a camera say where it is and looks, and are below FARTHEST."""
    matrix = np.asarray(camera.view if isinstance(camera, Matrix) else camera.to_world, float)
    if transforms.is_singular(matrix):
        return False
    with np.errstate(all="ignore"):
        at = pose(camera)
    numbers = np.concatenate([matrix.ravel(), at.origin, at.left, at.up, at.forward])
    return bool((np.abs(numbers) < FARTHEST).all())


def orbit(camera: Camera, pivot: Floats, up: Floats, dx: float, dy: float) -> Camera:
    """Turn about a point by a drag of (dx, dy) heights of the picture, half a turn each."""
    turn = _turn(pose(camera), up, math.pi * dx, -math.pi * dy)
    around = transforms.translate(pivot) @ turn @ transforms.translate(-pivot)
    return camera.moved(around)


def look(camera: Camera, up: Floats, dx: float, dy: float, aspect: float) -> Camera:
    """Turn the head so that the picture follows a drag of (dx, dy) heights of it."""
    at = pose(camera)
    angle = 2.0 * math.atan(min(camera.half_height(aspect), 1.0))
    turn = _turn(at, up, -angle * dx, angle * dy)
    return camera.moved(transforms.translate(at.origin) @ turn @ transforms.translate(-at.origin))


def pan(camera: Camera, distance: float, dx: float, dy: float, aspect: float) -> Camera:
    """Move across the view so that what is at a distance follows a drag."""
    at, half = pose(camera), camera.half_height(aspect)
    step = 2.0 * half * (distance if camera.enlarged(1.0) is None else 1.0)
    return camera.moved(transforms.translate(step * (dx * at.left + dy * at.up)))


def dolly(camera: Camera, pivot: Floats, by: float) -> Camera:
    """Come nearer to a point: the distance falls by the factor e^by; rays that are parallel meet
    a part of the scene that is smaller by it."""
    if (nearer := camera.enlarged(math.exp(-by))) is not None:
        return nearer
    at = pose(camera)
    along = float(np.dot(pivot - at.origin, at.forward))
    return camera.moved(transforms.translate(at.forward * along * (1.0 - math.exp(-by))))


def fly(camera: Camera, distance: float, right: float, up: float, forward: float) -> Camera:
    """Move along the camera's own axes by shares of a distance."""
    at = pose(camera)
    step = forward * at.forward + up * at.up - right * at.left
    return camera.moved(transforms.translate(distance * step))


def _turn(at: Pose, up: Floats, azimuth: float, elevation: float) -> NDArray[np.float64]:
    """Return the turn about `up`, then about the camera's side, which stops before the pole."""
    height = math.asin(float(np.clip(np.dot(at.forward, up), -1.0, 1.0)))
    limit = math.pi / 2.0 - POLE
    wanted = float(np.clip(height + elevation, min(-limit, height), max(limit, height)))
    side = np.cross(at.forward, up)
    side = _unit(side) if np.linalg.norm(side) > 1e-6 else -at.left
    sideways = transforms.rotate(side, math.degrees(wanted - height))
    return transforms.rotate(up, -math.degrees(azimuth)) @ sideways


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)
