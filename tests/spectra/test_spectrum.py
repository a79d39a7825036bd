"""clpt.spectra.spectrum: formulas, and the RGB stand-ins against Mitsuba."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from clpt import spectra
from clpt.errors import SceneError
from clpt.spectra import cie
from clpt.spectra.spectrum import gridded, hat_means, primaries

ANY = np.array([300.0, 361.0, 555.5, 829.0, 1200.0])


def test_constant_and_tabulated():
    np.testing.assert_array_equal(spectra.Constant(2.5).sample(ANY), 2.5)
    table = spectra.Tabulated([400, 500, 700], [1, 3, 2])
    np.testing.assert_allclose(table.sample([399, 400, 450, 600, 701]), [0, 1, 2, 2.5, 0])
    held = dataclasses.replace(table, outside="hold")
    np.testing.assert_allclose(held.sample([399, 701]), [1, 2])
    assert table.sample(450.0).shape == ()
    assert table == spectra.Tabulated((400, 500, 700), np.array([1, 3, 2]))
    assert hash(table) != hash(held)


@pytest.mark.parametrize("shape", [(), (1,), (5,), (2, 3)])
@pytest.mark.parametrize(
    "spectrum",
    [
        spectra.Constant(1.0),
        spectra.Tabulated([400, 500], [1, 2]),
        spectra.RGB(0.2, 0.5, 0.9),
        spectra.RGBUnbounded(1.0, 1.5, 2.0),
        spectra.RGBIlluminant(1.0, 1.5, 2.0),
        spectra.Cauchy(1.5, 0.005),
        spectra.glass("bk7"),
        spectra.Blackbody(3000.0),
        spectra.LED(450.0, 20.0),
        spectra.Lines([450.0], [1.0]),
    ],
    ids=lambda value: type(value).__name__,
)
def test_values_have_the_shape_of_the_wavelengths(spectrum, shape):
    values = spectrum.sample(np.full(shape, 450.0))
    assert np.shape(values) == shape and np.asarray(values).dtype == np.float64


@pytest.mark.parametrize(
    "lambdas, values, message",
    [
        ([400, 400], [1, 2], "ascend"),
        ([400, 500], [1], "as many"),
        ([], [], "as many"),
        ([400, 500], [1, np.nan], "finite"),
    ],
)
def test_bad_tables_are_refused(lambdas, values, message):
    with pytest.raises(SceneError, match=message):
        spectra.Tabulated(lambdas, values)


def test_indices():
    bk7 = spectra.glass("bk7")
    np.testing.assert_allclose(
        bk7.sample([486.1327, 587.5618, 656.2725]), [1.52238, 1.51680, 1.51432], atol=1e-5
    )
    np.testing.assert_allclose(spectra.Cauchy(1.5, 0.004, 1e-4).sample(500.0), 1.5176)
    assert np.isfinite(bk7.sample(np.arange(1.0, 1e5, 7.0))).all()


def test_rgb_is_itself_to_an_rgb_renderer():
    for kind in (spectra.RGB, spectra.RGBUnbounded, spectra.RGBIlluminant):
        np.testing.assert_array_equal(kind(0.2, 0.5, 0.9).to_rgb("emission"), [0.2, 0.5, 0.9])


@pytest.mark.parametrize("rgb", [(0.1, 0.5, 0.9), (1.0, 1.0, 1.0), (0.8, 0.02, 0.3)])
def test_rgb_spectra_have_their_colour(rgb):
    tolerance = 4e-3
    seen = spectra.Tabulated(cie.GRID, spectra.RGB(*rgb).sample(cie.GRID)).to_rgb("reflectance")
    np.testing.assert_allclose(seen, rgb, atol=tolerance)
    bright = spectra.RGBIlluminant(*(7.0 * np.array(rgb))).sample(cie.GRID)
    seen = cie.xyz_to_rgb(cie.spectrum_to_xyz(bright))
    np.testing.assert_allclose(seen, 7.0 * np.array(rgb), atol=14.0 * tolerance)
    eta = spectra.RGBUnbounded(*(3.0 * np.array(rgb))).sample(cie.GRID)
    seen = spectra.Tabulated(cie.GRID, eta).to_rgb("unbounded")
    np.testing.assert_allclose(seen, 3.0 * np.array(rgb), atol=6.0 * tolerance)


def test_white_illuminant_is_d65():
    white = spectra.RGBIlluminant(1.0, 1.0, 1.0).sample(ANY)
    np.testing.assert_allclose(white, spectra.illuminant("D65").sample(ANY), rtol=1e-4)


def test_on_grid_covers_the_range():
    grid = spectra.on_grid(spectra.Cauchy(0.0, 1.0), 360.0, 830.0)
    assert grid.dtype == np.float32 and grid.shape == (471,)
    assert spectra.on_grid(spectra.Constant(1.0), 360.0, 830.5, 2.0).shape == (237,)
    with pytest.raises(SceneError):
        spectra.on_grid(spectra.Constant(1.0), 830.0, 360.0)


PAIRS = [(400.0, 1.0), (500.0, 2.0), (600.0, 3.0), (700.0, 4.0)]


@pytest.fixture(scope="module")
def mitsuba_rgb():
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    return mi


def test_roles_agree_with_mitsuba(mitsuba_rgb):
    """Mitsuba's sum over 1000 points drops 0.1%; its observer is tabulated every 5 nm."""
    mi = mitsuba_rgb
    lambdas, values = (list(column) for column in zip(*PAIRS, strict=True))
    ours = spectra.Tabulated(lambdas, values)

    def theirs(holder, parameter, spectrum):
        node = mi.load_dict(holder | {parameter: {"type": "spectrum", "value": spectrum}})
        return np.ravel(mi.traverse(node)[f"{parameter}.value"])

    emitter, diffuse, conductor = {"type": "point"}, {"type": "diffuse"}, {"type": "conductor"}
    np.testing.assert_allclose(
        ours.to_rgb("emission"), theirs(emitter, "intensity", PAIRS), rtol=3e-3
    )
    np.testing.assert_allclose(ours.to_rgb("unbounded"), theirs(conductor, "eta", PAIRS), rtol=3e-3)
    dim = spectra.Tabulated(lambdas, np.array(values) / 10)
    np.testing.assert_allclose(
        dim.to_rgb(), theirs(diffuse, "reflectance", [(x, y / 10) for x, y in PAIRS]), rtol=3e-3
    )
    np.testing.assert_allclose(
        spectra.Constant(2.0).to_rgb("emission"), theirs(emitter, "intensity", 2.0), rtol=1e-3
    )


@pytest.mark.parametrize("name", ["Au", "Cu"])
def test_metals_agree_with_mitsuba(mitsuba_rgb, name):
    """Same file, same RGB: for its own files Mitsuba leaves D65 out, as if they were emission.

    Our table is another measurement and seen under D65, so it is compared as a reflectance.
    """
    mi = mitsuba_rgb
    params = mi.traverse(mi.load_dict({"type": "conductor", "material": name}))
    folder = Path(mi.__file__).parent / "data" / "ior"
    expected = [np.ravel(params[f"{part}.value"]) for part in ("eta", "k")]
    for part, rgb in zip(("eta", "k"), expected, strict=True):
        same_file = spectra.read_table(folder / f"{name}.{part}.spd", "hold")
        np.testing.assert_allclose(same_file.to_rgb("emission"), rgb, rtol=3e-3)
    ours = [part.to_rgb("unbounded") for part in spectra.metal(name)]
    np.testing.assert_allclose(normal_incidence(*ours), normal_incidence(*expected), atol=0.08)


def normal_incidence(eta, k):
    return ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)


def test_emission_agrees_with_mitsuba_spectral():
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_spectral")
    si = mi.SurfaceInteraction3f()
    colour = (0.2, 0.3, 0.9)
    pairs = [
        (spectra.illuminant("D65"), {"type": "d65"}, 2e-3),
        (spectra.Blackbody(5000.0), {"type": "blackbody", "temperature": 5000.0}, 1e-4),
        (
            spectra.RGBIlluminant(*colour),
            {"type": "d65", "color": {"type": "rgb", "value": list(colour)}},
            0.03,
        ),
    ]
    for ours, spectrum, tolerance in pairs:
        node = mi.load_dict(spectrum)
        for wavelength in (370.0, 450.0, 555.0, 640.0, 700.0):
            si.wavelengths = [wavelength] * 4
            assert ours.sample(wavelength) == pytest.approx(node.eval(si)[0], rel=tolerance)


def test_absorption_of_an_extinction_coefficient() -> None:
    """Water at 550 nm, k = 1.96e-9 (Hale and Querry 1973): 0.0448 per metre."""
    a = spectra.absorption(spectra.Constant(1.96e-9))
    np.testing.assert_allclose(a.sample([550.0]), 0.04478, rtol=1e-3)
    np.testing.assert_allclose(a.sample([400.0]) / a.sample([800.0]), 2.0)
    assert spectra.absorption(spectra.Constant(0.0)) == spectra.Constant(0.0)


GRID = np.arange(360.0, 831.0)


@pytest.mark.parametrize("fwhm", [0.3, 0.5, 1.0, 5.0])
@pytest.mark.parametrize("at", [546.0, 546.25, 546.5])
def test_a_fine_table_keeps_its_power_on_a_coarse_grid(fwhm, at):
    fine = np.arange(5300.0, 5601.0) / 10.0
    line = np.exp(-4.0 * np.log(2.0) * ((fine - at) / fwhm) ** 2)
    lamp = spectra.Tabulated(fine, line)
    power = np.trapezoid(line, fine)
    assert np.trapezoid(gridded(lamp, GRID), GRID) == pytest.approx(power, rel=1e-9)
    xyz = np.trapezoid(spectra.cie_xyz(fine) * line[:, None], fine, axis=0) / spectra.CIE_Y_INTEGRAL
    expected = np.maximum(spectra.xyz_to_rgb(xyz), 0.0)
    expected *= xyz[1] / spectra.luminance(expected)  # beyond Rec. 709, but as bright
    np.testing.assert_allclose(lamp.to_rgb("emission"), expected, rtol=5e-3, atol=1e-9)


@pytest.mark.parametrize("lo, hi", [(588.9, 589.7), (589.0, 590.0), (360.0, 830.0)])
@pytest.mark.parametrize("lamp", [spectra.illuminant("sodium"), spectra.Lines([359.6], [1.0])])
def test_the_ends_of_a_grid_are_exact(lo, hi, lamp):
    grid = np.linspace(lo, hi, max(101, round(hi - lo) + 1))
    fine = np.linspace(lo, hi, 470_001)
    expected = np.trapezoid(lamp.sample(fine), fine)
    found = np.trapezoid(gridded(lamp, grid), grid)
    assert found == pytest.approx(expected, rel=1e-6, abs=1e-12)


def test_tables_are_sampled_where_the_grid_has_all_their_points():
    table = spectra.Tabulated([400, 500, 700], [1, 3, 2])
    np.testing.assert_array_equal(gridded(table, GRID), table.sample(GRID))


def test_means_stay_within_the_limits_of_a_table():
    """A table of random steps between 0 and 1; between the ends straight lines stay."""
    rng = np.random.default_rng(1)
    at = np.sort(rng.uniform(340.0, 850.0, 3000))
    means = hat_means(at, rng.integers(0, 2, 3000).astype(float), GRID)
    assert means.min() >= -1e-12 and means.max() <= 1.0 + 1e-12
    line = hat_means(at, 2.0 * at - 3.0, GRID)
    np.testing.assert_allclose(line[1:-1], 2.0 * GRID[1:-1] - 3.0, rtol=1e-9)


def test_primaries_add_up_to_white():
    rows = np.stack([one.sample(cie.GRID) for one in primaries()])
    assert rows.min() >= 0.0
    np.testing.assert_allclose(rows.sum(axis=0), 1.0, atol=2e-7)
    seen = [spectra.Tabulated(cie.GRID, row).to_rgb("unbounded") for row in rows]
    np.testing.assert_allclose(seen, np.eye(3), atol=1e-6)
