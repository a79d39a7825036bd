"""Pixel filters: their values, integrals and reach, in pixels."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.scene.integrators import (
    BlackmanHarris,
    Box,
    Filter,
    Gaussian,
    Lanczos,
    Mitchell,
    Tent,
)

CUT = 4.0  # standard deviations at which a Gaussian ends that has no radius
STEPS = 1 << 16  # in which a filter is integrated
LEAST = 1e-6  # of the integral of its absolute values: what a filter's integral must exceed


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


def value(chosen: Filter, distance: ArrayLike) -> Floats:
    """Return a filter at distances from its centre along one axis [pixels], not normalised.

    The definitions are Mitsuba 3's, so that the same names give the same images.
    """
    x = np.abs(np.asarray(distance, np.float64))
    inside = x <= radius(chosen)
    return np.where(inside, FUNCTIONS[type(chosen)](chosen, np.where(inside, x, 0.0)), 0.0)


def integrals(chosen: Filter) -> tuple[Floats, Floats, Floats]:
    """Return edges of steps (n,), and the integrals of |f| and of f up to each, in steps.

    Raises SceneError for a filter whose integral is not positive.
    """
    edges = np.linspace(0.0, radius(chosen), STEPS + 1)
    middle = value(chosen, (edges[1:] + edges[:-1]) / 2.0)
    absolute, signed = (np.concatenate([[0.0], np.cumsum(f)]) for f in (np.abs(middle), middle))
    if not (np.isfinite(absolute[-1]) and signed[-1] > LEAST * absolute[-1]):
        message = "the filter's integral must be positive"
        raise SceneError(message, where=f"film.filter {chosen.kind}")
    return edges, absolute, signed


def _tent(chosen: Tent, x: Floats) -> Floats:
    return 1.0 - x / chosen.radius


def _gaussian(chosen: Gaussian, x: Floats) -> Floats:
    """Lowered by its value at the radius, so that it ends at zero."""
    end = radius(chosen) / chosen.stddev
    return np.exp(-0.5 * (x / chosen.stddev) ** 2) - np.exp(-0.5 * end**2)


def _mitchell(chosen: Mitchell, x: Floats) -> Floats:
    """Mitchell and Netravali 1988 eq. 8."""
    b, c, x = chosen.b, chosen.c, x * (2.0 / chosen.radius)
    near = (12 - 9 * b - 6 * c) * x**3 + (-18 + 12 * b + 6 * c) * x**2 + (6 - 2 * b)
    far = (-b - 6 * c) * x**3 + (6 * b + 30 * c) * x**2 + (-12 * b - 48 * c) * x + (8 * b + 24 * c)
    return np.where(x < 1.0, near, far) / 6.0


def _lanczos(chosen: Lanczos, x: Floats) -> Floats:
    """Windowed by the main lobe of a sinc `lobes` wide (Duchon 1979)."""
    return np.sinc(x) * np.sinc(x / chosen.lobes)


def _blackman_harris(chosen: BlackmanHarris, x: Floats) -> Floats:
    """The four-term window of Harris 1978, -92 dB."""
    t = np.pi * (x / chosen.radius + 1.0)
    return 0.35875 - 0.48829 * np.cos(t) + 0.14128 * np.cos(2 * t) - 0.01168 * np.cos(3 * t)


FUNCTIONS: dict[type[Filter], Callable[..., Floats]] = {
    Box: lambda chosen, x: np.ones_like(x),
    Tent: _tent,
    Gaussian: _gaussian,
    Mitchell: _mitchell,
    Lanczos: _lanczos,
    BlackmanHarris: _blackman_harris,
}
