"""Every material kind samples what its pdf says, and its weight is eval over pdf.

The table of kinds is clpt.scene.materials.LEAVES: a kind is tested by being listed.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from clpt.scene.materials import LEAVES
from clpt.testing import checks
from clpt.testing.settings import settings
from tests.kernels.harness import MODES, Probe, other_mode, quick_mode
from tests.rotation import rotating

SETTINGS = 4
# chance that any one of all chi-square tests fails where all is right: 1e-3 (Sidak)
TESTS = len(LEAVES) * len(MODES) * SETTINGS * len(checks.ANGLES)
SIGNIFICANCE = 1.0 - (1.0 - 1e-3) ** (1.0 / TESTS)

kinds = rotating("cls, mode", LEAVES, MODES, turn=quick_mode)


def other_mode_and_lanes(cls):
    """Which of MODES x lanes: lanes take turns."""
    return 2 * other_mode(cls) + LEAVES.index(cls) // 2 % 2


@kinds
def test_samples_follow_the_pdf(cls, mode):
    rng, probe = np.random.default_rng(17), Probe(cls, mode)
    for params in settings(cls, mode, rng, SETTINGS):
        checks.samples_follow_the_pdf(probe, params, rng, SIGNIFICANCE)


@kinds
def test_weight_is_eval_over_pdf(cls, mode):
    rng, probe = np.random.default_rng(3), Probe(cls, mode)
    for params in settings(cls, mode, rng, SETTINGS):
        checks.weight_is_eval_over_pdf(probe, params, rng)


@kinds
def test_lobes_are_told_truly(cls, mode):
    rng, probe = np.random.default_rng(4), Probe(cls, mode)
    for i, params in enumerate(settings(cls, mode, rng, SETTINGS)):
        checks.lobes_are_told_truly(probe, params, rng, hero_alone=2 * i >= SETTINGS)
        checks.flags_are_told_truly(probe, params, rng)
        checks.tangents_are_declared(probe, params, rng)


@rotating("cls, mode, lanes", LEAVES, MODES, [1, 8], turn=other_mode_and_lanes)
def test_lanes_agree(cls, mode, lanes):
    rng = np.random.default_rng(8)
    (params,) = settings(cls, mode, rng, 1)
    checks.lanes_agree(Probe(cls, mode), Probe(cls, mode, lanes), params, rng)


@pytest.mark.parametrize("degrees", [1, 2, 7, 40, 383])
def test_the_tail_of_a_chi_square(degrees):
    for x in (1e-3 * degrees, 0.9 * degrees, 1.3 * degrees + 8.0):
        assert checks.chi_square_tail(x, degrees) == pytest.approx(chi2.sf(x, degrees), rel=1e-9)
