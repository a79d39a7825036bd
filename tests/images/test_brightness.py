"""The exposure that suits a picture, and whether anything is seen in it."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import images


def grey(*values: float) -> np.ndarray:
    return np.array(values, np.float32)[None, :, None] * np.ones(3, np.float32)


def test_the_mean_becomes_a_middle_grey():
    assert images.auto_exposure(grey(0.18, 0.18)) == pytest.approx(0.0, abs=1e-6)
    assert images.auto_exposure(grey(0.18 * 4.0, 0.18)) == pytest.approx(-1.0, abs=1e-6)
    assert images.auto_exposure(grey(0.18 * 2.0**10)[..., :1]) == pytest.approx(-10.0, abs=1e-6)


def test_what_is_not_lit_does_not_count():
    assert images.auto_exposure(grey(0.18, 0.0, 0.0, np.nan, np.inf)) == pytest.approx(0, abs=1e-6)
    assert images.auto_exposure(grey(0.0, 0.0)) == 0.0
    # a stray photon counts as a ten-thousandth of the mean
    assert abs(images.auto_exposure(grey(*[0.18] * 99, 1e-30))) < 0.2


def test_the_exposure_of_a_large_range_is_finite():
    assert np.isfinite(images.auto_exposure(grey(1e-38, 1e38)))


def test_levels():
    found = images.levels(grey(0.0, 0.5, 2.0, 3.0))
    assert (found.lit, found.black) == (True, 0.25)
    assert found.white == pytest.approx(2 / 3)
    assert images.levels(grey(0.0, 0.5, 2.0, 3.0), -4.0).white == 0.0
    assert not images.levels(grey(0.0, np.nan)).lit
    assert images.levels(np.full((2000, 900, 3), 9.0, np.float32)).white == 1.0


def test_a_saturated_colour_is_not_white():
    assert images.levels(np.full((2, 2, 3), (9.0, 0.1, 0.1), np.float32)).white == 0.0
