"""Walks: which places of the film the slots of a plane take, one after the other, and how far."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FOREVER = np.iinfo(np.int32).max  # an end that no sample reaches

PixelIndices = NDArray[np.int64]


def pixels(settings: NDArray[np.void]) -> tuple[PixelIndices, PixelIndices]:
    """x and y of the pixel of every place (places,), in the order of 4x4 tiles, see film/film.cl."""
    place = np.arange(int(settings["padded_pixels"]))
    row, column = np.divmod(place >> 4, int(settings["tiles_x"]))
    return column * 4 + (place & 3), row * 4 + (place >> 2 & 3)


def inside(settings: NDArray[np.void]) -> PixelIndices:
    """The places that lie in the picture, ascending: its sides need not be multiples of four."""
    x, y = pixels(settings)
    return np.flatnonzero((x < settings["width"]) & (y < settings["height"]))


def table(
    settings: NDArray[np.void], order: PixelIndices, ends: PixelIndices | None = None
) -> NDArray[np.uint32]:
    """Deal places to the slots of a plane by turns; what kernels/film/film.cl calls `walk`.

    order: which places, and in what order; ends: the sample before which each of them is left, by
    default where the exposure ends. (2 * places + per_plane,) uint32.
    """
    padded_pixels, slots = int(settings["padded_pixels"]), int(settings["per_plane"])
    made = np.full(2 * padded_pixels + slots, padded_pixels, np.uint32)
    made[order[:-slots]] = order[slots:]
    made[padded_pixels : 2 * padded_pixels] = FOREVER
    if ends is not None:
        made[padded_pixels + order] = ends
    made[2 * padded_pixels :][: len(order)] = order[:slots]
    return made
