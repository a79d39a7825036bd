"""What a scene is that has been saved: what several places share is one again, bytes are bytes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import clpt
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Scene, materials, media
from clpt.scene.cameras import Perspective
from clpt.scene.lights import CubeMap, Envmap
from clpt.scene.shapes import Cylinder, Disk, Group, Instance, Sphere

FOG = media.Homogeneous(sigma_s=0.5)
OTHER = media.Homogeneous(sigma_s=0.7, name="homogeneous")
GLASS = materials.Dielectric()
PAIR = materials.Blend(first=GLASS, second=materials.Diffuse(reflectance=0.3))


def test_shared_parts(tmp_path: Path) -> None:
    """They are as many as before, and none has got a name."""
    ends = [Disk(interior=FOG, material=GLASS), Disk(interior=FOG, material=GLASS)]
    tube = Cylinder(interior=FOG, material=PAIR)
    ball = Sphere(interior=FOG, exterior=OTHER, material=PAIR, center=(9, 0, 0))
    inner = Instance(group=Group((ball,)))
    scene = Scene(camera=Perspective(medium=FOG), shapes=[*ends, tube, inner, Sphere()])
    clpt.save(scene, tmp_path / "a.json")
    found: Any = clpt.load(tmp_path / "a.json")
    one, other, wall, ball, alone = found.shapes
    ball = ball.group.shapes[0]
    assert one.interior is other.interior is wall.interior is ball.interior
    assert one.interior is found.camera.medium
    assert (one.interior.name, ball.exterior.name) == ("", "homogeneous")
    assert one.material is other.material is wall.material.first
    assert wall.material is ball.material
    assert (one.material.name, alone.material.name) == ("", "")


def test_surroundings_of_bytes(tmp_path: Path) -> None:
    """Arrays of bytes are as the .png to which they are saved: from 0 to 1, decoded."""
    image = np.arange(2 * 4 * 3, dtype=np.uint8).reshape(2, 4, 3) * 10
    lamps = [Envmap(image=image), CubeMap(image=[image[:, :2] + np.uint8(k) for k in range(6)])]
    scene = Scene(camera=Perspective(), lights=lamps)
    clpt.save(scene, tmp_path / "a.json")
    own, found = (lower(one).tables for one in (scene, clpt.load(tmp_path / "a.json")))
    assert own.keys() == found.keys()
    for name, words in own.items():
        np.testing.assert_array_equal(words, found[name], err_msg=name)
