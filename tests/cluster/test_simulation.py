"""A thousand workers that die, on a clock that is not real: all samples, once each."""

from __future__ import annotations

import pytest

from bench.cluster_simulation import Case, Simulation

CASES = {
    "a thousand": Case("", samples=8000, film_seconds=0.01, lifetime=600.0),
    "they die all the time": Case("", workers=100, samples=3000, lifetime=20.0, back=5.0),
    "one of a kind": Case("", workers=1, samples=200, lifetime=1e9),
    "a narrow network": Case("", workers=200, samples=20000, film_seconds=1.0),
}


@pytest.mark.parametrize("name", CASES)
def test_all_samples_are_rendered(name):
    """`Simulation.run` asserts that every sample is there; a sample that is there twice raises."""
    found = Simulation(CASES[name]).run()
    assert found.deaths > 0 or CASES[name].workers == 1
    assert found.lost >= found.deaths * 0.5 or found.deaths < 5
    assert 0.0 < found.efficiency <= 1.0


def test_a_network_that_is_narrow_makes_blocks_long():
    wide = Simulation(Case("", workers=200, samples=20000, film_seconds=0.01)).run()
    narrow = Simulation(Case("", workers=200, samples=20000, film_seconds=1.0)).run()
    assert narrow.block_seconds > 2 * wide.block_seconds
    assert narrow.blocks < wide.blocks
