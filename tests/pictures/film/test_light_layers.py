"""Layers of light: direct with indirect light, and the groups of lights, are the picture; each has
what its lights bring; integrators and filters that cannot make them are refused."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.render.wavefront.adaptive import checked
from clpt.scene import Film, Scene, media
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Auto, Box, Gaussian, Path, Vcm
from clpt.scene.lights import Area, Constant, Point
from clpt.scene.materials import Conductor, Diffuse, Fluorescent, Null
from clpt.scene.shapes import Cube, Rectangle, Sphere

NAMES = ("direct", "indirect", "light_groups")


def corner(integrator=None, paint=None, **film) -> Scene:
    """A floor and a wall, a mirror ball, two lamps of a group, a point, and a sky without one."""
    grey = paint or Diffuse(reflectance=(0.7, 0.5, 0.3))
    floor = Rectangle(to_world=tf.rotate([1, 0, 0], -90) @ tf.scale(4), material=grey)
    wall = Rectangle(to_world=tf.translate([0, 2, -2]) @ tf.scale(4), material=grey)
    ball = Sphere(center=(0.7, 0.5, 0), radius=0.5, material=Conductor())
    lamps = [
        Sphere(center=(x, 2.2, 0), radius=0.2, emission=Area(radiance=9.0, group="key"))
        for x in (-1.0, 1.0)
    ]
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 1.5, 5], [0, 1, 0], [0, 1, 0]), fov=45),
        shapes=[floor, wall, ball, *lamps],
        lights=[Point(position=(-2, 1, 1), intensity=(0, 0, 4), group="fill"), Constant()],
        film=Film(**{"width": 16, "height": 12, "mode": "rgb", "layers": NAMES, **film}),
        integrator=integrator or Path(light_paths=0),
    )


def rendered(scene: Scene, samples: int = 32):
    with clpt.Renderer(scene) as renderer:
        renderer.run(samples)
        return renderer.image()[..., :3], renderer.layers()


@pytest.mark.parametrize(
    ("how", "film"),
    [
        pytest.param(Path(light_paths=0), {}, marks=pytest.mark.slow),
        pytest.param(
            Auto(),
            {"mode": "spectral", "filter": Gaussian(), "white_balance": "A"},
            marks=pytest.mark.slow,
        ),
        (Path(light_paths=1), {"filter": Gaussian()}),
        pytest.param(Path(light_paths=0, guiding=True), {"alpha": True}, marks=pytest.mark.slow),
    ],
)
def test_parts_are_the_picture(how, film):
    """To the rounding of float32, with every filter and in both modes."""
    image, layers = rendered(corner(how, **film))
    assert [*layers] == ["direct", "indirect", "light_fill", "light_key", "light_rest"]
    groups = [layers[f"light_{name}"] for name in ("key", "fill", "rest")]
    assert min(part.mean() for part in (*groups, layers["indirect"])) > 0.003 * image.mean()
    np.testing.assert_allclose(sum(groups), image, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(layers["direct"] + layers["indirect"], image, rtol=1e-4, atol=1e-5)


def gas(kind: str) -> Cube:
    """A cube of a medium that emits and scatters."""
    given = {"sigma_a": 1.0, "sigma_s": 2.0, "emission": (4.0, 1.0, 0.5)}
    own = media.Homogeneous(**given)
    if kind == "grid":
        box = tf.translate([-1, 0, -1]) @ tf.scale(2.0)
        own = media.Grid(density=np.ones((9, 9, 9), np.float32), to_world=box, **given)
    return Cube(material=Null(), interior=own, to_world=tf.translate([0, 1, 0]) @ tf.scale(0.8))


@pytest.mark.parametrize("kind", ["homogeneous", pytest.param("grid", marks=pytest.mark.slow)])
def test_light_of_media_is_in_layers(kind):
    scene = corner(filter=Box())
    scene.shapes = [*scene.shapes[:2], gas(kind)]
    image, layers = rendered(scene)
    assert [*layers] == ["direct", "indirect", "light_fill", "light_rest"]
    groups = layers["light_fill"] + layers["light_rest"]
    np.testing.assert_allclose(groups, image, rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(layers["direct"] + layers["indirect"], image, rtol=1e-4, atol=1e-5)
    assert layers["indirect"].any()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["homogeneous", "grid"])
def test_light_of_media_that_is_scattered_once_is_direct(kind):
    scene = corner(Path(max_depth=1), filter=Box())
    scene.shapes, scene.lights = [gas(kind)], []
    image, layers = rendered(scene)
    assert image.mean() > 0.01 and not layers["indirect"].any()
    np.testing.assert_allclose(layers["light_rest"], image, rtol=1e-4, atol=1e-5)


@pytest.mark.slow
def test_fluorescent_light_is_seen_at_the_cameras_wavelengths():
    paint = Fluorescent()
    image, layers = rendered(corner(paint=paint, mode="spectral"))
    both = layers["direct"] + layers["indirect"]
    np.testing.assert_allclose(both, image, rtol=1e-4, atol=1e-5)


@pytest.mark.slow
def test_photons_bring_indirect_light():
    image, layers = rendered(corner(Vcm(), layers=("direct", "indirect")))
    both = layers["direct"] + layers["indirect"]
    np.testing.assert_allclose(both, image, rtol=1e-4, atol=1e-5)
    _, camera = rendered(corner(), 400)
    for name, values in layers.items():  # to 3 %, the noise of 32 samples
        assert abs(values.mean() / camera[name].mean() - 1.0) < 0.03


def test_limits_of_noise_are_refused():
    scene = corner(Path(light_paths=1))
    with pytest.raises(SceneError, match=r"noise: .*in direct; leave it out"):
        checked(0.1, lower(scene).features)
    assert lower(dataclasses.replace(scene, integrator=Auto(), noise=0.1)).integrator.kind == "path"


def test_a_group_is_what_its_lights_bring():
    """Without the others: means of the picture within 2 %, the noise of 2,000 samples a pixel; and
    direct light is that of paths of two edges, to 2 %."""
    scene = corner(width=4, height=3)
    _, layers = rendered(scene, 2000)
    fill = dataclasses.replace(
        scene,
        shapes=[dataclasses.replace(shape, emission=None) for shape in scene.shapes[:3]],
        lights=scene.lights[:1],
        film=dataclasses.replace(scene.film, layers=()),
    )
    alone, _ = rendered(fill, 2000)  # without the lamps' shadows
    assert abs(layers["light_fill"][..., 2].mean() / alone[..., 2].mean() - 1.0) < 0.05
    assert not layers["light_fill"][..., :2].any()  # its light is blue
    short, _ = rendered(
        dataclasses.replace(scene, integrator=Path(light_paths=0, max_depth=2)), 2000
    )
    assert abs(layers["direct"].mean() / short.mean() - 1.0) < 0.02


@pytest.mark.parametrize(
    ("how", "film", "message"),
    [
        (Vcm(), {}, "do not know their group"),
        (Path(), {"filtering": "splatting"}, "one pixel"),
    ],
)
def test_what_cannot_make_them_is_refused(how, film, message):
    with pytest.raises(SceneError, match=message):
        clpt.Renderer(corner(how, **film))
