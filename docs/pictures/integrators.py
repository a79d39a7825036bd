"""Pictures by each integrator, sampler and filter, of one scene each."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt.scene import Scene, cameras, integrators, lights, shapes
from clpt.scene.materials import Conductor, Dielectric, Diffuse
from clpt.scene.textures import Bitmap
from clpt.transforms import look_at, rotate, scale, translate

from .studio import BLACK, SMALL, UP, Picture, film

WALL, RED, GREEN = (0.72, 0.7, 0.66), (0.6, 0.07, 0.05), (0.1, 0.42, 0.12)


def room(*balls: Any) -> list[shapes.Shape]:
    """A room with a red and a green wall, and balls on its floor: glass, a mirror, blue plastic."""
    walls = [  # turned, moved, paint
        ([1, 0, 0], -90, [0, 0, 0], WALL),
        ([1, 0, 0], 90, [0, 2, 0], WALL),
        ([1, 0, 0], 0, [0, 1, -1], WALL),
        ([0, 1, 0], 90, [-1.33, 1, 0], RED),
        ([0, 1, 0], -90, [1.33, 1, 0], GREEN),
    ]
    paper = [
        shapes.Rectangle(
            to_world=translate(to) @ rotate(axis, angle) @ scale([1.34, 1, 1]),
            material=Diffuse(reflectance=paint),
        )
        for axis, angle, to, paint in walls
    ]
    return [
        *paper,
        shapes.Sphere(center=(-0.72, 0.4, 0.35), radius=0.4, material=Dielectric(int_ior=1.5)),
        shapes.Sphere(center=(0.1, 0.44, -0.45), radius=0.44, material=Conductor()),
        shapes.Sphere(
            center=(0.78, 0.33, 0.3), radius=0.33,
            material=Diffuse(reflectance=(0.06, 0.16, 0.45)),
        ),
    ]  # fmt: skip


def view() -> cameras.Perspective:
    return cameras.Perspective(to_world=look_at([0, 1, 5.0], [0, 1, 0], UP), fov=34.5)


def traced(
    caption: str, integrator: integrators.Integrator, *, spp: int = 128, size: Any = SMALL
) -> Picture:
    """The room, with a lamp below its ceiling; a point for what knows no surfaces that shine, and
    for what finds a point's caustics."""

    def scene() -> Scene:
        lamp = shapes.Rectangle(
            to_world=translate([0, 1.98, 0]) @ rotate([1, 0, 0], 90) @ scale([0.6, 0.4, 1]),
            material=BLACK,
            emission=lights.Area(radiance=(6.0, 5.6, 4.8)),
        )
        point = lights.Point(position=(0.0, 1.9, 0.2), intensity=(1.6, 1.5, 1.3))
        whitted = isinstance(integrator, (integrators.Whitted, integrators.Vcm))
        box = isinstance(integrator, integrators.ParticleTracer)
        picture = integrators.Film(width=size[0], height=size[1], mode="rgb")
        return Scene(
            camera=view(),
            shapes=room() if whitted else [*room(), lamp],
            lights=[point] if whitted else [],
            integrator=integrator,
            film=picture if box else film(size),
        )

    return Picture(caption, scene, spp)


def sampled(caption: str, sampler: integrators.Sampler) -> Picture:
    """Soft shadows with four samples a pixel, enlarged."""

    def scene() -> Scene:
        made = traced("", integrators.Direct()).scene()
        made.film = integrators.Film(width=96, height=72, mode="rgb")
        made.sampler, made.spp = sampler, 4
        made.shapes = [
            shapes.Sphere(center=s.center, radius=s.radius, material=Diffuse(reflectance=0.6))
            if isinstance(s, shapes.Sphere)
            else s
            for s in made.shapes
        ]
        return made

    return Picture(caption, scene, spp=4, zoom=2)


def filtered(caption: str, chosen: integrators.Filter) -> Picture:
    """A star of black and white rays in 48 by 36 pixels, enlarged."""

    def scene() -> Scene:
        y, x = (np.mgrid[0:768, 0:1024] + 0.5 - [[[384.0]], [[512.0]]]) / 384.0
        rays = np.cos(np.arctan2(y, x) * 20.0) > 0.0
        bright = np.where(np.hypot(x, y) < 0.93, rays, (x > 1.1) * 0.8 + (x < -1.1) * 0.2)
        image = np.repeat(bright[..., None], 3, 2).astype(np.float32)
        paper = shapes.Rectangle(
            to_world=rotate([0, 1, 0], 180) @ scale([1.0, 0.75, 1.0]),
            material=BLACK,
            emission=lights.Area(radiance=Bitmap(image=image, raw=True)),
        )
        return Scene(
            camera=cameras.Orthographic(to_world=translate([0, 0, -1])),
            shapes=[paper],
            integrator=integrators.Direct(),
            film=integrators.Film(width=48, height=36, mode="rgb", filter=chosen),
        )

    return Picture(caption, scene, spp=512, zoom=4)


INTEGRATORS = {
    "auto": traced(
        "What suits the scene: path, light paths beside it, or vcm.", integrators.Auto()
    ),
    "path": traced(
        "All light: from wall to wall, by glass and mirrors.",
        integrators.Path(light_paths=0),
        spp=256,
    ),
    "vcm": traced(
        "With a point light in the place of the lamp: its caustic, which `path` never finds, "
        "on the floor and in the mirror.",
        integrators.Vcm(),
        spp=192,
    ),
    "direct": traced("Straight from the lamp: the ceiling stays dark.", integrators.Direct()),
    "whitted": traced(
        "With a point light in the place of the lamp: hard shadows, and ambient light everywhere.",
        integrators.Whitted(max_depth=8, ambient=(0.12, 0.12, 0.12)),
        spp=64,
    ),
    "particle_tracer": traced(
        "The caustic is smooth; glass and mirror themselves stay black.",
        integrators.ParticleTracer(),
        spp=192,
    ),
}
SAMPLERS = {
    "sobol": sampled("Four samples a pixel.", integrators.Sobol()),
    "zsobol": sampled("Four samples a pixel: the noise is fine-grained.", integrators.Zsobol()),
    "independent": sampled("Four samples a pixel: the most noise.", integrators.Independent()),
}
FILTERS = {
    "box": filtered("`radius` 0.5: sharp, with aliases in the middle.", integrators.Box()),
    "tent": filtered("`radius` 1.", integrators.Tent()),
    "gaussian": filtered("`stddev` 0.5.", integrators.Gaussian()),
    "mitchell": filtered("`b` and `c` 1/3.", integrators.Mitchell()),
    "lanczos": filtered("`radius` 3: the sharpest, with rings at edges.", integrators.Lanczos()),
    "blackman_harris": filtered("`radius` 1.5.", integrators.BlackmanHarris()),
}
