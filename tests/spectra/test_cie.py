"""clpt.spectra.cie: against colour-science, Mitsuba, and the sampler's own density."""

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.spectra import cie


def test_observer_constants():
    assert pytest.approx(106.8569, abs=1e-3) == cie.CIE_Y_INTEGRAL
    np.testing.assert_allclose(cie.cie_xyz(555.0), [0.5121, 1.0, 0.00575], atol=1e-3)
    np.testing.assert_array_equal(cie.cie_xyz([300.0, 900.0]), 0.0)
    assert not np.allclose(cie.cie_xyz(450.0, "1964"), cie.cie_xyz(450.0))
    with pytest.raises(SceneError, match="1931, 1964"):
        cie.cie_xyz(500.0, "1976")


def test_matrices_are_rec709():
    np.testing.assert_allclose(cie.XYZ_TO_REC709 @ cie.REC709_TO_XYZ, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(cie.luminance(np.eye(3)), [0.2126, 0.7152, 0.0722], atol=3e-4)
    np.testing.assert_allclose(cie.xyz_to_rgb(cie.D65_WHITE), 1.0, atol=1e-14)
    x, y, _ = cie.D65_WHITE / cie.D65_WHITE.sum()
    np.testing.assert_allclose([x, y], [0.3127, 0.3290], atol=5e-5)


def test_equal_energy_has_luminance_one():
    np.testing.assert_allclose(cie.spectrum_to_xyz(np.ones(471)), 1.0, atol=5e-4)


def test_agrees_with_colour_science():
    colour = pytest.importorskip("colour")
    for year, name in (("1931", "2"), ("1964", "10")):
        cmfs = colour.MSDS_CMFS[f"CIE {year} {name} Degree Standard Observer"]
        np.testing.assert_allclose(cie.cie_xyz(cmfs.wavelengths, year), cmfs.values, rtol=1e-8)
    theirs = colour.RGB_COLOURSPACES["ITU-R BT.709"].matrix_XYZ_to_RGB
    np.testing.assert_allclose(cie.XYZ_TO_REC709, theirs, atol=1e-3)


@pytest.mark.parametrize("lo, hi", [(360.0, 830.0), (300.0, 2500.0), (540.0, 545.0)])
def test_wavelength_pdf_integrates_to_one(lo, hi):
    edges = np.linspace(lo, hi, 20001)
    middles = (edges[1:] + edges[:-1]) / 2
    assert cie.wavelength_pdf(middles, lo, hi).mean() * (hi - lo) == pytest.approx(1, abs=1e-6)
    assert cie.wavelength_pdf([lo - 1, hi + 1], lo, hi).max() == 0


@pytest.mark.parametrize("lo, hi", [(360.0, 830.0), (400.0, 600.0), (600.0, 1500.0)])
def test_sampler_inverts_the_distribution(lo, hi):
    """The pdf at a sample is du/dlambda, and the ends of u are the ends of the range."""
    u = np.linspace(0.0, 1.0, 100001)
    lambdas, pdf = cie.sample_wavelengths(u, lo, hi)
    assert lambdas[0] == pytest.approx(lo, abs=1e-6) and lambdas[-1] == pytest.approx(hi, abs=1e-3)
    np.testing.assert_allclose(pdf, cie.wavelength_pdf(lambdas, lo, hi), rtol=1e-6)
    slope = np.gradient(u, lambdas)
    np.testing.assert_allclose(slope[1:-1], pdf[1:-1], rtol=1e-3, atol=1e-5 * pdf.max())


def test_samples_follow_the_pdf():
    """Chi-squared over 64 bins, significance 0.001 (one fixed seed)."""
    stats = pytest.importorskip("scipy.stats")
    lo, hi = 380.0, 780.0
    lambdas, _ = cie.sample_wavelengths(np.random.default_rng(7).random(200_000), lo, hi)
    edges = np.linspace(lo, hi, 65)
    observed, _ = np.histogram(lambdas, edges)
    fine = np.linspace(lo, hi, 64 * 200 + 1)
    density = cie.wavelength_pdf((fine[1:] + fine[:-1]) / 2, lo, hi)
    expected = density.reshape(64, 200).sum(1)
    expected *= observed.sum() / expected.sum()
    assert stats.chisquare(observed, expected).pvalue > 1e-3


def test_empty_range_is_refused():
    with pytest.raises(SceneError, match="empty"):
        cie.sample_wavelengths(0.5, 700.0, 400.0)


def test_sampling_agrees_with_mitsuba():
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_spectral")
    u = (0.1, 0.5, 0.93)
    theirs = [mi.sample_rgb_spectrum(value) for value in u]
    lambdas, pdf = cie.sample_wavelengths(u)
    np.testing.assert_allclose(lambdas, [pair[0] for pair in theirs], atol=1e-2)
    np.testing.assert_allclose(1.0 / pdf, [pair[1] for pair in theirs], rtol=1e-4)
