"""Lamps that no ray sees: their light is that of lamps that are seen, whatever finds it."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene import integrators as methods
from clpt.scene import materials as m
from clpt.scene.cameras import Perspective
from clpt.scene.lights import Area
from clpt.scene.shapes import Cube, Cylinder, Disk, Mesh, Rectangle, Shape, Sphere
from tests.pictures.support import assert_agree, blocks, exposures, quick
from tests.pictures.transport.test_hybrid import narrow

GONE = m.Mask(material=m.Diffuse(reflectance=0.0), opacity=0.0)
PLACE = tf.translate([0.1, 1.2, 0.0]) @ tf.rotate([1, 0, 0], 90) @ tf.scale(0.3)
TRIANGLE: dict[str, Any] = {
    "vertices": np.array([[-1, -1, 0], [1, -1, 0], [0, 1, 0]], np.float32),
    "faces": np.array([[0, 1, 2]], np.uint32),
}
LAMPS: dict[str, Shape] = {
    "rectangle": Rectangle(to_world=PLACE),
    "disk": Disk(to_world=PLACE),
    "sphere": Sphere(to_world=PLACE),
    "cylinder": Cylinder(to_world=PLACE),
    "cube": Cube(to_world=PLACE),
    "mesh": Mesh(to_world=PLACE, **TRIANGLE),
}
INTEGRATORS = {
    "path": methods.Path(max_depth=4),
    "direct": methods.Direct(),
    "light_paths": methods.Path(max_depth=4, light_paths=1),
    "vcm": methods.Vcm(max_depth=4),
    "particle_tracer": methods.ParticleTracer(max_depth=4),
}


def room(lamp: Shape, method: methods.Integrator, *more: Shape, **light: Any) -> Scene:
    """A floor and a wall in the light of a lamp that nothing else shows, from above the lamp."""
    emission = Area(**{"radiance": (4.0, 3.0, 2.0), "two_sided": True, "visible": False, **light})
    floor = Rectangle(to_world=tf.rotate([1, 0, 0], -90) @ tf.scale(1.5), material=m.Diffuse())
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 2.5, 2.5], [0, 0.4, 0], [0, 1, 0]), fov=50),
        shapes=[floor, *more, dataclasses.replace(lamp, material=GONE, emission=emission)],
        film=Film(width=12, height=12, mode="rgb"),
        integrator=method,
    )


def taken(scene: Scene, spp: int = 64, first_seed: int = 1) -> Any:
    return blocks(exposures(scene, 8, spp, first_seed, device=narrow()))


@pytest.mark.parametrize("kind", quick(LAMPS, "mesh"))
def test_they_shine_as_a_lamp_out_of_sight_does(kind: str) -> None:
    """The floor's light is that from a lamp that only the camera does not see."""
    seen = room(LAMPS[kind], methods.Path(max_depth=4, hide_lights=True), visible=True)
    reference = taken(seen, first_seed=101)
    assert_agree(taken(room(LAMPS[kind], methods.Path(max_depth=4))), reference, kind)


@pytest.mark.parametrize("name", quick(INTEGRATORS, "light_paths"))
def test_every_integrator_finds_their_light(name: str) -> None:
    """Beside a rough metal, by which `path` finds what light paths find too."""
    place = tf.translate([-1.0, 0.8, 0.0]) @ tf.rotate([0, 1, 0], 90) @ tf.scale(0.8)
    metal = Rectangle(to_world=place, material=m.RoughConductor(alpha_u=0.4, alpha_v=0.4))
    depth = 2 if name == "direct" else 4
    path = room(LAMPS["disk"], methods.Path(max_depth=depth), metal)
    ours = room(LAMPS["disk"], INTEGRATORS[name], metal)
    assert_agree(taken(ours, 128), taken(path, 128, 101), name)


@pytest.mark.parametrize("name", quick(INTEGRATORS, "path", "particle_tracer"))
def test_no_ray_sees_them(name: str) -> None:
    """Before the camera and in a mirror there is nothing; the same lamp is bright if it is seen."""
    place = tf.translate([-1.0, 0.8, 0.0]) @ tf.rotate([0, 1, 0], 90) @ tf.scale(0.8)
    mirror = Rectangle(to_world=place, material=m.Conductor())
    unseen, seen = (
        room(LAMPS["mesh"], INTEGRATORS[name], mirror, visible=on) for on in (False, True)
    )
    unseen, seen = (dataclasses.replace(one, shapes=one.shapes[1:]) for one in (unseen, seen))
    assert not clpt.render(unseen, spp=16).any()
    assert clpt.render(seen, spp=16).max() > 1.0


def test_visible_changes_between_pictures() -> None:
    """A renderer takes the change as one that it makes anew."""
    unseen, seen = (
        room(LAMPS["disk"], methods.Path(max_depth=2), visible=on) for on in (False, True)
    )
    with clpt.Renderer(unseen, device=narrow()) as renderer:
        renderer.run(4)
        renderer.update(scene=seen)
        renderer.run(4)
        changed = renderer.image()
    with clpt.Renderer(seen, device=narrow()) as renderer:
        renderer.run(4)
        np.testing.assert_array_equal(changed, renderer.image())
