"""Reach of pixel filters, in pixels."""

from __future__ import annotations

import math

from clpt.scene.integrators import Filter, Gaussian

CUT = 4.0  # standard deviations at which a Gaussian ends that has no radius


def reach(chosen: Filter) -> int:
    """Return how many pixels beside its own a sample may serve, along an axis to one side."""
    return max(math.ceil(radius(chosen) - 0.5), 0)


def taps(chosen: Filter) -> int:
    """Return how many pixels of an axis have a point in their filters at most."""
    return math.ceil(2.0 * radius(chosen))


def radius(chosen: Filter) -> float:
    """Return the half width of a filter [pixels]."""
    if isinstance(chosen, Gaussian) and chosen.radius == 0.0:
        return CUT * chosen.stddev
    return float(chosen.radius)  # type: ignore[attr-defined]
