"""The adapter of Open Image Denoise, with pictures whose noise is known."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from clpt.denoise import oidn
from clpt.denoise.oidn import Oidn
from clpt.errors import SceneError

SHAPE = (48, 64)


@pytest.fixture(scope="module", autouse=True)
def _installed():
    pytest.importorskip("pyoidn", reason="Open Image Denoise is not installed")


@pytest.fixture(scope="module")
def steps() -> np.ndarray:
    """Four squares of colours, (h, w, 3)."""
    made = np.empty((*SHAPE, 3), np.float32)
    made[:24, :32], made[:24, 32:] = (0.8, 0.2, 0.1), (0.1, 0.5, 0.9)
    made[24:, :32], made[24:, 32:] = (0.3, 0.3, 0.3), (2.0, 1.5, 0.2)
    return made


def noisy(clean: np.ndarray, seed: int = 1) -> np.ndarray:
    """A picture with the noise of few samples: as bright as itself, without bias."""
    factors = np.random.default_rng(seed).exponential(size=clean.shape)
    return (clean * factors).astype(np.float32)


def error(image: np.ndarray, clean: np.ndarray) -> float:
    return float(np.mean((image - clean) ** 2 / (clean**2 + 0.01)))


def test_noise_goes_and_edges_of_layers_stay(steps):
    given = noisy(steps)
    normal = np.zeros_like(steps)
    normal[..., 2] = 1
    with Oidn() as alone, Oidn(np.minimum(steps, 1), normal) as helped:
        by_itself, with_layers = alone.colours(given), helped.colours(given)
        assert helped.version.startswith("2.")
    assert error(by_itself, steps) < error(given, steps) / 20
    assert error(with_layers, steps) < error(by_itself, steps) / 2


def test_what_is_no_number_counts_as_black(steps):
    given, black = noisy(steps), noisy(steps)
    given[5, 6], black[5, 6] = np.nan, 0.0
    with Oidn() as one:
        np.testing.assert_array_equal(one.colours(given), one.colours(black))


def test_values_below_zero_are_not_clamped(steps):
    """The colour of deep green light has a red below 0, and so has its mean after denoising."""
    deep = steps * np.float32([-0.5, 1.0, 1.0])
    spread = np.random.default_rng(2).normal(scale=0.1, size=deep.shape).astype(np.float32)
    with Oidn() as one:
        made = one.colours(deep + spread)
    assert made[4:20, 4:28, 0].mean() == pytest.approx(-0.4, abs=0.05)
    assert error(made, deep) < error(deep + spread, deep) / 3


def test_bands_have_one_scale(steps):
    """Bands that differ a thousandfold keep what they are to each other; seven are no threes."""
    strengths = np.float32([1, 10, 100, 1000, 100, 10, 1])
    clean = steps[..., :1] * strengths
    with Oidn() as one:
        made = one.bands(noisy(clean))
    assert made.shape == clean.shape
    ratios = made[4:20, 4:28].mean(axis=(0, 1)) / strengths
    np.testing.assert_allclose(ratios, 0.8, rtol=0.1)


def test_scale_is_that_of_grey_cards():
    image = np.full((8, 8), 4.0, np.float32)
    image[:4] = 0.0  # the sky is black
    assert oidn.scale_of(image) == pytest.approx(0.18 / 4)
    assert oidn.scale_of(np.zeros((8, 8), np.float32)) == 1.0


def test_a_missing_package_is_told_with_its_cure(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    with pytest.raises(SceneError, match=r"pip install 'clpt\[denoise\]'"):
        oidn.check_installed()
