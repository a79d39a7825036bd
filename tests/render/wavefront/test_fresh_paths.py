"""A path begins anew: nothing of it follows from the path that was in its slot before."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.records import PATH
from clpt.render.wavefront.path_buffers import PathBuffers
from clpt.scene import Film, Scene, cameras, lights, media, shapes
from clpt.scene import materials as m
from clpt.scene.integrators import Integrator, ParticleTracer, Path, Vcm
from clpt.scene.motion import Keys, Shutter
from clpt.scene.textures import Bitmap
from tests.pictures.support import quick

# the pixel of a slot and its sums, which outlive a path
KEPT = {
    "state",
    "pixel_index",
    "pixel_key",
    "sample",
    "low",
    "middle",
    "high",
    "covered",
    "samples",
}
FLOOR = tf.translate([0, -1, 0]) @ tf.rotate([1, 0, 0], -90) @ tf.scale(2.0)
BLACK = m.Diffuse(reflectance=0.0)


def _milk() -> Scene:
    """The camera within a sealed medium, which it does not name."""
    milk = media.Homogeneous(sigma_s=2.0)
    glass = m.Dielectric(int_ior=1.33, ext_ior=1.0)
    far = shapes.Rectangle(
        material=BLACK, emission=lights.Area(radiance=5.0), to_world=tf.translate([0, 0, -3])
    )
    ball = shapes.Sphere(radius=0.9, material=glass, interior=milk)
    at = cameras.Perspective(to_world=tf.look_at([0, 0.1, 0.3], [0, 0, 0], [0, 1, 0]), fov=60.0)
    return Scene(camera=at, shapes=[far, ball], integrator=Path(max_depth=32, light_paths=0))


def _room(way: Integrator, **film: object) -> Scene:
    """Fog, glass that absorbs, panes, a rough floor with mip levels, many lamps, and motion."""
    y, x = np.mgrid[0:16, 0:16]
    image = np.float32((x + y) % 2)[..., None]
    rough = m.RoughConductor(
        alpha_u=0.2, alpha_v=0.3, specular_reflectance=Bitmap(image=image, filter="trilinear")
    )
    fog = media.Homogeneous(sigma_a=0.2, sigma_s=0.3)
    body = m.Dielectric(int_ior=1.3, ext_ior=1.0, absorption=0.5)
    keys = Keys((0.0, 1.0), (np.eye(4), tf.translate([0.2, 0, 0])))
    box = shapes.Cube(material=m.Null(), interior=fog, to_world=tf.scale([1.5, 1.5, 2.0]))
    ball = shapes.Sphere(center=(-0.3, -0.4, 0.1), radius=0.4, material=body, motion=keys)
    pane = shapes.Rectangle(material=m.ThinDielectric(), to_world=tf.translate([0.4, 0, 0.5]))
    lamp = shapes.Rectangle(
        material=BLACK,
        emission=lights.Area(radiance=8.0),
        to_world=tf.translate([0, 0.9, 0]) @ tf.rotate([1, 0, 0], 90) @ tf.scale(0.5),
    )
    many = [lights.Point(position=(0.1 * i, 0.5, 0.3), intensity=0.05) for i in range(20)]
    view = tf.look_at([0, 0.2, 3.2], [0, -0.2, 0], [0, 1, 0])
    at = cameras.Perspective(to_world=view, fov=50.0, shutter=Shutter(0.0, 1.0))
    floor = shapes.Rectangle(material=rough, to_world=FLOOR)
    return Scene(
        camera=at,
        shapes=[floor, lamp, box, ball, pane],
        lights=many,
        integrator=way,
        film=Film(**film),
    )


SCENES = {
    "milk": _milk(),
    "path": _room(Path(light_paths=0)),
    "layers": _room(Path(light_paths=0), layers=("depth", "shading_normal", "albedo")),
    "light paths": _room(Path(light_paths=1)),
    "vcm": _room(Vcm()),
    "particle_tracer": _room(ParticleTracer()),
}


@pytest.mark.parametrize("name", quick(SCENES, "milk", "path"))
def test_no_path_follows_from_the_one_before(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Slots whose words hold other numbers give the same bits."""
    scene = SCENES[name]
    film = dataclasses.replace(scene.film, width=16, height=16, mode="spectral")
    scene = dataclasses.replace(scene, film=film)
    original = PathBuffers.restart
    pictures = []
    for pattern in (0, 0x3F19_999A, 0xC0A0_0000):  # .6 and -5 as floats, huge as integers

        def restart(self: PathBuffers, pattern: int = pattern) -> None:
            for member in PATH.members:
                if member.name not in KEPT:
                    for word in range(member.word, member.word + member.words):
                        rows = self.rows(PATH, word)
                        self.stream.fill_rows(self._fixed["path_words"], pattern, rows)
            original(self)

        monkeypatch.setattr(PathBuffers, "restart", restart)
        with clpt.Renderer(scene) as renderer:
            renderer.run(3)
            pictures.append(np.array(renderer.image()))
    for other in pictures[1:]:
        np.testing.assert_array_equal(other, pictures[0])
