"""clpt.spectra.upsampling: colours survive the round trip through a spectrum."""

import numpy as np
import pytest

from clpt import spectra
from clpt.spectra import cie, upsampling
from clpt.spectra.make_data import lab
from clpt.spectra.spectrum import d65
from clpt.spectra.upsampling import evaluate

N = 3000
WORST = 0.3  # Delta E 1976 under D65


def delta_e(rgb):
    lit = evaluate(spectra.uplift(rgb), cie.GRID) * d65().sample(cie.GRID)
    difference = lab(cie.spectrum_to_xyz(lit))[0] - lab(cie.rgb_to_xyz(rgb))[0]
    return np.linalg.norm(difference, axis=-1)


def colours(kind):
    rng = np.random.default_rng(3)
    rgb = rng.random((N, 3))
    rows, axis = np.arange(N), rng.integers(0, 3, N)
    if kind == "display-encoded":
        return rgb**2.2
    if kind == "dark":
        return 0.02 * rgb**2.2
    if kind == "near white":
        return 1.0 - 0.05 * rgb
    if kind == "edges":
        rgb = np.where(rgb > 0.5, 1.0, 0.0)
        rgb[rows, axis] = rng.random(N)
    elif kind.startswith("faces"):
        rgb[rows, axis] = float(kind[-1])
    return rgb


@pytest.mark.parametrize(
    "kind", ["linear", "display-encoded", "dark", "near white", "faces 0", "faces 1", "edges"]
)
def test_round_trip(kind):
    error = delta_e(colours(kind))
    assert error.max() < WORST
    assert error.mean() < 0.1


def test_corners():
    corners = np.array(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0])).reshape(3, -1).T
    assert delta_e(corners).max() < 0.1


def test_lab_jacobian():
    xyz = np.random.default_rng(1).random((50, 3)) ** 3
    value, jacobian = lab(xyz)
    step = 1e-7 * np.random.default_rng(2).random((50, 3))
    change = lab(xyz + step)[0] - value
    np.testing.assert_allclose(np.einsum("nij,nj->ni", jacobian, step), change, atol=1e-8)


def test_lab_agrees_with_colour_science():
    colour = pytest.importorskip("colour")
    xyz = np.random.default_rng(1).random((50, 3)) ** 3
    x, y, z = cie.D65_WHITE
    theirs = colour.XYZ_to_Lab(xyz, np.array([x, y]) / (x + y + z))
    np.testing.assert_allclose(lab(xyz)[0], theirs, atol=1e-3)


def test_greys_are_flat():
    grey = np.linspace(0.0, 1.0, 777)
    values = evaluate(spectra.uplift(np.repeat(grey[:, None], 3, 1)), np.linspace(300, 1000, 90))
    np.testing.assert_allclose(values, np.repeat(grey[:, None], 90, 1), atol=1e-6)


def test_black_white_and_out_of_range():
    black, white, over, under, nan = evaluate(
        spectra.uplift([[0, 0, 0], [1, 1, 1], [9, 2, 1e30], [-1, -0.1, -9], [np.nan] * 3]), cie.GRID
    )
    np.testing.assert_allclose(black, 0.0, atol=1e-7)
    for row, expected in ((white, 1.0), (over, white), (under, black), (nan, black)):
        np.testing.assert_allclose(row, expected, atol=1e-7)


def test_reflectances_stay_in_range_in_float32():
    c = spectra.uplift(np.random.default_rng(5).random((N, 3)) ** 4)
    lambdas = np.arange(300, 1001, 10, dtype=np.float32)
    x = (c[:, :1] * lambdas + c[:, 1:2]) * lambdas + c[:, 2:]
    values = np.float32(0.5) + np.float32(0.5) * x / np.sqrt(np.float32(1) + x * x)
    assert np.isfinite(values).all() and values.min() >= 0 and values.max() <= 1
    np.testing.assert_allclose(values, evaluate(c, lambdas), atol=2e-4)


def test_continuous_across_the_largest_component():
    rgb = np.array([[0.6, 0.6, 0.2], [0.3, 0.7, 0.7], [0.5, 0.1, 0.5]])
    tilt = np.array([1e-7, -1e-7, 0.0])
    tilted = np.concatenate([rgb + tilt, rgb - tilt[[1, 2, 0]]])
    values = evaluate(spectra.uplift(tilted), cie.GRID)
    np.testing.assert_allclose(values[:3], values[3:], atol=0.02)


@pytest.mark.parametrize("kind", [upsampling.node_values, upsampling.node_ratios])
def test_cells_are_those_of_a_search(kind):
    nodes, parts = upsampling._axis(kind)
    beside = np.concatenate([nodes, np.nextafter(nodes, -1.0), np.nextafter(nodes, 2.0)])
    at = np.concatenate([np.clip(beside, 0.0, 1.0), np.linspace(0.0, 1.0, 20_001)])
    cells = np.clip(np.searchsorted(nodes, at, "right") - 1, 0, len(nodes) - 2)
    assert np.array_equal(upsampling._cells_of(nodes, parts, at), cells)


def test_shapes_and_unbounded():
    image = np.random.default_rng(0).random((4, 5, 3))
    assert spectra.uplift(image).shape == (4, 5, 3) and spectra.uplift(image).dtype == np.float32
    scale, c = spectra.unbounded(image * 40)
    assert scale.shape == (4, 5)
    np.testing.assert_allclose(scale, 80 * image.max(-1), rtol=1e-6)
    np.testing.assert_array_equal(c, spectra.uplift(image / (2 * image.max(-1, keepdims=True))))
    scale, c = spectra.unbounded([0.0, 0.0, 0.0])
    assert scale == 0 and np.isfinite(c).all()
