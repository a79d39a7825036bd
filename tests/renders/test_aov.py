"""Values of the first hit: ids are whole, whatever the filter and the number of samples."""

from __future__ import annotations

import dataclasses

import numpy as np

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Aov, Mitchell
from clpt.scene.shapes import Rectangle, Sphere


def test_ids_are_whole():
    """Those of the pixels' centres; -1 where there is no shape."""
    balls = [Sphere(center=(x, 0, 0), radius=0.3) for x in (-0.8, 0.0, 0.8)]
    floor = Rectangle(to_world=tf.translate([0, -0.8, 0]) @ tf.scale([1.5, 0.3, 1]))
    scene = Scene(
        camera=Perspective(to_world=tf.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]), fov=45),
        shapes=[*balls, floor],
        film=Film(width=33, height=31, filter=Mitchell()),
        integrator=Aov(channels=("shape_id", "depth")),
    )
    with clpt.Renderer(scene) as renderer:
        renderer.run(7)
        renderer.run(5)
        found = renderer.layers()
        assert renderer.samples == 12
        counts = [one.counts.samples for one in renderer.wavefronts]
        assert counts == [33 * 31, 12 * 33 * 31]
        renderer.reset()
        renderer.step(3)
        np.testing.assert_array_equal(renderer.layers()["shape_id"], found["shape_id"])
    assert {*found["shape_id"].ravel().tolist()} == {-1.0, 0.0, 1.0, 2.0, 3.0}
    assert found["shape_id"][15, 16, 0] == 1.0 and found["shape_id"][0, 0, 0] == -1.0
    once = clpt.render(dataclasses.replace(scene, integrator=Aov(channels=("shape_id",))), 1)
    np.testing.assert_array_equal(once, found["shape_id"])
