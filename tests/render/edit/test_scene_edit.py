"""Edits of a scene as plain data, and lowering it again from pieces that were kept."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pyopencl.array as cl_array
import pytest

from clpt import device
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.edit.scene_edit import Successors, edit_scene, resolve_device_arrays
from clpt.render.flow.scene_to_tables import Lowered, lower
from clpt.scene import Scene
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Film
from clpt.scene.lights import Area, Envmap
from clpt.scene.shapes import Group, Instance, Mesh, Sphere
from clpt.scene.textures import Bitmap

RED, BLUE = m.Diffuse(reflectance=(0.8, 0.1, 0.1)), m.Diffuse(reflectance=(0.1, 0.1, 0.8))
RNG = np.random.default_rng(1)
PICTURE = RNG.random((6, 5, 3)).astype(np.float32)


def mesh(**more: Any) -> Mesh:
    vertices = RNG.random((40, 3)).astype(np.float32)
    faces = np.arange(39).reshape(-1, 3).astype(np.uint32)
    return Mesh(vertices=vertices, faces=faces, uvs=vertices[:, :2], **more)


def scene() -> Scene:
    """A bit of everything that is kept: meshes, an emissive one, images, a group."""
    pebble = Group((mesh(material=RED, name="pebble"), Sphere(material=BLUE)))
    return Scene(
        camera=Perspective(),
        film=Film(width=8, height=8, mode="rgb"),
        lights=[Envmap(image=PICTURE)],
        shapes=[
            mesh(material=m.TwoSided(front=RED), name="sheet"),
            mesh(emission=Area(radiance=2.0), name="lamp"),
            Sphere(material=m.Diffuse(reflectance=Bitmap(image=PICTURE)), name="ball"),
            Instance(group=pebble),
            Instance(group=pebble, to_world=tf.translate([3, 0, 0])),
        ],
    )


def same(a: Lowered, b: Lowered) -> bool:
    names = (*a.tables, "vertices", "faces")
    bits = [(x.table(n).view(np.uint32), x.table(n).shape) for n in names for x in (a, b)]
    pairs = zip(bits[::2], bits[1::2], strict=True)
    equal = all(s == t and np.array_equal(x, y) for (x, s), (y, t) in pairs)
    return equal and a.features == b.features and a.settings == b.settings


def test_a_lowering_takes_up_the_one_before() -> None:
    """The same tables and features as from nothing; what did not change is the same object."""
    first = scene()
    before = lower(first)
    taller = dataclasses.replace(first.shapes[0], to_world=tf.scale([1, 2, 1]))
    edits = {
        "nothing": first,
        "a transform": dataclasses.replace(first, shapes=[taller, *first.shapes[1:]]),
        "one less": dataclasses.replace(first, shapes=first.shapes[1:]),
        "the light": dataclasses.replace(first, lights=[Envmap(image=PICTURE, scale=3.0)]),
    }
    for name, after in edits.items():
        assert same(lower(after, former=before), lower(after)), name
    again = lower(first, former=before)
    assert again.tables["texels"].base is before.tables["texels"].base


def test_edits_replace_only_what_they_touch() -> None:
    first, successors = scene(), Successors()
    new, replaced = edit_scene(first, successors, materials={RED: BLUE, "ball": RED})
    successors.note(replaced)
    sheet, lamp, ball, one, other = new.shapes
    assert sheet.material.front is BLUE and ball.material is RED
    assert lamp is first.shapes[1]
    assert one.group is other.group and one.group.shapes[0].material is BLUE
    assert one.group.shapes[1] is first.shapes[3].group.shapes[1]
    assert first.shapes[0].material.front is RED, "the scene that was given stays as it was"
    # what was given at first still names its place
    newer, _ = edit_scene(new, successors, transforms={first.shapes[2]: np.diag([2, 2, 2, 1.0])})
    assert newer.shapes[2].material is RED and newer.shapes[2].to_world[0, 0] == 2.0
    points = np.zeros((40, 3), np.float32)
    moved, _ = edit_scene(new, successors, vertices={0: points, "pebble": points})
    assert not moved.shapes[0].vertices.any() and moved.shapes[0].vertices is not points
    assert not moved.shapes[4].group.shapes[0].vertices.any()


def test_what_is_used_in_place() -> None:
    """Faces and uvs of the only mesh, where they are as the tables are."""
    queue = device.choose().queue
    stone = dataclasses.replace(mesh(), uvs=RNG.random((40, 2)).astype(np.float32))
    made = {name: cl_array.to_device(queue, getattr(stone, name)) for name in ("faces", "uvs")}
    there = dataclasses.replace(stone, vertices=cl_array.to_device(queue, stone.vertices), **made)
    wide = cl_array.to_device(queue, stone.uvs.astype(np.float64))
    buffers = {name: array.data for name, array in made.items()}
    for shapes, lent in (
        ([there], buffers),
        ([there, Sphere()], buffers),
        ([stone], {}),
        ([there, stone], {}),
        ([dataclasses.replace(there, flip_normals=True)], {"uvs": buffers["uvs"]}),
        ([dataclasses.replace(there, faces=made["faces"].data)], buffers),
        (
            [dataclasses.replace(there, uvs=wide)],
            {"faces": buffers["faces"]},
        ),
    ):
        found = lower(
            resolve_device_arrays(dataclasses.replace(scene(), shapes=shapes), queue)
        ).zero_copy
        assert found == lent
    with pytest.raises(SceneError, match="uvs must be rows of 8 bytes, found a buffer of 156"):
        odd = dataclasses.replace(there, uvs=made["faces"].data)
        resolve_device_arrays(dataclasses.replace(scene(), shapes=[odd]), queue)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ({"materials": {m.Diffuse(): RED}}, "not in the scene"),
        ({"materials": {"ball": 3}}, "3 is not a material"),
        ({"materials": {"bull": RED}}, "no shape has the name 'bull'"),
        ({"transforms": {9: np.eye(4)}}, "no shape has the index 9: there are 5"),
        ({"transforms": {None: np.eye(4)}}, "None is no shape, name or index"),
        ({"transforms": {Sphere(name="b"): np.eye(4)}}, "sphere 'b' is not in the scene"),
        ({"vertices": {"ball": np.zeros((1, 3))}}, "a sphere has none"),
        ({"transforms": {"": np.eye(4)}}, "3 shapes have the name ''"),
    ],
)
def test_keys_that_mean_nothing(edit: dict[str, Any], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        edit_scene(scene(), Successors(), **edit)
