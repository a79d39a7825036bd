"""Fingerprints of scenes: the same for the same samples, and what differs is named."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt.errors import SceneError
from clpt.scene import (
    KINDS,
    Scene,
    cameras,
    integrators,
    lights,
    materials,
    roles,
    shapes,
    textures,
)
from clpt.scene.fingerprint import Fingerprint, fingerprint
from clpt.scene.params import params
from clpt.spectra import Tabulated

QUAD = {
    "vertices": np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32),
    "faces": np.array([[0, 1, 2], [0, 2, 3]], np.uint32),
}


def scene(**changes: object) -> Scene:
    red = materials.Diffuse(reflectance=(0.5, 0.2, 0.1), name="red")
    parts = {
        "camera": cameras.Perspective(fov=40.0),
        "shapes": [shapes.Mesh(**QUAD, material=red), shapes.Sphere(radius=0.5)],
        "lights": [lights.Constant(radiance=0.5)],
    }
    return Scene(**{**parts, **changes})


def differences(**changes: object) -> list[str]:
    return fingerprint(scene()).differences(fingerprint(scene(**changes)))


def test_the_same_scene_has_the_same_fingerprint():
    one, other = fingerprint(scene()), fingerprint(scene())
    assert one == other and one.digest == other.digest and not one.differences(other)


def test_what_changes_no_sample_is_left_out():
    named = shapes.Mesh(**QUAD, name="wall", material=scene().shapes[0].material)
    changed = {"spp": 7, "noise": 0.1, "name": "n", "warnings": ["w"], "extra": {"a": object()}}
    assert not differences(**changed, shapes=[named, shapes.Sphere(radius=0.5)])


def test_differences_have_names_and_values():
    assert differences(camera=cameras.Perspective(fov=45.0)) == ["camera.fov: 40.0 -> 45.0"]
    assert differences(seed=3) == ["seed: 0 -> 3"]
    assert differences(shapes=scene().shapes[:1]) == ["shapes.count: 2 -> 1"]
    assert differences(integrator=integrators.Vcm()) == ["integrator.type: auto -> vcm"]
    wall, ball = scene().shapes
    moved = [dataclasses.replace(wall, vertices=QUAD["vertices"] + 1), ball]
    assert differences(shapes=moved) == ["shapes[0].vertices: its content differs"]
    glass = dataclasses.replace(scene().shapes[1], material=materials.Dielectric())
    changed = differences(shapes=[scene().shapes[0], glass])
    assert changed == ["shapes[1].material.type: diffuse -> dielectric"]


def test_a_value_is_the_same_in_other_types():
    """Lists, tuples and arrays of any width, as files and programs give them."""
    mesh = scene().shapes[0]
    given = {
        "vertices": QUAD["vertices"].astype(np.float64).tolist(),
        "faces": QUAD["faces"].astype(np.int64),
        "to_world": np.eye(4).tolist(),
    }
    listed = dataclasses.replace(mesh, **given)
    assert not differences(shapes=[listed, scene().shapes[1]])
    assert differences(shapes=[dataclasses.replace(mesh, to_world=2 * np.eye(4)), mesh])


@pytest.mark.parametrize(
    "cls", [c for known in KINDS.values() for c in known], ids=lambda c: c.kind
)
def test_every_number_of_every_kind_counts(cls):
    """Over the table of kinds: another value of any number is another fingerprint."""
    given = {"group": shapes.Group(shapes=(shapes.Sphere(),))} if cls is shapes.Instance else {}
    thing = cls(**given)
    before = Fingerprint(_values(thing))
    assert before == Fingerprint(_values(cls(**given)))
    for name, param in params(cls).items():
        value = getattr(thing, name)
        if param.role is roles.FLAG:
            other: object = not value
        elif param.role is roles.REAL and isinstance(value, float):
            other = value + 1e-3 if value + 1e-3 <= param.high else value - 1e-3
        else:
            continue
        changed = type(thing).__new__(type(thing))  # past checks that parameters suit each other
        for part in dataclasses.fields(thing):
            object.__setattr__(changed, part.name, getattr(thing, part.name))
        object.__setattr__(changed, name, other)
        found = before.differences(Fingerprint(_values(changed)))
        assert found and found[0].startswith(f"extra.{name}"), name


def _values(thing: object) -> dict:
    """The values of one thing, as the only light of a scene: nobody reads it."""
    plain = Scene(camera=cameras.Perspective())
    plain.lights = thing  # type: ignore[assignment]
    values = fingerprint(plain).values
    return {n.replace("lights", "extra", 1): v for n, v in values.items() if n.startswith("lights")}


def test_spectra_and_images_count(tmp_path: Path):
    image = tmp_path / "a.png"
    clpt.write_image(image, np.full((2, 2, 3), 0.5))
    texture = textures.Bitmap(image=image)

    def lit(radiance: object, reflectance: object = 0.5) -> Fingerprint:
        wall = shapes.Mesh(**QUAD, material=materials.Diffuse(reflectance=reflectance))
        return fingerprint(scene(shapes=[wall], lights=[lights.Constant(radiance=radiance)]))

    table = Tabulated(range(400, 700, 10), range(30))
    assert lit(table) == lit(Tabulated(range(400, 700, 10), range(30)))
    found = lit(table).differences(lit(Tabulated(range(400, 700, 10), [*range(29), 28])))
    assert found == ["lights[0].radiance.values: its content differs"]
    before = lit(1.0, texture)
    assert before == lit(1.0, textures.Bitmap(image=str(image)))
    clpt.write_image(image, np.full((2, 2, 3), 0.6))
    found = before.differences(lit(1.0, texture))
    assert found == ["shapes[0].material.reflectance.image: its content differs"]
    image.unlink()
    with pytest.raises(SceneError, match=r"a\.png: shapes\[0\].*cannot be read"):
        lit(1.0, texture)


@pytest.mark.parametrize("count", [3, 100, 5000])
def test_members_of_long_lists_count(count: int):
    """In full, as a digest each, and as one digest."""
    spheres = [shapes.Sphere(radius=1.0 + i) for i in range(count)]
    before = fingerprint(scene(shapes=spheres))
    assert len(before.values) < 8000
    spheres[1] = shapes.Sphere(radius=0.5)
    assert len(before.differences(fingerprint(scene(shapes=spheres)))) == 1


def test_groups_count_once_and_whole():
    def placed(radius: float) -> Fingerprint:
        group = shapes.Group(shapes=[shapes.Sphere(radius=radius)])
        return fingerprint(scene(shapes=[shapes.Instance(group=group) for _ in range(3)]))

    assert placed(1.0) == placed(1.0)
    assert placed(1.0).differences(placed(2.0))[0] == "shapes[0].group: its content differs"


def test_memory_on_a_device_is_read_or_refused():
    class Array:
        context = None

        def get(self):
            return QUAD["vertices"]

    class Buffer:
        context = None

    mesh = scene().shapes[0]
    assert not differences(shapes=[dataclasses.replace(mesh, vertices=Array()), scene().shapes[1]])
    with pytest.raises(SceneError, match=r"shapes\[0\].vertices: is a buffer"):
        fingerprint(scene(shapes=[dataclasses.replace(mesh, vertices=Buffer())]))
    with pytest.raises(SceneError, match=r"shapes\[0\].vertices: cannot be compared: a object"):
        fingerprint(scene(shapes=[dataclasses.replace(mesh, vertices=object())]))
