"""How cameras move: what stays where, and which way things go on the screen."""

from __future__ import annotations

import math

import numpy as np
import pytest

from clpt import transforms
from clpt.scene import viewpoint
from clpt.scene.cameras import Camera, Matrix, Orthographic, Perspective, Spherical, ThinLens
from clpt.view import camera_work

ORIGIN, TARGET = np.array([1.0, 2.0, 5.0]), np.array([0.5, 0.0, 0.0])
LOOK = transforms.look_at(ORIGIN, TARGET, [0, 1, 0])
VIEW = np.diag([-1.0, 1.0, -1.0, 1.0]) @ np.linalg.inv(LOOK)
CAMERAS = [
    Perspective(to_world=LOOK),
    ThinLens(to_world=LOOK, fov_axis="y"),
    Orthographic(to_world=LOOK),
    Spherical(to_world=LOOK),
    Matrix(view=VIEW, projection=np.diag([1.0, 1.0, -1.0, 1.0])),
]
each = pytest.mark.parametrize("camera", CAMERAS, ids=lambda camera: camera.kind)


def on_screen(camera: Camera, point: np.ndarray) -> tuple[float, float]:
    """Where a point is seen: to the right and down, per unit of distance."""
    at = viewpoint.pose(camera)
    away = point - at.origin
    ahead = 1.0 if isinstance(camera, Orthographic) else float(away @ at.forward)
    return -float(away @ at.left) / ahead, -float(away @ at.up) / ahead


@each
def test_the_pose_is_that_of_look_at(camera: Camera) -> None:
    at = viewpoint.pose(camera)
    towards = (TARGET - ORIGIN) / np.linalg.norm(TARGET - ORIGIN)
    assert np.allclose(at.origin, ORIGIN) and np.allclose(at.forward, towards)
    assert np.allclose(np.cross(at.up, at.forward), at.left) and at.up[1] > 0


@each
def test_an_orbit_keeps_the_pivot_where_it_is_seen(camera: Camera) -> None:
    pivot, up = np.array([0.2, 0.4, -0.3]), np.array([0.0, 1.0, 0.0])
    turned = camera_work.orbit(camera, pivot, up, 0.2, 0.1)
    before, after = viewpoint.pose(camera), viewpoint.pose(turned)
    assert np.linalg.norm(after.origin - pivot) == pytest.approx(
        np.linalg.norm(before.origin - pivot)
    )
    assert np.allclose(on_screen(turned, pivot), on_screen(camera, pivot), atol=1e-9)
    near = pivot - 0.1 * before.forward  # what is before the pivot follows the pointer
    right, down = np.subtract(on_screen(turned, near), on_screen(camera, near))
    assert right > 0 and down > 0


@each
def test_an_orbit_ends_before_the_pole(camera: Camera) -> None:
    up = np.array([0.0, 1.0, 0.0])
    for dy in (20.0, -20.0):
        turned = camera_work.orbit(camera, TARGET, up, 0.0, dy)
        height = abs(viewpoint.pose(turned).forward @ up)
        assert height == pytest.approx(math.cos(camera_work.POLE), abs=1e-9)


@pytest.mark.parametrize("camera", [CAMERAS[0], CAMERAS[1]], ids=lambda camera: camera.kind)
def test_pan_and_look_follow_the_pointer(camera: Camera) -> None:
    """A drag by a tenth of the height moves what is in the middle by that."""
    at, aspect = viewpoint.pose(camera), 1.5
    height = 2.0 * camera.half_height(aspect)
    distance = float(np.linalg.norm(TARGET - ORIGIN))
    panned = camera_work.pan(camera, distance, 0.1, 0.05, aspect)
    assert np.allclose(on_screen(panned, TARGET), (0.1 * height, 0.05 * height))
    looked = camera_work.look(camera, at.up, 0.01, 0.005, aspect)
    assert np.allclose(on_screen(looked, TARGET), (0.01 * height, 0.005 * height), rtol=0.1)
    assert np.allclose(viewpoint.pose(looked).origin, ORIGIN)


@each
def test_dolly_and_fly(camera: Camera) -> None:
    near = camera_work.dolly(camera, TARGET, math.log(2.0))
    if isinstance(camera, Orthographic):
        half = type(camera).half_height
        assert half(near, 1.0) == pytest.approx(half(camera, 1.0) / 2.0)
    else:
        assert np.allclose(viewpoint.pose(near).origin, (ORIGIN + TARGET) / 2.0)
    at = viewpoint.pose(camera)
    flown = viewpoint.pose(camera_work.fly(camera, 2.0, 0.5, 0.25, 1.0))
    assert np.allclose(flown.origin, ORIGIN - at.left + 0.5 * at.up + 2.0 * at.forward)


def test_the_axis_that_is_upright() -> None:
    for up in ([0, 1, 0], [0, 0, 1], [0, -1, 0]):
        camera = Perspective(to_world=transforms.look_at([3, 2, 1], [0, 0, 0], up))
        assert np.allclose(viewpoint.upright(camera), up)
