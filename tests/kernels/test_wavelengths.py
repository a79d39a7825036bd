"""Wavelengths from a tabulated density: what is drawn follows it, and it is as it is said to be."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from clpt.render.spectra.find import Density
from tests.kernels.scene_harness import SceneProbe, scene_files

SIGNIFICANCE = 1e-4
BODY = """
    Wavelengths w = wavelengths_sample(scene, x[0]);
    r[0] = w.x; r[1] = w.y; r[2] = w.z; r[3] = w.w; r[4] = density_pdf(scene, x[1]);
"""
READ = '#include "spectra/spectral.cl#read"\n#include "spectra/wavelengths.cl#density"\n'
NODES = np.linspace(300.0, 829.5, 531)


def spiked() -> Density:
    """A line on a slope, and a stretch with next to nothing."""
    values = 1.0 + (NODES - 300.0) / 300.0
    values[np.abs(NODES - 589.0) < 2.0] = 400.0
    values[(NODES > 400.0) & (NODES < 440.0)] = 1e-3
    whole = np.sum((values[1:] + values[:-1]) / 2.0) * (NODES[1] - NODES[0])
    return Density(300.0, 829.5, values / whole)


def probe(density: Density, lanes: int = 8, before: int = 5) -> SceneProbe:
    """Behind some other words, as behind a filter's table."""
    return SceneProbe(
        BODY,
        2,
        5,
        mode="spectral",
        lanes=lanes,
        virtual={**scene_files("spectral"), "generated/spectrum_read.cl": READ},
        tables={"distributions": np.concatenate([np.zeros(before), density.words()])},
        settings={"density": before},
    )


def test_the_density_is_the_tables() -> None:
    density, lambdas = spiked(), np.linspace(300.0, 829.5, 4001)
    found = probe(density)(np.zeros(4001), lambdas)[4]
    np.testing.assert_allclose(found, density.pdf(lambdas), rtol=2e-3, atol=1e-7)


def test_samples_invert_the_distribution() -> None:
    """The share of the density below a sample is the number that it was drawn with."""
    density = spiked()
    u = np.linspace(0.0, 1.0, 20001, endpoint=False)
    drawn = probe(density)(u, u)[0].astype(np.float64)
    fine = np.linspace(300.0, 829.5, 530 * 64 + 1)
    cells = (density.pdf(fine)[1:] + density.pdf(fine)[:-1]) / 2.0 * np.diff(fine)
    shares = np.interp(drawn, fine, np.concatenate([[0.0], np.cumsum(cells)]))
    np.testing.assert_allclose(shares, u, atol=2e-4)  # a line: 6e-5 nm of rounding at 0.4 / nm
    assert drawn.min() >= 300.0 and drawn.max() <= 829.5


def test_four_wavelengths_are_rotated() -> None:
    """Each follows the density alone: chi-squared over 50 bins each, significance 1e-4."""
    density = spiked()
    drawn = probe(density)(np.random.default_rng(3).random(40_000), np.full(40_000, 500.0))[:4]
    edges = np.linspace(300.0, 829.5, 51)
    fine = np.linspace(300.0, 829.5, 50 * 400 + 1)
    cells = (density.pdf(fine)[1:] + density.pdf(fine)[:-1]) / 2.0 * np.diff(fine)
    expected = cells.reshape(50, 400).sum(axis=1) / cells.sum() * 40_000
    for row in drawn:
        observed, _ = np.histogram(row, edges)
        keep = expected > 5.0
        seen = np.append(observed[keep], observed[~keep].sum())
        wanted = np.append(expected[keep], expected[~keep].sum())
        assert stats.chisquare(seen, wanted * seen.sum() / wanted.sum()).pvalue > SIGNIFICANCE / 4


@pytest.mark.parametrize("lanes", [1, 16])
def test_lanes_agree_to_the_bit(lanes: int) -> None:
    u = np.random.default_rng(4).random(1000)
    density = spiked()
    assert np.array_equal(probe(density, lanes)(u, 300 + 500 * u), probe(density)(u, 300 + 500 * u))


def test_the_ends_of_u_and_unused_lanes() -> None:
    """Numbers at 0 and just below 1, and what idle lanes may hold, stay within the table."""
    density = spiked()
    u = np.array([0.0, 1.0 - 2.0**-24, 0.25, 0.75])
    found = probe(density)(u, np.array([0.0, 1e9, -1e9, np.nan]))
    assert np.isfinite(found[:4]).all() and found[:4].min() >= 300.0 and found[:4].max() <= 829.5
