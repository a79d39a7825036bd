"""Pixels of a film: the work list of the slots, and the cells of adaptive sampling.

The work list gives each slot of a plane its pixels, their order, and the end of their samples.
Pixels are numbered in the order of 4x4 tiles, with padding, see kernels/film/film.cl. For adaptive
sampling the film is cut into squares, and the pixels of a square into the two colours of a
chessboard: two cells.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Integers

FOREVER = np.iinfo(np.int32).max  # an end that no sample reaches
SIDE = 16  # pixels of a square's side, a multiple of four


def pixels(settings: NDArray[np.void]) -> tuple[Integers, Integers]:
    """Return x and y in the picture of every padded pixel, (padded_pixels,) each."""
    index, margin = np.arange(int(settings["padded_pixels"])), int(settings["margin"])
    row, column = np.divmod(index >> 4, int(settings["tiles_x"]))
    return column * 4 + (index & 3) - margin, row * 4 + (index >> 2 & 3) - margin


def inside(settings: NDArray[np.void]) -> Integers:
    """Return the pixels in the picture, ascending: its sides need not be multiples of four."""
    return _within(settings, 0)


def picture(settings: NDArray[np.void], stored: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """Return stored values of pixels, (padded_pixels,), as a picture, (h, w)."""
    across, margin = int(settings["tiles_x"]), int(settings["margin"])
    rows = stored.reshape(-1, across, 4, 4).swapaxes(1, 2).reshape(-1, 4 * across)
    width, height = int(settings["width"]), int(settings["height"])
    return rows[margin : margin + height, margin : margin + width]


def sampled(settings: NDArray[np.void]) -> Integers:
    """Return the pixels that have samples, ascending: those of the picture and its margin."""
    return _within(settings, int(settings["margin"]))


def _within(settings: NDArray[np.void], margin: int) -> Integers:
    """The pixels in the picture and in a margin around it."""
    x, y = pixels(settings)
    width, height = int(settings["width"]), int(settings["height"])
    across = (-margin <= x) & (x < width + margin)
    return np.flatnonzero(across & (-margin <= y) & (y < height + margin))


def table(
    settings: NDArray[np.void], order: Integers, ends: Integers | None = None
) -> NDArray[np.uint32]:
    """Deal pixels in turn to the slots of a plane; return `work_list` of kernels/film/film.cl.

    order: the pixels, in the order of their samples; ends: the end of the samples of each pixel, by
    default the end of the render. (2 * padded_pixels + per_plane,) uint32: the pixel that follows
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


class CellGrid:
    """The cell of each pixel; settings: of the paths, which give the film's size.

    across: squares in a row; inside: the pixels of the picture, see `inside`; cell:
    (padded_pixels,) of each pixel; pixels: (cells,) number of pixels in each cell.
    """

    def __init__(self, settings: NDArray[np.void]):
        x, y = pixels(settings)
        self.inside = inside(settings)
        self.across, down = (-(-int(settings[name]) // SIDE) for name in ("width", "height"))
        self.cell: Integers = 2 * (y // SIDE * self.across + x // SIDE) + (x + y) % 2
        count = 2 * self.across * down
        self.pixels: Integers = np.bincount(self.cell[self.inside], minlength=count)
