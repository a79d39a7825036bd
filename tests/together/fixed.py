"""A few small scenes that hold many features at once, for what is to be equal and to agree."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clpt import transforms as tf
from clpt.scene import Film, Scene, media, phases
from clpt.scene import materials as m
from clpt.scene.cameras import Camera, Perspective, ThinLens
from clpt.scene.integrators import Independent, Path
from clpt.scene.lights import Area, Constant, Directional, Envmap, Point, Spot
from clpt.scene.shapes import Cube, Mesh, Rectangle, Sphere
from clpt.scene.textures import Checkerboard

UP = [0.0, 1.0, 0.0]
VIEW = tf.look_at([0.3, 1.4, 4.2], [0, 0.7, 0], UP)
WHITE = m.Diffuse(reflectance=(0.7, 0.7, 0.7))
RED = m.Diffuse(reflectance=(0.7, 0.2, 0.1))
METAL = m.RoughConductor(alpha_u=0.3, alpha_v=0.2)
GLASS = m.Dielectric(int_ior=1.5)
CORNERS = np.array([[-0.9, 0, -0.4], [0.1, 0, -0.5], [-0.4, 0, 0.4], [-0.4, 1.1, -0.1]], np.float32)
FACES = np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]], np.uint32)
SKY = np.random.default_rng(3).random((4, 8, 3)).astype(np.float32)
DENSITY = np.random.default_rng(4).random((5, 4, 6)).astype(np.float32)
FORWARD = phases.HenyeyGreenstein(g=0.5)


def peak(material: m.Material, **more: Any) -> Mesh:
    return Mesh(vertices=CORNERS, faces=FACES, uvs=CORNERS[:, :2], material=material, **more)


def floor(material: m.Material = WHITE) -> Rectangle:
    down = tf.rotate([1, 0, 0], -90) @ tf.scale(4.0)
    return Rectangle(material=m.TwoSided(front=material), to_world=down)


def lamp(radiance: Any = (6.0, 6.0, 6.0), size: float = 0.5) -> Rectangle:
    place = tf.translate([0.2, 2.6, 0.4]) @ tf.rotate([1, 0, 0], 90) @ tf.scale(size)
    return Rectangle(emission=Area(radiance=radiance), material=WHITE, to_world=place)


def box(medium: media.Medium, **more: Any) -> Cube:
    place = tf.translate([0.1, 0.75, 0.1]) @ tf.rotate([0, 1, 0], 20) @ tf.scale([1.0, 0.7, 0.7])
    return Cube(material=m.Null(), interior=medium, to_world=place, **more)


def grid(**given: Any) -> media.Grid:
    place = tf.translate([-1.2, -0.1, -1.0]) @ tf.scale([2.6, 1.7, 2.2])
    return media.Grid(density=DENSITY, to_world=place, **given)


def ball(material: m.Material, **more: Any) -> Sphere:
    return Sphere(center=(0.7, 0.5, 0.4), radius=0.45, material=material, **more)


def world(*things: Any, camera: Camera | None = None, **given: Any) -> Scene:
    usual: dict[str, Any] = {
        "integrator": Path(max_depth=5, light_paths=0),
        "film": Film(width=12, height=12, mode="rgb"),
    }
    return Scene(
        camera=camera or Perspective(to_world=VIEW, fov=42), shapes=[*things], **usual | given
    )


SPECTRAL = Film(width=12, height=12)
SPOT = Spot(to_world=tf.look_at([-1.2, 2.2, 1.5], [0.2, 0.5, 0], UP), intensity=(30.0, 28.0, 20.0))
POINT = Point(position=(1.2, 2.0, 1.2), intensity=(4.0, 4.5, 5.0))
SUN = Directional(direction=(0.3, -1.0, -0.4), irradiance=(2.0, 1.9, 1.7))
CHECKS = m.Diffuse(reflectance=Checkerboard(color0=0.2, color1=0.8))
TURBID = media.Homogeneous(sigma_s=(0.5, 0.7, 0.9), sigma_a=(0.2, 0.1, 0.05), phase=FORWARD)
SMOKE = grid(sigma_t=(0.8, 1.2, 1.6), albedo=0.8, phase=FORWARD)
MIXED = media.Mixture(parts=(SMOKE, media.Homogeneous(sigma_s=(0.3, 0.2, 0.1))))
JADE = m.Dielectric(int_ior=1.4, absorption=(1.5, 0.3, 1.0))

SCENES: dict[str, Callable[[], Scene]] = {
    "lamp and metal": lambda: world(floor(CHECKS), peak(RED), ball(METAL), lamp()),
    "lamps at points": lambda: world(floor(), peak(RED), ball(METAL), lights=[SPOT, POINT, SUN]),
    "a sky of pixels": lambda: world(floor(), peak(METAL), ball(RED), lights=[Envmap(image=SKY)]),
    "glass": lambda: world(floor(), peak(GLASS), ball(GLASS), lamp((9.0, 8.0, 6.0), 0.6)),
    "glass that absorbs, spectral": lambda: world(
        floor(), peak(JADE), ball(JADE), lamp(), film=SPECTRAL
    ),
    "turbid, under a lamp": lambda: world(floor(), ball(RED), box(TURBID), lamp()),
    "turbid, under a spot": lambda: world(floor(), peak(RED), box(TURBID), lights=[SPOT, POINT]),
    "smoke, spectral": lambda: world(
        floor(), peak(RED), box(SMOKE), lights=[SPOT], film=SPECTRAL
    ),
    "a mixture": lambda: world(floor(), peak(RED), box(MIXED), lamp(), lights=[SPOT]),
    "milk in glass": lambda: world(
        floor(), ball(GLASS, interior=TURBID), lamp((9.0, 9.0, 9.0), 0.9),
        lights=[Constant(radiance=0.3)],
    ),
    "a wide lens": lambda: world(
        floor(CHECKS), peak(RED), lamp(), sampler=Independent(),
        camera=ThinLens(to_world=VIEW, fov=42, aperture_radius=0.1, focus_distance=4.2),
    ),
    "a coat and a blend": lambda: world(
        floor(), peak(m.TwoSided(front=m.Blend(first=RED, second=METAL, weight=0.4))),
        ball(m.RoughPlastic(diffuse_reflectance=(0.2, 0.4, 0.7), alpha=0.15)), lamp(),
    ),
}  # fmt: skip
