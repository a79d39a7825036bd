"""The benchmark's scenes, from formulas without files.

`atrium`: 309 thousand triangles of three kinds of material under sun and sky; `cornell`: 32
triangles and a lamp, traced without a tree; others: balls of metal, glass and mist on a floor.

PICTURES and SIZES fix the picture benchmark. After a change there or to the scenes, raise
BENCHMARK_VERSION and write new references by `python -m clpt.bench.make_references`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from clpt import transforms
from clpt.bench import atrium as court
from clpt.errors import UnknownKindError
from clpt.scene import Scene, integrators, lights, media, phases
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Box, Film
from clpt.scene.materials import (
    Conductor,
    Dielectric,
    Diffuse,
    Material,
    Null,
    RoughConductor,
    RoughPlastic,
    TwoSided,
)
from clpt.scene.shapes import Mesh, Rectangle, Shape, Sphere
from clpt.scene.textures import Checkerboard

COLOURS = {
    "walls": (0.68, 0.55, 0.4),
    "galleries": (0.68, 0.55, 0.4),
    "columns": (0.76, 0.71, 0.62),
    "arches": (0.76, 0.71, 0.62),
    "curtains": (0.5, 0.045, 0.04),
    "vases": (0.42, 0.15, 0.07),
    "foliage": (0.13, 0.34, 0.05),
    "lamps": (0.76, 0.71, 0.62),
}
BENCHMARK_VERSION = 1


def atrium() -> Scene:
    """A court of columns and arches under sun and sky, seen along its length."""
    vertices, faces, parts = court.atrium()
    brass = TwoSided(front=RoughConductor(eta=0.3, k=3.0, alpha_u=0.2, alpha_v=0.2))
    materials: dict[str, Material] = {
        name: TwoSided(front=Diffuse(reflectance=colour)) for name, colour in COLOURS.items()
    }
    marble = RoughPlastic(alpha=0.12, diffuse_reflectance=(0.5, 0.46, 0.4))
    materials |= {"floor": marble, "chains": brass, "relief": brass}
    shapes: list[Shape] = []
    for name, which in parts.items():
        used, local = np.unique(faces[which], return_inverse=True)
        local = local.reshape(-1, 3)
        if name == "floor":  # its front is up
            local = local[:, ::-1]
        mesh = Mesh(name=name, vertices=vertices[used], faces=local, material=materials[name])
        shapes.append(mesh)
    view = transforms.look_at((2.0, 5.5, 9.0), (40.0, 5.0, 9.5), (0, 1, 0))
    return Scene(
        camera=Perspective(fov=70.0, to_world=view),
        shapes=shapes,
        lights=[
            lights.Constant(radiance=(0.42, 0.56, 0.78)),
            lights.Directional(direction=(0.35, -1.0, 0.42), irradiance=(6.5, 5.7, 4.5)),
        ],
        integrator=integrators.Path(max_depth=8),
        name="atrium",
    )


def cornell() -> Scene:
    """A room with two boxes under a square lamp."""
    white, red, green = (
        TwoSided(front=Diffuse(reflectance=colour))
        for colour in ((0.73, 0.71, 0.68), (0.57, 0.043, 0.044), (0.105, 0.378, 0.076))
    )

    def wall(
        material: Material, axis: Any, degrees: float, offset: Any, size: float = 1.0, **more: Any
    ) -> Shape:
        placed = transforms.rotate(axis, degrees) @ transforms.scale(size)
        return Rectangle(material=material, to_world=transforms.translate(offset) @ placed, **more)

    def block(height: float, degrees: float, offset: Any) -> list[Shape]:
        low, high = (-0.3, 0.0, -0.3), (0.3, height, 0.3)
        sides = court.box(low, high)
        first = np.cumsum([0, *(len(points) for points, _ in sides)])
        vertices = np.concatenate([points for points, _ in sides]).astype(np.float32)
        faces = np.concatenate([f + n for (_, f), n in zip(sides, first, strict=False)])
        turned = transforms.translate(offset) @ transforms.rotate((0, 1, 0), degrees)
        return [Mesh(vertices=vertices, faces=faces, material=white, to_world=turned)]

    lamp = lights.Area(radiance=(15.0, 15.0, 15.0))
    shapes = [
        wall(white, (1, 0, 0), -90, (0, -1, 0)),
        wall(white, (1, 0, 0), 90, (0, 1, 0)),
        wall(white, (0, 1, 0), 0, (0, 0, -1)),
        wall(red, (0, 1, 0), 90, (-1, 0, 0)),
        wall(green, (0, 1, 0), -90, (1, 0, 0)),
        wall(Diffuse(reflectance=0.0), (1, 0, 0), 90, (0, 0.999, 0), 0.25, emission=lamp),
        *block(0.6, -17.0, (0.335, -1, 0.38)),
        *block(1.2, 17.0, (-0.33, -1, -0.28)),
    ]
    view = transforms.look_at((0, 0, 3.9), (0, 0, 0), (0, 1, 0))
    return Scene(
        camera=Perspective(fov=39.3077, to_world=view),
        shapes=shapes,
        integrator=integrators.Path(max_depth=8),
        name="cornell",
    )


def _floor() -> Shape:
    """A floor of checks, 12 m wide, at height 0."""
    checks = Checkerboard(
        color0=(0.6, 0.58, 0.55), color1=(0.16, 0.18, 0.22), to_uv=np.diag((6.0, 6.0, 1.0))
    )
    flat = transforms.rotate((1, 0, 0), -90) @ transforms.scale(6.0)
    return Rectangle(material=Diffuse(reflectance=checks), to_world=flat)


def _ball(x: float, z: float, material: Material) -> Shape:
    return Sphere(center=(x, 0.8, z), radius=0.8, material=material)


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


SCENES: dict[str, Callable[[], Scene]] = {
    "atrium": atrium,
    "cornell": cornell,
    "spheres": spheres,
    "glass": glass,
    "mist": mist,
}


def build_scene(name: str) -> Scene:
    """Return a scene of SCENES. Raises UnknownKindError, which lists the names."""
    if name not in SCENES:
        raise UnknownKindError("scene", name, SCENES)
    return SCENES[name]()


def opened(name: str, mode: str | None = None) -> Scene:
    """Return a scene of the benchmark, or of any file or folder that clpt loads.

    mode: rgb or spectral, by default the scene's. Raises SceneError.
    """
    if name in SCENES:
        scene = build_scene(name)
    else:
        from clpt.formats import load

        scene = load(name)
        scene.name = scene.name or name
    return in_mode(scene, mode)


def in_mode(scene: Scene, mode: str | None) -> Scene:
    """Return a scene in the mode rgb or spectral; unchanged for None."""
    if mode is None:
        return scene
    return dataclasses.replace(scene, film=dataclasses.replace(scene.film, mode=mode))


@dataclass(frozen=True)
class Size:
    """Width and height of a square picture [pixels], a multiple of 8, and its samples a pixel."""

    side: int
    samples: int

    @property
    def all_samples(self) -> int:
        """Samples of all pixels together."""
        return self.side**2 * self.samples


@dataclass(frozen=True)
class Kept:
    """The mode of a scene, and the speed [Msamples/s] that counts 1000 points."""

    mode: str
    reference: float


SIZES = {"quick": Size(128, 64), "standard": Size(384, 64), "large": Size(1024, 128)}
PICTURES = {  # speeds of about two cores with AVX-512, by PoCL
    "cornell": Kept("rgb", 10.0),
    "atrium": Kept("rgb", 1.0),
    "spheres": Kept("rgb", 20.0),
    "glass": Kept("spectral", 12.0),
    "mist": Kept("spectral", 5.0),
}


def picture(name: str, size: str, seed: int = 0) -> Scene:
    """Return a scene of PICTURES with a box filter and a film whose size is a key of SIZES.

    Raises UnknownKindError for a scene that the benchmark does not have.
    """
    scene, side = build_scene(name), SIZES[size].side
    film = Film(width=side, height=side, mode=PICTURES[name].mode, filter=Box())
    return dataclasses.replace(scene, film=film, seed=seed, spp=SIZES[size].samples)
