"""Pictures of lights: each alone, in a small room, or under the sky."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from clpt.scene import Scene, cameras, integrators, lights, shapes
from clpt.scene.materials import Conductor, Diffuse
from clpt.scene.textures import Bitmap
from clpt.transforms import look_at, rotate, scale, translate

from .studio import BLACK, SMALL, UP, Array, Picture, film, floor, knob

SCENES = Path(__file__).parents[2] / "scenes"


def things(room: bool) -> list[shapes.Shape]:
    """A knob of plaster, a blue ball, outdoors a mirror, and a red box on a chequered floor."""
    ball = Diffuse(reflectance=(0.12, 0.3, 0.6)) if room else Conductor()
    box = translate([0.12, 0.24, 0.85]) @ rotate([0, 1, 0], 28) @ scale(0.24)
    return [
        knob(Diffuse(reflectance=0.75), -0.75),
        shapes.Sphere(center=(0.85, 0.48, 0.1), radius=0.48, material=ball),
        shapes.Cube(material=Diffuse(reflectance=(0.6, 0.06, 0.04)), to_world=box),
        floor(),
    ]


def walls() -> list[shapes.Shape]:
    """A back wall, and one on either side."""
    paint = Diffuse(reflectance=(0.62, 0.6, 0.56))
    size = scale([2.2, 1.6, 1.0])
    back = shapes.Rectangle(material=paint, to_world=translate([0, 1.6, -1.6]) @ size)
    sides = [
        shapes.Rectangle(
            material=paint,
            to_world=translate([-s * 2.2, 1.6, 0.6]) @ rotate([0, 1, 0], s * 90) @ size,
        )
        for s in (1, -1)
    ]
    return [back, *sides]


def lit(
    caption: str,
    *lamps: Any,
    room: bool = True,
    integrator: Any = None,
    extra: Sequence[shapes.Shape] = (),
    spp: int = 64,
) -> Picture:
    """The things under these lights."""

    def scene() -> Scene:
        at = look_at([0.0, 1.7, 5.9], [0.0, 0.86 if room else 0.7, 0.0], UP)
        traced = isinstance(integrator, integrators.ParticleTracer)
        picture = integrators.Film(width=SMALL[0], height=SMALL[1], mode="rgb")
        return Scene(
            camera=cameras.Perspective(to_world=at, fov=40.0),
            shapes=[*things(room), *(walls() if room else []), *extra],
            lights=list(lamps),
            integrator=integrator or integrators.Path(max_depth=6),
            film=picture if traced else film(SMALL),
        )

    return Picture(caption, scene, spp)


def glowing(place: Any, radiance: Any, kind: Any = shapes.Rectangle) -> shapes.Shape:
    return kind(to_world=place, material=BLACK, emission=lights.Area(radiance=radiance))


def beam(place: Any, power: float) -> shapes.Shape:
    emission = lights.DirectionalArea(irradiance=(power, power, power))
    return shapes.Disk(to_world=place, material=BLACK, emission=emission)


def star() -> Array:
    """An image of directions: six bright sectors over the lower half, a glow above."""
    v, u = (np.mgrid[0:128, 0:256] + 0.5) / [[[128.0]], [[256.0]]]
    sectors = 0.5 + 0.5 * np.sign(np.cos(u * 2.0 * np.pi * 12.0))
    bands = 0.35 + 0.65 * (np.floor(v * 14.0) % 2)
    return np.repeat((0.06 + sectors * bands)[..., None], 3, 2).astype(np.float32)


def sky() -> Array:
    """A sunset: warm at the horizon, blue above, a low sun at the left, dark ground."""
    v, u = (np.mgrid[0:256, 0:512] + 0.5) / [[[256.0]], [[512.0]]]
    height = 90.0 - 180.0 * v  # [degrees] above the horizon
    warm = np.exp(-np.maximum(height, 0.0) / 14.0)[..., None]
    image = warm * [1.5, 0.75, 0.35] + (1.0 - warm) * [0.16, 0.28, 0.6]
    image = np.where(height[..., None] < 0.0, [0.16, 0.13, 0.11], image)
    turn = (u - 0.62) * 360.0 * np.cos(np.radians(height))
    sun = np.exp(-((turn**2 + (height - 22.0) ** 2) / 4.0**2))
    return (image + sun[..., None] * [120.0, 80.0, 45.0]).astype(np.float32)


LIGHTS = {
    "area": lit(
        "A lamp that hangs in the room: the emission of a rectangle.",
        extra=[
            glowing(
                translate([0.0, 2.25, -0.2]) @ rotate([1, 0, 0], 90) @ scale([0.9, 0.3, 1.0]),
                (9.0, 8.2, 7.0),
            ),
            glowing(
                translate([-1.75, 0.22, 0.75]) @ scale(0.16), (2.0, 3.5, 7.0), shapes.Sphere
            ),
        ],
    ),
    "directional_area": lit(
        "A disk sends a beam through the room, by the `particle_tracer`.",
        integrator=integrators.ParticleTracer(),
        extra=[beam(look_at([1.6, 3.4, 3.6], [-0.35, 0.9, -1.0], UP) @ scale(1.0), 4.0)],
        spp=128,
    ),
    "point": lit(
        "In front of the things: shadows grow with the distance.",
        lights.Point(position=(0.1, 1.1, 1.3), intensity=(4.6, 4.2, 3.4)),
    ),
    "spot": lit(
        "Two cones: `edge` linear and smooth.",
        lights.Spot(
            to_world=look_at([-1.9, 2.9, 2.0], [-0.75, 0.5, 0.0], UP),
            intensity=(34.0, 29.0, 22.0), cutoff=17.0, beam_width=14.0,
        ),
        lights.Spot(
            to_world=look_at([1.9, 2.9, 2.0], [0.75, 0.5, 0.0], UP),
            intensity=(16.0, 23.0, 34.0), cutoff=24.0, beam_width=4.0, edge="smooth",
        ),
    ),
    "projector": lit(
        "Throws an image at the wall.",
        lights.Projector(
            image=Bitmap(image=SCENES / "poppy_field" / "picture.jpg"),
            irradiance=(105.0, 105.0, 105.0), fov=34.0,
            to_world=look_at([0.4, 2.2, 4.6], [0.0, 1.25, -1.6], UP),
        ),
    ),
    "goniometric": lit(
        "An image over directions gives rays and rings.",
        lights.Goniometric(
            image=Bitmap(image=star(), raw=True),
            intensity=(4.0, 3.6, 3.0), to_world=translate([0.05, 1.55, -0.3]),
        ),
    ),
    "directional": lit(
        "Parallel: shadows keep their width.",
        lights.Directional(direction=(0.75, -0.8, -0.5), irradiance=(3.6, 3.4, 3.0)),
        room=False,
    ),
    "constant": lit(
        "From everywhere: the soft light of an overcast sky.",
        lights.Constant(radiance=(0.75, 0.8, 0.9)),
        room=False,
    ),
    "envmap": lit(
        "An image of a sunset, seen behind the things and in the ball.",
        lights.Envmap(image=sky(), to_world=rotate([0, 1, 0], 0.0)),
        room=False,
    ),
    "cube_map": lit(
        "Six images, here the painted sky of `scenes/three_spheres`.",
        lights.CubeMap(image=SCENES / "three_spheres" / "sky.png", scale=1.0),
        room=False,
    ),
    "sky": lit(
        "A low sun in clear air, both brightened: `sun_elevation` and `aerosol` make all colours.",
        lights.Sky(sun_elevation=14.0, sun_azimuth=-70.0, sky_scale=2.5, sun_scale=2.5),
        room=False,
    ),
}  # fmt: skip
