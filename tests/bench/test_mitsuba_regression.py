"""What the comparison with Mitsuba's references says of pictures that are known."""

from __future__ import annotations

import numpy as np
import pytest

from bench import mitsuba_regression as regression

RNG = np.random.default_rng(6)


def pictures(mean: np.ndarray, spp: int) -> regression.Estimate:
    """An estimate from 16 pictures whose samples have a standard deviation of 0.3."""
    noise = RNG.normal(0.0, 0.3 / spp**0.5, (regression.EXPOSURES, *mean.shape))
    return regression.estimate(list(mean + noise), spp)


def test_equal_pictures_agree_and_others_differ() -> None:
    mean = RNG.uniform(0.2, 1.0, (48, 48, 3))
    against = pictures(mean, 2000)
    same = regression.compare(pictures(mean, 54), 16 * 54, against)
    assert same["agrees"] and same["passes"] and same["ratio"] == pytest.approx([1.0] * 3, abs=5e-3)
    brighter = mean.copy()
    brighter[8:12, 20:24] *= 1.1  # a block; too small a share of the pixels for Mitsuba's test
    block = regression.compare(pictures(brighter, 54), 16 * 54, against)
    assert not block["agrees"] and block["worst_block"] == [5, 2]
    assert block["worst_ratio"] == pytest.approx(1.1, abs=0.03)
    far = regression.compare(pictures(1.3 * mean, 54), 16 * 54, against)
    assert not far["agrees"] and not far["passes"] and far["pixels"] < 0.9


def test_what_is_compared(tmp_path) -> None:
    """Scenes of the folder, without the fragments below them; a missing reference is None."""
    folder = tmp_path / "tests" / "scenes" / "one"
    (folder / "fragments").mkdir(parents=True)
    for name in ("a_path.xml", "b_direct.xml", "fragments/part.xml"):
        (folder / name).touch()
    found = list(regression.scene_files(tmp_path, ""))
    assert [path.stem for path in found] == ["a_path", "b_direct"]
    assert list(regression.scene_files(tmp_path / "tests" / "scenes", "b_")) == found[1:]
    assert regression.reference(found[0], "rgb") is None
