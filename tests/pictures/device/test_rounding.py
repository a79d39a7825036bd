"""A device that rounds otherwise renders the same picture."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest

import clpt
from clpt.device import building

ROOT = Path(__file__).resolve().parents[3]


@pytest.mark.slow
def test_the_same_paths(monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiler that may reorder sums stands for a GPU's, which joins products and sums.

    Few paths differ, where a number was at the edge of a choice; none is a hash of what was
    rounded. Light here comes from many bricks.
    """
    scene = clpt.load(ROOT / "scenes" / "candle_behind_smoke")
    scene = dataclasses.replace(scene, film=dataclasses.replace(scene.film, width=32, height=32))
    pictures = []
    for more in ((), ("-cl-unsafe-math-optimizations",)):
        monkeypatch.setattr(building, "OPTIONS", (*building.OPTIONS, *more))
        pictures.append(np.array(clpt.render(scene, 4)))
    assert not np.array_equal(*pictures)
    off = np.abs(pictures[0] - pictures[1]) > 0.01 * pictures[0] + 1e-3 * pictures[0].mean()
    assert off.any(axis=-1).mean() < 0.02
