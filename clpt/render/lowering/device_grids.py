"""Densities that lie on a device: lowering leaves room for their bricks, which kernels fill."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyopencl.array as cl_array

from clpt.render.lowering.tables import TableStore
from clpt.scene.media import Grid

POINT_WORDS = 365  # of a brick, see kernels/motion/brick_density.cl


@dataclass(frozen=True, eq=False)
class DeviceGrid:
    """A density on a device, and where its bricks begin in `images`.

    values: (nx, ny, nz) float32; bricks: their number along each axis.
    """

    values: cl_array.Array
    bricks: tuple[int, ...]
    first: int


def stays_there(medium: Grid) -> bool:
    """Return whether kernels read a density where it is: float32 on a device, z fastest, in 16 bits
    a point, without colours or light."""
    density: Any = medium.density
    more = (medium.albedo_grid, medium.emission_grid, medium.temperature)
    plain = medium.bits == 16 and medium.light is None and all(one is None for one in more)
    return plain and (
        isinstance(density, cl_array.Array)
        and density.dtype == np.float32
        and bool(density.flags.c_contiguous)
    )


def reserve(store: TableStore, density: cl_array.Array, bricks: tuple[int, ...]) -> int:
    """Append room for the bricks of a density to `images`; return its first word."""
    count = int(np.prod(bricks))
    first = store.append("images", np.zeros(count * (2 + POINT_WORDS), np.uint32))
    store.device_grids.append(DeviceGrid(density.view(), bricks, first))
    return first
