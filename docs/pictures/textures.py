"""Pictures of textures: each on a board and a ball."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from clpt.scene import Scene, shapes
from clpt.scene.materials import Diffuse
from clpt.scene.textures import (
    PATTERNS,
    Bitmap,
    Checkerboard,
    Checkers,
    Dots,
    Graph,
    Marble,
    MeshAttribute,
    Mix,
    Noise,
    Product,
    Voxels,
)
from clpt.scene.volumes import Volume
from clpt.transforms import rotate, scale, translate

from .studio import PLACES, SMALL, WIDE, Picture, arc, lathe, near_camera, studio

FIELD = Path(__file__).parents[2] / "scenes" / "poppy_field" / "picture.jpg"
RED, CREAM, DARK = (0.6, 0.07, 0.04), (0.8, 0.72, 0.58), (0.03, 0.06, 0.16)
BALL = rotate([1, 0, 0], 90)  # an image stands upright on it


def uv_scale(u: float, v: float) -> Any:
    return np.diag([u, v, 1.0])


def board_and_ball(caption: str, texture: Callable[[float], Any]) -> Picture:
    """A board and a ball of a texture, which is given how often it repeats on each."""

    def scene() -> Scene:
        board, ball = (Diffuse(reflectance=texture(n)) for n in (1, 2))
        place = translate([-0.55, 0.8, -0.5]) @ rotate([0, 1, 0], 14) @ scale([1.05, 0.79, 1.0])
        things = [
            shapes.Rectangle(material=board, to_world=place),
            shapes.Sphere(
                radius=0.56,
                material=ball,
                to_world=translate([0.95, 0.56, 0.35]) @ rotate([0, 1, 0], 160) @ BALL,
            ),
        ]
        return studio(things, size=SMALL, camera=near_camera())

    return Picture(caption, scene)


def noises() -> Scene:
    """The three patterns of noise on three balls."""
    balls = [
        shapes.Sphere(
            center=(x, 0.68, 0),
            radius=0.68,
            material=Diffuse(
                reflectance=Mix(
                    first=DARK,
                    second=CREAM,
                    amount=Mix(
                        first=low,
                        second=1.0 + low,
                        amount=Noise(pattern=pattern, to_texture=scale(4.0)),
                    ),
                )
            ),
        )
        for x, pattern, low in zip(PLACES, PATTERNS, (0.5, 0.0, 0.0), strict=True)
    ]
    return studio(balls, size=WIDE)


def attributes() -> Scene:
    """Colours of vertices on a smooth bell, of faces on a coarse ball."""
    smooth = lathe([(0.0, 0.0), (0.75, 0.0)], [*arc(0.0, 0.0, 0.75, 0.0, 90.0, 24)])
    height = smooth["vertices"][:, 1:2] / 0.75
    turn = np.arctan2(smooth["vertices"][:, 2:], smooth["vertices"][:, :1])
    hues = 0.5 + 0.5 * np.cos(turn * 3.0 + height * 6.0 + np.arange(3) * 2.1)
    coarse = lathe([*arc(0.0, 0.0, 0.62, -90.0, 90.0, 9)], around=14)
    del coarse["normals"]
    colours = np.random.default_rng(3).uniform(0.05, 0.75, (len(coarse["faces"]), 3))
    things = [
        shapes.Mesh(
            **smooth,
            attributes={"vertex_color": hues * 0.75},
            material=Diffuse(reflectance=MeshAttribute(name="vertex_color")),
            to_world=translate([-0.78, 0.0, 0.0]) @ scale([1.0, 1.7, 1.0]),
        ),
        shapes.Mesh(
            **coarse,
            attributes={"face_color": colours},
            material=Diffuse(reflectance=MeshAttribute(name="face_color")),
            to_world=translate([0.8, 0.62, 0.2]),
        ),
    ]
    return studio(things, size=SMALL, camera=near_camera())


def field(n: float) -> Bitmap:
    return Bitmap(image=FIELD, to_uv=uv_scale(n, 1))


def squares(n: float, dark: Any = DARK, light: Any = CREAM) -> Checkerboard:
    return Checkerboard(color0=light, color1=dark, to_uv=uv_scale(4 * n, 3 if n == 1 else 4))


def voxels() -> Voxels:
    colours = np.random.default_rng(2).uniform(0.02, 0.75, (8, 5, 5, 3))
    box = translate([-1.7, 0.0, -1.0]) @ scale([3.4, 1.7, 2.0])
    return Voxels(values=Volume(colours, box))


def dots(n: float) -> Mix:
    spots = Dots(to_uv=uv_scale(10 * n, 7.5 if n == 1 else 8))
    return Mix(first=CREAM, second=RED, amount=spots)


def wood(_: float) -> Graph:
    """Rings around an axis, which noise bends."""
    nodes: dict[str, Any] = {
        "bend": {"type": "fractal3d", "amplitude": 0.12, "channels": 3},
        "place": {"type": "add", "in1": "position", "in2": "bend"},
        "across": {"type": "multiply", "in1": "place", "in2": [1, 0.15, 1]},
        "radius": {"type": "magnitude", "in": "across"},
        "rings": {"type": "multiply", "in1": "radius", "in2": 11},
        "ring": {"type": "fract", "in": "rings"},
        "color": {"type": "ramp", "in": "ring", "interpolation": 2,
                  "stops": [[0, 0.36, 0.16, 0.05], [0.7, 0.62, 0.36, 0.15], [1, 0.2, 0.08, 0.03]]},
    }  # fmt: skip
    return Graph(nodes=nodes)


TEXTURES = {
    "bitmap": board_and_ball("An image: once on a board, twice around a ball.", field),
    "checkerboard": board_and_ball("Two colours over uv.", squares),
    "product": board_and_ball(
        "An image times a `checkerboard` of grey and white.",
        lambda n: Product(first=field(n), second=squares(n, 0.25, 1.0)),
    ),
    "mix": board_and_ball(
        "An image and one colour; a `checkerboard` is the `amount`.",
        lambda n: Mix(first=field(n), second=RED, amount=squares(n, 0.0, 0.8)),
    ),
    "mesh_attribute": Picture("Colours of vertices, and of faces.", attributes),
    "dots": board_and_ball("As the `amount` of a `mix` of two colours.", dots),
    "checkers": board_and_ball(
        "Cubes of 0.25 m, as the `amount` of a `mix` of two colours.",
        lambda _: Mix(
            first=CREAM,
            second=DARK,
            amount=Checkers(to_texture=scale(4.0) @ rotate([1, 1, 0], 20)),
        ),
    ),
    "noise": Picture("`fbm`, `wrinkled` and `windy`, as the `amount` of a `mix`.", noises),
    "marble": board_and_ball("The same in space on both.", lambda _: Marble(scale=2.0)),
    "voxels": board_and_ball(
        "Random colours at 8 x 5 x 5 points in a box around both.", lambda _: voxels()
    ),
    "graph": board_and_ball("Wood: rings in space that noise bends, and a ramp of colors.", wood),
}
