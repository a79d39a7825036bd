"""What maps are along: their own coordinates, whichever set these are, transformed or mirrored."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene, integrators
from clpt.scene import materials as m
from clpt.scene.cameras import Orthographic
from clpt.scene.lights import Directional
from clpt.scene.motion import Deformation, Keys, Shutter
from clpt.scene.shapes import Group, Instance, Mesh, Rectangle
from clpt.scene.textures import Bitmap, MeshAttribute

LIGHT = np.array([0.5, 0.3, 0.8]) / np.linalg.norm([0.5, 0.3, 0.8])  # toward it
CORNERS = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
FACES = np.array([(0, 1, 2), (0, 2, 3)], np.uint32)
PLAIN = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])


def image(values: object, **placed: Any) -> Bitmap:
    return Bitmap(image=np.tile(np.float32(values), (2, 2, 1)), raw=True, **placed)


def normals(**placed: Any) -> m.Material:
    n = np.array([0.2, 0.5, np.sqrt(1 - 0.29)])
    white = m.Diffuse(reflectance=(1.0, 1.0, 1.0))
    return m.NormalMap(material=white, map=image(n / 2 + 0.5, **placed), along_v=True)


def coat(**placed: Any) -> m.Material:
    n = np.array([0.1, 0.3, np.sqrt(1 - 0.1)]) / 2 + 0.5
    own = {f"clearcoat_normal_{x}": image([v], **placed) for x, v in zip("xyz", n, strict=True)}
    rough = {"clearcoat": 1.0, "clearcoat_roughness": 0.7, "base_color": 0.1}
    return m.GltfSurface(**rough, clearcoat_apart=1.0, **own)


def brushed(**placed: Any) -> m.Material:
    turn = image([35.0], **placed)
    return m.GltfSurface(metallic=1.0, roughness=0.6, anisotropy=0.7, anisotropy_rotation=turn)


def bent_and_brushed(**placed: Any) -> m.Material:
    return dataclasses.replace(normals(**placed), material=brushed(**placed))


def heights(**placed: Any) -> m.Material:
    v, u = np.mgrid[0:16, 0:16] / 16.0
    ramp = Bitmap(image=np.float32(0.5 * u - 0.3 * v), raw=True, wrap="clamp", **placed)
    return m.BumpMap(material=m.Diffuse(reflectance=(1.0, 1.0, 1.0)), height=ramp)


KINDS: dict[str, Callable[..., m.Material]] = {
    one.__name__: one for one in (normals, coat, brushed, bent_and_brushed, heights)
}
LINEAR = {  # the map's coordinates by the plain ones, but for a shift
    "as they are": np.eye(2),
    "turned": np.array([[0.4, -0.3], [0.3, 0.4]]),
    "mirrored": np.diag([-0.5, 0.5]),
    "upside down": np.diag([0.5, -0.5]),
    "stretched and sheared": np.array([[0.5, 0.2], [0.0, 0.2]]),
    "turned and mirrored": np.array([[0.2, 0.4], [0.4, -0.2]]),
}


def _whole(linear: np.ndarray) -> np.ndarray:
    """The affine map whose middle is the middle of the image."""
    made = np.eye(3)
    made[:2, :2] = linear
    made[:2, 2] = 0.5 - linear @ (0.5, 0.5)
    return made


def _mesh(material: m.Material, uvs: np.ndarray = PLAIN, **more: Any) -> Mesh:
    return Mesh(vertices=CORNERS, faces=FACES, uvs=np.float32(uvs), material=material, **more)


def _carried(kind: Callable[..., m.Material], linear: np.ndarray) -> list[Any]:
    """The shape whose main coordinates are the map's, and those that bring them otherwise."""
    whole = _whole(linear)
    own = (PLAIN @ linear.T + whole[:2, 2]).astype(np.float32)
    second = {"attributes": {"vertex_u1": own[:, :1], "vertex_v1": own[:, 1:]}}
    up = np.tile(np.float32([0, 0, 1]), (4, 1))
    on_second = _mesh(kind(mapping="uv1"), **second)
    moved = np.stack([CORNERS, CORNERS + np.float32([0, 0, 0.5])])
    shapes = [
        _mesh(kind(), own),
        on_second,
        _mesh(kind(to_uv=whole)),
        _mesh(kind(mapping="uv1"), own[[1, 2, 3, 0]], **second),
        _mesh(kind(mapping="uv1"), normals=up, **second),
        Rectangle(material=kind(to_uv=whole)),
        Instance(group=Group((on_second,), "second")),
        dataclasses.replace(on_second, deformation=Deformation((0.0, 1.0), moved)),
    ]
    mirrored = dataclasses.replace(on_second, to_world=MIRROR)
    return [*shapes, Instance(group=Group((mirrored,), "mirrored"), to_world=MIRROR)]


def _pictures(shapes: list[Any]) -> np.ndarray:
    """The brightness of each, side by side under one light; nothing here is random."""
    count = len(shapes)
    placed = [
        dataclasses.replace(one, to_world=tf.translate([2.0 * i + 1.0, 0.0, 0.0]) @ one.to_world)
        for i, one in enumerate(shapes)
    ]
    view = tf.look_at([count, 0, 4], [count, 0, 0], [0, 1, 0]) @ tf.scale([count, 1.0, 1.0])
    scene = Scene(
        camera=Orthographic(to_world=view),
        shapes=placed,
        lights=[Directional(direction=tuple(-LIGHT), irradiance=(np.pi,) * 3)],
        integrator=integrators.Direct(),
        film=Film(width=3 * count, height=3, mode="rgb"),
    )
    return np.asarray(clpt.render(scene, 16)[1, 1::3, 0])


@pytest.mark.parametrize("kind", KINDS)
def test_coordinates_are_the_maps_own(kind: str) -> None:
    """A map on a second set, or under a transform, is as on a mesh whose main set has these."""
    shapes, counts = [], []
    for linear in LINEAR.values():
        carried = _carried(KINDS[kind], linear)
        shapes += carried
        counts.append(len(carried))
    rows = np.split(_pictures(shapes), np.cumsum(counts)[:-1])
    for name, row in zip(LINEAR, rows, strict=True):
        np.testing.assert_allclose(row, row[0], rtol=4e-3, err_msg=name)
    assert np.ptp([row[0] for row in rows]) > 0.03 * max(row[0] for row in rows)


@pytest.mark.parametrize("kind", KINDS)
def test_a_mirror_shows_the_mirror_image(kind: str) -> None:
    """A mirrored copy is what its map is on coordinates that run the other way."""
    mirrored = PLAIN * np.float32([-1, 1]) + np.float32([1, 0])
    own = _mesh(KINDS[kind]())
    shapes = [
        _mesh(KINDS[kind](), mirrored),
        dataclasses.replace(own, to_world=MIRROR),
        Instance(group=Group((own,), "own"), to_world=MIRROR),
        Rectangle(material=KINDS[kind](), to_world=MIRROR),
    ]
    row = _pictures(shapes[:3])
    np.testing.assert_allclose(row, row[0], rtol=4e-3)


@pytest.mark.slow
def test_told_tangents_hold_for_every_set() -> None:
    """Tangents of a mesh are its frame, on both sets, under transforms; a relief asks for none."""
    along = np.tile(np.float32([np.cos(0.6), np.sin(0.6), 0, -1]), (4, 1))
    up = np.tile(np.float32([0, 0, 1]), (4, 1))
    whole = _whole(LINEAR["turned"])
    own = (PLAIN @ LINEAR["turned"].T + whole[:2, 2]).astype(np.float32)
    more = {"normals": up, "attributes": {"vertex_u1": own[:, :1], "vertex_v1": own[:, 1:]}}
    for kind in (normals, coat, brushed):
        told = [
            _mesh(kind(**placed), tangents=along, **more)
            for placed in ({}, {"mapping": "uv1"}, {"to_uv": whole})
        ]
        row = _pictures([*told, _mesh(kind(), **more)])
        np.testing.assert_allclose(row[:3], row[0], rtol=4e-3)
        assert abs(row[3] - row[0]) > 0.01 * row[0]
    bent = [_mesh(heights(), **more), _mesh(heights(), tangents=along, **more)]
    row = _pictures(bent)
    np.testing.assert_allclose(row, row[0], rtol=4e-3)


def test_backs_have_the_same_directions() -> None:
    """What is brushed along a line is so from both sides."""
    turn = tf.rotate([0, 1, 0], 180)
    both = m.TwoSided(front=brushed())
    left = m.TwoSided(front=m.GltfSurface(**_brushed(-35.0)))
    row = _pictures([_mesh(both, to_world=turn), _mesh(left)])
    np.testing.assert_allclose(row, row[0], rtol=4e-3)


def _brushed(turn: float) -> dict[str, float]:
    return {"metallic": 1.0, "roughness": 0.6, "anisotropy": 0.7, "anisotropy_rotation": turn}


def test_relief_of_what_a_mesh_tells() -> None:
    """A height that vertices have is the relief of an image with the same values."""
    heights_ = np.float32(0.5 * PLAIN[:, :1] + 0.3 * PLAIN[:, 1:])
    told = m.BumpMap(
        material=m.Diffuse(reflectance=(1.0, 1.0, 1.0)), height=MeshAttribute(name="vertex_h")
    )
    row = _pictures([_mesh(told, attributes={"vertex_h": heights_}), _mesh(heights())])
    np.testing.assert_allclose(row, row[0], rtol=4e-3)


def test_a_second_set_that_moves() -> None:
    """A mesh that moves takes its second set along: turned by a half, it is its own half turn."""
    whole = _whole(LINEAR["stretched and sheared"])
    own = (PLAIN @ whole[:2, :2].T + whole[:2, 2]).astype(np.float32)
    second = {"attributes": {"vertex_u1": own[:, :1], "vertex_v1": own[:, 1:]}}
    still = _mesh(normals(mapping="uv1"), **second)
    turn = tf.rotate([0, 0, 1], 180)
    keys = Keys((0.0, 1.0), (turn, turn))
    moving = dataclasses.replace(still, motion=keys)
    placed = [dataclasses.replace(still, to_world=turn), moving]
    row = [
        np.asarray(
            clpt.render(
                Scene(
                    camera=Orthographic(
                        to_world=tf.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                        shutter=Shutter(0.0, 1.0),
                    ),
                    shapes=[one],
                    lights=[Directional(direction=tuple(-LIGHT), irradiance=(np.pi,) * 3)],
                    integrator=integrators.Direct(),
                    film=Film(width=3, height=3, mode="rgb"),
                ),
                16,
            )
        )[1, 1, 0]
        for one in placed
    ]
    np.testing.assert_allclose(row, row[0], rtol=4e-3)
