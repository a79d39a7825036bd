"""Instances against the same scene with a copy of the group for each."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import device
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.scene import Film, Scene
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path as PathTracing
from clpt.scene.shapes import Group, Instance, Mesh, Shape, Sphere
from tests.pictures.support import assert_agree, blocks, exposures, layers_of, with_film

LAYERS = ("position", "shading_normal", "uv", "shape_id", "primitive_id")
SPECK = Group((Mesh(vertices=np.eye(3), faces=np.array([[0, 1, 2]], np.uint32)),))
# Behind the camera: with them all scenes here have the same programs.
HIDDEN = [Instance(group=SPECK, to_world=tf.translate([i, 0, 1e6])) for i in (0, 1)]


def together(layers: dict[str, np.ndarray]) -> np.ndarray:
    """The layers side by side, (h, w, 10)."""
    return np.concatenate([layers[name] for name in LAYERS], axis=2)


def bumpy() -> Mesh:
    """A mesh with smooth normals and uvs, turned from the start."""
    u, v = np.meshgrid(np.linspace(0, 1, 13), np.linspace(0, 1, 9))
    height = 0.3 * np.sin(5 * u) * np.cos(4 * v)
    slopes = [1.5 * np.cos(5 * u) * np.cos(4 * v), -1.2 * np.sin(5 * u) * np.sin(4 * v)]
    corner = (13 * np.arange(8)[:, None] + np.arange(12)).reshape(-1, 1)
    faces = (corner + np.array([0, 1, 14, 0, 14, 13])).reshape(-1, 3)
    return Mesh(
        vertices=np.stack([u, v, height], axis=-1).reshape(-1, 3),
        faces=faces.astype(np.uint32),
        normals=np.stack([-slopes[0], -slopes[1], np.ones_like(u)], axis=-1).reshape(-1, 3),
        uvs=np.stack([u, 1.0 - v], axis=-1).reshape(-1, 2),
        to_world=tf.rotate([1, 2, 3], 70) @ tf.translate([-0.5, -0.5, 0]),
    )


def spread(count: int, seed: int) -> list[np.ndarray]:
    """Evenly scaled, every second one mirrored, so that smooth normals stay what they are."""
    rng = np.random.default_rng(seed)
    return [
        tf.translate(rng.uniform(-2.5, 2.5, 3))
        @ tf.rotate(rng.normal(size=3), rng.uniform(0, 360))
        @ tf.scale(rng.uniform(0.5, 2) * np.array([(-1) ** i, 1, 1]))
        for i in range(count)
    ]


def scene(shapes: list[Shape], center: float = 0.0, size: float = 1.0) -> Scene:
    """Their values as a camera in front of them sees them; the programs are the same for all."""
    view = tf.look_at([center, 0, 8 * size], [center, 0, 0], [0, 1, 0])
    return Scene(
        camera=Perspective(to_world=view, fov=40),
        shapes=[*shapes, *HIDDEN],
        film=Film(width=40, height=32, layers=LAYERS),
        integrator=PathTracing(max_depth=1, light_paths=0),
    )


@pytest.mark.parametrize(
    "layout",
    ["wide8", *(pytest.param(name, marks=pytest.mark.slow) for name in ("compact", "binary"))],
)
def test_values_are_those_of_copies(layout: str) -> None:
    """Position, normals, uv and numbers, with few exceptions at edges."""
    mesh, matrices = bumpy(), spread(30, 3)
    group = Group((mesh,))
    placed: list[Shape] = [Instance(group=group, to_world=m) for m in matrices]
    copies: list[Shape] = [dataclasses.replace(mesh, to_world=m @ mesh.to_world) for m in matrices]
    ball = Sphere(radius=0.4)
    renderers = [clpt.Renderer(scene([*s, ball]), layout=layout) for s in (placed, copies)]
    assert all(renderer.run(1) for renderer in renderers)
    ours, expected = (together(renderer.layers()) for renderer in renderers)
    assert len(np.unique(expected[..., 8])) > 20  # nearly all are seen
    off = np.abs(ours - expected) > 1e-4 * (1.0 + np.abs(expected))
    assert off.any(axis=2).sum() <= 3
    stats, other = (renderer.stats for renderer in renderers)
    assert (stats.instances, other.instances) == (32, 2)
    assert stats.triangles == 192 + 1 and other.triangles == stats.triangles_instanced - 1
    assert stats.trees["triangles"] < other.trees["triangles"] / 10
    assert stats.seconds["first_sample"] > stats.seconds["ready"] > stats.seconds["trees"] > 0.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("center", "size"), [(0.0, 1e-4), pytest.param(0.0, 3e4, marks=pytest.mark.slow), (2e3, 1.0)]
)
def test_scales_and_places(center: float, size: float) -> None:
    """A group drawn large and placed small, the other way round, and one far from the origin."""
    mesh, matrices = bumpy(), spread(30, 3)
    whole = tf.translate([center, 0, 0]) @ tf.scale(size)
    copies: list[Shape] = [
        dataclasses.replace(mesh, to_world=whole @ m @ mesh.to_world) for m in matrices
    ]
    expected = together(layers_of(scene(copies, center, size), 1))
    for own in (1e4, 1e-4):
        away = tf.translate([0, own * 100.0, 0]) @ tf.scale(own)
        group = Group((dataclasses.replace(mesh, to_world=away @ mesh.to_world),))
        back = [whole @ m @ tf.inverse(away) for m in matrices]
        placed: list[Shape] = [Instance(group=group, to_world=m) for m in back]
        ours = together(layers_of(scene(placed, center, size), 1))
        reach = np.abs([center, 8 * size]).max()
        off = np.abs(ours[..., :3] - expected[..., :3]).max(axis=2) > 1e-5 * reach
        off |= np.abs(ours[..., 3:8] - expected[..., 3:8]).max(axis=2) > 2e-2
        assert off.mean() < 0.02, (center, size, own)


def test_brute_force_holds_no_instances() -> None:
    with pytest.raises(SceneError, match="brute"):
        clpt.render(scene([]), 1, layout="brute")


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_pictures_are_those_of_copies(scenes: Path, mode: str) -> None:
    loaded = with_film(clpt.load(scenes / "instances.xml"), mode=mode)
    copies = [
        dataclasses.replace(shape, to_world=one.to_world @ shape.to_world)
        for one in loaded.shapes
        if isinstance(one, Instance)
        for shape in one.group.shapes
    ]
    plain = [shape for shape in loaded.shapes if not isinstance(shape, Instance)]
    reference = dataclasses.replace(loaded, shapes=[*plain, *copies])
    ours, expected = (exposures(s, 24, 16) for s in (loaded, reference))
    assert_agree(blocks(ours), blocks(expected), allowed=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_lanes_change_nothing(scenes: Path, mode: str) -> None:
    loaded = with_film(clpt.load(scenes / "instances.xml"), mode=mode)
    images = []
    for lanes in (1, 8, 16):
        on = device.choose()
        on.lanes = lanes
        images.append(clpt.render(loaded, 8, device=on))
    assert np.array_equal(images[0], images[1]) and np.array_equal(images[0], images[2])
