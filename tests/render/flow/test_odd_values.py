"""Numbers that float32 or float64 cannot square: a clear error, or tables without a warning."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, cameras, integrators, lights, shapes
from clpt.scene import materials as m

ODD = (0.0, 1e-300, 1e-45, 1e-20, 1e20, 1e37, 3e38, 1e39, 1e200, -1.0)
VIEW = tf.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0])
CORNERS = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0)])
FACE = np.array([(0, 1, 2)], np.uint32)
BALL = np.ones(3), np.array([0.0, 1.0, 2.0])


def scene(*given: Any, **changes: Any) -> Scene:
    made = {"camera": cameras.Perspective(to_world=VIEW), "lights": [lights.Constant()]}
    film = Film(width=6, height=5, mode="rgb")
    return Scene(**{"shapes": list(given), "film": film, **made, **changes})


def placed(v: float) -> Iterator[np.ndarray]:
    """Transforms with a number: a scale, a stretch, what is no affine transform, a far place."""
    yield from (np.diag(d) for d in ([v, v, v, 1.0], [v, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, v]))
    yield tf.translate([v, 0.0, 0.0])


def of_shapes(v: float) -> Iterator[Callable[[], Scene]]:
    lit = {"emission": lights.Area()}
    yield lambda: scene(shapes.Sphere(radius=v))
    yield lambda: scene(shapes.Sphere(center=(v, 0, 0), **lit))
    yield lambda: scene(shapes.Cylinder(p1=(0, 0, v), radius=1.0))
    yield lambda: scene(shapes.Mesh(vertices=CORNERS * v, faces=FACE, normals="smooth", **lit))
    yield lambda: scene(
        shapes.Curves(points=np.array([(0, 0, 0, 0.1), (0, v, 1, 0.1)]), basis="linear")
    )
    yield lambda: scene(shapes.Spheres(centers=[(0, 0, 0), (v, 0, 0)], radii=[1.0, abs(v)], **lit))
    for matrix in placed(v):
        for kind in (shapes.Sphere, shapes.Cylinder, shapes.Rectangle, shapes.Disk, shapes.Cube):
            yield lambda kind=kind, at=matrix: scene(kind(to_world=at, **lit))
            group = shapes.Group((kind(),), "two")
            yield lambda group=group, at=matrix: scene(
                *(shapes.Instance(group=group, to_world=one) for one in (np.eye(4), at))
            )


def of_lamps(v: float) -> Iterator[Callable[[], Scene]]:
    even = {"image": np.ones((4, 8, 3), np.float32)}
    for matrix in placed(v):
        yield lambda at=matrix: scene(lights=[lights.Spot(to_world=at), *([lights.Point()] * 20)])
        yield lambda at=matrix: scene(lights=[lights.Projector(to_world=at, image=0.5)])
        yield lambda at=matrix: scene(lights=[lights.Envmap(to_world=at, **even)])
    yield lambda: scene(lights=[lights.Point(position=(v, i, 0)) for i in range(20)])
    yield lambda: scene(lights=[lights.Point(intensity=min(abs(v), 3e38))])
    yield lambda: scene(lights=[lights.Directional(direction=(v, 0, 0))])


def of_cameras(v: float) -> Iterator[Callable[[], Scene]]:
    glass = shapes.Sphere(material=m.Dielectric())
    things = {"lights": [lights.Point(position=(0, 0, 3))], "integrator": integrators.Auto()}
    for matrix in placed(v):
        for kind in (cameras.Perspective, cameras.Orthographic, cameras.Spherical):
            yield lambda kind=kind, at=matrix: scene(
                glass, shapes.Rectangle(), camera=kind(to_world=at), **things
            )


@pytest.mark.parametrize("v", ODD)
@pytest.mark.parametrize("scenes", [of_shapes, of_lamps, of_cameras])
def test_odd_numbers_are_refused_or_lowered(scenes: Any, v: float) -> None:
    for one in scenes(v):
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            try:
                found = lower(one())
            except SceneError:
                continue
        assert np.isfinite(found.vertices).all()
        assert np.isfinite(found.settings["scene_radius"])


def test_a_disk_that_an_instance_flattens_is_named() -> None:
    group = shapes.Group((shapes.Disk(),), "two")
    flat = np.diag([1e-300, 1.0, 1.0, 1.0])
    both = (shapes.Instance(group=group, to_world=at) for at in (np.eye(4), flat))
    with pytest.raises(SceneError, match=r"disk.*singular"):
        lower(scene(*both))


def test_lengths_of_far_vectors() -> None:
    assert tf.length([3e200, 4e200, 0.0]) == pytest.approx(5e200)
    assert not tf.is_singular(np.diag([1e200, 2e200, 1e200, 1.0]))
    assert tf.is_singular(np.diag([1e200, 0.0, 1e200, 1.0]))
