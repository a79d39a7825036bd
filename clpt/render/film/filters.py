"""Pixel filters as tables for kernels, which sample filters and evaluate them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.render.records.tables import TableStore
from clpt.scene.integrators import Filter

CELLS = 1024  # of equal probability, on each side
PROFILE = 256  # steps of a filter's values
STEPS = 1 << 16  # of the numerical integral of a filter
LEAST = 1e-6  # share of the integral of |f| that the integral of f must exceed


def encode_filter(pixel_filter: Filter, store: TableStore, splatting: bool) -> None:
    """Put a filter's table into `distributions`, where kernels expect it to be the first.

    splatting: whether a sample serves all pixels whose filters hold it. The table then has the
    filter's values, else cells to sample. Raises SceneError if `distributions` is not empty, and as
    `sampling_table` does.
    """
    table = profile_table(pixel_filter) if splatting else sampling_table(pixel_filter)
    if store.append_floats("distributions", table) != 0:
        raise SceneError("the pixel filter has to be encoded first")


def encode_profile(pixel_filter: Filter, store: TableStore, splatting: bool) -> int:
    """Return the first word of a filter's values in `distributions`, which light paths need.

    splatting: whether `encode_filter` has already appended these values.
    """
    return 0 if splatting else store.append_floats("distributions", profile_table(pixel_filter))


def integrals(pixel_filter: Filter) -> tuple[Floats, Floats, Floats]:
    """Return edges of steps (n,), and the integrals of |f| and of f up to each, in steps.

    Raises SceneError for a filter whose integral is not positive.
    """
    edges = np.linspace(0.0, pixel_filter.half_width, STEPS + 1)
    values = pixel_filter.value((edges[1:] + edges[:-1]) / 2.0)
    absolute, signed = (np.concatenate([[0.0], np.cumsum(f)]) for f in (np.abs(values), values))
    if not (np.isfinite(absolute[-1]) and signed[-1] > LEAST * absolute[-1]):
        message = "the filter's integral must be positive"
        raise SceneError(message, where=f"film.filter {pixel_filter.kind}")
    return edges, absolute, signed


def sampling_table(pixel_filter: Filter) -> NDArray[np.float32]:
    """Return n, then n + 1 distances, then n weights: see kernels/film/filter.cl.

    Cells have equal shares of the integral of |f|. A cell's weight is n times its share of the
    integral of f, so that the weights' mean is 1. Raises SceneError as `integrals` does.
    """
    if pixel_filter.is_constant:
        return np.array([1.0, 0.0, pixel_filter.half_width, 1.0], np.float32)
    edges, absolute, signed = integrals(pixel_filter)
    distances = np.interp(np.linspace(0.0, absolute[-1], CELLS + 1), absolute, edges)
    weights = np.diff(np.interp(distances, edges, signed)) * CELLS / signed[-1]
    return np.concatenate([[CELLS], distances, weights]).astype(np.float32)


def profile_table(pixel_filter: Filter) -> NDArray[np.float32]:
    """Return the radius, n, and n + 1 values from the centre to there: see kernels/film/filter.cl.

    The integral of the filter, over both sides, is 1.
    """
    radius = pixel_filter.half_width
    values = pixel_filter.value(np.linspace(0.0, radius, PROFILE + 1))
    area = 2.0 * np.sum((values[1:] + values[:-1]) / 2.0) * radius / PROFILE
    return np.concatenate([[radius, PROFILE], values / area]).astype(np.float32)
