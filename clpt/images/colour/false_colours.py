"""False colours: numbers from 0 to 1 as colours from dark to bright."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Bytes

# From few to many: of matplotlib's "inferno", which is as even in grey.
SCALE: Final = (
    "#000004", "#1b0c41", "#4a0c6b", "#781c6d", "#a52c60", "#cf4446", "#ed6925", "#fb9b06",
    "#f7d13d", "#fcffa4",
)  # fmt: skip


def false_colours(share: NDArray[Any]) -> Bytes:
    """Return numbers (h, w) from 0 to 1 as colours of the scale, (h, w, 3) uint8."""
    table = np.array([[int(one[i : i + 2], 16) for i in (1, 3, 5)] for one in SCALE], float)
    at = np.linspace(0.0, 1.0, len(table))
    fine = np.linspace(0.0, 1.0, 256)
    steps = np.stack([np.interp(fine, at, column) for column in table.T], axis=1)
    index = np.clip(np.rint(255.0 * share), 0, 255).astype(np.uint8)
    return np.rint(steps).astype(np.uint8)[index]
