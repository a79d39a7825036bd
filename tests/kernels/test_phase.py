"""Every phase function integrates to one, and samples what it says.

The table of kinds is clpt.scene.phases.LEAVES: a kind is tested by being listed, with the same
parameters at all wavelengths, and in both modes with others at each.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from clpt.scene import phases
from clpt.testing.probe import LAMBDAS
from tests.kernels.harness import Probe
from tests.rotation import rotating

BUMPS = np.cos(np.linspace(0.0, 9.0, 33)) + 1.1
COSINES = (-1.0, -0.95, -0.1, 0.0, 0.3, 0.9, 0.97, 1.0)
AT = np.sort(LAMBDAS)
SETTINGS = {
    phases.Isotropic: [{}],
    phases.HenyeyGreenstein: [{"g": g} for g in (-0.95, -0.3, 0.0, 1e-4, 0.002, 0.6, 0.99)],
    phases.Rayleigh: [{}],
    phases.Draine: [
        {"g": g, "alpha": alpha}
        for g, alpha in (
            (0.0, 1.0),
            (-0.9, 0.5),
            (0.1, 0.0),
            (0.249, 3.0),
            (0.7, 250.0),
            (0.97, 1.0),
        )
    ],
    phases.Reradiating: [{"reflectance": 1.0, "reradiation": 0.0, "amount": 1.0}],
    phases.Tabulated: [
        {"values": (1.0, 1.0)},
        {"values": BUMPS},
        {"values": (3.0, 0.0, 0.0, 1.0, 0.5, 0.7, 40.0, 200.0), "cosines": COSINES},
    ],
}
VARIED = {  # at the four wavelengths of the probe, or for three colours
    phases.HenyeyGreenstein: {"g": (0.8, 0.3, -0.5, 0.0)},
    phases.Draine: {"g": (0.8, 0.3, -0.5, 0.0), "alpha": (0.0, 1.0, 5.0, 0.3)},
    phases.Tabulated: {
        "values": [BUMPS, BUMPS[::-1], np.ones(33), np.linspace(0.0, 1.0, 33) ** 4],
        "wavelengths": (430.0, 500.0, 570.0, 640.0),
    },
}
CASES = [(cls, given) for cls in phases.LEAVES for given in SETTINGS[cls]]
VARIED_CASES = [(cls, mode) for cls in VARIED for mode in ("rgb", "spectral")]
TESTS = 2 * (len(CASES) + len(VARIED_CASES))
SIGNIFICANCE = 1.0 - (1.0 - 1e-3) ** (1.0 / TESTS)  # chance of a false alarm: 1e-3 (Sidak)
WO = np.array([[0.0, 0.0, 1.0]])
BINS = 40


def formula(cls, given, cos, part=0, mode="rgb"):
    """Phase functions [1/sr] in float64; cos: of the angle by which light turns; part: which of the
    probe's wavelengths or colours."""
    if cls is phases.Isotropic:
        return np.full_like(cos, 0.25 / np.pi)
    if cls is phases.Rayleigh:
        return 3.0 / (16.0 * np.pi) * (1.0 + cos**2)
    if cls is phases.Tabulated:
        made = phases.Tabulated(**given)
        cosines, rows, start, step = made.device_rows(mode == "spectral")
        at = (LAMBDAS[part] - start) / step if mode == "spectral" else part
        at = np.clip(at, 0, len(rows) - 1)
        low = min(int(at), max(len(rows) - 2, 0))
        high = min(low + 1, len(rows) - 1)
        return np.interp(cos, cosines, rows[low] + (at - low) * (rows[high] - rows[low]))
    g, alpha = (np.ravel(given.get(name, 0.0)) for name in ("g", "alpha"))
    g, alpha = g[min(part, len(g) - 1)], alpha[min(part, len(alpha) - 1)]
    hg = (1.0 - g * g) / (4.0 * np.pi * (1.0 + g * g - 2.0 * g * cos) ** 1.5)
    return hg * (1.0 + alpha * cos**2) / (1.0 + alpha * (1.0 + 2.0 * g * g) / 3.0)


def directions(cos, turn):
    sine = np.sqrt(1.0 - cos**2)
    return np.stack([sine * np.cos(turn), sine * np.sin(turn), -cos], axis=1)


@rotating("cls, lanes", phases.LEAVES, [1, 8, 16],
          turn=lambda cls: phases.LEAVES.index(cls) % 3)  # fmt: skip
def test_is_its_formula(cls, lanes):
    rng = np.random.default_rng(5)
    cos = np.concatenate([rng.uniform(-1.0, 1.0, 500), [-1.0, 1.0]])
    wi = directions(cos, rng.uniform(0.0, 6.0, 502))
    for given in SETTINGS[cls]:
        got = Probe(cls, "rgb", lanes)(given, WO, wi, np.full((1, 3), 0.5))
        expected = formula(cls, given, cos)
        # near its peak HG turns the rounding of a direction into 3 / (1 - g)^2 times as much
        bound = 1e-5 + 1e-6 / (1.0 - abs(given.get("g", 0.0))) ** 2
        if cls is phases.Tabulated:
            bound = 1e-3  # by what the cosine is rounded, in its steepest cell
        np.testing.assert_allclose(got["pdf"], expected, rtol=bound, atol=bound * expected.mean())
        np.testing.assert_allclose(
            got["eval"],
            np.repeat(expected[:, None], 3, 1),
            rtol=bound,
            atol=bound * expected.mean(),
        )


def density_grid(negative):
    grid = np.concatenate([np.linspace(-1, 0.9, 20001), 1 - np.geomspace(0.1, 1e-9, 20000), [1.0]])
    return -grid[::-1] if negative else grid


def assert_follows(cls, given, got, grid, density):
    """Chi-square over the cosine and over the azimuth, bins of equal chance; density: over the
    cosine, at the grid."""
    cos, turn = -got["wi"][:, 2].astype(float), np.arctan2(got["wi"][:, 1], got["wi"][:, 0])
    np.testing.assert_allclose(np.linalg.norm(got["wi"], axis=1), 1.0, atol=2e-6)
    whole = np.concatenate([[0.0], np.cumsum(np.diff(grid) * 0.5 * (density[1:] + density[:-1]))])
    assert abs(whole[-1] - 1.0) < 1e-4
    edges = np.interp(np.linspace(0.0, whole[-1], BINS + 1), whole, grid)[1:-1]
    for values, ends in ((cos, edges), (turn, np.linspace(-np.pi, np.pi, BINS + 1)[1:-1])):
        counts = np.bincount(np.searchsorted(ends, values), minlength=BINS)
        p = stats.chisquare(counts).pvalue
        assert p > SIGNIFICANCE, (cls.kind, given, p)


@pytest.mark.parametrize("cls, given", CASES)
def test_samples_follow_it(cls, given):
    rng = np.random.default_rng(11)
    got = Probe(cls, "rgb")(given, WO, WO, rng.random((200_000, 3)))
    np.testing.assert_allclose(got["weight"], 1.0, atol=1e-6)
    grid = density_grid(np.ravel(given.get("g", 0.0))[0] < 0.0)
    assert_follows(cls, given, got, grid, 2.0 * np.pi * formula(cls, given, grid))


@pytest.mark.parametrize("cls, mode", VARIED_CASES)
def test_samples_of_several_wavelengths(cls, mode):
    """The hero's density is sampled, or in RGB mode the mean of three; weights tell the others'."""
    given, parts = VARIED[cls], 3 if mode == "rgb" else 4
    if cls is not phases.Tabulated:
        given = {name: np.array(values[:parts]) for name, values in given.items()}
    rng = np.random.default_rng(12)
    got = Probe(cls, mode)(given, WO, WO, rng.random((200_000, 3)))
    grid = density_grid(False)
    densities = np.array([formula(cls, given, grid, part, mode) for part in range(parts)])
    sampled = densities[0] if mode == "spectral" else densities.mean(axis=0)
    assert_follows(cls, given, got, grid, 2.0 * np.pi * sampled)
    cos = -got["wi"][:, 2].astype(float)
    for part in range(parts):
        expected = formula(cls, given, cos, part, mode)
        np.testing.assert_allclose(got["eval_again"][:, part], expected, rtol=2e-3, atol=1e-4)
        weighed = got["weight"][:, part] * got["sampled_pdf"]
        np.testing.assert_allclose(weighed, got["eval_again"][:, part], rtol=1e-4, atol=1e-6)
