"""Gratings in pictures: where a lamp's orders appear, and that no light is lost on the way."""

from __future__ import annotations

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic, Perspective
from clpt.scene.integrators import Box
from clpt.scene.lights import Area, Constant
from clpt.scene.materials import Conductor, Grating, TwoSided
from clpt.scene.shapes import Disk, Rectangle, Sphere
from clpt.spectra import Tabulated
from tests.pictures.builders import BLACK
from tests.pictures.support import assert_agree, exposures

PERIOD, HEIGHT, WIDTH = 1600.0, 2.0, 128  # [nm], of the lamp [m], of the film [pixels]


def from_above(material, shape, wavelength: float) -> Scene:
    """A surface seen along its normal, and a lamp of nearly one wavelength over its middle."""
    light = Tabulated((wavelength - 2.0, wavelength, wavelength + 2.0), (0.0, 4e3, 0.0))
    return Scene(
        camera=Orthographic(to_world=tf.look_at([0, 0, 9], [0, 0, 0], [0, 1, 0])),
        shapes=[
            shape(material=material),
            Sphere(
                center=(0, 0, HEIGHT), radius=0.05, material=BLACK, emission=Area(radiance=light)
            ),
        ],
        film=Film(width=WIDTH, height=WIDTH, filter=Box()),
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "shape",
    [Rectangle, Disk],
    ids=["rectangle", "disk"],
)
def test_where_a_lamps_first_order_appears(shape):
    """At x = +-H tan(asin(lambda / d)), along the tangent of a rectangle, all around on a disk."""
    made = from_above(Grating(period=PERIOD), shape, 550.0)
    y = spectra.luminance(clpt.render(made, spp=64))
    at = (np.arange(WIDTH) + 0.5) / WIDTH * 2.0 - 1.0
    expected = HEIGHT * np.tan(np.arcsin(550.0 / PERIOD))
    radius = np.hypot(at[:, None], at[None])
    y = np.where(radius > 0.3, y, 0.0)  # the lamp itself, and its mirror image
    if shape is Rectangle:
        x = np.abs(at)[None] * np.ones((WIDTH, 1))
        assert np.sum(y * np.abs(at)[:, None]) / y.sum() < 0.06  # nothing goes across
    else:
        x = radius
        angles = np.arctan2(at[:, None], at[None])
        quarters = [y[(angles // (np.pi / 2)) == q].sum() for q in range(-2, 2)]
        assert min(quarters) > 0.5 * max(quarters)
    assert np.sum(x * y) / y.sum() == pytest.approx(expected, abs=1.5 * 2.0 / WIDTH)


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["spectral", "rgb"])
def test_a_grating_in_an_even_sky_is_a_grey_mirror(mode):
    sky = Constant(radiance=spectra.Constant(1.0))
    camera = Perspective(to_world=tf.look_at([0, -2, 1.2], [0, 0, 0], [0, 0, 1]), fov=40.0)
    materials = Grating(reflectance=0.7, depth=180.0), Conductor(specular_reflectance=0.7)
    made = [
        Scene(
            camera=camera,
            shapes=[Rectangle(material=material)],
            lights=[sky],
            film=Film(width=12, height=8, mode=mode),
        )
        for material in materials
    ]
    assert_agree(*(exposures(scene, 8, 64) for scene in made))


def test_a_transmissive_grating_has_no_back_of_its_own():
    material = TwoSided(front=Grating(mode="transmissive"))
    with pytest.raises(SceneError, match="grating lets light through"):
        lower(Scene(camera=Perspective(), shapes=[Rectangle(material=material)]))
    lower(Scene(camera=Perspective(), shapes=[Rectangle(material=TwoSided(front=Grating()))]))
