"""Products of colours in RGB, as glTF has them: textures, vertices' colours and factors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Path
from clpt.scene.lights import Area, Constant
from clpt.scene.materials import Diffuse
from clpt.scene.shapes import Mesh
from clpt.scene.textures import Bitmap, MeshAttribute, Product
from tests.pictures.builders import BLACK, UP
from tests.pictures.support import assert_mean, exposures

PAIRS = [
    ((1.0, 0.0, 0.0), (0.0, 1.0, 1.0)),  # red and cyan: nothing
    ((0.2, 0.6, 0.4), (0.8, 0.5, 0.2)),
    ((1.0, 1.0, 1.0), (0.9, 0.02, 0.4)),
]
FACTOR = (1.0, 0.5, 0.8)
BRIGHT = 3.0  # of the squares that emit


def square(column: int, colour: Any, **given: Any) -> Mesh:
    """A unit square in a row before the camera; its vertices have a colour."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], np.float32)
    return Mesh(
        vertices=corners,
        faces=np.array([(0, 1, 2), (0, 2, 3)], np.uint32),
        uvs=corners[:, :2],
        attributes={"vertex_color": np.tile(np.float32(colour), (4, 1))},
        to_world=tf.translate([column, 0, 0]),
        **given,
    )


def bitmap(rgb: Any, bytes_: bool) -> Bitmap:
    made = np.broadcast_to(np.array(rgb), (2, 2, 3))
    if bytes_:
        return Bitmap(image=np.round(255.0 * made).astype(np.uint8), raw=True)
    return Bitmap(image=made.astype(np.float32))


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_products_are_of_rgb(mode: str) -> None:
    """Of a texture (of floats, of bytes), the vertices and a factor; under D65, and as light."""
    shapes, expected = [], []
    for texel, vertex in PAIRS:
        for bytes_ in (False, True):
            both = Product(first=bitmap(texel, bytes_), second=FACTOR, rgb=True)
            product = Product(first=MeshAttribute(), second=both, rgb=True)
            shown = np.array(texel) * vertex * FACTOR
            shapes.append(square(len(shapes), vertex, material=Diffuse(reflectance=product)))
            light = Area(radiance=Product(first=product, second=BRIGHT))
            shapes.append(square(len(shapes), vertex, material=BLACK, emission=light))
            expected += [shown, BRIGHT * shown]
    middle, half = [len(shapes) / 2.0, 0.5, 0.0], len(shapes) / 2.0
    view = tf.look_at(np.add(middle, [0, 0, 4]), middle, UP) @ tf.scale([half, half, 1.0])
    scene = Scene(
        camera=Orthographic(to_world=view),
        shapes=shapes,
        lights=[Constant(radiance=1.0)],
        integrator=Path(max_depth=2),
        film=Film(width=4 * len(shapes), height=4, mode=mode),
    )
    images = exposures(scene, 16, 64)
    columns = images.reshape(*images.shape[:2], len(shapes), 4, 3).transpose(2, 0, 1, 3, 4)
    for column, shown in zip(columns, expected, strict=True):
        assert_mean(column, shown, 0.05, 0.004)
