"""The benchmark's scenes, from formulas without files.

`atrium`: 309 thousand triangles of three kinds of material under sun and sky; `cornell`: 32
triangles and a lamp, traced without a tree; others: see clpt.bench.balls.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from clpt import transforms
from clpt.bench import atrium as court
from clpt.bench import balls
from clpt.errors import UnknownKindError
from clpt.scene import Scene, integrators, lights
from clpt.scene.cameras import Perspective
from clpt.scene.materials import Diffuse, Material, RoughConductor, RoughPlastic, TwoSided
from clpt.scene.shapes import Mesh, Rectangle, Shape

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


SCENES: dict[str, Callable[[], Scene]] = {
    "atrium": atrium,
    "cornell": cornell,
    "spheres": balls.spheres,
    "glass": balls.glass,
    "mist": balls.mist,
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
