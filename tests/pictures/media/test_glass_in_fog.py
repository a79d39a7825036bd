"""Bodies of glass in a medium: what names no media leaves it, or restores it, as named ones do."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene, cameras, integrators, lights, media, shapes
from clpt.scene import materials as m
from clpt.scene.params import interior_params
from tests.pictures.support import quick

FOG = media.Homogeneous(sigma_a=0.5, sigma_s=0.4)
GREY = m.Diffuse(reflectance=0.7)
GLASS: dict[str, m.Material] = {
    "dielectric": m.Dielectric(int_ior=1.3, ext_ior=1.0),
    "rough_dielectric": m.RoughDielectric(int_ior=1.3, ext_ior=1.0, alpha_u=0.2, alpha_v=0.2),
    "gltf_surface": m.GltfSurface(transmission=1.0, roughness=0.2, ior=1.3),
    "openpbr": m.Openpbr(transmission_weight=1.0, specular_roughness=0.3, specular_ior=1.3),
}
WAYS: dict[str, integrators.Integrator] = {
    "path": integrators.Path(light_paths=0),
    "light paths": integrators.Path(light_paths=1),
    "vcm": integrators.Vcm(),
    "particle_tracer": integrators.ParticleTracer(),
    "guiding": integrators.Path(guiding=True, guide_paths=20_000, light_paths=0),
    "whitted": integrators.Whitted(),
}


def _picture(bodies: list[Any], way: integrators.Integrator, spp: int = 8) -> np.ndarray:
    floor = shapes.Rectangle(
        material=GREY,
        to_world=tf.translate([0, -1, 0]) @ tf.rotate([1, 0, 0], -90) @ tf.scale([2, 2, 1]),
    )
    lamp = shapes.Rectangle(
        material=m.Diffuse(reflectance=0.0),
        emission=lights.Area(radiance=8.0),
        to_world=tf.translate([0, 0.98, 0]) @ tf.rotate([1, 0, 0], 90) @ tf.scale([0.6, 0.6, 1]),
    )
    box = shapes.Cube(material=m.Null(), interior=FOG, to_world=tf.scale([0.99, 0.99, 2]))
    scene = Scene(
        camera=cameras.Perspective(to_world=tf.look_at([0, 0.2, 3.2], [0, -0.2, 0], [0, 1, 0])),
        shapes=[floor, lamp, box, *bodies],
        film=Film(width=16, height=16, mode="rgb"),
        integrator=way,
    )
    return np.asarray(clpt.render(scene, spp))


def _balls(material: m.Material, name: bool) -> list[shapes.Sphere]:
    """Balls that absorb nothing, told in two ways, and one that absorbs; name: the fog around."""
    balls = []
    for x, absorption in ((-0.55, 0.0), (0.0, (0.0, 0.0, 0.0)), (0.55, 0.8)):
        own = dataclasses.replace(material, absorption=absorption)
        sides: dict[str, Any] = {"exterior": FOG} if name else {}
        if name and absorption != 0.8:
            sides["interior"] = FOG
        balls.append(shapes.Sphere(center=(x, -0.4, 0.1), radius=0.25, material=own, **sides))
    return balls


def test_all_kinds_with_an_inside_are_here() -> None:
    assert {cls.kind for cls in m.LEAVES if interior_params(cls)} == set(GLASS)


@pytest.mark.parametrize("kind", GLASS)
def test_what_names_no_media(kind: str) -> None:
    """The same random numbers give the picture of balls that name the fog around them."""
    named, unnamed = (_picture(_balls(GLASS[kind], own), WAYS["path"]) for own in (True, False))
    np.testing.assert_allclose(unnamed, named, rtol=1e-3, atol=1e-5)


def test_fog_within_is_seen() -> None:
    """The comparison can fail: a ball that names the fog outside alone is clear."""
    clear = [dataclasses.replace(one, exterior=FOG) for one in _balls(GLASS["dielectric"], False)]
    without = _picture(clear, WAYS["path"])
    assert np.abs(without - _picture(_balls(GLASS["dielectric"], True), WAYS["path"])).max() > 0.01


@pytest.mark.parametrize("way", quick(WAYS, "path", "light paths", "whitted"))
def test_every_integrator(way: str) -> None:
    glass = GLASS["dielectric"]
    named, unnamed = (_picture(_balls(glass, own), WAYS[way]) for own in (True, False))
    np.testing.assert_allclose(unnamed, named, rtol=2e-3, atol=1e-4 * named.max())


def test_instances() -> None:
    """Each body restores what it was met in, whichever body of its group it is."""
    pictures = []
    for own in (True, False):
        group = shapes.Group(tuple(_balls(GLASS["dielectric"], own)), "balls")
        pictures.append(_picture([shapes.Instance(group=group)], WAYS["path"]))
    np.testing.assert_allclose(*pictures, rtol=1e-3, atol=1e-5)
