"""Every phase function integrates to one, and samples what it says.

The table of kinds is clpt.scene.media.PHASES: a kind is tested by being listed.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from clpt.scene import media
from tests.kernels.harness import Probe
from tests.rotation import rotating

SETTINGS = {
    media.Isotropic: [{}],
    media.HenyeyGreenstein: [{"g": g} for g in (-0.95, -0.3, 0.0, 1e-4, 0.002, 0.6, 0.99)],
    media.Rayleigh: [{}],
}
CASES = [(cls, given) for cls in media.PHASES for given in SETTINGS[cls]]
SIGNIFICANCE = 1.0 - (1.0 - 1e-3) ** (1.0 / len(CASES))  # chance of a false alarm: 1e-3 (Sidak)
WO = np.array([[0.0, 0.0, 1.0]])
BINS = 40


def formula(cls, given, cos):
    """Phase functions [1/sr] in float64; cos: of the angle by which light turns."""
    if cls is media.Isotropic:
        return np.full_like(cos, 0.25 / np.pi)
    if cls is media.Rayleigh:
        return 3.0 / (16.0 * np.pi) * (1.0 + cos**2)
    g = given["g"]
    return (1.0 - g * g) / (4.0 * np.pi * (1.0 + g * g - 2.0 * g * cos) ** 1.5)


def directions(cos, turn):
    sine = np.sqrt(1.0 - cos**2)
    return np.stack([sine * np.cos(turn), sine * np.sin(turn), -cos], axis=1)


@rotating("cls, lanes", media.PHASES, [1, 8, 16], turn=lambda cls: media.PHASES.index(cls) % 3)
def test_is_its_formula(cls, lanes):
    rng = np.random.default_rng(5)
    cos = np.concatenate([rng.uniform(-1.0, 1.0, 500), [-1.0, 1.0]])
    wi = directions(cos, rng.uniform(0.0, 6.0, 502))
    for given in SETTINGS[cls]:
        got = Probe(cls, "rgb", lanes)(given, WO, wi, np.full((1, 3), 0.5))
        expected = formula(cls, given, cos)
        # near its peak HG turns the rounding of a direction into 3 / (1 - g)^2 times as much
        bound = 1e-5 + 1e-6 / (1.0 - abs(given.get("g", 0.0))) ** 2
        np.testing.assert_allclose(got["pdf"], expected, rtol=bound)
        np.testing.assert_allclose(got["eval"], np.repeat(expected[:, None], 3, 1), rtol=bound)


@pytest.mark.parametrize("cls, given", CASES)
def test_samples_follow_it(cls, given):
    """Chi-square over the cosine and over the azimuth, bins of equal chance."""
    rng = np.random.default_rng(11)
    u = rng.random((200_000, 3))
    got = Probe(cls, "rgb")(given, WO, WO, u)
    cos, turn = -got["wi"][:, 2].astype(float), np.arctan2(got["wi"][:, 1], got["wi"][:, 0])
    np.testing.assert_allclose(np.linalg.norm(got["wi"], axis=1), 1.0, atol=2e-6)
    assert (got["weight"] == 1.0).all()
    grid = np.concatenate([np.linspace(-1, 0.9, 20001), 1 - np.geomspace(0.1, 1e-9, 20000), [1.0]])
    if given.get("g", 0.0) < 0.0:
        grid = -grid[::-1]
    density = 2.0 * np.pi * formula(cls, given, grid)
    whole = np.concatenate([[0.0], np.cumsum(np.diff(grid) * 0.5 * (density[1:] + density[:-1]))])
    assert abs(whole[-1] - 1.0) < 1e-4
    edges = np.interp(np.linspace(0.0, whole[-1], BINS + 1), whole, grid)[1:-1]
    for values, ends in ((cos, edges), (turn, np.linspace(-np.pi, np.pi, BINS + 1)[1:-1])):
        counts = np.bincount(np.searchsorted(ends, values), minlength=BINS)
        p = stats.chisquare(counts).pvalue
        assert p > SIGNIFICANCE / 2.0, (cls.kind, given, p)
