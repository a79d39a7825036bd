"""Builds a canal on the night of a lantern festival: twenty thousand triangles that shine.

    python scenes/lanterns/generate.py

Paper lanterns hang across the canal, windows.png lights the houses (many of its panes are dark),
and at the far end a projector throws another scene's picture on a screen.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

from clpt import transforms as tf
from clpt.formats import native
from clpt.scene import Film, Scene, materials
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path as PathTracer
from clpt.scene.lights import Area, Constant, Projector
from clpt.scene.shapes import Mesh, Rectangle
from clpt.scene.textures import Bitmap

HERE = Path(__file__).parent
RANDOM = np.random.default_rng(7)
COLOURS = {"red": (1.5, 0.16, 0.05), "amber": (1.6, 0.62, 0.12), "jade": (0.16, 0.8, 0.4)}
PANES, CELL = 8, 24  # windows.png: windows in a row, pixels of each
LENGTH, BANK, FRONT = 26.0, 3.0, 4.6  # of the canal; from its middle to the quay, to the houses [m]
Array = NDArray[np.float64]


def windows() -> None:
    """Paint an atlas of windows: warm or cold rooms behind four panes, most of them dark."""
    size = PANES * CELL
    picture = np.zeros((size, size, 3))
    for row in range(PANES):
        for column in range(PANES):
            warm = (1.0, 0.62, 0.3) if RANDOM.random() < 0.8 else (0.6, 0.8, 1.0)
            bright = RANDOM.uniform(0.5, 1.0) if RANDOM.random() < 0.45 else 0.015
            room = np.tile(np.linspace(1.0, RANDOM.uniform(0.4, 0.9), CELL)[:, None], CELL)
            room[:, : RANDOM.integers(0, 8)] *= 0.5  # a curtain
            room[[0, 1, 9, 10, -2, -1]] = room[:, [0, 1, 11, 12, -2, -1]] = 0.004
            cell = (slice(row * CELL, (row + 1) * CELL), slice(column * CELL, (column + 1) * CELL))
            picture[cell] = bright * room[..., None] * np.array(warm)
    encoded = np.round(255 * np.clip(picture, 0, 1) ** (1 / 2.2)).astype(np.uint8)
    Image.fromarray(encoded).save(HERE / "windows.png")


def joined(name: str, parts: list[trimesh.Trimesh], **more: object) -> Mesh:
    """One mesh of many, without normals, so that edges stay sharp."""
    whole = trimesh.util.concatenate(parts)
    return Mesh(
        name=name,
        vertices=np.asarray(whole.vertices, np.float32),
        faces=np.asarray(whole.faces, np.uint32),
        **more,
    )


def box(low: list[float], high: list[float]) -> trimesh.Trimesh:
    return trimesh.creation.box(bounds=[low, high])


def houses() -> tuple[list[trimesh.Trimesh], list[tuple[Array, float]]]:
    """Walls and roofs along both banks, and the middles of their windows with the side's sign."""
    parts, middles = [], []
    for side in (-1.0, 1.0):
        z = 2.0
        while z > -LENGTH:
            wide, tall = RANDOM.uniform(3.0, 4.6), RANDOM.uniform(4.8, 7.6)
            x = sorted([side * FRONT, side * (FRONT + 6.0)])
            parts.append(box([x[0], 0.0, z - wide], [x[1], tall, z - 0.03]))
            ridge = sorted([side * (FRONT - 0.25), side * (FRONT + 6.0)])
            parts.append(box([ridge[0], tall, z - wide], [ridge[1], tall + 0.18, z - 0.03]))
            for y in np.arange(1.5, tall - 0.9, 1.75):
                for across in np.arange(0.7, wide - 0.3, 1.05):
                    middles.append((np.array([side * (FRONT - 0.02), y, z - across]), side))
            z -= wide
    return parts, middles


def panes(middles: list[tuple[Array, float]]) -> Mesh:
    """Two triangles a window, each with a place in the atlas."""
    corners, uvs = [], []
    for middle, side in middles:
        square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * [0.34, 0.52]
        along = np.stack([np.zeros(4), square[:, 1], side * square[:, 0]], axis=1)
        corners.append(middle + along)
        cell = RANDOM.integers(0, PANES, 2)
        uvs.append((cell + np.array([(0, 0), (1, 0), (1, 1), (0, 1)])) / PANES)
    first = 4 * np.arange(len(corners))[:, None]
    faces = np.concatenate([first + np.array(c) for c in ((0, 1, 2), (0, 2, 3))])
    return Mesh(
        name="windows",
        vertices=np.concatenate(corners).astype(np.float32),
        faces=faces.astype(np.uint32),
        uvs=np.concatenate(uvs).astype(np.float32),
        material=materials.Diffuse(reflectance=0.02),
        emission=Area(radiance=Bitmap(image=HERE / "windows.png")),
    )


def lanterns() -> list[Mesh]:
    """Balls of 80 triangles on lines that sag across the canal, and afloat; one mesh a colour."""
    balls: dict[str, list[trimesh.Trimesh]] = {name: [] for name in COLOURS}
    places = []
    for z in np.arange(-1.0, -LENGTH + 4.0, -2.3):
        for t in np.linspace(0.06, 0.94, 15):
            x = (2.0 * t - 1.0) * FRONT
            places.append((x, 3.3 + 0.09 * x * x + RANDOM.uniform(-0.06, 0.06), z, 0.17))
    for _ in range(46):
        places.append((RANDOM.uniform(-2.7, 2.7), 0.06, RANDOM.uniform(-LENGTH, -1.0), 0.11))
    for *place, radius in places:
        ball = trimesh.creation.icosphere(subdivisions=1, radius=radius)
        ball.apply_scale([1.0, RANDOM.uniform(0.8, 1.25), 1.0])
        ball.apply_translation(place)
        balls[str(RANDOM.choice(list(COLOURS), p=[0.45, 0.4, 0.15]))].append(ball)
    paper = materials.Diffuse(reflectance=0.2)
    return [
        joined(f"lanterns_{name}", parts, material=paper, emission=Area(radiance=COLOURS[name]))
        for name, parts in balls.items()
    ]


WATER = materials.RoughPlastic(diffuse_reflectance=(0.003, 0.008, 0.01), alpha=0.04)


def scene() -> Scene:
    windows()
    walls, middles = houses()
    quays = [
        box([s * BANK if s > 0 else -11.0, -1.0, -LENGTH], [11.0 if s > 0 else -BANK, 0.35, 4.0])
        for s in (-1.0, 1.0)
    ]
    screen = tf.translate([0, 2.6, -LENGTH + 3.0])
    sea = tf.translate([0, 0, 2.0 - LENGTH / 2]) @ tf.rotate([1, 0, 0], -90)
    return Scene(
        camera=Perspective(to_world=tf.look_at([0.7, 1.75, 3.4], [0, 2.2, -9], [0, 1, 0]), fov=58),
        shapes=[
            joined("houses", walls, material=materials.Diffuse(reflectance=(0.62, 0.54, 0.46))),
            joined("quays", quays, material=materials.Diffuse(reflectance=0.25)),
            panes(middles),
            *lanterns(),
            Rectangle(
                name="water",
                to_world=sea @ tf.scale([BANK, LENGTH / 2 + 2.0, 1.0]),
                material=WATER,
            ),
            Rectangle(
                name="screen",
                to_world=screen @ tf.scale([3.1, 2.2, 1.0]),
                material=materials.Diffuse(reflectance=0.85),
            ),
        ],
        lights=[
            Constant(radiance=(0.002, 0.004, 0.011)),
            Projector(
                image=Bitmap(image=HERE / "slide.png"),
                irradiance=(500.0, 500.0, 500.0),
                fov=30.0,
                to_world=tf.look_at([0, 2.6, -LENGTH + 14.0], [0, 2.6, -LENGTH], [0, 1, 0]),
            ),
        ],
        integrator=PathTracer(max_depth=4),
        film=Film(width=480, height=300),
        spp=256,
    )


if __name__ == "__main__":
    native.save(scene(), HERE / "scene.json")
