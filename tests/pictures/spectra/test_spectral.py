"""Spectral pictures of narrow bands, against integrals over a fine grid: no ripple, any range.

A flat light seen through bands at many wavelengths must have the amplitude that the observer's
curves give, at any number of samples; wavelengths that are chosen unevenly would show here.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt import spectra
from clpt import transforms as tf
from clpt.scene import Film, Scene
from clpt.scene.cameras import Orthographic
from clpt.scene.integrators import Independent, Sobol
from clpt.scene.integrators import Path as PathIntegrator
from clpt.scene.lights import Area, Constant
from clpt.scene.materials import Diffuse
from clpt.scene.shapes import Rectangle
from tests.pictures.builders import BLACK, UP
from tests.pictures.support import assert_mean, exposures, with_film, with_path

CENTRES = np.arange(400.0, 701.0, 25.0)  # [nm]
HALF_WIDTH = 12.0  # [nm]
FINE = np.arange(300.0, 1000.0, 0.1)  # [nm]


def band(centre: float) -> spectra.Tabulated:
    """A triangle of height 1 around a wavelength."""
    lambdas = (centre - HALF_WIDTH, centre, centre + HALF_WIDTH)
    return spectra.Tabulated(lambdas, (0.0, 1.0, 0.0))


def to_rgb(values: np.ndarray) -> np.ndarray:
    """Linear Rec. 709 of radiances on FINE; a flat spectrum of 1 has a luminance of 1."""
    xyz = spectra.cie_xyz(FINE) * values[:, None]
    return spectra.XYZ_TO_REC709 @ (xyz.sum(axis=0) * 0.1 / spectra.CIE_Y_INTEGRAL)


def strip(sampler: object) -> Scene:
    """Squares that emit a band each; below, squares that reflect it of a flat light."""
    squares = []
    for i, centre in enumerate(CENTRES):
        x = 2.0 * i - len(CENTRES) + 1.0
        light = {"material": BLACK, "emission": Area(radiance=band(centre))}
        squares.append(Rectangle(to_world=tf.translate([x, 1.0, 0.0]), **light))
        colour = Diffuse(reflectance=band(centre))
        squares.append(Rectangle(to_world=tf.translate([x, -1.0, 0.0]), material=colour))
    half = float(len(CENTRES))
    return Scene(
        camera=Orthographic(
            to_world=tf.look_at([0, 0, 4], [0, 0, 0], UP) @ tf.scale([half, half, 1])
        ),
        shapes=squares,
        lights=[Constant(radiance="E")],
        integrator=PathIntegrator(max_depth=2),
        sampler=sampler,
        film=Film(width=4 * len(CENTRES), height=8),
    )


@pytest.mark.slow
@pytest.mark.parametrize("spp", [1, 3, 16])
@pytest.mark.parametrize("sampler", [Sobol(), Independent()], ids=lambda s: s.kind)
def test_no_ripple(sampler: object, spp: int) -> None:
    images = exposures(strip(sampler), 512 if spp == 1 else 128, spp)
    for i, centre in enumerate(CENTRES):
        expected = to_rgb(
            np.interp(
                FINE,
                *np.transpose(
                    [(centre - HALF_WIDTH, 0.0), (centre, 1.0), (centre + HALF_WIDTH, 0.0)]
                ),
            )
        )
        for rows in (slice(0, 4), slice(4, 8)):
            column = images[:, rows, 4 * i : 4 * i + 4]
            assert_mean(column, expected, 0.12, 2e-3)


@pytest.mark.parametrize(
    "ends",
    [(360.0, 830.0), (450.0, 620.0), pytest.param((300.0, 990.0), marks=pytest.mark.slow)],
)
def test_range_of_wavelengths(ends: tuple[float, float]) -> None:
    """A film records its own range; a flat light has there what the observer sees of it."""
    film = Film(width=16, height=16, lambda_min=ends[0], lambda_max=ends[1])
    scene = Scene(camera=Orthographic(), lights=[Constant(radiance="E")], film=film)
    images = exposures(scene, 32, 16)
    assert_mean(images, to_rgb(((ends[0] <= FINE) & (ends[1] >= FINE)) * 1.0), 0.01, 1e-3)


@pytest.mark.parametrize("outside", [340.0, 840.0])
def test_bands_outside_of_the_range_are_dark(outside: float) -> None:
    """What lies beyond the film's range, or beyond the observer's, adds nothing."""
    light = Constant(radiance=band(outside))
    scene = Scene(camera=Orthographic(), lights=[light], film=Film(width=8, height=8))
    assert np.abs(exposures(scene, 2, 64)).max() < 1e-3 * np.abs(to_rgb(np.ones(len(FINE)))).max()


@pytest.mark.slow
def test_spectral_sky_has_its_colours(scenes: Path) -> None:
    """Seen directly, colours of an image that were uplifted come back."""
    scene = with_path(clpt.load(scenes / "envmap.xml"), max_depth=1)
    exact = clpt.render(with_film(scene, mode="rgb"), 256)
    images = exposures(with_film(scene, mode="spectral"), 16, 64)
    assert_mean(images, exact.mean(axis=(0, 1)), 0.01, 5e-3)
    assert np.abs(images.mean(axis=0) - exact).max() < 0.1 * exact.max()
