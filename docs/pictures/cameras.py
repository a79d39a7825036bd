"""Pictures by each camera, of one scene."""

from __future__ import annotations

import numpy as np

from clpt.scene import Scene, cameras, shapes
from clpt.scene.materials import Conductor, Diffuse
from clpt.transforms import look_at, rotate, scale, translate

from .studio import SMALL, UP, Picture, knob, studio

EYE = look_at([0.9, 1.5, 4.4], [-0.1, 0.6, 0.0], UP)


def row() -> list[shapes.Shape]:
    """Three knobs behind each other, a mirror ball and a box."""
    colours = ((0.62, 0.08, 0.05), (0.75, 0.6, 0.2), (0.06, 0.2, 0.5))
    knobs = [
        knob(Diffuse(reflectance=colour), -0.9 + 0.55 * i, 1.5 - 1.5 * i)
        for i, colour in enumerate(colours)
    ]
    box = translate([1.15, 0.35, 0.1]) @ rotate([0, 1, 0], 20) @ scale(0.35)
    return [
        *knobs,
        shapes.Sphere(center=(-1.5, 0.4, -0.9), radius=0.4, material=Conductor()),
        shapes.Cube(material=Diffuse(reflectance=(0.2, 0.45, 0.2)), to_world=box),
    ]


def seen(caption: str, camera: cameras.Camera, size: tuple[int, int] = SMALL) -> Picture:
    def scene() -> Scene:
        return studio(row(), size=size, camera=camera)

    return Picture(caption, scene)


def cabinet() -> cameras.Matrix:
    """A cabinet projection: depth goes up and to the right, at half its length."""
    shear = np.eye(4)
    shear[:2, 2] = -0.5 * np.cos(np.radians(45.0)), -0.5 * np.sin(np.radians(45.0))
    box = np.diag([1.0 / 2.3, 1.0 / 1.725, -1.0 / 20.0, 1.0])
    view = translate([0.1, -1.1, -10.0])
    away = translate([0.0, 0.0, 10.0])  # sheared about the middle of the scene
    return cameras.Matrix(view=view, projection=box @ np.linalg.inv(away) @ shear @ away)


def disc() -> cameras.Rays:
    """Rays whose directions turn with the distance from the middle, as of a fisheye lens."""
    y, x = np.mgrid[0:180, 0:180] / 90.0 - 1.0 + 1.0 / 180.0
    angle, radius = np.arctan2(y, x), np.hypot(x, y)
    theta = np.minimum(radius, 1.0) * np.radians(80.0)
    rows = [-np.sin(theta) * np.cos(angle), -np.sin(theta) * np.sin(angle), np.cos(theta)]
    return cameras.Rays(
        origins=np.zeros((180 * 180, 3)),
        directions=np.stack(rows, axis=-1).reshape(-1, 3),
        weights=(radius < 1.0).astype(float).reshape(-1),
        to_world=look_at([0.5, 1.3, 2.2], [-0.1, 0.7, 0.0], UP),
    )


CAMERAS = {
    "perspective": seen("What is far is small.", cameras.Perspective(to_world=EYE, fov=50)),
    "thin_lens": seen(
        "`aperture_radius` 0.16, in focus on the yellow knob.",
        cameras.ThinLens(to_world=EYE, fov=50, aperture_radius=0.16, focus_distance=4.6),
    ),
    "lens": seen(
        "A `sonnar` wide open, in focus on the yellow knob: dark corners.",
        cameras.Lens(
            to_world=EYE,
            lens="sonnar",
            unit=5e-3,
            film_width=0.23,
            focus_distance=4.6,
        ),
    ),
    "orthographic": seen(
        "What is far is as large as what is near.",
        cameras.Orthographic(
            to_world=look_at([2.0, 3.4, 9.0], [-0.1, 0.6, 0.0], UP) @ scale([2.3, 2.3, 1.0])
        ),
    ),
    "spherical": seen(
        "All directions around a point between the things.",
        cameras.Spherical(to_world=look_at([0.25, 0.9, 0.9], [0.0, 0.9, -1.0], UP)),
        size=(264, 132),
    ),
    "matrix": seen("A cabinet projection, which no other camera has.", cabinet()),
    "rays": seen(
        "A fisheye of 160 degrees, ray by ray: a list makes any camera.", disc(), (180, 180)
    ),
    "calibrated": seen(
        "A fisheye by OpenCV's model, with calibrated distortion; what it does not see is black.",
        cameras.Calibrated(
            model="kannala_brandt",
            intrinsics=(60.0, 60.0, 95.5, 71.5),
            distortion=(0.05, -0.1, 0.0, 0.0),
            to_world=look_at([0.5, 1.3, 2.2], [-0.1, 0.7, 0.0], UP),
        ),
    ),
}
