"""The test of pictures by tiles: its limits, its rate of false alarms, and what it finds."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
import pytest

from clpt.bench import pictures
from clpt.bench.pictures import Reference, compare, limit, regions
from clpt.bench.scenes import BENCHMARK_VERSION, PICTURES

SIDE, SAMPLES, COUNT = 32, 1000, 32
NOISE = 0.01  # the standard deviation of a tile's mean


def picture(rng: np.random.Generator, noise: float = NOISE) -> np.ndarray:
    """A grey picture whose tiles' means have that noise."""
    means = 0.5 + noise * rng.standard_normal((8, 8, 3))
    return means.repeat(SIDE // 8, 0).repeat(SIDE // 8, 1)


def reference(rng: np.random.Generator) -> Reference:
    found = [regions(picture(rng)) for _ in range(COUNT)]
    return Reference(
        np.mean(found, 0), np.std(found, 0, ddof=1), COUNT, SAMPLES, MappingProxyType({})
    )


def test_regions_are_means_of_tiles_and_of_all() -> None:
    image = np.random.default_rng(1).random((16, 16, 3)).astype(np.float32)
    found = regions(image)
    assert found.shape == (65, 3)
    np.testing.assert_allclose(found[9], image[2:4, 2:4].mean((0, 1)), rtol=1e-6)
    np.testing.assert_allclose(found[64], image.mean((0, 1)), rtol=1e-6)


@pytest.mark.parametrize("freedom", [3, 7, 31, 63])
@pytest.mark.parametrize("rate", [0.5, 1e-2, 5e-7])
def test_limits_are_those_of_students_t(freedom: int, rate: float) -> None:
    stats = pytest.importorskip("scipy.stats")
    assert limit(freedom, rate) == pytest.approx(stats.t.isf(rate / 2, freedom), rel=1e-6)


def test_right_pictures_are_called_wrong_at_the_stated_rate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At a rate of 0.1 in place of 1e-4, of 1,000 right ones 10 % at most: z < 4 (p = 3e-5)."""
    monkeypatch.setattr(pictures, "FALSE_ALARMS", 0.1)
    rng, wrong = np.random.default_rng(2), 0
    for _ in range(1000):
        wrong += bool(compare(picture(rng), reference(rng), SAMPLES).wrong)
    assert 40 < wrong < 100 + 4 * np.sqrt(1000 * 0.1 * 0.9)


def test_what_is_wrong_is_found() -> None:
    rng = np.random.default_rng(3)
    right = reference(rng)
    image = picture(rng)
    assert compare(image, right, SAMPLES) == (0.0, pytest.approx(3, abs=2), "")
    some = image.copy()
    some[:8, :16] *= 1.3  # two rows of four tiles
    assert compare(some, right, SAMPLES).wrong == "wrong: 12 % of tiles"
    one = image.copy()
    one[5, 5, 0] = np.nan
    found = compare(one, right, SAMPLES)
    assert found.wrong == "wrong: 2 % of tiles" and np.isinf(found.largest)
    whole = compare(image * 1.02, right, SAMPLES)
    assert whole.share == 0.0 and "all of it is +2" in whole.wrong
    assert compare(np.zeros_like(image), right, SAMPLES).wrong == "wrong: 100 % of tiles"


def test_more_samples_find_smaller_faults() -> None:
    """A tile that is 5 % off is within the noise of few samples, and beyond that of many."""
    rng = np.random.default_rng(4)
    right = reference(rng)
    image = picture(rng, 0.001)
    image[:4, :4] *= 1.05
    assert not compare(image, right, SAMPLES).wrong
    assert compare(image, right, 100 * SAMPLES).wrong == "wrong: 2 % of tiles"


def test_references_are_shipped_for_every_scene() -> None:
    kept = pictures.references()
    assert kept.keys() == PICTURES.keys()
    with np.load(pictures.FILE) as file:
        assert f'"version": {BENCHMARK_VERSION},' in str(file["about"])
    assert pictures.FILE.stat().st_size < 64 << 10
    for one in kept.values():
        assert one.mean.shape == one.deviation.shape == (65, 3) and one.count % 2 == 0
        assert (one.mean > 0).all() and np.isfinite(one.deviation).all()
