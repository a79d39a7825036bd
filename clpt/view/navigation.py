"""Moves of a camera by drags. Cameras are plain data: each move returns another one."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Floats
from clpt.scene.cameras import Camera, Matrix, Orthographic, Perspective
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


def moved(camera: Camera, motion: NDArray[np.float64]) -> Camera:
    """Return a camera after a motion of the world (4, 4) that takes it along."""
    if isinstance(camera, Matrix):
        view = np.asarray(camera.view, float) @ np.linalg.inv(motion)
        return dataclasses.replace(camera, view=view)
    return dataclasses.replace(camera, to_world=motion @ np.asarray(camera.to_world, float))


def half_height(camera: Camera, aspect: float) -> float:
    """Return half the height that a camera sees at the distance 1, or of all its parallel rays.

    aspect: the film's width over its height.
    """
    if isinstance(camera, Orthographic):
        return float(np.linalg.norm(np.asarray(camera.to_world, float)[:3, 1])) / aspect
    if isinstance(camera, Perspective):
        tangent = math.tan(math.radians(camera.fov) / 2.0)
        wide = camera.fov_axis == "x" or camera.fov_axis == ("larger" if aspect > 1 else "smaller")
        return tangent / aspect if wide else tangent
    return 1.0


def orbit(camera: Camera, pivot: Floats, up: Floats, dx: float, dy: float) -> Camera:
    """Turn about a point by a drag of (dx, dy) heights of the picture, half a turn each."""
    turn = _turn(pose(camera), up, math.pi * dx, -math.pi * dy)
    around = transforms.translate(pivot) @ turn @ transforms.translate(-pivot)
    return moved(camera, around)


def look(camera: Camera, up: Floats, dx: float, dy: float, aspect: float) -> Camera:
    """Turn the head so that the picture follows a drag of (dx, dy) heights of it."""
    at = pose(camera)
    angle = 2.0 * math.atan(min(half_height(camera, aspect), 1.0))
    turn = _turn(at, up, -angle * dx, angle * dy)
    return moved(camera, transforms.translate(at.origin) @ turn @ transforms.translate(-at.origin))


def pan(camera: Camera, distance: float, dx: float, dy: float, aspect: float) -> Camera:
    """Move across the view so that what is at a distance follows a drag."""
    at, half = pose(camera), half_height(camera, aspect)
    step = 2.0 * half * (1.0 if isinstance(camera, Orthographic) else distance)
    return moved(camera, transforms.translate(step * (dx * at.left + dy * at.up)))


def dolly(camera: Camera, pivot: Floats, by: float) -> Camera:
    """Come nearer to a point: the distance falls by the factor e^by; rays that are parallel meet
    a part of the scene that is smaller by it."""
    if isinstance(camera, Orthographic):
        scale = np.diag([math.exp(-by), math.exp(-by), 1.0, 1.0])
        return dataclasses.replace(camera, to_world=np.asarray(camera.to_world, float) @ scale)
    at = pose(camera)
    along = float(np.dot(pivot - at.origin, at.forward))
    return moved(camera, transforms.translate(at.forward * along * (1.0 - math.exp(-by))))


def fly(camera: Camera, distance: float, right: float, up: float, forward: float) -> Camera:
    """Move along the camera's own axes by shares of a distance."""
    at = pose(camera)
    step = forward * at.forward + up * at.up - right * at.left
    return moved(camera, transforms.translate(distance * step))


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
