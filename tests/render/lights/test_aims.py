"""The spheres at which light paths aim hold all that is sharp, and little else."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh
from numpy.typing import ArrayLike, NDArray

from clpt import transforms as tf
from clpt.render.flow.scene_to_tables import lower
from clpt.render.lights.aims import CELLS, MANY, MOST, is_sharp
from clpt.scene import Film, Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import ParticleTracer, Path
from clpt.scene.lights import Directional
from clpt.scene.shapes import (
    Cube,
    Cylinder,
    Group,
    Instance,
    Mesh,
    Rectangle,
    Shape,
    Sphere,
    Spheres,
)
from clpt.scene.textures import Checkerboard

GLASS = m.Dielectric()
GROUND = Rectangle(to_world=tf.rotate([1, 0, 0], -90) @ tf.scale(50.0), material=m.Diffuse())

AIMED = 0.7  # by default


def scene_of(*shapes: Shape) -> Scene:
    """The shapes on wide ground."""
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 3, 9], [0, 0, 0], [0, 1, 0])),
        shapes=[GROUND, *shapes],
        lights=[Directional(direction=(0, -1, 0))],
        film=Film(width=8, height=8, mode="rgb"),
        integrator=Path(light_paths=1),
    )


def spheres_of(*shapes: Shape) -> NDArray[np.float32]:
    """Centre, radius and share (k, 5) of the spheres in the scene of these shapes."""
    lowered = lower(scene_of(*shapes))
    first, number = (int(lowered.settings[name]) for name in ("aims", "aim_count"))
    assert bool(lowered.features.transport.aimed) == (number > 0)
    return lowered.tables["distributions"][first : first + 5 * number].reshape(-1, 5)


def assert_inside(points: NDArray[np.floating], spheres: NDArray[np.float32]) -> None:
    """Every point (n, 3) is in one of the spheres."""
    far = np.linalg.norm(points[:, None] - spheres[None, :, :3], axis=2) - spheres[:, 3]
    assert (far.min(axis=1) <= 0.0).all()


def ball_mesh(radius: float, center: ArrayLike, subdivisions: int = 2) -> Mesh:
    made = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    vertices = np.asarray(made.vertices + np.array(center), np.float32)
    return Mesh(vertices=vertices, faces=np.asarray(made.faces, np.uint32), material=GLASS)


@pytest.mark.parametrize(
    "shape",
    [
        Sphere(center=(1, 2, 3), radius=0.5, material=GLASS),
        ball_mesh(0.5, (1, 2, 3)),
        Spheres(centers=np.array([(1, 2, 3)], np.float32), radii=0.5, material=GLASS),
        Cube(to_world=tf.translate([1, 2, 3]) @ tf.scale(0.5 / np.sqrt(3.0)), material=GLASS),
        Cylinder(p0=(1, 2, 2.6), p1=(1, 2, 3.4), radius=0.3 / np.sqrt(2.0), material=GLASS),
    ],
    ids=lambda shape: shape.kind,
)
def test_one_shape_has_one_sphere(shape: Shape) -> None:
    """Each of them just fills a sphere of radius 1/2."""
    (sphere,) = spheres_of(shape)
    np.testing.assert_allclose(sphere, (1, 2, 3, 0.5, AIMED), rtol=0.025)
    assert sphere[3] > 0.5


def test_a_fine_mesh_has_a_sphere_a_little_larger() -> None:
    """Of more triangles than are looked at one by one."""
    fine = ball_mesh(0.5, (1, 2, 3), subdivisions=5)
    assert len(fine.faces) > CELLS**3
    (sphere,) = spheres_of(fine)
    assert_inside(fine.vertices, sphere[None])
    assert sphere[3] < 0.6


def test_what_stands_apart_has_spheres_of_its_own() -> None:
    balls = [Sphere(center=(x, 1, 0), radius=0.1, material=GLASS) for x in (-9, -2, -1.5, 9)]
    made = spheres_of(*balls, ball_mesh(2.0, (0, 2, 20)))
    assert len(made) == 5
    assert np.isclose(made[:, 4].sum(), AIMED)
    assert made[made[:, 3].argmax(), 4] > 0.4 * AIMED, "half the paths go by area"
    assert made[:, 4].min() > 0.09 * AIMED, "half to all alike"


def test_what_lies_close_shares_a_sphere() -> None:
    """A pane in four pieces."""
    pane = [
        Rectangle(to_world=tf.translate([x, y, 0]) @ tf.scale(0.5), material=GLASS)
        for x in (-0.5, 0.5)
        for y in (4.5, 5.5)
    ]
    assert len(spheres_of(*pane)) == 1


def test_of_many_some_share_a_sphere() -> None:
    rng = np.random.default_rng(3)
    centers = rng.uniform([-40, 1, -40], [40, 2, 40], (300, 3)).astype(np.float32)
    made = spheres_of(Spheres(centers=centers, radii=0.1, material=GLASS))
    assert 8 < len(made) <= MOST
    assert_inside(centers, made)
    assert np.isclose(made[:, 4].sum(), AIMED)


def test_of_many_fine_meshes_all_is_inside() -> None:
    """So many triangles together that each mesh's grid is coarser."""
    places = np.random.default_rng(3).uniform([-40, 1, -40], [40, 2, 40], (64, 3))
    balls = [ball_mesh(0.1, place, subdivisions=3) for place in places]
    assert len(balls[0].faces) < CELLS**3
    assert sum(len(ball.faces) for ball in balls) > MANY
    spheres = spheres_of(*balls)
    assert 8 < len(spheres) <= MOST
    assert_inside(np.concatenate([ball.vertices for ball in balls]), spheres)


def test_instances() -> None:
    """What is sharp in a group has a sphere at each place; the rest of it has none."""
    table = Cube(to_world=tf.translate([0, -5, 0]) @ tf.scale(4.0), material=m.Diffuse())
    group = Group(shapes=[table, ball_mesh(0.5, (1, 0, 0)), ball_mesh(0.5, (1, 0.2, 0))])
    places = [
        tf.translate([x, 10, 0]) @ tf.rotate([0, 1, 0], 40) @ tf.scale([1, 2, 1]) for x in (-20, 20)
    ]
    made = spheres_of(*(Instance(group=group, to_world=place) for place in places))
    assert len(made) == 2
    ball = np.concatenate([ball_mesh(0.5, (1, y, 0)).vertices for y in (0, 0.2)])
    for place in places:
        assert_inside(tf.transform_points(place, ball), made)
    assert made[:, 3].max() < 1.25


SHARP = {
    "glass": (m.Dielectric(), True),
    "pane": (m.ThinDielectric(), True),
    "mirror": (m.Conductor(), True),
    "smooth metal": (m.RoughConductor(alpha_u=0.3, alpha_v=0.05), True),
    "frosted glass": (m.RoughDielectric(alpha_u=0.5, alpha_v=0.5), False),
    "metal by an image": (
        m.RoughConductor(alpha_u=Checkerboard(), alpha_v=Checkerboard()),
        False,
    ),
    "diffuse": (m.Diffuse(), False),
    "coat": (m.Plastic(), False),
    "nothing": (m.Null(), False),
    "smooth back": (m.TwoSided(front=m.Diffuse(), back=m.Conductor()), True),
    "holes": (m.Mask(material=m.Diffuse()), False),
    "mirror with holes": (m.Mask(material=m.Conductor()), True),
    "blend": (m.Blend(first=m.Diffuse(), second=m.Dielectric()), True),
    "principled metal": (m.Principled(metallic=1.0, roughness=0.2), True),
    "principled paint": (m.Principled(roughness=0.2), False),
    "glTF glass": (m.GltfSurface(transmission=1.0, roughness=0.0), True),
    "OpenPBR's glass": (m.Openpbr(transmission_weight=1.0, specular_roughness=0.0), True),
    "OpenPBR's paint": (m.Openpbr(specular_roughness=0.0), False),
    "grating": (m.Grating(), False),
    "rippled": (m.BumpMap(material=m.Dielectric(), height=Checkerboard()), False),
}


@pytest.mark.parametrize("name", SHARP)
def test_what_is_sharp(name: str) -> None:
    """Light paths end at gratings and behind bent normals: nothing is gained by going there."""
    material, expected = SHARP[name]
    assert is_sharp(material) == expected


def test_without_something_sharp_and_small_nothing_is_aimed() -> None:
    dull = Sphere(center=(0, 1, 0), radius=0.5, material=m.Diffuse())
    wide = Sphere(center=(0, 1, 0), radius=49.0, material=GLASS)
    assert len(spheres_of(dull)) == len(spheres_of(wide)) == 0
    scene = scene_of(Sphere(center=(0, 1, 0), radius=0.5, material=GLASS))
    for integrator in (Path(light_paths=0), ParticleTracer()):
        assert not lower(dataclasses.replace(scene, integrator=integrator)).features.transport.aimed
