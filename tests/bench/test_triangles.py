"""Instances as triangles of the world."""

from __future__ import annotations

import numpy as np

from clpt import transforms
from clpt.bench import rays
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene
from clpt.scene.cameras import Perspective
from clpt.scene.shapes import Group, Instance, Mesh


def test_instances_are_where_they_are_placed(monkeypatch) -> None:
    rng = np.random.default_rng(5)
    points = rng.normal(3.0, 1.0, (9, 3)).astype(np.float32)
    mesh = Mesh(vertices=points, faces=np.arange(9).reshape(-1, 3))
    group = Group(shapes=(mesh,))
    places = [
        transforms.translate((i, 2, 0)) @ transforms.rotate((1, 2, 3), 40 * i) @ transforms.scale(i)
        for i in (1, 2)
    ]
    shapes = [mesh, *(Instance(group=group, to_world=place) for place in places)]
    lowered = lower(Scene(camera=Perspective(), shapes=shapes))
    assert len(lowered.faces) == 6  # the instances share theirs
    vertices, faces = rays.world(lowered)
    placed = [points, *(transforms.transform_points(place, points) for place in places)]
    expected = np.concatenate(placed).reshape(-1, 3, 3)
    np.testing.assert_allclose(vertices[faces], expected, rtol=0, atol=2e-5)

    monkeypatch.setattr(rays, "MOST", 6)
    assert len(rays.world(lowered)[1]) == 6
