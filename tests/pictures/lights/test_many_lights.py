"""Pictures lit by many lights: the tree and the choice by power agree, and so do all lanes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.device import choose
from clpt.render.flow import scene_to_tables as lowering
from clpt.render.materials import encode
from clpt.scene import Film, Scene, materials
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path
from clpt.scene.lights import Area, Constant, Point
from clpt.scene.shapes import Mesh, Rectangle, Sphere
from clpt.scene.textures import Bitmap
from tests.pictures.support import assert_agree, blocks, exposures


def crowd(mode: str) -> Scene:
    """A ball over a floor, 300 textured triangles above, a ball that shines, a lamp, a sky."""
    rng = np.random.default_rng(1)
    place = rng.uniform([-2, 1.5, -2], [2, 2.5, 2], (300, 1, 3))
    vertices = (place + rng.normal(size=(300, 3, 3)) * 0.1).reshape(-1, 3).astype(np.float32)
    picture = rng.random((8, 8, 3)).astype(np.float32) ** 4 * 20.0
    mesh = Mesh(
        vertices=vertices,
        faces=np.arange(900).reshape(300, 3),
        uvs=rng.random((900, 2)).astype(np.float32),
        material=materials.Diffuse(reflectance=0.1),
        emission=Area(radiance=Bitmap(image=picture), two_sided=True),
    )
    ball = Area(radiance=(6.0, 5.0, 4.0))
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 1.2, 4], [0, 0.5, 0], [0, 1, 0]), fov=50),
        shapes=[
            Rectangle(to_world=tf.rotate([1, 0, 0], -90) @ tf.scale(3.0)),
            Sphere(center=(0, 0.6, 0), radius=0.6, material=materials.RoughPlastic(alpha=0.2)),
            Sphere(center=(-1.2, 0.4, 0.8), radius=0.15, emission=ball),
            mesh,
        ],
        lights=[
            Constant(radiance=(0.1, 0.1, 0.2)),
            Point(position=(1.5, 1.0, 1.0), intensity=(0.5, 0.5, 0.5)),
        ],
        integrator=Path(max_depth=3),
        film=Film(width=24, height=20, mode=mode),
    )


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_the_tree_and_the_choice_by_power_agree(mode, monkeypatch):
    scene = crowd(mode)
    ours = blocks(exposures(scene, 24, 16))
    monkeypatch.setattr(lowering, "TREE_FROM", 1 << 30)
    theirs = blocks(exposures(scene, 24, 32))
    assert_agree(ours, theirs, "tree against power")


def polished(mode: str, light_paths: float) -> Scene:
    """The crowd over rough metal, with a principled ball, a wavy one, and a lamp in view."""
    made = crowd(mode)
    floor, ball, *lamps = made.shapes
    wavy = materials.BumpMap(
        material=materials.RoughConductor(alpha_u=0.05, alpha_v=0.2),
        height=Bitmap(image=np.random.default_rng(2).random((8, 8, 1)).astype(np.float32)),
        scale=0.02,
    )
    shapes = [
        replace(floor, material=materials.RoughConductor(alpha=0.1)),
        replace(ball, material=materials.Principled(roughness=0.3, metallic=0.4)),
        Sphere(center=(1.1, 0.4, 0.6), radius=0.4, material=wavy),
        *lamps,
    ]
    integrator = Path(max_depth=3, light_paths=light_paths)
    return replace(made, shapes=shapes, integrator=integrator)


@pytest.mark.slow
@pytest.mark.parametrize("light_paths", [0, 1])
@pytest.mark.parametrize("mode", ["rgb", "spectral"])
def test_gloss_only_changes_how_lights_are_chosen(mode, light_paths, monkeypatch):
    scene = polished(mode, light_paths)
    assert lowering.lower(scene).features.lights.gloss > 0
    ours = blocks(exposures(scene, 24, 24))
    for module in (lowering, encode):
        monkeypatch.setattr(module, "gloss_word", lambda material: 0)
    assert lowering.lower(scene).features.lights.gloss == 0
    theirs = blocks(exposures(scene, 24, 24))
    assert_agree(ours, theirs, "by gloss against by cosine")
    noise = [(a.var(axis=0) / a.mean(axis=0) ** 2).mean() for a in (ours, theirs)]
    assert noise[0] < noise[1]


@pytest.mark.slow
def test_lanes_agree():
    pictures = []
    for lanes in (1, 8, 16):
        device = choose()
        device.lanes = lanes
        pictures.append(clpt.render(crowd("rgb"), spp=2, device=device))
    for other in pictures[1:]:
        np.testing.assert_array_equal(pictures[0], other)
