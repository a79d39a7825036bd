"""Analysis: what is decided before anything becomes words."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.render.flow.find import analyse
from clpt.render.flow.scene_to_tables import lower
from clpt.render.records.tables import LoweringCache
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Auto, Path, Vcm
from clpt.scene.lights import Area, Constant, Point
from clpt.scene.materials import Dielectric, Diffuse
from clpt.scene.media import Homogeneous
from clpt.scene.shapes import Rectangle, Sphere


def scene(**changes: object) -> Scene:
    """A ball of glass over a table, below a lamp and a panel that shines."""
    panel = Rectangle(to_world=tf.translate([0, 0, 9]), emission=Area(), name="panel")
    table = Rectangle(material=Diffuse(), to_world=tf.translate([0, 0, -1.5]) @ tf.scale(4.0))
    made = {
        "camera": Perspective(to_world=tf.look_at([0, -6, 3], [0, 0, 0], [0, 0, 1])),
        "shapes": [Sphere(material=Dielectric()), table, panel],
        "lights": [Constant(), Point(position=(0.0, 0.0, 5.0), intensity=100.0)],
        "film": Film(width=8, height=8, mode="rgb"),
        "integrator": Auto(),
    }
    return Scene(**{**made, **changes})


def test_the_integrator_is_decided_without_words() -> None:
    found = analyse(scene(), LoweringCache())
    assert not isinstance(found.index.integrator, Auto)
    assert "is specular" in found.reason
    made = lower(scene())
    assert type(made.integrator) is type(found.index.integrator)
    assert made.reason == found.reason


def test_what_was_decided_before_stays() -> None:
    found = analyse(scene(), LoweringCache(), Path(light_paths=0), lit_before=False)
    assert found.index.integrator.light_paths == 0
    assert found.reason == "as before the scene was edited"
    kept = analyse(scene(), LoweringCache(), Vcm(), lit_before=False)
    assert isinstance(kept.index.integrator, Vcm)


def test_sources_are_those_of_the_rows_of_lights() -> None:
    found, made = analyse(scene(), LoweringCache()), lower(scene())
    assert found.sources.infinite == int(made.settings["infinite_count"]) == 1
    assert len(found.sources.power) == int(made.settings["light_count"]) == 3
    assert found.sources.order == (0, 1)
    assert found.sources.first == (2,)
    assert [one.bounds.placed.all() for one in found.sources.every] == [False, True, True]


def test_lowering_leaves_an_analysis_as_it_is() -> None:
    """It is frozen, and rows of shapes get their materials and lights in copies."""
    cache = LoweringCache()
    found = analyse(scene(), cache)
    with pytest.raises(FrozenInstanceError):
        found.reason = ""  # type: ignore[misc]
    lower(scene())
    assert all(row["light"] == -1 and row["front"] == 0 for row in found.geometry.rows)
    assert {field.name for field in fields(found)} >= {"index", "geometry", "sources", "around"}


def test_media_are_found_around_lights_and_the_camera() -> None:
    fog = Homogeneous(sigma_s=0.1, sigma_a=0.0, name="fog")
    room = Sphere(to_world=tf.scale(50.0), material=Diffuse(), interior=fog)
    given = scene()
    given.shapes = [*given.shapes, room]
    given.lights = given.lights[1:]
    found = analyse(given, LoweringCache())
    assert found.around == (fog,)
    assert [around for around, _ in found.light_media.around] == [(fog, None), (fog, None)]
    np.testing.assert_allclose(found.light_media.extinction, 0.1, rtol=1e-6)
