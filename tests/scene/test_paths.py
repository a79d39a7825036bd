"""Parameters by path: read, listed and changed, with the nearest names where there is none."""

from __future__ import annotations

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt.errors import SceneError
from clpt.scene import Film, Scene, cameras, lights, materials, shapes

GOLD = materials.RoughConductor(metal="gold", name="gold")
BLUE = materials.Diffuse(reflectance=(0.1, 0.2, 0.6))


def scene() -> Scene:
    return Scene(
        camera=cameras.Perspective(),
        film=Film(size=(4, 4), mode="rgb"),
        shapes=[
            shapes.Sphere(name="ball", material=BLUE),
            shapes.Cube(name="a.box", material=materials.TwoSided(front=BLUE)),
            shapes.Sphere(material=GOLD),
            shapes.Disk(name="twin"),
            shapes.Disk(name="twin"),
        ],
        lights=[lights.Point(intensity=2.0)],
    )


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("spp", 64),
        ("camera.fov", 45.0),
        ("film.width", 4),
        ("film.filter.radius", 0.5),
        ("ball.material.reflectance", spectra.RGB(0.1, 0.2, 0.6)),
        ("ball.material.reflectance.g", 0.2),
        ("a.box.material.front", BLUE),
        ("shapes[2].material.alpha_u", 0.1),
        ("gold.alpha_u", 0.1),
        ("gold", GOLD),
        ("shapes[4].name", "twin"),
        ("lights[0].intensity.r", 2.0),
    ],
)
def test_read(path: str, value: object) -> None:
    assert scene()[path] == value


def test_all_paths_can_be_read() -> None:
    made = scene()
    found = made.parameters()
    assert list(found)[:3] == ["camera.to_world", "camera.medium", "camera.motion"]
    for path, value in found.items():
        assert made[path] is value, path
    assert {"ball.material.reflectance", "gold.alpha_u", "lights[0].intensity"} <= found.keys()
    assert "shapes[2].material" in found  # and its parameters under its name
    assert "a.box.material.front" in found  # the ball's, which is shared
    assert not any(path.startswith("twin") for path in found)


def test_a_change_makes_another_scene() -> None:
    made = scene()
    other = made.changed({"ball.material.reflectance": (0.5, 0.0, 0.0), "camera.fov": 30.0})
    assert made["camera.fov"] == 45.0 and made["ball.material"] is BLUE
    assert other["camera.fov"] == 30.0
    assert other["ball.material.reflectance"] == spectra.RGB(0.5, 0.0, 0.0)
    assert other["a.box.material.front"] is other["ball.material"]  # it is shared
    assert other.shapes[2] is made.shapes[2]
    assert made.changed({"spp": 8, "film.filter.radius": 1.0})["film.filter.radius"] == 1.0


def test_a_default_is_not_shared() -> None:
    made = scene().changed({"shapes[3].material.reflectance": 0.9})
    assert made["shapes[3].material.reflectance"] == spectra.Constant(0.9)
    assert made["shapes[4].material.reflectance"] == spectra.Constant(0.5)
    assert shapes.Disk().material.reflectance == spectra.Constant(0.5)  # type: ignore[attr-defined]


def test_shorthands_change_what_they_stand_for() -> None:
    made = scene().changed({"gold.metal": "silver", "film.size": (8, 2)})
    assert made["gold.eta"] == spectra.metal("Ag")[0] and made.film.size == (8, 2)
    looking = made.changed({"lights[0].intensity": 1.0, "shapes[2].material.alpha": 0.3})
    assert looking["gold.alpha_v"] == 0.3
    with pytest.raises(SceneError, match="rough_conductor has no 'metal'"):
        made["gold.metal"]


def test_inside_of_groups_and_lists() -> None:
    group = shapes.Group((shapes.Sphere(name="leaf", material=BLUE),), "tree")
    glass = materials.Dielectric(layers=(materials.Layer(thickness=100.0),))
    made = Scene(
        camera=cameras.Perspective(),
        shapes=[
            shapes.Instance(group=group, name="first"),
            shapes.Instance(group=group),
            shapes.Sphere(name="bubble", material=glass),
        ],
    )
    other = made.changed(
        {"first.group.shapes[0].radius": 2.0, "bubble.material.layers[0].thickness": 200.0}
    )
    assert other.shapes[0].group is other.shapes[1].group  # type: ignore[attr-defined]
    assert other["shapes[1].group.shapes[0].radius"] == 2.0
    assert other["bubble.material.layers[0].thickness"] == 200.0
    assert made["bubble.material.layers[0].thickness"] == 100.0


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("bal.material", r"a scene has no 'bal'; did you mean 'ball'\?"),
        ("ball.materal", r"sphere has no 'materal'; did you mean 'material'\?"),
        ("ball.material.color", r"diffuse has no 'color'; known: name, reflectance"),
        ("lights[3].intensity", r"a scene has no 'lights\[3\]'; its lights are "),
        ("lights[3].lux", r"its lights are 'lights\[0\]'"),
        ("shapes[0].radius", r"a scene has no 'shapes\[0\]'; its shapes are 'ball', "),
        ("shapes[5].radius", r"a scene has no 'shapes\[5\]'; its shapes are 'ball', "),
        ("ball.material[0]", r"diffuse has no 0; known"),
        ("ball..material", r"must be names with dots between"),
        ("", r"a scene has no ''"),
    ],
)
def test_paths_to_nothing(path: str, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        scene()[path]
    with pytest.raises(SceneError, match=message):
        scene().changed({path: 1.0})


def test_a_scene_is_no_list() -> None:
    with pytest.raises(TypeError, match="a path is text"):
        list(scene())  # type: ignore[call-overload]


def test_a_value_that_makes_no_sense() -> None:
    with pytest.raises(SceneError, match=r"^diffuse\.reflectance: 2\.0 is outside \[0, 1\]"):
        scene().changed({"ball.material.reflectance": 2.0})


def test_a_renderer_takes_the_other_scene(one_context: None) -> None:
    made = Scene(
        camera=cameras.Perspective(),
        film=Film(size=(4, 4), mode="rgb"),
        lights=[lights.Constant(radiance=1.0)],
    )
    with clpt.Renderer(made) as renderer:
        renderer.run(1)
        renderer.update(scene=made.changed({"lights[0].radiance": 3.0}))
        renderer.run(1)
        np.testing.assert_allclose(renderer.image(), 3.0, rtol=1e-5)
