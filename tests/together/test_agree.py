"""Independent ways to the same mean agree, in twelve scenes that hold many features at once.

False discovery rate and heavy tails as in tests/together/agree.py.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.together.agree import (
    RATE,
    SAMPLES,
    WAYS,
    Comparison,
    compared,
    discoveries,
    judged,
    probabilities,
)  # fmt: skip
from tests.together.fixed import SCENES

pytestmark = pytest.mark.usefixtures("one_context")


def test_what_is_called_different() -> None:
    """A block that is off by 8 % is; noise is not, and neither are tails without a variance."""
    rng = np.random.default_rng(1)
    size = 12, 4000
    noise = [1.0 + 0.02 * rng.standard_normal(size) for _ in range(2)]
    assert not discoveries(probabilities(*noise)).any()
    noise[0][:, :40] *= 1.08
    assert discoveries(probabilities(*noise))[:40].mean() > 0.9
    assert not discoveries(probabilities(*noise))[40:].any()
    bright = 1.0 + 0.5 * (rng.pareto(1.7, (16, *size)) - 1.0 / 0.7).mean(axis=0)
    even = 1.0 + 1e-3 * rng.standard_normal(size)
    assert discoveries(probabilities(bright, even)).mean() < RATE
    assert discoveries(probabilities(bright + 5.0, even)).mean() > 0.9


@pytest.mark.slow
def test_fixed_scenes() -> None:
    """No block differs, again, of any scene, by light paths and by two other ways in turn."""
    found: list[Comparison] = []
    others = [way for way in WAYS if way != "light paths"]
    for number, (name, made) in enumerate(SCENES.items()):
        turns = [others[(number + k) % len(others)] for k in range(2)]
        found += compared(name, made(), ["light paths", *turns], 1 + 100 * number)
    assert len(found) > 2 * len(SCENES)
    different = judged(found, 5000, SAMPLES)
    assert not different, [one.row() for one in different]
