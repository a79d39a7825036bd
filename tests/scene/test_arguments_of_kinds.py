"""Wrong arguments of the classes of a scene: the error comes at the class, with the names."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from clpt import transforms as tf
from clpt.errors import SceneError, UnknownKindError, UnusedParameterError
from clpt.scene import KINDS, Scene, cameras, lights, materials, shapes

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (
            lambda: materials.Diffuse(color=1.0),
            UnusedParameterError,
            r"^diffuse has no parameter 'color'; known: name, reflectance$",
        ),
        (
            lambda: lights.Goniometric(file="a.ies"),
            SceneError,
            "goniometric: 'file' is for scene f",
        ),
        (lambda: shapes.Sphere(type="sphere"), SceneError, "'type' is for scene files: .* class"),
        (
            lambda: materials.Dielectric(layers=[{"eta": 1.3}]),
            SceneError,
            r"clpt\.scene\.materials\.Layer\(eta=",
        ),
        (
            lambda: cameras.Perspective(fovy=40.0),
            UnusedParameterError,
            r"^perspective has no parameter 'fovy'; did you mean 'fov' or 'fov_axis'\?$",
        ),
        (
            lambda: lights.Point(name="lamp", intensity=1.0),
            UnusedParameterError,
            r"^point 'lamp': point has no parameter 'name'",
        ),
        (lambda: materials.Diffuse(0.5), TypeError, r"by name: Diffuse\(reflectance=\.\.\.\)"),
        (
            lambda: materials.Dielectric(int_ior="glas", name="bottle"),
            SceneError,
            r"^dielectric 'bottle'\.int_ior: unknown glass 'glas'; did you mean",
        ),
        (
            lambda: materials.Diffuse(reflectance=2.0, name="wall"),
            SceneError,
            r"^diffuse 'wall'\.reflectance: 2\.0 is outside \[0, 1\]; colours are 0 to 1",
        ),
        (
            lambda: shapes.Sphere(radius=-1.0, name="ball"),
            SceneError,
            r"^sphere 'ball'\.radius: must be above 0, not -1\.0$",
        ),
        (lambda: shapes.Sphere(radius=0.0), SceneError, r"^sphere\.radius: must be above 0"),
        (
            lambda: shapes.Sphere(center=(0.0, 1.0)),
            SceneError,
            r"^sphere\.center: must be three finite numbers, not \(0\.0, 1\.0\)$",
        ),
        (
            lambda: shapes.Sphere(center=(0.0, 1.0, np.nan)),
            SceneError,
            r"sphere\.center: must be three finite numbers",
        ),
        (
            lambda: shapes.Cube(to_world=np.eye(3)),
            SceneError,
            r"^cube\.to_world: must be \(4, 4\), found \(3, 3\)$",
        ),
        (lambda: shapes.Cube(to_world="here"), SceneError, r"^cube\.to_world: is not a matrix"),
        (
            lambda: shapes.Sphere(material="gold"),
            SceneError,
            r"^sphere\.material: must be a material, such as .*Diffuse\(\), not 'gold'$",
        ),
        (
            lambda: shapes.Sphere(emission=lights.Point()),
            SceneError,
            r"^sphere\.emission: must be a light of a surface, Area or DirectionalArea, not Point",
        ),
        (
            lambda: shapes.Mesh(vertices=CORNERS, faces=[[0, 1, 3]], name="leaf"),
            SceneError,
            r"^mesh 'leaf'\.faces: a face names vertex 3, there are 3$",
        ),
        (
            lambda: shapes.Mesh(vertices=CORNERS, faces=np.array([[0, -1, 2]])),
            SceneError,
            r"^mesh\.faces: a face names vertex -1",
        ),
        (
            lambda: lights.Directional(direction=(0, 0, 0)),
            SceneError,
            r"^directional\.direction: has no length$",
        ),
    ],
)
def test_the_class_says_what_is_wrong(
    make: Callable[[], Any], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        make()


@pytest.mark.parametrize("cls", [cls for category in KINDS.values() for cls in category])
def test_every_kind_knows_the_nearest_name(cls: Any) -> None:
    with pytest.raises(UnusedParameterError, match=f"{cls.kind} has no parameter 'no_such_name'"):
        cls(no_such_name=1)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        ({"shapes": 3}, r"^shapes: must be a list of shapes, not 3$"),
        ({"shapes": [lights.Point()]}, r"^shapes\[0\]: must be of a kind of shape, not Point"),
        ({"lights": [lights.Point(), 2]}, r"^lights\[1\]: must be of a kind of light, not 2$"),
        ({"camera": shapes.Sphere()}, r"^camera: must be of a kind of camera"),
        ({"film": {"width": 4}}, r"^film: must be of a kind of film"),
    ],
)
def test_parts_of_a_scene(parts: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Scene(**{"camera": cameras.Perspective(), **parts})


def test_one_thing_stands_for_a_list_of_it() -> None:
    ball, lamp = shapes.Sphere(), lights.Point()
    made = Scene(camera=cameras.Perspective(), shapes=ball, lights=lamp)  # type: ignore[arg-type]
    assert made.shapes == [ball] and made.lights == [lamp]
    several = [ball]
    assert Scene(camera=cameras.Perspective(), shapes=several).shapes is several
    assert Scene(camera=cameras.Perspective(), shapes=(ball, ball)).shapes == [ball, ball]  # type: ignore[arg-type]


def test_unknown_layer_of_a_film() -> None:
    from clpt.scene import Film

    with pytest.raises(UnknownKindError, match="depth"):
        Film(layers="dept")  # type: ignore[arg-type]


@pytest.mark.parametrize("cls", [shapes.Sphere, shapes.Cube, shapes.Rectangle, shapes.Disk])
def test_a_placed_shape_is_the_shape_elsewhere(cls: type[shapes.Shape]) -> None:
    lit = cls(emission=lights.Area(radiance=2.0), name="lamp")
    matrix = tf.translate([1.0, 2.0, 3.0]) @ tf.scale(2.0)
    assert repr(lit.placed(matrix)) == repr(dataclasses.replace(lit, to_world=matrix))
    assert lit.placed(matrix).emission is lit.emission
    np.testing.assert_array_equal(lit.to_world, np.eye(4))
