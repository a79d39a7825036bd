"""clpt.render.lights.level: how bright a scene is."""

from __future__ import annotations

from typing import Any

import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene, cameras
from clpt.scene.lights import Area, Constant, Point
from clpt.scene.shapes import Rectangle, Sphere


def scale(factor: float = 1.0, **scene: Any) -> float:
    """What the film of a scene has of a value of 1."""
    made = Scene(camera=cameras.Perspective(), film=Film(width=4, height=4, mode="rgb"), **scene)
    return float(lower(made).settings["film_scale"])


def test_ordinary_light_is_summed_as_it_is() -> None:
    floor = Rectangle(to_world=tf.scale(100.0))
    for light in (1e-4, 1.0, 1e8):
        assert scale(shapes=[floor], lights=[Constant(radiance=light)]) == 1.0
    assert scale() == 1.0


def test_the_brightest_light_counts() -> None:
    dim, lamp = Constant(radiance=1e-20), Sphere(radius=1e-3, emission=Area(radiance=1.0))
    assert scale(lights=[dim]) > 2.0**40
    assert scale(lights=[dim], shapes=[lamp]) == 1.0


def test_a_strong_lamp_far_away_is_not_bright() -> None:
    """A point that stands for the sun: 1e24 W/sr at 1.5e11 m are 44 W/m^2."""
    floor, sun = Rectangle(), Point(position=(0.0, 0.0, 1.5e11), intensity=1e24)
    assert scale(shapes=[floor], lights=[sun]) == 1.0
    near = Point(position=(0.0, 0.0, 1.0), intensity=1e24)
    assert scale(shapes=[floor], lights=[near]) < 2.0**-40


def test_films_of_other_light_are_not_merged() -> None:
    """The unit of their sums differs; those of one scene have one unit."""
    states = []
    for light in (1.0, 1e-20):
        scene = Scene(
            camera=cameras.Perspective(),
            lights=[Constant(radiance=light)],
            film=Film(width=4, height=4, mode="rgb"),
        )
        with clpt.Renderer(scene) as renderer:
            renderer.run(1)
            states.append(renderer.film_state())
    with pytest.raises(SceneError, match="another scale"):
        states[0].merged(states[1])


def test_emission_beyond_float32_is_refused_by_name() -> None:
    for light in (1e39, (1.0, 1e39, 1.0)):
        with pytest.raises(SceneError, match=r"constant\.radiance.*3\.40282e\+38"):
            Constant(radiance=light)
