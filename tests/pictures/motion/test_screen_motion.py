"""The layer of motion: against the same in float64, for shapes, instances, cameras and the sky."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.film.layers import viewable
from clpt.scene import Film, Scene, lights, materials, shapes
from clpt.scene.cameras import Lens, Orthographic, Perspective
from clpt.scene.integrators import Box, Path
from clpt.scene.motion import Deformation, Keys, Shutter

SIZE = 24
GREY = materials.Diffuse(reflectance=0.5)
MOMENT = [1.0, *[0.0] * 255]  # the shutter is open for a moment after its beginning
LOOK = tf.look_at([0, 0, -5], [0, 0, 0], [0, 1, 0])
FOV = 50.0


def keys(*transforms) -> Keys:
    return Keys([0.0, 1.0][: len(transforms)], transforms)


BALL = keys(tf.translate([-0.2, 0, 0]), tf.translate([0.4, 0.3, 0.5]))
CUBE = keys(np.eye(4), tf.translate([0, 0.3, 0]) @ tf.rotate([0, 0, 1], 30))
PAN = keys(
    np.eye(4), tf.translate([0, 0, -5]) @ tf.rotate([0, 1, 0], 4) @ tf.translate([0.1, 0, 5])
)


def scene(camera=None, still: bool = False, **film) -> Scene:
    """A ball and an instance that move, a wall that does not, and the sky above it."""
    cube = shapes.Group(shapes=(shapes.Cube(to_world=tf.scale(0.45), material=GREY),))
    moves = {} if still else {"motion": BALL}
    turns = {} if still else {"motion": CUBE}
    wall = tf.translate([0, -3, 2]) @ tf.rotate([0, 1, 0], 180) @ tf.scale(3.5)
    return Scene(
        camera=camera or Perspective(to_world=LOOK, fov=FOV, shutter=Shutter(shape=MOMENT)),
        shapes=[
            shapes.Sphere(center=(-0.8, 0, 0), radius=0.7, material=GREY, **moves),
            shapes.Instance(group=cube, to_world=tf.translate([1, 0, 0]), **turns),
            shapes.Rectangle(to_world=wall, material=GREY),
        ],
        lights=[lights.Constant()],
        film=Film(
            **{"width": SIZE, "height": SIZE, "mode": "rgb", "filter": Box(radius=0.01),
               "layers": ("motion", "position", "shape_id"), **film},
        ),
        integrator=Path(max_depth=1, light_paths=0),
    )  # fmt: skip


def rendered(given: Scene) -> dict[str, np.ndarray]:
    with clpt.Renderer(given) as renderer:
        renderer.run(8)
        return renderer.layers()


def seen_at(points: np.ndarray, camera: Keys | None, time: float) -> np.ndarray:
    """Where a pinhole sees points (..., 4) at a time, in pixels to the right and up."""
    matrix = LOOK if camera is None else camera.at(time) @ LOOK
    at = points @ np.linalg.inv(matrix).T
    return -at[..., :2] / at[..., 2:3] * SIZE / 2.0 / np.tan(np.radians(FOV / 2.0)) * [1, -1]


def moved(points: np.ndarray, keys: Keys | None, time: float) -> np.ndarray:
    """Points of the first time (..., 4) at another one."""
    if keys is None:
        return points
    return points @ (keys.at(time) @ np.linalg.inv(keys.at(0.0))).T


@pytest.mark.parametrize("camera", [pytest.param(None, marks=pytest.mark.slow), PAN])
def test_what_moves_is_told_in_pixels(camera):
    """A moment after the shutter has opened all lies ahead, as points moved in float64 say."""
    view = Perspective(to_world=LOOK, fov=FOV, shutter=Shutter(shape=MOMENT), motion=camera)
    made = rendered(scene(view))
    shape, motion = made["shape_id"][..., 0], made["motion"]
    p = np.concatenate([made["position"], np.ones((SIZE, SIZE, 1))], axis=2)
    y, x = np.mgrid[:SIZE, :SIZE] + 0.5
    half = np.tan(np.radians(FOV / 2.0)) / (SIZE / 2.0)
    rays = np.stack([(SIZE / 2 - x) * half, (SIZE / 2 - y) * half, np.ones_like(x)], axis=2)
    rays = np.concatenate([rays, np.zeros((SIZE, SIZE, 1))], axis=2) @ LOOK.T
    for number, own in ((0, BALL), (1, CUBE), (2, None), (-1, None)):
        here = shape == number
        inner = here.copy()  # away from outlines, where a pixel sees two things in time
        for axis in (0, 1):
            for step in (-1, 1):
                inner &= np.roll(here, step, axis)
        assert inner.sum() > 5
        points = p if number >= 0 else rays
        expected = seen_at(moved(points, own, 1.0), camera, 1.0) - seen_at(points, camera, 0.0)
        # in a moment, a 400th of the whole, about as much less is left
        np.testing.assert_allclose(motion[inner, 2:], expected[inner], rtol=0.02, atol=0.02)
        np.testing.assert_allclose(motion[inner, :2], 0.0, atol=0.02)
        if own is not None or camera is not None:
            assert np.linalg.norm(expected[inner], axis=1).min() > 0.3
    shown = viewable("motion", motion)
    assert shown.shape == (SIZE, SIZE, 3) and 0.7 < shown.max() <= 1.0


@pytest.mark.slow
@pytest.mark.parametrize("deforms", [False, True])
@pytest.mark.parametrize("kind", [Perspective, Orthographic])
def test_a_plane_that_slides(kind, deforms):
    """Across the axis each of its points goes f d / z pixels from the shutter's opening to its
    closing, whenever it is seen; a quarter and three quarters of the keys' time."""
    slides = keys(tf.translate([-1, 0, 0]), tf.translate([1, 0.5, 0]))
    wide = tf.rotate([0, 1, 0], 180) @ tf.scale(9)
    plane = shapes.Rectangle(to_world=wide, material=GREY, motion=slides)
    if deforms:  # each vertex by itself, half of the way, and the whole the other half
        flat = np.array([[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], np.float32)
        half = np.array([1, 0.25, 0], np.float32)
        plane = shapes.Mesh(
            vertices=flat,
            faces=[[0, 2, 1], [0, 3, 2]],
            material=GREY,
            deformation=Deformation([0.0, 1.0], [flat, flat + half]),
            motion=keys(tf.translate([-1, 0, 0]), tf.translate([0, 0.25, 0])),
        )
    shutter = Shutter(0.25, 0.75)
    if kind is Orthographic:
        view = Orthographic(to_world=LOOK @ tf.scale([2, 2, 1]), shutter=shutter)
        pixels = SIZE / 4.0  # of a metre there
    else:
        view = Perspective(to_world=LOOK, fov=FOV, shutter=shutter)
        pixels = SIZE / 2.0 / np.tan(np.radians(FOV / 2.0)) / 5.0
    motion = rendered(dataclasses.replace(scene(view), shapes=[plane]))["motion"]
    whole = np.broadcast_to([-pixels, 0.25 * pixels], (SIZE, SIZE, 2))
    np.testing.assert_allclose(motion[..., 2:] - motion[..., :2], whole, atol=1e-3)


@pytest.mark.slow
def test_what_stands_still_does_not_move():
    assert not rendered(scene(still=True))["motion"].any()


def test_a_camera_without_an_axis_is_refused():
    with pytest.raises(
        SceneError, match=r"film.layers: the camera lens has no projection for motion"
    ):
        clpt.Renderer(scene(Lens(to_world=LOOK)))
