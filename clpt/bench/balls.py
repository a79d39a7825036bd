"""Balls of metal, glass and mist on a floor of checks: small scenes of the benchmark."""

from __future__ import annotations

import dataclasses

import numpy as np

from clpt import transforms
from clpt.scene import Scene, integrators, lights, media, phases
from clpt.scene.cameras import Perspective
from clpt.scene.materials import (
    Conductor,
    Dielectric,
    Diffuse,
    Material,
    Null,
    RoughConductor,
    RoughPlastic,
)
from clpt.scene.shapes import Rectangle, Shape, Sphere
from clpt.scene.textures import Checkerboard


def _floor() -> Shape:
    """A floor of checks, 12 m wide, at height 0."""
    checks = Checkerboard(
        color0=(0.6, 0.58, 0.55), color1=(0.16, 0.18, 0.22), to_uv=np.diag((6.0, 6.0, 1.0))
    )
    flat = transforms.rotate((1, 0, 0), -90) @ transforms.scale(6.0)
    return Rectangle(material=Diffuse(reflectance=checks), to_world=flat)


def _ball(x: float, z: float, material: Material, radius: float = 0.8) -> Shape:
    return Sphere(center=(x, radius, z), radius=radius, material=material)


def _lamp() -> Shape:
    """A square lamp of 3 m above the floor, which shines down."""
    placed = transforms.translate((0, 5, 0)) @ transforms.rotate((1, 0, 0), 90)
    lamp = lights.Area(radiance=6.0)
    return Rectangle(
        material=Diffuse(reflectance=0.0), emission=lamp, to_world=placed @ transforms.scale(1.5)
    )


def _set_up(name: str, shapes: list[Shape], sky: float, max_depth: int) -> Scene:
    """Return shapes on the floor under the lamp and an even sky, seen from the front."""
    view = transforms.look_at((0, 2.6, 6.4), (0, 0.75, 0), (0, 1, 0))
    return Scene(
        camera=Perspective(fov=46.0, to_world=view),
        shapes=[_floor(), _lamp(), *shapes],
        lights=[lights.Constant(radiance=(0.8 * sky, 0.9 * sky, sky))],
        integrator=integrators.Path(max_depth=max_depth),
        name=name,
    )


def spheres() -> Scene:
    """Three balls of brushed metal, glossy plastic and a mirror on a floor of checks."""
    brass = RoughConductor(eta=(0.2, 0.42, 1.1), k=(3.9, 2.4, 1.9), alpha_u=0.25, alpha_v=0.1)
    plastic = RoughPlastic(diffuse_reflectance=(0.5, 0.06, 0.04), alpha=0.15)
    balls = [_ball(-1.8, 0.0, brass), _ball(0.0, 0.0, plastic), _ball(1.8, 0.0, Conductor())]
    return _set_up("spheres", balls, 0.6, 8)


def glass() -> Scene:
    """Balls of clear and green glass and a ball with air inside, under an even sky."""
    clear, green = Dielectric(int_ior="BK7"), Dielectric(absorption=(1.6, 0.25, 1.1))
    air = Dielectric(int_ior=1.000277, ext_ior="BK7")
    bubble = Sphere(center=(1.8, 0.8, 0.0), radius=0.7, material=air)
    balls = [_ball(-1.8, 0.0, green), _ball(0.0, 0.0, clear), _ball(1.8, 0.0, clear), bubble]
    return _set_up("glass", balls, 1.0, 16)


def mist() -> Scene:
    """Balls of white mist, coloured mist and wine, without surfaces."""
    white = media.Homogeneous(sigma_s=5.0, phase=phases.HenyeyGreenstein(g=0.6))
    amber = media.Homogeneous(sigma_t=(1.2, 3.0, 7.0), albedo=(0.999, 0.99, 0.96))
    wine = media.Homogeneous(sigma_a=(0.3, 3.4, 3.0), sigma_s=0.1)
    balls = [
        dataclasses.replace(_ball(x, 0.0, Null()), interior=medium)
        for x, medium in ((-1.8, white), (0.0, amber), (1.8, wine))
    ]
    return _set_up("mist", balls, 0.6, 64)
