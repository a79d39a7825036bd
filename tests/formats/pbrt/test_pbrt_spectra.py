"""Colours and spectra of PBRT files against numbers from elsewhere."""

from __future__ import annotations

import colour
import pytest

from clpt import spectra
from clpt.errors import SceneError
from clpt.formats.pbrt.spectra import named, names, spectrum, to_rec709
from clpt.scene.roles import NAMED
from clpt.spectra import cie, scaled
from tests.formats.pbrt.directives import params, state


def take(role, *value, space="srgb", folder=None):
    at = state() if folder is None else state(folder)
    at.colour_space = space
    return spectrum(params(x=value), "x", NAMED[role], at)


def luminance(made):
    """Of an emission, by the 1931 observer of colour-science; the constant 1 has luminance 1."""
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    values = made.sample(observer.wavelengths)
    return float((values * observer.values[:, 1]).sum() / observer.values[:, 1].sum())


@pytest.mark.parametrize(
    "space, theirs",
    [("rec2020", "ITU-R BT.2020"), ("dci-p3", "Display P3"), ("aces2065-1", "ACES2065-1")],
)
def test_colour_spaces(space, theirs):
    rgb = [0.3, 0.5, 0.25]
    for light in (False, True):
        adapt = None if light else "Bradford"
        wanted = colour.RGB_to_RGB(
            rgb, colour.RGB_COLOURSPACES[theirs], colour.RGB_COLOURSPACES["sRGB"], adapt
        )
        assert to_rec709(rgb, space, light=light) == pytest.approx(wanted, abs=4e-4)
    assert to_rec709([1, 1, 1], space, light=False) == pytest.approx([1, 1, 1], abs=1e-6)


def test_colours_beyond_rec709_are_told():
    at = state()
    at.colour_space = "rec2020"
    dull = spectrum(params(x=("rgb", 0.5, 0.4, 0.4)), "x", NAMED["reflectance"], at)
    assert not at.shared.warnings and dull == pytest.approx((0.57, 0.39, 0.4), abs=0.02)
    green = spectrum(params(x=("rgb", 0.0, 0.9, 0.0)), "x", NAMED["reflectance"], at)
    assert green[0] == 0.0 and "Rec. 709" in at.shared.warnings[0]


def test_lights_have_luminance_one(tmp_path):
    (tmp_path / "lamp.spd").write_text("400 3\n500 7\n600 2\n")
    for value in (
        ("blackbody", 2700.0),
        ("spectrum", 400.0, 1.0, 500.0, 8.0, 700.0, 3.0),
        ("spectrum", "stdillum-F11"),
        ("spectrum", "illum-acesD60"),
        ("spectrum", "lamp.spd"),
    ):
        made = take("emission", *value, folder=tmp_path)
        assert luminance(made) == pytest.approx(1.0, abs=2e-4), value
        assert luminance(scaled(made, 3.0)) == pytest.approx(3.0, abs=6e-4)
    grey = take("emission", "rgb", 2.0, 2.0, 2.0)
    assert luminance(grey) == pytest.approx(2.0, abs=4e-3)
    assert grey.to_rgb("emission") == pytest.approx([2.0, 2.0, 2.0])


def test_blackbody_has_its_colour():
    made = take("emission", "blackbody", 5000.0)
    xyz = cie.spectrum_to_xyz(made.sample(cie.GRID))
    wanted = colour.temperature.CCT_to_xy(5000.0, method="Kang 2002")
    assert xyz[:2] / xyz.sum() == pytest.approx(wanted, abs=1e-3)


def test_aces_white():
    xyz = cie.spectrum_to_xyz(named("illum-acesD60").sample(cie.GRID))
    assert xyz[:2] / xyz.sum() == pytest.approx([0.32168, 0.33767], abs=1e-3)


def test_inline_spectra_end_or_hold():
    pairs = ("spectrum", 500.0, 0.2, 600.0, 0.4)
    assert take("reflectance", *pairs).sample([450.0, 550.0]) == pytest.approx([0.0, 0.3])
    assert take("index", *pairs).sample([450.0, 550.0]) == pytest.approx([0.2, 0.3])


def test_metals_and_glasses_by_name():
    """Indices at the sodium line: Rakic 1998 and Schott's data sheets, as pbrt has them."""
    assert named("glass-BK7").sample(589.3) == pytest.approx(1.51673, abs=2e-5)
    assert named("glass-LASF9").sample(589.3) == pytest.approx(1.85004, abs=5e-5)
    assert named("glass-BAF10").sample(589.3) == pytest.approx(1.66988, abs=5e-5)
    assert named("glass-FK51A").sample(589.3) == pytest.approx(1.48651, abs=5e-5)
    assert named("glass-F5").sample(589.3) == pytest.approx(1.67254, abs=5e-5)
    assert named("glass-F10").sample(589.3) == pytest.approx(1.72806, abs=5e-5)
    assert named("glass-F11").sample(589.3) == pytest.approx(1.78448, abs=5e-4)
    assert named("metal-Au-k") == spectra.metal("Au")[1]
    assert named("metal-Unobtainium-k") is None
    assert all(named(name) is not None for name in names())


@pytest.mark.parametrize(
    "value, message",
    [
        (("spectrum", "metal-Gold-eta"), "metal-"),
        (("spectrum", 400.0, 1.0, 500.0), "pairs"),
        (("spectrum", 500.0, 1.0, 400.0, 1.0), "ascend"),
        (("rgb", 0.1, 0.2), "3 numbers"),
        (("rgb", 0.1, -0.2, 0.0), "negative"),
        (("rgb", 0.1, 1.2, 0.0), "exceed 1"),
        (("blackbody", -5.0), "positive"),
        (("point3", 1.0, 1.0, 1.0), "type"),
    ],
)
def test_what_is_no_spectrum_is_told(value, message):
    with pytest.raises(SceneError, match=message) as caught:
        take("reflectance", *value)
    assert caught.value.line == 1


def test_dark_lights_are_refused():
    with pytest.raises(SceneError, match="dark"):
        take("emission", "spectrum", 1000.0, 1.0, 1100.0, 1.0)
