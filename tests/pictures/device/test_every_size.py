"""Films of every size from 1x1 to 40x40, with each sky, instances, queues and adaptive sampling.

A film that is the corner of a larger one has the bits of the larger one's pixels, so the reference
of every size is one picture.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import trimesh

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene, kinds, materials, shapes
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path
from tests.rotation import rotating

SIDE, SPP = 40, 2
SKIES = sorted(name for name, cls in kinds("light").items() if cls.reach == "infinite")
IMAGES = {
    "envmap": np.linspace(0.1, 2.0, 4 * 8 * 3, dtype=np.float32).reshape(4, 8, 3),
    "cube_map": [np.full((2, 2, 3), 0.2 + 0.2 * i, np.float32) for i in range(6)],
}
FORMS = [{"looped": False}, {"slots": 64}, {"slots": 1 << 14}]
ALL = [(w, h) for w in range(1, SIDE + 1) for h in range(1, SIDE + 1)]
QUICK = [(1, 1), (1, 17), (2, 3), (3, 40), (4, 4), (5, 16), (16, 16), (17, 17), (33, 1), (39, 37)]


def scene(sky: str, size: tuple[int, int]) -> Scene:
    """Placed copies of a ball and a mirror under a sky; of the film the upper left corner."""
    given = {"image": IMAGES[sky]} if sky in IMAGES else {}
    ball = trimesh.creation.icosphere(subdivisions=1, radius=0.3)
    made = shapes.Mesh(vertices=ball.vertices, faces=ball.faces, material=materials.Diffuse())
    group = shapes.Group(shapes=[made])
    copies = [
        shapes.Instance(group=group, to_world=tf.translate([x, 0.1 * x, 0.0]))
        for x in (-0.6, 0.0, 0.6)
    ]
    mirror = shapes.Sphere(center=(0.3, 0.5, -0.5), radius=0.3, material=materials.Conductor())
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 0, 2.5], [0, 0, 0], [0, 1, 0]), fov=45),
        shapes=[*copies, mirror],
        lights=[kinds("light")[sky](**given)],
        film=Film(width=SIDE, height=SIDE, crop=(0, 0, *size), mode="rgb"),
        integrator=Path(light_paths=0),
    )


@cache
def whole(sky: str) -> np.ndarray:
    """The picture of the whole film."""
    return clpt.render(scene(sky, (SIDE, SIDE)), SPP)


def check(size: tuple[int, int], sky: str, form: dict[str, object]) -> None:
    width, height = size
    with clpt.Renderer(scene(sky, size), **form) as renderer:
        renderer.run(SPP)
        np.testing.assert_array_equal(renderer.image(), whole(sky)[:height, :width])
        renderer.reset()
        assert renderer.run(24, noise=0.2)
        counts = renderer.film_state().samples
        assert counts.min() >= 16 and counts.max() <= 24
        assert np.isfinite(renderer.image()).all()


@rotating("sky, form", SKIES, FORMS[1:])
def test_some_sizes(sky, form):
    for size in QUICK[:: 1 if form == FORMS[1] else 3]:
        check(size, sky, form)


@pytest.mark.slow  # queues too
@pytest.mark.parametrize("row", range(SIDE))
def test_every_size(row):
    """Skies and forms take turns."""
    for i, size in enumerate(ALL[row * SIDE : (row + 1) * SIDE]):
        check(size, SKIES[(i + row) % len(SKIES)], FORMS[(i // 3 + row) % len(FORMS)])
