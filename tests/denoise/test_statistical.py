"""The statistical denoiser, with pictures whose noise is known, and against a written-out mean."""

from __future__ import annotations

import numpy as np
import pytest

from clpt import device
from clpt.denoise import statistical
from clpt.denoise.statistical import DARK, Statistical

SHAPE = (40, 56)
SAMPLES = 32  # of each half


@pytest.fixture(scope="module")
def on() -> device.Device:
    return device.choose()


def halves(clean: np.ndarray, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Two means of samples that are as noisy as light: exponential, without bias."""
    rng = np.random.default_rng(seed)
    first, second = (rng.exponential(size=(2, SAMPLES, *clean.shape)).mean(axis=1)) * clean
    return first.astype(np.float32), second.astype(np.float32)


def squares(*sides: float) -> np.ndarray:
    """A picture (h, w, 3) of upright stripes."""
    made = np.empty((*SHAPE, 3), np.float32)
    for i, side in enumerate(sides):
        made[:, SHAPE[1] * i // len(sides) :] = np.float32([side, 0.5 * side, 0.2 * side])
    return made


def error(image: np.ndarray, clean: np.ndarray) -> float:
    return float(np.mean((image - clean) ** 2 / clean**2))


def test_an_even_picture_loses_nearly_all_noise(on):
    clean = squares(0.7)
    given = halves(clean)
    made = Statistical(on, given)
    assert error(made.colours, clean) < error(np.mean(given, axis=0), clean) / 40
    assert made.colours.mean() == pytest.approx(np.mean(given), rel=0.01)


def test_an_edge_of_light_stays(on):
    """Surfaces are alike, so only the light tells them apart: a shadow's edge."""
    clean = squares(1.0, 0.3)
    given = halves(clean)
    made = Statistical(on, given).colours
    assert error(made, clean) < error(np.mean(given, axis=0), clean) / 15
    step = made[4:-4, 27:29, 0].mean(axis=0)
    np.testing.assert_allclose(step, [1.0, 0.3], rtol=0.08)


def test_an_edge_of_surfaces_stays(on):
    """A texture too faint for the light to tell it."""
    clean, normal = squares(0.7, 0.72), np.zeros((*SHAPE, 3), np.float32)
    normal[..., 2] = 1
    albedo = np.where(clean[..., :1] > 0.71, np.float32(0.9), np.float32(0.4)) * np.ones(3)
    made = Statistical(on, halves(clean), albedo.astype(np.float32), normal).colours[..., 0]
    left, right = made[:, 10:24].mean(), made[:, 32:46].mean()
    assert right - left == pytest.approx(0.02, abs=0.015)
    assert np.abs(made[:, 27].mean() - left) < np.abs(made[:, 28].mean() - left)


def test_an_outlier_does_not_stay(on):
    clean = squares(0.5)
    first, second = halves(clean)
    first[20, 20] = 50.0
    made = Statistical(on, (first, second)).colours
    assert made[20, 20].max() < 5.0


def test_bands_get_the_weights_of_colours(on):
    """Seventy bands, more than go at once: each the mean that the colours have."""
    clean = squares(1.0, 0.3)
    given = halves(clean)
    made = Statistical(on, given)
    strengths = np.linspace(1, 3, 70, dtype=np.float32)
    bands = made.bands(np.mean(given, axis=0)[..., :1] * strengths)
    np.testing.assert_allclose(bands, made.colours[..., :1] * strengths, rtol=1e-3, atol=1e-4)


def test_where_halves_agree_nothing_changes(on):
    clean = np.random.default_rng(3).uniform(0.1, 1, (*SHAPE, 3)).astype(np.float32)
    made = Statistical(on, (clean, clean))
    assert error(made.colours, clean) < 1e-3 and made.error().max() < 1e-6


def test_it_is_not_worse_than_noise_where_nothing_is_alike(on):
    """A picture of fine detail that neither surfaces nor statistics can save from averages."""
    clean = np.random.default_rng(4).uniform(0.4, 0.6, (*SHAPE, 3)).astype(np.float32)
    given = halves(clean)
    assert error(Statistical(on, given).colours, clean) < error(np.mean(given, axis=0), clean)


def test_the_error_is_of_the_size_of_what_is_wrong(on):
    clean = squares(1.0, 0.3)
    made = Statistical(on, halves(clean))
    told = made.error()
    assert told.shape == SHAPE
    wrong = made.colours.astype(float) - clean
    light = made.colours.mean(axis=2) ** 2 + (DARK * clean.mean()) ** 2
    left = np.sqrt(np.mean(np.mean(wrong**2, axis=2) / light))
    # windows of 81 pixels tell no less than a tenth of the noise, which is an eighth of the light
    assert left < np.sqrt(np.mean(told**2)) < 2.5 * left


def test_the_first_average_is_that_of_its_formula(on):
    """One pixel by numpy: weights of Welch's statistic over patches of transformed light."""
    clean = squares(1.0, 0.6)
    given = halves(clean)
    made = Statistical(on, given)
    scale = statistical.SCALE * np.mean(given, dtype=float)
    a, b = (np.arcsinh(half.astype(float) / scale) for half in given)
    guide, radius = (a + b) / 2, statistical.NOISE_RADIUS
    noise = ((a - b) / 2) ** 2
    y, x = 20, 26
    variance = np.zeros_like(noise)
    for v in range(y - 12, y + 13):
        for u in range(x - 12, x + 13):
            window = noise[v - radius : v + radius + 1, u - radius : u + radius + 1]
            variance[v, u] = window.mean(axis=(0, 1)) + statistical.LEAST_VARIANCES[0]
    total, weights, largest = 0.0, 0.0, 0.0
    for dy in range(-10, 11):
        for dx in range(-10, 11):
            if dx * dx + dy * dy > 100 or (dx, dy) == (0, 0):
                continue
            here = np.s_[y - 1 : y + 2, x - 1 : x + 2]
            there = np.s_[y + dy - 1 : y + dy + 2, x + dx - 1 : x + dx + 2]
            apart = (guide[here] - guide[there]) ** 2 / (variance[here] + variance[there])
            weight = 1 / (1 + (apart.mean() / statistical.LIMITS[0]) ** 6)
            total = total + weight * given[0][y + dy, x + dx]
            weights, largest = weights + weight, max(largest, weight)
    wanted = (total + largest * given[0][y, x]) / (weights + largest)
    both = np.zeros((*SHAPE, 8), np.float32)
    both[..., :3], both[..., 4:7] = given
    found = made._download(made._average(0, made._upload(both), 2), both.shape)
    np.testing.assert_allclose(found[y, x, :3], wanted, rtol=1e-4)


@pytest.mark.parametrize("lanes", [1, 8, 16])
@pytest.mark.parametrize("shape", [(19, 33), (8, 16), (1, 40), (40, 1)])
def test_lanes_and_rows_of_work_items_change_nothing(on, monkeypatch, lanes, shape):
    """Pixels of a row and rows of a work-item, whole and in part, beside a vector of one pixel."""
    rng = np.random.default_rng(5)
    given = tuple(rng.uniform(0.2, 1, (*shape, 3)).astype(np.float32) for _ in range(2))
    albedo, normal = (rng.uniform(0, 1, (*shape, 3)).astype(np.float32) for _ in range(2))
    pictures = []
    for count in (on.lanes, lanes):
        monkeypatch.setattr(type(on), "lanes", property(lambda _, count=count: count))
        made = Statistical(on, given, albedo, normal)
        pictures.append((made.colours, made.error(), made.bands(np.tile(given[0], 7))))
    for one, other in zip(*pictures, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (3, 2)])
def test_small_pictures(on, shape):
    given = halves(np.full((*shape, 3), 0.5, np.float32))
    made = Statistical(on, given)
    assert made.colours.shape == (*shape, 3) and np.isfinite(made.colours).all()


def test_black_stays_black(on):
    empty = np.zeros((*SHAPE, 3), np.float32)
    assert (Statistical(on, (empty, empty)).colours == 0).all()
