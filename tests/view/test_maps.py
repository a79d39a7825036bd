"""Maps in the place of the picture: the error is as large as it says."""

from __future__ import annotations

import numpy as np

from clpt.view import pictures

SHAPE = (96, 128)


def film(sums: np.ndarray, count: int) -> np.ndarray:
    """A film (h, w, 4) of grey pixels, of sums of so many samples."""
    mean = np.repeat(sums[..., None] / count, 3, axis=2)
    return np.dstack([mean, np.full(SHAPE, count)]).astype(np.float32)


def test_the_error_is_that_of_independent_samples() -> None:
    """Left half: sigma 1, right half: sigma 4, mean 10: with 64 samples 1.25 % and 5 %.

    The mean of the squares over 6,000 pixels, normal, has a relative standard deviation of
    sqrt(2 / 6000) = 1.8 %: 10 % are more than 5 of them.
    """
    rng = np.random.default_rng(1)
    sigma = np.where(np.arange(SHAPE[1]) < SHAPE[1] // 2, 1.0, 4.0) * np.ones(SHAPE)
    errors = pictures.ErrorMap()
    sums, count = np.zeros(SHAPE), 0
    for n in (4, 4, 8, 16, 16, 16):  # the film is noted at 4, 8, 16, 32, 64
        assert errors.of(film(sums, max(count, 1))) is None or count > 4
        sums += 10.0 * n + sigma * np.sqrt(n) * rng.standard_normal(SHAPE)
        count += n
        if errors.wants(count):
            errors.note(film(sums, count))
    squared = errors.of(film(sums, count)) ** 2
    inside = pictures.WINDOW
    left = squared[:, : SHAPE[1] // 2 - inside].mean()
    right = squared[:, SHAPE[1] // 2 + inside :].mean()
    # what is darker than DARK of the mean counts as brighter: the level is 10.1
    assert abs(left / (1.0 / 64 / 10.1**2) - 1.0) < 0.1
    assert abs(right / (16.0 / 64 / 10.1**2) - 1.0) < 0.1


def test_colours_go_from_few_to_many() -> None:
    counts = np.tile(np.linspace(16, 64, SHAPE[1]), (SHAPE[0], 1))
    shown, legend = pictures.samples(np.dstack([np.zeros((*SHAPE, 3)), counts]).astype(np.float32))
    assert shown.shape == (*SHAPE, 3) and (legend.low, legend.high) == ("16", "64 samples")
    brightness = shown[0].astype(int).sum(axis=1)
    assert (np.diff(brightness) >= 0).all() and brightness[-1] > 600 > 10 > brightness[0]


def test_pixels_that_get_no_more_samples_keep_out_of_the_mean() -> None:
    """A pixel that was left says nothing; its neighbours do."""
    rng = np.random.default_rng(2)
    errors = pictures.ErrorMap()
    sums = 40.0 + 2.0 * rng.standard_normal(SHAPE)
    errors.note(film(sums, 4))
    later = film(sums + 120.0 + np.sqrt(12.0) * rng.standard_normal(SHAPE), 16)
    left = np.zeros(SHAPE, bool)
    left[:, ::2] = True
    later[left] = film(sums, 4)[left]
    found = errors.of(later)
    assert found is not None and 0.5 * 0.025 < np.sqrt((found**2).mean()) < 2.0 * 0.025
