"""Every material kind samples what its pdf says, and its weight is eval over pdf.

The table of kinds is clpt.scene.materials.LEAVES: a kind is tested by being listed.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from clpt.scene.materials import LEAVES
from tests.kernels.harness import COMPONENTS, Probe
from tests.kernels.settings import pairs, settings, tilted

DELTA, TRANSMIT, DISPERSE = 4, 2, 8
MODES = tuple(COMPONENTS)
SETTINGS, ANGLES = 4, (25.0, 75.0, 140.0)
SAMPLES, THETA, PHI, FINE = 60_000, 16, 24, 12
# chance that any one of all chi-square tests fails where all is right: 1e-3 (Sidak)
TESTS = len(LEAVES) * len(MODES) * SETTINGS * len(ANGLES)
SIGNIFICANCE = 1.0 - (1.0 - 1e-3) ** (1.0 / TESTS)

kinds = pytest.mark.parametrize("cls", LEAVES, ids=lambda cls: cls.kind)
modes = pytest.mark.parametrize("mode", MODES)


def _fine_grid():
    """Midpoints (n, 3) of FINE x FINE cells in every bin of theta and phi; their solid angles."""
    theta = (np.arange(THETA * FINE) + 0.5) / (THETA * FINE) * np.pi
    phi = (np.arange(PHI * FINE) + 0.5) / (PHI * FINE) * 2.0 * np.pi
    t, p = (a.ravel() for a in np.meshgrid(theta, phi, indexing="ij"))
    w = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=1)
    return w, np.sin(t) * np.pi / (THETA * FINE) * 2.0 * np.pi / (PHI * FINE)


def _in_bins(values):
    """Sums (THETA * PHI,) of values on the fine grid."""
    return values.reshape(THETA, FINE, PHI, FINE).sum(axis=(1, 3)).ravel()


def _bin_of(w):
    t = np.arccos(np.clip(w[:, 2], -1.0, 1.0)) / np.pi * THETA
    p = (np.arctan2(w[:, 1], w[:, 0]) / (2.0 * np.pi)) % 1.0 * PHI
    return np.minimum(t.astype(int), THETA - 1) * PHI + np.minimum(p.astype(int), PHI - 1)


def _p_value(observed, expected):
    """Chi-square with bins of few expected samples put together."""
    order = np.argsort(expected)
    o, e = observed[order], expected[order]
    few = int(np.searchsorted(np.cumsum(e), 10.0)) + 1
    few = max(few, int(np.searchsorted(e, 5.0)))
    o, e = np.append(o[few:], o[:few].sum()), np.append(e[few:], e[:few].sum())
    if len(o) < 2:
        return 1.0
    return chi2.sf(np.sum((o - e) ** 2 / np.maximum(e, 1e-9)), len(o) - 1)


@kinds
@modes
def test_samples_follow_the_pdf(cls, mode):
    rng, probe = np.random.default_rng(17), Probe(cls, mode)
    grid, solid = _fine_grid()
    for params in settings(cls, mode, rng, SETTINGS):
        for angle in ANGLES:
            wo = tilted(angle)[None]
            density = probe(params, wo, grid, grid)["pdf"]
            expected = _in_bins(density.astype(float) * solid)
            sampled = probe(params, wo, wo, rng.random((SAMPLES, 3)))
            spread = (sampled["sampled_pdf"] > 0.0) & (sampled["lobe"] & DELTA == 0)
            counts = np.bincount(_bin_of(sampled["wi"][spread]), minlength=THETA * PHI)
            total = expected.sum()
            assert total < 1.005, f"pdf integrates to {total:.4f} at {angle} degrees, {params}"
            rest = max(0.0, 1.0 - total)
            p = _p_value(
                np.append(counts, SAMPLES - spread.sum()), SAMPLES * np.append(expected, rest)
            )
            assert p > SIGNIFICANCE, f"p = {p:.1e} at {angle} degrees, {params}"


@kinds
@modes
def test_weight_is_eval_over_pdf(cls, mode):
    rng, probe = np.random.default_rng(3), Probe(cls, mode)
    for params in settings(cls, mode, rng, SETTINGS):
        wo, _ = pairs(rng, 2000)
        r = probe(params, wo, wo, rng.random((len(wo), 3)))
        spread = (r["sampled_pdf"] > 1e-3) & (r["lobe"] & DELTA == 0)
        r = {k: v[spread] for k, v in r.items()}
        np.testing.assert_allclose(r["sampled_pdf"], r["pdf_again"], rtol=2e-3)
        product = r["weight"] * r["sampled_pdf"][:, None]
        np.testing.assert_allclose(product, r["eval_again"], rtol=3e-3, atol=1e-5)


@kinds
@modes
def test_lobes_are_told_truly(cls, mode):
    rng, probe = np.random.default_rng(4), Probe(cls, mode)
    for i, params in enumerate(settings(cls, mode, rng, SETTINGS)):
        wo, wi = pairs(rng, 2000)
        r = probe(params, wo, wi, rng.random((len(wo), 3)))
        made = r["sampled_pdf"] > 0.0
        crossed = (wo[:, 2] * r["wi"][:, 2] < 0.0)[made]
        assert np.array_equal(crossed, (r["lobe"][made] & TRANSMIT) != 0)
        assert np.all(r["eta"][made][~crossed] == 1.0)
        assert np.all(r["sampled_pdf"][made & (r["lobe"] & DELTA != 0)] <= 1.0)
        np.testing.assert_allclose(np.linalg.norm(r["wi"][made], axis=1), 1.0, atol=1e-5)
        assert np.all(r["eval"] >= 0.0) and np.all(r["pdf"] >= 0.0)
        if 2 * i < SETTINGS:  # the pdf is the hero's; other wavelengths may go where it cannot
            assert np.all(r["eval"][r["pdf"] == 0.0] < 1e-6)


@kinds
@pytest.mark.parametrize("lanes", [1, 8])
@modes
def test_lanes_agree(cls, lanes, mode):
    rng = np.random.default_rng(8)
    (params,) = settings(cls, mode, rng, 1)
    wo, wi = pairs(rng, 500)
    u = rng.random((len(wo), 3))
    wide, narrow = (Probe(cls, mode, n)(params, wo, wi, u) for n in (16, lanes))
    for name, value in wide.items():
        np.testing.assert_allclose(narrow[name], value, rtol=2e-5, atol=2e-6, err_msg=name)
