"""What a renderer drops is given back: its memory stays where it was, however often it changes."""

from __future__ import annotations

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.scene.integrators import Path

TIMES = 30  # a leak of one allocation shows after one
POINTS = np.array([[-1, 0, -1], [1, 0, -1], [0, 1, -1]], np.float32)


@pytest.fixture(scope="module")
def renderer(one_context: None) -> clpt.Renderer:
    scene = Scene(
        camera=cameras.Perspective(to_world=tf.look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])),
        film=Film(width=24, height=16, mode="rgb"),
        integrator=Path(max_depth=2),
        shapes=[
            shapes.Mesh(vertices=POINTS, faces=np.array([[0, 1, 2]], np.uint32), name="moves"),
            shapes.Sphere(radius=0.2, name="ball"),
        ],
        lights=[lights.Constant()],
    )
    return clpt.Renderer(scene)


def reset(renderer: clpt.Renderer, _: int) -> None:
    renderer.reset()
    renderer.run(32, noise=0.5)


def move(renderer: clpt.Renderer, i: int) -> None:
    renderer.update(transforms={"moves": tf.translate([0.01 * i, 0, 0])})


def deform(renderer: clpt.Renderer, i: int) -> None:
    renderer.update(vertices={"moves": POINTS + np.float32(0.01 * i)})


def rebuild_and_move(renderer: clpt.Renderer, i: int) -> None:
    """Lowering again drops what moved shapes so far."""
    glow = lights.Point(intensity=float(1 + i % 2))
    more = [materials.Diffuse(reflectance=0.1 * (1 + i % 2))]
    scene = renderer.scene
    ball = shapes.Sphere(radius=0.2 + 0.01 * (i % 2), name="ball", material=more[0])
    renderer.update(
        scene=Scene(
            camera=scene.camera, film=scene.film, integrator=scene.integrator,
            shapes=[scene.shapes[0], ball], lights=[scene.lights[0], glow],
        )
    )  # fmt: skip
    move(renderer, i)


@pytest.mark.parametrize("change", [reset, move, deform, rebuild_and_move])
def test_used_stays_where_it_was(renderer: clpt.Renderer, change) -> None:
    buffers = renderer._wavefront.buffers
    for i in range(2):
        change(renderer, i)
    used = buffers.used
    for i in range(TIMES):
        change(renderer, i)
    assert buffers.used == used
