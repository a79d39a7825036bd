"""Scenes whose pictures are known by a formula."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Camera, Orthographic
from clpt.scene.integrators import Integrator, Path, Sampler, Sobol
from clpt.scene.lights import Area, Constant, CubeMap, Directional, Envmap, Light, Point, Spot
from clpt.scene.materials import Diffuse, Material
from clpt.scene.shapes import Cylinder, Disk, Mesh, Rectangle, Shape, Sphere

BLACK = Diffuse(reflectance=0.0)
DOWN = tf.rotate([1, 0, 0], 180)  # turns +z to -z
ALBEDO = 0.5
RADIANCE = 2.0
HIDDEN = tf.translate([0, 0, -50.0])  # below the ground, where it lights nothing
FOOTPRINT = 1e-3  # half the width of what the camera sees [m]
UP = np.array([0.0, 1.0, 0.0])


def facing_down() -> Camera:
    """A camera close above the ground that sees little more than its origin."""
    view = tf.look_at([0, 0, 0.05], [0, 0, 0], UP) @ tf.scale([FOOTPRINT, FOOTPRINT, 1.0])
    return Orthographic(to_world=view, near=1e-3)


def overhead(half: float) -> np.ndarray:
    """Placement of a square or disk of this half width, one above the ground, facing down."""
    return tf.translate([0, 0, 1.0]) @ DOWN @ tf.scale(half)


def shining(kind: str, value: float) -> tuple[list[Shape], list[Light]]:
    """Every kind of light; the one named `kind` shines and is in place, all others are dark.

    So one set of programs serves them all.
    """
    on = {name: value if name == kind else 0.0 for name in EXPECTED}
    place = {name: (np.eye(4) if name == kind else HIDDEN) for name in EXPECTED}

    def area(name: str) -> dict[str, Any]:
        v = on[name]
        return {"material": BLACK, "emission": Area(radiance=(v, v, v)), "name": name}

    corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
    faces = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
    shapes: list[Shape] = [
        Sphere(center=(0, 0, 1), radius=0.4, to_world=place["sphere"], **area("sphere")),
        Disk(to_world=place["disk"] @ overhead(0.5), **area("disk")),
        Rectangle(to_world=place["rectangle"] @ overhead(0.6), **area("rectangle")),
        Mesh(vertices=corners, faces=faces, to_world=place["mesh"] @ overhead(0.6), **area("mesh")),
        Cylinder(
            p0=(-40, 0, 1),
            p1=(40, 0, 1),
            radius=0.1,
            to_world=place["cylinder"],
            **area("cylinder"),
        ),
    ]
    image = np.ones((4, 8, 3), np.float32)
    cube = [np.ones((2, 2, 3), np.float32)] * 6
    rgb = {name: (v, v, v) for name, v in on.items()}
    lamps = [
        Point(position=(0, 0, 2), intensity=rgb["point"]),
        Point(position=(0, 0, 2), intensity=rgb["point_without_falloff"], falloff=False),
        Spot(to_world=tf.translate([0, 0, 2]) @ DOWN, intensity=rgb["spot"]),
        Directional(direction=(0.6, 0.0, -0.8), irradiance=rgb["directional"]),
        Constant(radiance=rgb["constant"]),
        Envmap(image=image, scale=on["envmap"]),
        CubeMap(image=cube, scale=on["cube_map"]),
    ]
    return shapes, lamps


def _square_irradiance(half: float) -> float:
    """On the ground under the middle of a square at height 1, over its radiance."""
    root = np.sqrt(1.0 + half * half)
    return 4.0 * half / root * np.arctan(half / root)


# Irradiance on the ground at the origin, over the radiance, intensity or irradiance given.
EXPECTED = {
    "sphere": np.pi * 0.4**2,
    "disk": np.pi * 0.5**2 / (0.5**2 + 1.0),
    "rectangle": _square_irradiance(0.6),
    "mesh": _square_irradiance(0.6),
    "cylinder": np.pi * 0.1,  # endless, as good as: pi r / d
    "point": 1.0 / 4.0,
    "point_without_falloff": 1.0,
    "spot": 1.0 / 4.0,
    "directional": 0.8,
    "constant": np.pi,
    "envmap": np.pi,
    "cube_map": np.pi,
}


def lit_ground(
    kind: str, mode: str, integrator: Integrator | None = None, sampler: Sampler | None = None
) -> Scene:
    """A point of a diffuse ground under one light of a kind."""
    shapes, lamps = shining(kind, RADIANCE)
    ground = Rectangle(material=Diffuse(reflectance=ALBEDO), to_world=tf.scale(100.0))
    return Scene(
        camera=facing_down(),
        shapes=[ground, *shapes],
        lights=lamps,
        integrator=integrator or Path(max_depth=2),
        sampler=sampler or Sobol(),
        film=Film(width=8, height=8, mode=mode),
    )


def furnace(
    material: Material, mode: str, *, radiance: float = 1.0, closed: bool = False, **path: Any
) -> Scene:
    """A sphere in even light; `closed`: the light comes from its inside, and so does the view."""
    if closed:
        emission = Area(radiance=(radiance,) * 3)
        ball = Sphere(radius=2.0, flip_normals=True, material=material, emission=emission)
        view = tf.look_at([0.1, 0.2, 0.3], [0, 0, 0], UP)
    else:
        ball = Sphere(material=material)
        view = tf.look_at([0.0, 0.0, 4.0], [0, 0, 0], UP) @ tf.scale([0.5, 0.5, 1.0])
    return Scene(
        camera=Orthographic(to_world=view @ tf.scale([0.5, 0.5, 1.0])),
        shapes=[ball],
        lights=[] if closed else [Constant(radiance=(radiance,) * 3)],
        integrator=Path(**path),
        film=Film(width=16, height=16, mode=mode),
    )
