"""Pixel filters on their way to the device: tables to sample them by, and of their values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.render.film.filters import integrals, radius, value
from clpt.render.records.tables import TableStore
from clpt.scene.integrators import Box, Filter

CELLS = 1024  # of equal probability, on one side
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


def table(chosen: Filter) -> NDArray[np.float32]:
    """Return n, then n + 1 distances, then n weights: see kernels/film/filter.cl.

    Cells have equal shares of the integral of |f|; a cell's weight is its share of the integral of
    f, times n, so that the weights' mean is 1.
    """
    if isinstance(chosen, Box):
        return np.array([1.0, 0.0, chosen.radius, 1.0], np.float32)
    edges, absolute, signed = integrals(chosen)
    distances = np.interp(np.linspace(0.0, absolute[-1], CELLS + 1), absolute, edges)
    weights = np.diff(np.interp(distances, edges, signed)) * CELLS / signed[-1]
    return np.concatenate([[CELLS], distances, weights]).astype(np.float32)


def profile(chosen: Filter) -> NDArray[np.float32]:
    """Return the radius, n, and n + 1 values from the centre to there: see kernels/film/spread.cl.

    The integral of the filter, over both sides, is 1.
    """
    distances = np.linspace(0.0, radius(chosen), PROFILE + 1)
    values = value(chosen, distances)
    area = 2.0 * np.sum((values[1:] + values[:-1]) / 2.0) * radius(chosen) / PROFILE
    return np.concatenate([[radius(chosen), PROFILE], values / area]).astype(np.float32)
