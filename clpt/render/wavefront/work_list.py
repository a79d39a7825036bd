"""The work list: which pixels of the film each slot of a plane samples, in what order, how far."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FOREVER = np.iinfo(np.int32).max  # an end that no sample reaches

PixelIndices = NDArray[np.int64]  # of padded pixels, in the order of 4x4 tiles, see film/film.cl


def pixels(settings: NDArray[np.void]) -> tuple[PixelIndices, PixelIndices]:
    """Return x and y of every padded pixel, (padded_pixels,) each."""
    index = np.arange(int(settings["padded_pixels"]))
    row, column = np.divmod(index >> 4, int(settings["tiles_x"]))
    return column * 4 + (index & 3), row * 4 + (index >> 2 & 3)


def inside(settings: NDArray[np.void]) -> PixelIndices:
    """Return the pixels in the picture, ascending: its sides need not be multiples of four."""
    x, y = pixels(settings)
    return np.flatnonzero((x < settings["width"]) & (y < settings["height"]))


def table(
    settings: NDArray[np.void], order: PixelIndices, ends: PixelIndices | None = None
) -> NDArray[np.uint32]:
    """Deal pixels in turn to the slots of a plane; return `work_list` of kernels/film/film.cl.

    order: which pixels, and in what order; ends: the sample before which each of them is left, by
    default where the render ends. (2 * padded_pixels + per_plane,) uint32: the pixel that follows
    each pixel, the end of each, and the first pixel of each slot; padded_pixels stands for none.
    """
    padded_pixels, slots = int(settings["padded_pixels"]), int(settings["per_plane"])
    words = np.full(2 * padded_pixels + slots, padded_pixels, np.uint32)
    words[order[:-slots]] = order[slots:]
    words[padded_pixels : 2 * padded_pixels] = FOREVER
    if ends is not None:
        words[padded_pixels + order] = ends
    words[2 * padded_pixels :][: len(order)] = order[:slots]
    return words
