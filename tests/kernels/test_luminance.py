"""The luminance that tints are divided by, against sums over the whole spectrum."""

from __future__ import annotations

import numpy as np

from clpt import spectra
from clpt.spectra import RGB, cie
from tests.kernels.harness import map_text, run

FILES = ("core/luminance.cl",)
NODES = "Spectrum s = luminance_lambdas(); r[0] = s.x; r[1] = s.y; r[2] = s.z; r[3] = s.w;"
VALUE = "Spectrum s = {x[0], x[1], x[2], x[3]}; r[0] = luminance_of(s);"


def luminances(values: np.ndarray) -> np.ndarray:
    """Luminance (n,) of reflectances (n, 4) at the kernels' own wavelengths."""
    text = map_text(VALUE, 4, 1, "spectral", FILES)
    return run(text, 8, values.T.astype(np.float32), 1)[0]


def nodes() -> np.ndarray:
    """Those wavelengths, (4,) [nm]."""
    return run(map_text(NODES, 1, 4, "spectral", FILES), 8, np.zeros((1, 1)), 4)[:, 0]


def test_polynomials_of_the_seventh_degree_are_exact():
    weight = cie.cie_xyz(cie.GRID)[:, 1] * spectra.illuminant("D65").sample(cie.GRID)
    powers = [((x - 560.0) / 200.0)[:, None] ** np.arange(8) for x in (nodes(), cie.GRID)]
    expected = weight @ powers[1] / weight.sum()
    np.testing.assert_allclose(luminances(powers[0].T), expected, atol=2e-5)


def test_colours_have_the_luminance_of_their_rgb():
    rgb = np.random.default_rng(3).random((200, 3))
    at = np.array([RGB(*c).sample(nodes()) for c in rgb])
    ratio = luminances(at) / (rgb @ [0.2126, 0.7152, 0.0722])
    assert np.abs(ratio - 1.0).mean() < 0.015
    assert np.abs(ratio - 1.0).max() < 0.2


def test_rgb_has_rec_709s():
    text = map_text("Spectrum s = {x[0], x[1], x[2]}; r[0] = luminance_of(s);", 3, 1, "rgb", FILES)
    made = run(text, 8, np.eye(3, dtype=np.float32), 1)[0]
    np.testing.assert_allclose(made, [0.2126, 0.7152, 0.0722], rtol=1e-6)
