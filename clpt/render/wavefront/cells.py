"""The cells of a film, by which adaptive sampling decides.

The film is cut into squares, and their pixels into the two colours of a chessboard: two cells.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Integers
from clpt.render.wavefront import work_list

SIDE = 16  # pixels of a square's side, a multiple of four


class CellGrid:
    """Which cell each pixel is in; settings: those of the paths, which say the film's size.

    across: squares in a row; inside: the pixels of the picture, see `work_list.inside`; cell:
    (padded_pixels,) of each pixel; pixels: (cells,) how many each has.
    """

    def __init__(self, settings: NDArray[np.void]):
        x, y = work_list.pixels(settings)
        self.inside = work_list.inside(settings)
        self.across, down = (-(-int(settings[name]) // SIDE) for name in ("width", "height"))
        self.cell: Integers = 2 * (y // SIDE * self.across + x // SIDE) + (x + y) % 2
        count = 2 * self.across * down
        self.pixels: Integers = np.bincount(self.cell[self.inside], minlength=count)
