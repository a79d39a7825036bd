"""Sectors that groups of work-items touch: by hand for few slots, by a formula for many."""

from __future__ import annotations

import numpy as np
import pytest

from bench import warps


def launch(slots: np.ndarray) -> warps.Launch:
    return warps.Launch("stage", slots, slots, int(slots.max()) + 1)


@pytest.mark.parametrize(
    ("layout", "expected"), [("streams", 8), ("blocks", 8), ("fours", 16), ("slots", 32)]
)
def test_a_whole_group_reads_two_words(layout: str, expected: int) -> None:
    """Two words of 32 slots fill 8 sectors; four words of two slots fill a sector."""
    assert warps.sectors(launch(np.arange(32)), {"path": [0, 1]}, layout, 64, {}) == expected


def test_few_slots_touch_sectors_of_their_own() -> None:
    """With a share p of the slots, (1 - (1 - p)^8) / p of the bytes, within 3 errors of a mean."""
    rng = np.random.default_rng(1)
    share, count = 0.1, 1 << 16
    slots = np.nonzero(rng.random(count) < share)[0]
    touched = warps.sectors(launch(slots), {"path": [3]}, "blocks", count, {})
    expected = (1 - (1 - share) ** 8) * count / 8
    assert abs(touched - expected) < 3 * np.sqrt(expected)


def test_lanes() -> None:
    assert warps.lanes(np.arange(64), 32) == 1.0
    assert warps.lanes(np.array([0, 1, 40]), 32) == 3 / 64
    assert warps._evenness(np.array([1.0, 3.0, 0.0, 0.0]), 2) == 4 / 6


def test_words_that_are_used_together_are_neighbours() -> None:
    stages = [{"path": [0, 9]}, {"path": [0, 4, 9]}, {"path": [7]}]
    numbers = warps.neighbours(stages)["path"]
    assert sorted(numbers.values()) == [0, 1, 2, 3]
    assert abs(numbers[0] - numbers[9]) == 1
