"""Lamps seen directly: their radiance through the renderer, against sums over a fine grid.

The mean of independent exposures is compared at the significance of tests/pictures/support.py.
"""

from __future__ import annotations

import numpy as np
import pytest

from clpt import spectra
from clpt import transforms as tf
from clpt.errors import SceneError
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic
from clpt.scene.lights import Area, Constant
from clpt.scene.shapes import Rectangle
from clpt.scene.textures import Checkerboard, Mix, Product
from tests.pictures.support import assert_mean, exposures, with_film

FINE = np.arange(360.0, 830.0, 0.05)  # [nm]
LAMPS = {
    "one line between two samples": spectra.Lines((546.5,), (100.0,)),
    "a line on a sample": spectra.Lines((500.0,), (100.0,)),
    "broad lines": spectra.Lines((450.3, 611.8), (60.0, 90.0), 6.0),
    "sodium": spectra.illuminant("sodium"),
    "mercury": spectra.illuminant("mercury", 3.0),
    "HP1": spectra.illuminant("HP1"),
    "LED-B3": spectra.illuminant("LED-B3", 0.5),
    "an LED": spectra.LED(630.0, 18.0, 4.0),
    "a candle": spectra.Blackbody(1900.0),
    "daylight of luminance 2": spectra.Blackbody(6500.0, 2.0, normalised=True),
}


def xyz_of(lamp: spectra.Spectrum) -> np.ndarray:
    """XYZ by a sum over FINE; the flat spectrum 1 has Y = 1."""
    weights = spectra.cie_xyz(FINE) * lamp.sample(FINE)[:, None]
    return weights.sum(axis=0) * (FINE[1] - FINE[0]) / spectra.CIE_Y_INTEGRAL


@pytest.mark.parametrize("name", LAMPS)
def test_radiance_of_lamps(name: str) -> None:
    lamp = LAMPS[name]
    film = Film(width=16, height=16)
    scene = Scene(camera=Orthographic(), lights=[Constant(radiance=lamp)], film=film)
    assert_mean(spectra.rgb_to_xyz(exposures(scene, 32, 16)), xyz_of(lamp), 0.02, 1e-3)


def test_lamps_in_rgb_mode() -> None:
    """In RGB mode a lamp has its luminance; its colour is cut to Rec. 709."""
    lamp = LAMPS["sodium"]
    film = Film(width=4, height=4)
    scene = Scene(camera=Orthographic(), lights=[Constant(radiance=lamp)], film=film)
    image = exposures(with_film(scene, mode="rgb"), 2, 1).mean(axis=(0, 1, 2))
    xyz = xyz_of(lamp)
    cut = np.maximum(spectra.XYZ_TO_REC709 @ xyz, 0.0)
    expected = cut * xyz[1] / spectra.rgb_to_xyz(cut)[1]
    np.testing.assert_allclose(image, expected, rtol=2e-3, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lo", "hi"), [(588.9, 589.7), pytest.param(550.0, 550.02, marks=pytest.mark.slow)]
)
def test_narrow_films_are_exact_at_their_ends(lo: float, hi: float) -> None:
    """The mean of a band of sodium's lines, and of a grey; float32 has 6e-5 nm at 550 nm."""
    for lamp in (LAMPS["sodium"], spectra.Constant(0.5)):
        film = Film(width=16, height=16, lambda_min=lo, lambda_max=hi, bands=1)
        scene = Scene(camera=Orthographic(), lights=[Constant(radiance=lamp)], film=film)
        fine = np.linspace(lo, hi, 10_001)
        assert_mean(exposures(scene, 4, 16), [lamp.sample(fine).mean()], 0.02, 2e-3)


def test_films_too_narrow_for_float32_are_refused() -> None:
    with pytest.raises(SceneError, match=r"film\.lambda_min: must be 0\.01 nm or more below"):
        Film(lambda_min=550.0, lambda_max=550.001)


BEFORE = tf.translate([0, 0, 2]) @ tf.rotate([1, 0, 0], 180)  # the camera, facing it
NUMBERS = {
    "a number": 0.7,
    "three numbers": (0.7, 0.7, 0.7),
    "a product": Product(first=0.35, second=2.0),
    "a mixture": Mix(first=0.0, second=1.4, amount=Checkerboard(color0=0.5, color1=0.5)),
}


@pytest.mark.slow
@pytest.mark.parametrize("mode", ["rgb", pytest.param("spectral", marks=pytest.mark.slow)])
def test_a_number_is_white_light(mode: str) -> None:
    """D65 times the number, on a shape as in the sky, in textures as without."""
    film = Film(width=16, height=16, mode=mode)
    for given in NUMBERS.values():
        lamp = Rectangle(emission=Area(radiance=given), to_world=BEFORE)
        scene = Scene(camera=Orthographic(), shapes=[lamp], film=film)
        assert_mean(exposures(scene, 4, 16), [0.7] * 3, 0.02, 1e-3)
    sky = Scene(camera=Orthographic(), lights=[Constant(radiance=0.7)], film=film)
    assert_mean(exposures(sky, 4, 16), [0.7] * 3, 0.02, 1e-3)


def test_names_of_lamps_are_taken_where_files_take_them() -> None:
    assert Area(radiance="D65").radiance == spectra.illuminant("D65")
    assert Constant(radiance="E").radiance == spectra.Constant(1.0)
    with pytest.raises(SceneError, match=r"area\.radiance: unknown illuminant 'D66'.*D65"):
        Area(radiance="D66")
