"""Colours by clpt's tables and sums, against the package colour-science: Delta E 2000.

The chart's 24 reflectances are the measured ones of scenes/color_checker.
"""

from pathlib import Path

import numpy as np
import pytest

from clpt import spectra
from clpt.spectra import cie

colour = pytest.importorskip("colour", reason="the package that we compare with is not installed")

pytestmark = pytest.mark.filterwarnings("ignore:.*Aligning")

CHART = Path(__file__).parents[2] / "scenes" / "color_checker" / "reflectances.csv"
OBSERVERS = {
    "1931": "CIE 1931 2 Degree Standard Observer",
    "1964": "CIE 1964 10 Degree Standard Observer",
}
ROUND_TRIP = 0.3  # Delta E 2000 of colours made spectra and seen under D65
STEPS = 33  # of the sampled gamut, along each primary


def delta_e(ours, theirs, white):
    """Delta E 2000 of XYZ (n, 3) whose white has the XYZ `white`."""
    x, y, z = white
    lab = [colour.XYZ_to_Lab(xyz / y, (x / (x + y + z), y / (x + y + z))) for xyz in (ours, theirs)]
    return colour.delta_E(*lab, method="CIE 2000")


def their_xyz(sd, lamp, observer):
    """XYZ of a reflectance by colour-science's sum at 1 nm; white has Y = 1."""
    cmfs = colour.MSDS_CMFS[OBSERVERS[observer]]
    illuminant = colour.SDS_ILLUMINANTS[lamp.replace("F", "FL")]
    return colour.sd_to_XYZ(sd, cmfs, illuminant, method="Integration") / 100.0


@pytest.mark.parametrize("observer", OBSERVERS)
@pytest.mark.parametrize("lamp", ["A", "D65", "F2"])
def test_reflectances_under_lamps(lamp, observer):
    """24 measured reflectances: what differs is the interpolation between their 10 nm."""
    table = np.loadtxt(CHART, delimiter=",").T
    curves = [spectra.Tabulated(table[0], row, "hold").sample(cie.GRID) for row in table[1:]]
    lit = spectra.illuminant(lamp).sample(cie.GRID)
    weights = cie.cie_xyz(cie.GRID, observer) * lit[:, None]
    weights /= weights[:, 1].sum()
    sds = [colour.SpectralDistribution(row, table[0]) for row in table[1:]]
    theirs = np.array([their_xyz(sd, lamp, observer) for sd in sds])
    error = delta_e(np.array(curves) @ weights, theirs, weights.sum(axis=0))
    assert error.max() < 0.25 and error.mean() < 0.1, (error.max(), error.mean())


@pytest.fixture(scope="module")
def gamut():
    """The cube of Rec. 709, evenly in linear and in display-encoded values: (n, 3)."""
    axis = np.linspace(0.0, 1.0, STEPS)
    even = np.stack(np.meshgrid(axis, axis, axis), axis=-1).reshape(-1, 3)
    return np.concatenate([even, even**2.4])


def test_gamut_survives_the_spectrum(gamut):
    """Every colour, the saturated ones of the cube's faces and the greys included."""
    lit = spectra.illuminant("D65").sample(cie.GRID)
    for rgb in np.array_split(gamut, 8):
        curves = spectra.upsampling.evaluate(spectra.uplift(rgb), cie.GRID)
        assert curves.min() >= 0.0 and curves.max() <= 1.0
        error = delta_e(cie.spectrum_to_xyz(curves * lit), cie.rgb_to_xyz(rgb), cie.D65_WHITE)
        assert error.max() < ROUND_TRIP, rgb[error.argmax()]


def test_uplift_stays_physical_outside_of_the_visible(gamut):
    curves = spectra.upsampling.evaluate(spectra.uplift(gamut[::7]), np.arange(200.0, 2500.0, 25.0))
    assert np.isfinite(curves).all() and curves.min() >= 0.0 and curves.max() <= 1.0
