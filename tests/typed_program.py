"""What a user's type checker sees: mypy reads this file, nothing runs it."""

from __future__ import annotations

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray
from pyopencl.array import Array
from typing_extensions import assert_type

import clpt
from clpt.scene import cameras, materials


def pictures(queue: cl.CommandQueue) -> None:
    """A program that embeds a renderer."""
    scene = clpt.load("scenes/cornell_box")
    assert_type(scene, clpt.Scene)
    with clpt.Renderer(scene, queue=queue) as renderer:
        event = renderer.step(16)
        assert_type(event, cl.Event)
        assert_type(renderer.step(16, wait_for=[event]), cl.Event)
        assert_type(renderer.image(), NDArray[np.float32])
        assert_type(renderer.samples, int)
        assert_type(renderer.update(camera=cameras.Perspective()), cl.Event)
        assert_type(renderer.reset(), cl.Event)
        assert_type(renderer.run(16), bool)
        film: Array = renderer.film
        renderer.update(vertices={"ball": film})
        renderer.update(materials={scene.shapes[0]: materials.Diffuse()})
        renderer.cancel()
    assert_type(clpt.render(scene, 16), NDArray[np.float32])


def rays(queue: cl.CommandQueue, points: Array, directions: Array) -> None:
    """A program that asks what rays meet."""
    accel = clpt.Accel(queue, np.zeros((3, 3), np.float32), np.zeros((1, 3), np.uint32))
    hits = accel.intersect(points, directions)
    assert_type(hits, clpt.Hits)
    assert_type(hits.event, cl.Event)
