"""Grids to choose directions by on their way to the device, see kernels/core/grid.cl."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

from numpy.typing import ArrayLike, NDArray

from clpt.render.lights.block_grids import BlockGrid
from clpt.render.materials.encoder import Encoder


def members(corners: NDArray[Any], grid: BlockGrid, encoder: Encoder) -> dict[str, ArrayLike]:
    """Put a grid, and the weights at its corners, into the tables; return a record's members.

    A power of two brings the largest weight next to 1, so that squares of weights stay in float32.
    """
    append = partial(encoder.store.append_floats, "distributions")
    unit = 2.0 ** math.frexp(float(corners.max()))[1]
    return {
        "corners": append(corners / unit),
        "marginal": append(grid.marginal),
        "conditional": append(grid.conditional),
        "blocks": append(grid.blocks),
        "block_rows": grid.block_rows,
        "block_columns": grid.block_columns,
        "norm": unit / grid.total if grid.total > 0.0 else 0.0,
    }
