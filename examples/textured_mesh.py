"""A mesh of one's own with a texture: a vase turned from a curve, with a painted glaze.

Vertices, texture coordinates and the image are plain numpy arrays; no file is read.
"""

from argparse import ArgumentParser
from pathlib import Path

import numpy as np

import clpt
from clpt.scene import Film, Scene, cameras, lights, materials, shapes, textures
from clpt.transforms import look_at, rotate, scale

COLUMNS, ROWS = 128, 96


def vase(material: materials.Material) -> shapes.Mesh:
    """Return a surface of revolution about y; u runs around it, v from its foot to its rim."""
    u, v = np.meshgrid(np.linspace(0, 1, COLUMNS + 1), np.linspace(0, 1, ROWS + 1))
    radius = 0.42 + 0.3 * np.sin(5.2 * v - 0.6) * (1 - 0.45 * v)
    angle = -2 * np.pi * u
    vertices = np.stack([radius * np.cos(angle), 2 * v, radius * np.sin(angle)], axis=-1)
    first = (np.arange(ROWS)[:, None] * (COLUMNS + 1) + np.arange(COLUMNS)).ravel()
    above = first + COLUMNS + 1
    faces = [np.stack([first, first + 1, above + 1], 1), np.stack([first, above + 1, above], 1)]
    return shapes.Mesh(
        vertices=vertices.reshape(-1, 3),
        faces=np.concatenate(faces),
        uvs=np.stack([u, v], axis=-1).reshape(-1, 2),
        normals="smooth",
        material=materials.TwoSided(front=material),
    )


def glaze() -> np.ndarray:
    """Return an image (h, w, 3) float32 in linear Rec. 709: waves and dots of blue on white."""
    v, u = np.meshgrid(np.linspace(1, 0, 512), np.linspace(0, 1, 1024), indexing="ij")  # top first
    waves = np.abs(np.sin(np.pi * (10 * v + 0.35 * np.sin(2 * np.pi * 8 * u)))) < 0.3
    bands = np.sin(6 * np.pi * v) > 0.2
    dots = np.hypot((16 * u) % 1 - 0.5, (8 * v) % 1 - 0.5) < 0.28
    blue = np.where(bands, waves, dots)
    gold = (np.abs(v - 0.965) < 0.02) | (np.abs(v - 0.03) < 0.015)
    image = np.where(blue[..., None], [0.02, 0.06, 0.35], [0.78, 0.76, 0.7])
    return np.float32(np.where(gold[..., None], [0.6, 0.35, 0.05], image))


arguments = ArgumentParser(description=__doc__)
arguments.add_argument("folder", type=Path, nargs="?", default=".", help="gets the picture")
picture = arguments.parse_args().folder / "textured_mesh.png"
paint = textures.Bitmap(image=glaze(), wrap="repeat")
china = materials.RoughPlastic(diffuse_reflectance=paint, alpha=0.06)
table = materials.RoughPlastic(diffuse_reflectance=(0.25, 0.13, 0.07), alpha=0.25)
scene = Scene(
    camera=cameras.Perspective(to_world=look_at([0, 2.3, 5.2], [0, 0.95, 0], [0, 1, 0]), fov=33),
    shapes=[
        vase(china),
        shapes.Disk(to_world=rotate([1, 0, 0], -90) @ scale(40), material=table),
        shapes.Rectangle(
            to_world=look_at([-3, 4, 3], [0, 1, 0], [0, 1, 0]) @ scale(1.3),
            material=materials.Diffuse(reflectance=0.0),
            emission=lights.Area(radiance=(15, 14, 12)),
        ),
    ],
    lights=[lights.Constant(radiance=(0.4, 0.45, 0.55))],
    film=Film(width=400, height=320),
)
clpt.write_image(picture, clpt.render(scene, spp=64), tone="agx")
print(f"wrote {picture}")
