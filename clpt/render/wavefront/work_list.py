"""The work list: which pixels of the film each slot of a plane samples, in what order, how far.

Indices of pixels are of padded ones, in the order of 4x4 tiles, see kernels/film/film.cl.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Integers

FOREVER = np.iinfo(np.int32).max  # an end that no sample reaches


def pixels(settings: NDArray[np.void]) -> tuple[Integers, Integers]:
    """Return x and y in the picture of every padded pixel, (padded_pixels,) each."""
    index, margin = np.arange(int(settings["padded_pixels"])), int(settings["margin"])
    row, column = np.divmod(index >> 4, int(settings["tiles_x"]))
    return column * 4 + (index & 3) - margin, row * 4 + (index >> 2 & 3) - margin


def inside(settings: NDArray[np.void]) -> Integers:
    """Return the pixels in the picture, ascending: its sides need not be multiples of four."""
    return _within(settings, 0)


def picture(settings: NDArray[np.void], stored: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return what pixels have (padded_pixels,), as they are stored, row by row: (h, w)."""
    across, margin = int(settings["tiles_x"]), int(settings["margin"])
    rows = stored.reshape(-1, across, 4, 4).swapaxes(1, 2).reshape(-1, 4 * across)
    width, height = int(settings["width"]), int(settings["height"])
    return rows[margin : margin + height, margin : margin + width]


def sampled(settings: NDArray[np.void]) -> Integers:
    """Return the pixels that have samples, ascending: those of the picture and its margin."""
    return _within(settings, int(settings["margin"]))


def _within(settings: NDArray[np.void], margin: int) -> Integers:
    """The pixels in the picture and in so many around it."""
    x, y = pixels(settings)
    width, height = int(settings["width"]), int(settings["height"])
    across = (-margin <= x) & (x < width + margin)
    return np.flatnonzero(across & (-margin <= y) & (y < height + margin))


def table(
    settings: NDArray[np.void], order: Integers, ends: Integers | None = None
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
