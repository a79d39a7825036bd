"""Errors of pictures without a reference, and efficiency by them."""

from __future__ import annotations

import numpy as np
import pytest

from bench import peer_figures
from bench.peer_figures import Picture

SEEDS = 8
SHAPE = (64, 64, 3)


def noisy(sigma: float, seed: int) -> list[Picture]:
    """Pictures of a ramp with uniform noise of a standard deviation."""
    rng = np.random.default_rng(seed)
    truth = np.linspace(0.5, 1.5, 64)[:, None, None]
    half = sigma * np.sqrt(3.0)
    noise = rng.uniform(-half, half, (SEEDS, *SHAPE))
    return [(truth + picture).astype(np.float32) for picture in noise]


def expected(sigma: float) -> float:
    """The mean of sigma^2 / (ramp^2 + .01)."""
    ramp = np.linspace(0.5, 1.5, 64)
    return float((sigma**2 / (ramp**2 + 0.01)).mean())


def test_errors_are_variances_though_contenders_share_pictures() -> None:
    good, bad = noisy(0.1, 1), noisy(0.3, 2)
    found = peer_figures.errors({"good": good, "again": good, "bad": bad})
    assert found["again"] == found["good"]
    # Without the worst thousandth; 8 x 64^2 pixels: four standard errors are 3 %.
    assert np.mean(found["good"]) == pytest.approx(expected(0.1), rel=0.03)
    assert np.mean(found["bad"]) == pytest.approx(expected(0.3), rel=0.03)


def test_a_bias_counts_as_error() -> None:
    """One contender in three is a tenth too bright: it is beside the others by most of that."""
    high = [picture * 1.1 for picture in noisy(0.02, 3)]
    found = peer_figures.errors({"a": noisy(0.02, 4), "b": noisy(0.02, 5), "high": high})
    assert np.mean(found["high"]) > 5.0 * np.mean(found["a"])


def test_the_efficiency_of_equal_pictures_is_a_ratio_of_times_without_error() -> None:
    errors = [1.0, 2.0, 3.0]
    quick = {"seconds": 1.0, "relmse": errors}
    slow = {"seconds": 3.0, "relmse": errors}
    assert peer_figures.gain(quick, slow) == (3.0, 0.0)


def test_efficiency_has_a_standard_error() -> None:
    """Errors of two contenders that differ by a fifth from seed to seed, at equal times."""
    rng = np.random.default_rng(6)
    ratios = []
    for _ in range(200):
        pair = [{"seconds": 1.0, "relmse": list(rng.normal(1.0, 0.2, SEEDS))} for _ in range(2)]
        ratios.append(peer_figures.gain(*pair))
    spread = np.std([ratio for ratio, _ in ratios])
    assert np.mean([error for _, error in ratios]) == pytest.approx(spread, rel=0.2)
