"""A transparent film: over the sky it is the ordinary picture."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import clpt
from clpt import images
from clpt import transforms as tf
from clpt.cli.files import outputs
from clpt.cli.options.grading import Grading
from clpt.errors import SceneError
from clpt.scene import Film, Scene, media
from clpt.scene.cameras import Perspective
from clpt.scene.integrators import Path
from clpt.scene.lights import Area, Constant
from clpt.scene.materials import Dielectric, Diffuse, Mask, Null, ThinDielectric
from clpt.scene.shapes import Cube, Rectangle, Shape, Sphere
from tests.pictures.support import with_film

SKY = np.array([0.2, 0.4, 0.8], np.float32)


def still_life(**film: object) -> Scene:
    """A painted ball, one of glass, half a curtain and a lamp, under a sky of one colour."""
    curtain = Mask(opacity=0.5, material=Diffuse(reflectance=(0.8, 0.1, 0.1)))
    lamp = tf.translate([0, 0.7, 0]) @ tf.scale(0.2)
    return Scene(
        camera=Perspective(to_world=tf.look_at([0, 0, 3], [0, 0, 0], [0, 1, 0]), fov=40),
        shapes=[
            Sphere(center=(-0.5, 0, 0), radius=0.4, material=Diffuse()),
            Sphere(center=(0.5, 0, 0), radius=0.3, material=Dielectric()),
            Rectangle(to_world=tf.translate([0, -0.7, 0]) @ tf.scale(0.4), material=curtain),
            Rectangle(to_world=lamp, emission=Area(radiance=(2.0, 2.0, 1.0))),
        ],
        lights=[Constant(radiance=tuple(SKY.tolist()))],
        integrator=Path(light_paths=0),
        film=Film(**{"width": 22, "height": 20, "mode": "rgb", **film}),
    )


@pytest.fixture(scope="module")
def transparent() -> np.ndarray:
    return clpt.render(still_life(alpha=True), 16)


def test_over_the_sky_it_is_the_ordinary_picture(transparent):
    """The same samples, so all but rounding is the same."""
    ordinary = clpt.render(still_life(), 16)
    colour, alpha = transparent[..., :3], transparent[..., 3:]
    assert transparent.shape == (20, 22, 4) and alpha.min() == 0.0 and alpha.max() == 1.0
    assert ((alpha > 0.3) & (alpha < 0.7)).any()  # the curtain
    assert (colour[alpha[..., 0] == 0.0] == 0.0).all()
    np.testing.assert_allclose(colour + (1.0 - alpha) * SKY, ordinary, rtol=2e-5, atol=2e-6)


def test_in_crops_and_halves(transparent):
    film = {"alpha": True, "crop": (3, 2, 12, 9)}
    with clpt.Renderer(still_life(**film), halves=True) as renderer:
        renderer.run(8)
        image = renderer.image()
        assert image.shape == (9, 12, 4) and image[..., 3].min() < image[..., 3].max() == 1.0
        state = renderer.film_state()
        assert state.words.shape[1] == 13
        renderer.reset()
        renderer.merge(state)
        np.testing.assert_array_equal(renderer.image(), image)


def test_hidden_lights_cover_nothing(transparent):
    scene = still_life(alpha=True)
    integrator = dataclasses.replace(scene.integrator, hide_lights=True)
    hidden = clpt.render(dataclasses.replace(scene, integrator=integrator), 16)
    lamp = np.s_[2:4, 9:13]
    assert (transparent[lamp][..., 3] > 0.9).any() and (hidden[lamp][..., 3] == 0.0).all()


def test_files(tmp_path, transparent):
    """An .exr has colours as they arrive, a .png those of what covers."""
    with clpt.Renderer(still_life(alpha=True)) as renderer:
        renderer.run(16)
        for name in ("a.exr", "a.png"):
            outputs.write(tmp_path / name, renderer, {"spp": 16}, Grading())
    exr, png = images.read(tmp_path / "a.exr"), images.read(tmp_path / "a.png")
    np.testing.assert_allclose(exr, transparent, rtol=1e-3, atol=1e-4)
    covered = transparent[..., 3] > 0.25
    straight = np.clip(images.straight(transparent)[..., :3], 0.0, 1.0)
    np.testing.assert_allclose(png[covered][:, :3], straight[covered], atol=0.01)
    np.testing.assert_allclose(png[..., 3], transparent[..., 3], atol=0.003)


def test_another_film_needs_another_renderer():
    with clpt.Renderer(still_life()) as renderer, pytest.raises(SceneError, match="alpha"):
        renderer.update(scene=with_film(still_life(), alpha=True))


def _before(material: Any, **options: Any) -> list[Shape]:
    return [Cube(to_world=tf.scale(0.5), material=material, **options)]


BLACK_SMOKE = media.Grid(
    density=np.ones((2, 2, 2), np.float32),
    to_world=tf.translate([-0.5, -0.5, -0.5]),
    sigma_a=1.0,
    sigma_s=0.0,
)
COVERS = {
    "smoke": _before(Null(), interior=media.Homogeneous(sigma_a=1.0, sigma_s=0.0)),
    "coloured smoke": _before(
        Null(), interior=media.Homogeneous(sigma_a=(0.2, 1.0, 3.0), sigma_s=0.0)
    ),
    "fog": _before(Null(), interior=media.Homogeneous(sigma_a=0.5, sigma_s=0.5)),
    "a black grid": _before(Null(), interior=BLACK_SMOKE),
    "a tinted pane": [Rectangle(material=ThinDielectric(specular_transmittance=0.25))],
    "a mask": [Rectangle(material=Mask(opacity=0.4, material=Diffuse()))],
    "smoke before a wall": [
        *_before(Null(), interior=media.Homogeneous(sigma_a=1.0, sigma_s=0.0)),
        Rectangle(to_world=tf.translate([0.3, 0, -1]) @ tf.scale(0.3)),
    ],
}  # fmt: skip
QUICK = [("smoke", "rgb"), ("a tinted pane", "rgb"), ("a black grid", "spectral")]
ALL = [(what, mode) for what in COVERS for mode in ("rgb", "spectral")]


@pytest.mark.parametrize(
    ("what", "mode"),
    [pytest.param(*one, marks=() if one in QUICK else pytest.mark.slow) for one in ALL],
)
def test_what_takes_light_away_covers(what: str, mode: str) -> None:
    """Laid over white it is the picture before a white sky: of the same samples, whose alpha is a
    mean over the colours. Where these differ the means of the pictures are compared."""

    def made(**film: Any) -> np.ndarray:
        one = Scene(
            camera=Perspective(origin=(0, 0, 4), target=(0, 0, 0), fov=30),
            shapes=COVERS[what],
            lights=[Constant(radiance=1.0)],
            integrator=Path(light_paths=0),
            film=Film(width=9, height=9, mode=mode, **film),
        )
        return clpt.render(one, 32)

    sky, cut = made(), made(alpha=True)
    over = cut[..., :3] + (1.0 - cut[..., 3:])
    each = mode == "rgb" and what != "coloured smoke"  # else colours are noise, or differ
    error = np.abs(sky - over).max() if each else abs((sky - over).mean())
    assert error < (1e-5 if each else 0.02)
    assert 0.1 < cut[4, 4, 3] < 1.0 + 1e-6
