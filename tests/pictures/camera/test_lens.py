"""A lens of glass: each wavelength has its own focus, and nothing else changes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.render.flow.scene_to_tables import lower
from clpt.scene import Film, Scene
from clpt.scene.cameras import ThinLens
from clpt.scene.integrators import Box
from clpt.scene.lights import Area, Constant
from clpt.scene.shapes import Disk
from clpt.spectra import Tabulated
from tests.pictures.builders import BLACK
from tests.pictures.support import SIGNIFICANCE, assert_agree, exposures, with_film

LENGTH, FOCUS, APERTURE = 0.05, 2.0, 0.01  # [m]
DISTANCE, SIZE = 2.0, 0.004  # of a luminous disk [m]
PIXELS, FOV = 48, 1.6


def scene(light: spectra.Spectrum, **lens) -> Scene:
    """A small luminous disk that faces a lens."""
    disk = tf.translate([0, 0, DISTANCE]) @ tf.rotate([0, 1, 0], 180) @ tf.scale(SIZE)
    return Scene(
        camera=ThinLens(
            fov=FOV, aperture_radius=APERTURE, focus_distance=FOCUS, focal_length=LENGTH, **lens
        ),
        shapes=[Disk(material=BLACK, emission=Area(radiance=light), to_world=disk)],
        film=Film(width=PIXELS, height=PIXELS, filter=Box()),
    )


def spread(image: np.ndarray) -> float:
    """Mean square distance from the axis [tan of the angle, squared], by luminance."""
    y = spectra.luminance(image)
    at = (np.arange(PIXELS) + 0.5 - PIXELS / 2) / PIXELS * 2.0 * np.tan(np.radians(FOV / 2))
    radius2 = at[:, None] ** 2 + at[None] ** 2
    return float((y * radius2).sum() / y.sum())


@pytest.mark.parametrize("wavelength", [450.0, 560.0, 640.0])
def test_blur_of_a_disk_out_of_its_focus(wavelength):
    """Uniform disks add mean squares: that of the sharp image, that of the circle of confusion.

    The latter's radius is a |1 / z - 1 / s|, its mean square a half of that squared. Ten exposures,
    Student's t with 9 degrees of freedom; a pixel's own width adds its mean square, 1 / 6 of it.
    """
    lambdas = np.linspace(wavelength - 6.0, wavelength + 6.0, 25)
    light = Tabulated(lambdas, np.ones(25))
    made = scene(light, glass="sf11")
    found = [spread(image) for image in exposures(made, 10, 64)]
    n, design = (spectra.glass("sf11").sample(w) for w in (lambdas, 587.56))
    focus = 1.0 / FOCUS + ((n - 1.0) / (design - 1.0) - 1.0) / LENGTH
    confusion = APERTURE * np.abs(1.0 / DISTANCE - focus)
    weight = spectra.cie_xyz(lambdas)[:, 1]
    pixel = 2.0 * np.tan(np.radians(FOV / 2)) / PIXELS
    blur = np.sum(weight * confusion**2) / weight.sum() / 2.0
    expected = blur + (SIZE / DISTANCE) ** 2 / 2.0 + pixel**2 / 6.0
    error = np.std(found, ddof=1) / np.sqrt(10)
    assert abs(np.mean(found) - expected) < 6.6 * error + 2e-3 * expected  # 6.6: 1e-4, two-sided
    assert SIGNIFICANCE == 1e-4
    if wavelength == 450.0:
        assert blur > 0.2 * expected  # what is tested is there


@pytest.mark.slow
def test_glass_that_does_not_disperse_changes_no_bit():
    plain = scene(spectra.Constant(1.0))
    flat = dataclasses.replace(plain, camera=dataclasses.replace(plain.camera, glass=1.7))
    assert np.array_equal(clpt.render(plain, spp=4), clpt.render(flat, spp=4))
    assert not lower(flat).features.dispersion


@pytest.mark.slow
def test_an_even_sky_keeps_its_brightness():
    sky = Constant(radiance=spectra.Constant(1.0))
    film = Film(width=16, height=16)
    made = [
        Scene(camera=ThinLens(focal_length=LENGTH, glass=glass), lights=[sky], film=film)
        for glass in (1.5, "sf11")
    ]
    assert_agree(*(exposures(s, 8, 32) for s in made))


def test_rgb_mode_warns():
    rgb = lower(with_film(scene(spectra.Constant(1.0), glass="bk7"), mode="rgb"))
    assert any("one focus" in note for note in rgb.warnings)
    assert not rgb.features.camera.disperses
