"""clpt.spectra.spaces: matrices, adaptation and whites, against colour-science."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import UnknownKindError
from clpt.spectra import cie, illuminant, spaces

THEIRS = {
    "rec709": "ITU-R BT.709",
    "rec2020": "ITU-R BT.2020",
    "display_p3": "Display P3",
    "aces2065_1": "ACES2065-1",
    "acescg": "ACEScg",
}


@pytest.mark.parametrize("space", spaces.SPACES)
def test_white_is_one_one_one(space: str) -> None:
    rgb = spaces.from_xyz(space) @ spaces.white(space)
    expected = spaces.white(space) if space == "xyz" else np.ones(3)
    np.testing.assert_allclose(rgb, expected, atol=1e-12)
    np.testing.assert_allclose(spaces.from_xyz(space) @ spaces.to_xyz(space), np.eye(3), atol=1e-12)


@pytest.mark.parametrize("space", THEIRS)
def test_agrees_with_colour_science(space: str) -> None:
    """To 1e-3: their whites are D65's chromaticity to four digits, ours is the table's."""
    colour = pytest.importorskip("colour")
    theirs = colour.RGB_COLOURSPACES[THEIRS[space]]
    np.testing.assert_allclose(spaces.from_xyz(space), theirs.matrix_XYZ_to_RGB, atol=1e-3)
    stated = np.reshape(spaces.chromaticities(space), (4, 2))
    np.testing.assert_allclose(stated[:3], theirs.primaries, atol=1e-12)
    np.testing.assert_allclose(stated[3], theirs.whitepoint, atol=5e-5)


def test_bradford_agrees_with_colour_science() -> None:
    adaptation = pytest.importorskip("colour.adaptation")
    whites = [illuminant("A").sample(cie.GRID), illuminant("F11").sample(cie.GRID)]
    source, target = (cie.spectrum_to_xyz(light) for light in whites)
    theirs = adaptation.matrix_chromatic_adaptation_VonKries(source, target, "Bradford")
    np.testing.assert_allclose(spaces.bradford(source, target), theirs, atol=1e-9)
    np.testing.assert_allclose(spaces.bradford(3.0 * source, target) @ source, target, rtol=1e-12)


@pytest.mark.parametrize("source", spaces.SPACES)
def test_between_keeps_white(source: str) -> None:
    one = spaces.from_xyz(source) @ spaces.white(source)
    np.testing.assert_allclose(spaces.between(source, "rec709") @ one, 1.0, atol=1e-12)


@pytest.mark.parametrize("kelvin", [4000.0, 5003.0, 6504.0, 7000.0, 9300.0, 25000.0])
def test_daylight_agrees_with_colour_science(kelvin: float) -> None:
    colour = pytest.importorskip("colour")
    theirs = colour.temperature.CCT_to_xy_CIE_D(kelvin)
    np.testing.assert_allclose(spaces.xy_of_temperature(kelvin), theirs, atol=1e-9)


@pytest.mark.parametrize("kelvin", [1000.0, 2000.0, 2856.0, 3999.0])
def test_black_bodies_agree_with_colour_science(kelvin: float) -> None:
    """4e-5: they sum from 360 to 780 nm, here it is to 830 nm."""
    colour = pytest.importorskip("colour")
    shape = colour.SpectralShape(360, 780, 1)
    xyz = colour.sd_to_XYZ(colour.sd_blackbody(kelvin, shape), method="Integration")
    np.testing.assert_allclose(spaces.xy_of_temperature(kelvin), colour.XYZ_to_xy(xyz), atol=4e-5)


def test_unknown_spaces_are_refused() -> None:
    for function in (spaces.white, spaces.to_xyz, spaces.from_xyz, spaces.chromaticities):
        with pytest.raises(UnknownKindError, match="display_p3"):
            function("display p3")
