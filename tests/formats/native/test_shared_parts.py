"""A medium or a material that several places share is one again when it has been saved."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import clpt
from clpt.scene import Scene, materials, media
from clpt.scene.cameras import Perspective
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
