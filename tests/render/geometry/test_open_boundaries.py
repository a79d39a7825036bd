"""Meshes that have an inside and a hole: one warning that names the shape; none where nothing is
open."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import trimesh

import clpt.transforms as tf
from clpt.geometry.winding import largest_hole
from clpt.render.flow.scene_to_tables import lower
from clpt.render.geometry.surroundings import HOLE
from clpt.scene import Film, Scene, materials, media
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Constant
from clpt.scene.shapes import Cylinder, Disk, Group, Instance, Mesh

BALL = trimesh.creation.icosphere(2)
TUBE = trimesh.creation.cylinder(1.0, 2.0, sections=24)
WALL = np.abs(TUBE.face_normals[:, 2]) < 0.5
SQUARES = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2], [1, 0, 0]], float)
CORNER = np.array([[0, 2, 4], [4, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])  # 4 on the edge 0 1
FOG = media.Homogeneous(sigma_s=0.5)
AMBER = materials.Dielectric(absorption=(0.1, 0.5, 2.0))
OTHER_AMBER = materials.Dielectric(absorption=(0.1, 0.5, 2.0), ext_ior=1.2)
CLEAR = materials.Dielectric()


@pytest.mark.parametrize(
    ("vertices", "faces", "share"),
    [
        (BALL.vertices, BALL.faces, 0.0),
        (BALL.vertices[BALL.faces].reshape(-1, 3), np.arange(3 * len(BALL.faces)), 0.0),
        (BALL.vertices, BALL.faces[:-1], BALL.area_faces[-1] / BALL.area_faces[:-1].sum()),
        (TUBE.vertices, TUBE.faces[WALL], TUBE.area_faces[~WALL].sum() / 2 / (2 * 1.9885 * np.pi)),
        (SQUARES, CORNER, 0.0),
        (SQUARES, CORNER[:, ::-1], 0.0),
        (SQUARES[:3], np.array([[0, 1, 2]]), 1.0),
    ],
    ids=["ball", "soup", "hole", "tube", "vertex on an edge", "inside out", "triangle"],
)  # fmt: skip
def test_largest_hole(vertices: Any, faces: Any, share: float) -> None:
    """What is gone of a ball, an end of a tube; no matter how vertices are shared."""
    found = largest_hole(vertices, np.reshape(faces, (-1, 3)))
    assert found == pytest.approx(share, rel=0.02, abs=1e-12)


def test_a_turned_triangle_is_a_hole() -> None:
    """What is on its sides is not what its neighbours have there."""
    faces = BALL.faces.copy()
    faces[7] = faces[7, ::-1]
    assert largest_hole(BALL.vertices, faces) > HOLE


def ball(*, cut: int = 1, part: Any = None, **more: Any) -> Mesh:
    faces = BALL.faces[:-cut] if part is None else BALL.faces[part]
    return Mesh(vertices=BALL.vertices.astype("f4"), faces=faces.astype("u4"), **more)


def warnings(*things: Any) -> list[str]:
    lights, film = [Constant(radiance=1.0)], Film(width=8, height=8)
    scene = Scene(camera=Perspective(), shapes=list(things), lights=lights, film=film)
    return [row for row in lower(scene).warnings if "not closed" in row]


FIRST, SECOND = slice(0, 100), slice(100, None)
CAP, PIPE = Disk(material=AMBER), Cylinder(material=AMBER)
MOVED = Instance(group=Group((ball(material=AMBER, part=FIRST),)), to_world=tf.translate([3, 0, 0]))


@pytest.mark.parametrize(
    ("things", "said"),
    [
        ([ball(interior=FOG, name="cloud")], "mesh 'cloud': not closed, a hole has"),
        ([ball(material=AMBER)], "mesh: not closed"),
        ([ball(material=materials.Mask(material=CLEAR), interior=FOG)], "mesh: not closed"),
        ([ball(material=AMBER), ball(interior=FOG)], "mesh, and 1 other: not closed"),
        ([ball(material=AMBER)] * 3, "mesh: not closed"),
        ([ball(material=AMBER, part=FIRST, name="half"), MOVED], "mesh 'half'"),
        ([ball(material=CLEAR)], ""),
        ([ball(part=slice(None), material=AMBER, interior=FOG)], ""),
        ([ball(material=AMBER, part=FIRST), ball(material=OTHER_AMBER, part=SECOND)], ""),
        ([ball(material=materials.GltfSurface(thin=True, absorption=1.0))], ""),
        ([CAP, PIPE], ""),
    ],
)  # fmt: skip
def test_warnings(things: list[Any], said: str) -> None:
    """One, of a medium or an absorbing inside; the parts of a boundary close each other."""
    found = warnings(*things)
    assert len(found) == bool(said)
    assert all(said in row for row in found), found
