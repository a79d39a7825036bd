"""Gates, cameras of phases and lidar echoes: of signals whose numbers are known."""

from __future__ import annotations

import numpy as np
import pytest

from clpt.errors import SceneError
from clpt.instruments import correlation, echoes, gate, phase_ranges
from clpt.scene.integrators import LIGHT_SPEED

EDGES = np.linspace(0.0, 100.0, 2001)  # [ns], 50 ps each
MIDDLE = (EDGES[1:] + EDGES[:-1]) / 2.0


def pulse(range_: float, light: float = 1.0):
    """A signal of one echo: its light in a single bin."""
    signal = np.zeros(2000)
    signal[int(2.0 * range_ / LIGHT_SPEED / 0.05)] = light
    return signal


def test_a_gate_takes_shares_of_bins():
    weights = gate([0.0, 10.0, 20.0, 30.0], 5.0, 22.0)
    np.testing.assert_allclose(weights, [0.5, 1.0, 0.2])
    assert not gate([0.0, 10.0], 12.0, 20.0).any()


@pytest.mark.parametrize("frequency", [20.0, 80.0])
@pytest.mark.parametrize("range_", [0.5, 1.3])
def test_four_phases_give_the_range(frequency, range_):
    """To half a bin, 3.7 mm; an even background changes nothing over whole periods."""
    signal = pulse(range_, 3.0) + 0.01
    pictures = [signal @ correlation(EDGES, frequency, phase) for phase in (0, 90, 180, 270)]
    found, amplitude = phase_ranges(pictures, frequency)
    assert found == pytest.approx(range_, abs=0.0038)
    assert amplitude == pytest.approx(3.0, rel=1e-3)


def test_beyond_half_a_wave_the_range_is_ambiguous():
    frequency, whole = 50.0, 500.0 * LIGHT_SPEED / 50.0
    signal = pulse(2.0 + whole)
    pictures = [signal @ correlation(EDGES, frequency, phase) for phase in (0, 90, 180, 270)]
    assert phase_ranges(pictures, frequency)[0] == pytest.approx(2.0, abs=0.0038)
    with pytest.raises(SceneError, match="four pictures"):
        phase_ranges(np.zeros((3, 5)), frequency)


def test_wide_bins_have_the_mean_of_the_cosine():
    weights = correlation([0.0, 5.0, 20.0], 20.0, 30.0)
    fine = np.linspace(0.0, 20.0, 400001)[:-1] + 2.5e-5
    cosine = (1.0 + np.cos(2e-3 * np.pi * 20.0 * fine - np.radians(30.0))) / 2.0
    np.testing.assert_allclose(weights, [cosine[:100000].mean(), cosine[100000:].mean()], atol=1e-8)


def test_echoes_are_runs_of_bins():
    signal = np.zeros((2, 3, 2000))
    signal[0, 0, 100:102] = 1.0, 3.0
    signal[0, 0, 500] = 0.5
    signal[1, 2, -1] = 7.0
    ranges, light = echoes(signal, EDGES, count=2)
    assert ranges.shape == light.shape == (2, 3, 2)
    expected = LIGHT_SPEED / 2.0 * np.array([(MIDDLE[100] + 3.0 * MIDDLE[101]) / 4.0, MIDDLE[500]])
    np.testing.assert_allclose(ranges[0, 0], expected)
    np.testing.assert_allclose(light[0, 0], [4.0, 0.5])
    assert ranges[1, 2, 0] == pytest.approx(LIGHT_SPEED / 2.0 * MIDDLE[-1])
    assert np.isnan(ranges).sum() == 9 and not light[np.isnan(ranges)].any()
    first, _ = echoes(signal, EDGES, threshold=2.0)
    assert first[0, 0, 0] == pytest.approx(LIGHT_SPEED / 2.0 * MIDDLE[101])
