"""Pixel filters on their way to the device: tables to sample them by, and of their values."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.render.analysis.filters import radius
from clpt.render.lowering.tables import TableStore
from clpt.scene.integrators import (
    BlackmanHarris,
    Box,
    Filter,
    Gaussian,
    Lanczos,
    Mitchell,
    Tent,
)

CELLS = 1024  # of equal probability, on one side
STEPS = 1 << 16  # in which a filter is integrated
PROFILE = 256  # steps of a filter's values


def lower_filter(chosen: Filter, store: TableStore, splatting: bool) -> None:
    """Put a filter's table into `distributions`, where the kernels expect it to be the first.

    splatting: whether light serves all pixels whose filters hold it: then the filter's values.
    Raises SceneError if something stands there already, and as `table` does.
    """
    if store.append_floats("distributions", (profile if splatting else table)(chosen)) != 0:
        raise SceneError("the pixel filter has to be lowered first")


def lower_profile(chosen: Filter, store: TableStore, splatting: bool) -> int:
    """Return where a filter's values begin in `distributions`, for the light of others' paths.

    splatting: as of `lower_filter`; where samples serve their own pixel the values are appended.
    """
    return 0 if splatting else store.append_floats("distributions", profile(chosen))


def value(chosen: Filter, distance: ArrayLike) -> Floats:
    """Return a filter at distances from its centre along one axis [pixels], not normalised.

    The definitions are Mitsuba 3's, so that the same names give the same images.
    """
    x = np.abs(np.asarray(distance, np.float64))
    inside = x <= radius(chosen)
    return np.where(inside, FUNCTIONS[type(chosen)](chosen, np.where(inside, x, 0.0)), 0.0)


def table(chosen: Filter) -> NDArray[np.float32]:
    """Return n, then n + 1 distances, then n weights: see kernels/film/filter.cl.

    Cells have equal shares of the integral of |f|; a cell's weight is its share of the integral of
    f, times n, so that the weights' mean is 1. Raises SceneError for a filter without an integral.
    """
    if isinstance(chosen, Box):
        return np.array([1.0, 0.0, chosen.radius, 1.0], np.float32)
    edges = np.linspace(0.0, radius(chosen), STEPS + 1)
    middle = value(chosen, (edges[1:] + edges[:-1]) / 2.0)
    absolute, signed = (np.concatenate([[0.0], np.cumsum(f)]) for f in (np.abs(middle), middle))
    if not (np.isfinite(absolute[-1]) and signed[-1] > 1e-6 * absolute[-1]):
        raise SceneError(
            "the filter's integral must be positive", where=f"film.filter {chosen.kind}"
        )
    distances = np.interp(np.linspace(0.0, absolute[-1], CELLS + 1), absolute, edges)
    weights = np.diff(np.interp(distances, edges, signed)) * CELLS / signed[-1]
    return np.concatenate([[CELLS], distances, weights]).astype(np.float32)


def profile(chosen: Filter) -> NDArray[np.float32]:
    """Return the radius, n, and n + 1 values from the centre to there: see kernels/film/spread.cl.

    The integral of the filter, over both sides, is 1. Raises as `table` does.
    """
    table(chosen)
    distances = np.linspace(0.0, radius(chosen), PROFILE + 1)
    values = value(chosen, distances)
    area = 2.0 * np.sum((values[1:] + values[:-1]) / 2.0) * radius(chosen) / PROFILE
    return np.concatenate([[radius(chosen), PROFILE], values / area]).astype(np.float32)


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
