"""clpt.spectra.emission: lamps against radiometry, CIE 15 and their own line tables."""

import numpy as np
import pytest

from clpt import spectra
from clpt.errors import SceneError, UnknownKindError
from clpt.spectra import cie

FINE = np.arange(300.0, 900.0, 0.01)


def xyz_of(spectrum):
    return cie.spectrum_to_xyz(spectrum.sample(cie.GRID))


def test_every_illuminant_has_luminance_one():
    assert {"A", "D50", "D65", "E", "F1", "F12"} <= set(spectra.illuminants())
    for name in spectra.illuminants():
        xyz = cie.spectrum_to_xyz(spectra.illuminant(name).sample(cie.GRID))
        assert xyz[1] == pytest.approx(1.0, abs=1e-12), name
    np.testing.assert_allclose(spectra.illuminant("D65").to_rgb("emission"), 1.0, atol=1e-12)


@pytest.mark.parametrize(
    "name, x, y",
    [
        ("A", 0.44757, 0.40745),
        ("D50", 0.34567, 0.35850),
        ("D65", 0.31271, 0.32902),
        ("E", 1 / 3, 1 / 3),
        ("F2", 0.37208, 0.37529),
        ("F11", 0.38052, 0.37713),
        ("HP1", 0.5330, 0.4150),
        ("HP3", 0.4302, 0.4075),
        ("LED-B3", 0.3756, 0.3723),
        ("LED-RGB1", 0.4557, 0.4211),
    ],
)
def test_chromaticities_of_cie_15(name, x, y):
    xyz = cie.spectrum_to_xyz(spectra.illuminant(name).sample(cie.GRID))
    np.testing.assert_allclose(xyz[:2] / xyz.sum(), [x, y], atol=3e-4)


@pytest.mark.parametrize("kelvin", [2856.0, 5000.0, 6504.0])
def test_blackbody_peaks_where_wien_says(kelvin):
    lambdas = np.arange(300.0, 2000.0, 0.01)
    peak = lambdas[np.argmax(spectra.Blackbody(kelvin).sample(lambdas))]
    assert peak == pytest.approx(2.897771955e6 / kelvin, abs=0.02)


def test_blackbody_integrates_to_stefan_boltzmann():
    lambdas = np.geomspace(50.0, 1e7, 200_000)
    radiance = np.trapezoid(spectra.Blackbody(3000.0, 2.0).sample(lambdas), lambdas)
    assert radiance == pytest.approx(2.0 * 5.670374419e-8 * 3000.0**4 / np.pi, rel=1e-5)
    assert spectra.Blackbody(100.0).sample(360.0) == pytest.approx(0.0, abs=1e-100)
    with pytest.raises(SceneError):
        spectra.Blackbody(0.0)


def test_normalised_blackbody_has_luminance_one():
    for kelvin in (300.0, 1900.0, 6500.0, 1e5):
        glow = spectra.Blackbody(kelvin, 2.5, normalised=True)
        assert xyz_of(glow)[1] == pytest.approx(2.5, rel=1e-12)
        ratio = glow.sample([400.0, 550.0]) / spectra.Blackbody(kelvin).sample([400.0, 550.0])
        assert ratio[0] == pytest.approx(ratio[1], rel=1e-12)
    with pytest.raises(SceneError, match="dark"):
        spectra.Blackbody(5.0, normalised=True)


@pytest.mark.parametrize("width", [1.0, 2.0, 5.0])
@pytest.mark.parametrize("start", [360.0, 360.37, 300.5])
def test_lines_keep_their_power_on_the_renderers_grid(start, width):
    """The sum over samples 1 nm apart is the power, and their centroid the wavelength."""
    wavelengths, powers = (404.6565, 546.0750, 588.9951), (2.0, 0.5, 3.0)
    grid = spectra.on_grid(spectra.Lines(wavelengths, powers, width), start, 830.0)
    assert grid.sum() == pytest.approx(5.5, rel=1e-6)
    lambdas = start + np.arange(grid.size)
    moment = np.dot(wavelengths, powers)
    assert (grid * lambdas).sum() == pytest.approx(moment, rel=1e-6)


def test_lines_are_as_wide_as_they_say():
    values = spectra.Lines((550.0,), (7.0,), 4.0, 2.0).sample(FINE)
    assert np.trapezoid(values, FINE) == pytest.approx(14.0, rel=1e-6)
    assert np.ptp(FINE[values >= 0.5 * values.max()]) == pytest.approx(4.0, abs=0.02)


@pytest.mark.parametrize(
    "given, message",
    [
        (((500.0,), (1.0, 2.0)), "as many"),
        (((), ()), "as many"),
        (((500.0,), (np.inf,)), "finite"),
        (((500.0,), (-1.0,)), "below 0"),
        (((500.0,), (1.0,), 1.0, -1.0), "scale"),
        (((500.0,), (1.0,), 0.5), "whole number"),
        (((500.0,), (1.0,), 2.5), "whole number"),
        (((500.0,), (1.0,), np.nan), "whole number"),
    ],
)
def test_bad_lines_are_refused(given, message):
    with pytest.raises(SceneError, match=message):
        spectra.Lines(*given)


def test_discharges():
    """Sodium is nearly monochromatic, on the spectral locus; mercury's brightest line is green."""
    x, y, z = xyz_of(spectra.illuminant("sodium"))
    locus = cie.cie_xyz(589.2)
    np.testing.assert_allclose([x, y, z], locus / locus[1], atol=0.02)
    mercury = spectra.illuminant("mercury").sample(cie.GRID)
    luminance = mercury * cie.cie_xyz(cie.GRID)[:, 1]
    shares = [luminance[abs(cie.GRID - line) < 3.0].sum() for line in (436.0, 546.0, 578.0)]
    np.testing.assert_allclose(np.array(shares) / luminance.sum(), [0.01, 0.54, 0.45], atol=0.02)
    assert mercury[cie.GRID < 370.0].sum() > 0.0  # the black light


def test_leds_follow_ohno():
    """Against colour-science; half of the height is reached 0.92 of the nominal width apart."""
    colour = pytest.importorskip("colour")
    theirs = colour.sd_single_led(530.0, half_spectral_width=25.0)
    np.testing.assert_allclose(spectra.LED(530.0, 25.0).sample(theirs.wavelengths), theirs.values)
    values = spectra.LED(530.0, 25.0, 3.0).sample(FINE)
    assert values.max() == pytest.approx(3.0)
    assert np.ptp(FINE[values >= 1.5]) == pytest.approx(0.92 * 25.0, abs=0.05)
    with pytest.raises(SceneError, match="positive"):
        spectra.LED(530.0, 0.0)


@pytest.mark.parametrize("scale", [-1.0, np.inf, np.nan])
def test_scales_that_are_none(scale):
    for lamp in (spectra.Blackbody, spectra.LED):
        with pytest.raises(SceneError, match="scale"):
            lamp(3000.0, scale=scale)
    with pytest.raises(SceneError, match="scale"):
        spectra.Illuminant("D65", scale)


def test_named_lamps_have_a_scale():
    half = spectra.illuminant("F2", 0.5)
    np.testing.assert_allclose(half.sample(FINE), 0.5 * spectra.illuminant("F2").sample(FINE))
    assert spectra.illuminant("E", 3.0) == spectra.Constant(3.0)
    with pytest.raises(UnknownKindError, match="D65"):
        spectra.illuminant("D55")
