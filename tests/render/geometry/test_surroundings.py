"""The medium around the camera is found by how boundaries wind around it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.geometry.analytic import tessellate
from clpt.geometry.triangles import triangulate
from clpt.geometry.winding import winding_number
from clpt.render.geometry.surroundings import media_around, warnings_of
from clpt.scene import Scene, cameras, media
from clpt.scene.materials import Diffuse, Null
from clpt.scene.shapes import Cube, Cylinder, Disk, Group, Instance, Shape, Sphere, Spheres

FOG = media.Homogeneous(sigma_s=1.0, name="fog")
WINE = media.Homogeneous(sigma_a=1.0, name="wine")
IN = {"material": Null(), "interior": FOG}
BALLS = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]], np.float32)


def around(*shapes: Shape, camera: cameras.Camera | None = None) -> tuple[media.Medium, ...]:
    seen = camera or cameras.Perspective(to_world=tf.look_at([0.1, 0.2, 0.3], [0, 0, 9], [0, 1, 0]))
    return media_around(Scene(camera=seen, shapes=list(shapes)))


TUBE = (
    Cylinder(p0=(0, 0, -1), p1=(0, 0, 1), **IN),
    Disk(to_world=tf.translate([0, 0, 1]), **IN),
    Disk(to_world=tf.translate([0, 0, -1]), flip_normals=True, **IN),
)
BODIES = {
    "sphere": (Sphere(**IN),),
    "spheres": (Spheres(centers=BALLS, **IN),),
    "cube": (Cube(**IN),),
    "mesh": (tessellate(Sphere(**IN)),),
    "stretched sphere": (Sphere(to_world=tf.scale([1, 2, 3]), **IN),),
    "mirrored": (Cube(to_world=tf.scale([-1, 1, 1]), **IN),),
    "tube": TUBE,
    "room": (Cube(material=Null(), exterior=FOG, flip_normals=True),),
    "endless": (Sphere(to_world=tf.translate([5, 0, 0]), material=Null(), exterior=FOG),),
    "instance": (
        Instance(
            group=Group(shapes=(Cube(**IN), Sphere(to_world=tf.translate([9, 0, 0])))),
            to_world=tf.scale(0.9),
        ),
    ),
}


@pytest.mark.parametrize("name", BODIES)
def test_inside_and_outside(name: str) -> None:
    body = BODIES[name]
    assert around(*body) == (FOG,)
    far = cameras.Perspective(to_world=tf.translate([4.9, 0.1, 0.0]))
    assert around(*body, camera=far) == ()


def test_a_lens_is_where_light_comes_into_it() -> None:
    """Its film is outside of the ball, 7 cm behind the front of the lens, which is inside."""
    lens = cameras.Lens(to_world=tf.translate([0.0, 0.0, -1.05]))
    assert around(Sphere(**IN), camera=lens) == (FOG,)
    moved = dataclasses.replace(lens, to_world=tf.translate([0.0, 0.0, -1.4]))
    assert around(Sphere(**IN), camera=moved) == ()


def test_one_in_the_other() -> None:
    outer = Sphere(radius=3.0, **IN)
    inner = {"material": Null(), "interior": WINE}
    assert around(outer, Sphere(exterior=FOG, **inner)) == (WINE,)
    found = around(outer, Sphere(**inner))
    assert found == (WINE, FOG)
    assert "'wine' and 'fog'" in warnings_of(found)[0]
    assert warnings_of((FOG,)) == []
    named = cameras.Spherical(medium=FOG)
    assert around(outer, Sphere(**inner), camera=named) == (FOG,)


@pytest.mark.parametrize(
    "camera",
    [
        cameras.Orthographic(to_world=tf.translate([0.1, 0.0, 0.2])),
        cameras.Spherical(to_world=tf.translate([0.1, 0.0, 0.2])),
        cameras.Matrix(view=np.diag([4.0, 4.0, 4.0, 1.0])),
    ],
    ids=lambda camera: camera.kind,
)
def test_cameras(camera: cameras.Camera) -> None:
    assert around(Sphere(**IN), Sphere(material=Diffuse()), camera=camera) == (FOG,)


def test_winding_number_of_a_closed_mesh_is_whole() -> None:
    vertices, faces, *_ = triangulate(tessellate(Sphere()))
    rng = np.random.default_rng(1)
    for p in rng.uniform(-2.0, 2.0, (50, 3)):
        if abs(np.linalg.norm(p) - 1.0) > 0.01:
            expected = float(np.linalg.norm(p) < 1.0)
            assert winding_number(vertices, faces, p) == pytest.approx(expected, abs=1e-6)
