"""The same picture at every scale: wherever a scene stands, and however small or large it is.

Significance as in tests/renders/support.py.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic, Perspective
from clpt.scene.integrators import ParticleTracer, Path, Whitted
from clpt.scene.lights import Area, Constant
from clpt.scene.materials import Dielectric, Diffuse, Mask, Null
from clpt.scene.shapes import Cube, Cylinder, Disk, Mesh, Rectangle, Shape, Sphere
from tests.renders.builders import BLACK, DOWN, UP
from tests.renders.support import assert_agree, exposures

EVEN = Constant(radiance=(1.0, 1.0, 1.0))
DEEP = Path(max_depth=60, rr_depth=100)
CLEAR = {"int_ior": 1.0, "ext_ior": 1.0}  # a boundary that bends and reflects nothing


def looking_at(point: Any, half: float, shapes: list[Shape], **more: Any) -> Scene:
    """Shapes seen along -z from 4 m above a point, in a square 2 * half wide, under an even sky."""
    point = np.asarray(point, float)
    view = tf.look_at(point + [0, 0, 4], point, UP) @ tf.scale([half, half, 1])
    return Scene(
        camera=Orthographic(to_world=view),
        shapes=shapes,
        integrator=DEEP,
        film=Film(width=4, height=4, mode="rgb"),
        **{"lights": [EVEN], **more},
    )


@pytest.mark.parametrize("at", [0.0, 10.0], ids=["at_the_origin", "ten_metres_away"])
def test_absorption_takes_the_whole_thickness(at: float) -> None:
    """A cube that absorbs 1 / e, however thin: the ray's step off its surface is no part of it."""
    for thickness in (1e-3, 1e-2):
        dye = Dielectric(**CLEAR, absorption=1.0 / thickness)
        cube = Cube(to_world=tf.translate([at] * 3) @ tf.scale(thickness / 2), material=dye)
        image = clpt.render(looking_at([at] * 3, thickness / 8, [cube]), 4)
        ulp = float(np.spacing(np.float32(at)))  # by which faces are rounded
        np.testing.assert_allclose(image, np.exp(-1.0), rtol=1e-5 + 2.0 * ulp / thickness)


def test_thin_bodies_are_left_again() -> None:
    """Clear panes far from the origin, and a small ball: nobody sees them in an even sky."""
    glass = Dielectric(int_ior=1.5, ext_ior=1.0)
    panes = ((20.0, 1e-3), (50.0, 2e-3), (100.0, 4e-3), (1e4, 0.4))
    for x, thickness in panes:
        placed = tf.translate([x] * 3) @ tf.scale([1, 1, thickness / 2])
        image = clpt.render(looking_at([x] * 3, 0.5, [Cube(to_world=placed, material=glass)]), 16)
        np.testing.assert_allclose(image, 1.0, atol=1e-4, err_msg=f"{thickness} m at {x} m")
    image = clpt.render(looking_at([0] * 3, 1.5e-5, [Sphere(radius=2e-5, material=glass)]), 16)
    np.testing.assert_allclose(image, 1.0, atol=1e-4)


def corner(shape: str) -> list[Shape]:
    """A lit white floor under a shape of each kind, with a lamp above."""
    white = Diffuse(reflectance=0.7)
    lamp = tf.translate([0.5, 0.5, 3.0]) @ DOWN @ tf.scale(0.5)
    turned = tf.rotate([1, 2, 3], 40) @ tf.scale(0.5)
    ball = {
        "cube": Cube(to_world=tf.translate([0, 0, 0.9]) @ turned, material=white),
        "sphere": Sphere(center=(0, 0, 0.6), radius=0.5, material=white),
        "disk": Disk(to_world=tf.translate([0, 0, 0.6]) @ turned, material=white),
        "cylinder": Cylinder(p0=(-0.5, 0, 0.4), p1=(0.5, 0.2, 0.7), radius=0.3, material=white),
    }[shape]
    return [
        Rectangle(to_world=tf.scale(2.0), material=white),
        ball,
        Rectangle(to_world=lamp, material=BLACK, emission=Area(radiance=(4.0, 4.0, 4.0))),
    ]


def placed(shapes: list[Shape], to_world: Any, mode: str) -> Scene:
    """The shapes and the camera that looks at them, all of them moved."""
    view = tf.look_at([2.5, -2.0, 2.5], [0, 0, 0.4], [0, 0, 1])
    eye = view.copy()
    eye[:3, 3] = (to_world @ view)[:3, 3]
    return Scene(
        camera=Perspective(to_world=eye, fov=50.0, near=1e-9),
        shapes=[dataclasses.replace(s, to_world=to_world @ s.to_world) for s in shapes],
        integrator=Path(max_depth=4),
        film=Film(width=12, height=12, mode=mode),
    )
