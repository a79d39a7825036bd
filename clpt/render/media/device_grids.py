"""Densities that kernels put into bricks, for which lowering leaves room.

They lie on a device, or are those of clouds, which are worked out there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import pyopencl.array as cl_array
from numpy.typing import NDArray

from clpt.records import BRICK_SIZES
from clpt.render.records.tables import TableStore
from clpt.scene.media import ON_POINTS, Cloud, Grid
from clpt.scene.params import fields_of

POINT_WORDS = BRICK_SIZES["words"]


@dataclass(frozen=True, eq=False)
class CloudDensity:
    """The density of a cloud at points; numbers: see kernels/stage/cloud_density.cl, float32."""

    shape: tuple[int, ...]
    numbers: NDArray[np.float32]


Values: TypeAlias = cl_array.Array | CloudDensity


@dataclass(frozen=True, eq=False)
class DeviceGrid:
    """A density that kernels put into bricks, and where these begin in `images`.

    values: (nx, ny, nz) float32, or what makes them; bricks: their number along each axis.
    """

    values: Values
    bricks: tuple[int, ...]
    first: int


def stays_there(medium: Grid) -> bool:
    """Return whether kernels read a density where it is.

    They do if it is float32 on a device, z fastest, in 16 bits a point, without colours or light.
    """
    density = medium.density
    more = [fields_of(medium)[name] for name in ON_POINTS]
    plain = medium.bits == 16 and medium.light is None and all(one is None for one in more)
    return plain and (
        isinstance(density, cl_array.Array)
        and density.dtype == np.float32
        and bool(density.flags.c_contiguous)
    )


def cloud_density(cloud: Cloud) -> CloudDensity:
    """Return what makes the density of a cloud, at the centres of the cells of its box."""
    step = (np.asarray(cloud.high, float) - np.asarray(cloud.low, float)) / cloud.size
    first = np.asarray(cloud.low, float) + 0.5 * step
    own = (cloud.density, cloud.wispiness, cloud.frequency)
    return CloudDensity(cloud.size, np.array([*first, *step, *own], np.float32))


def reserve(store: TableStore, density: Values, bricks: tuple[int, ...]) -> int:
    """Append room for the bricks of a density to `images`; return its first word."""
    count = int(np.prod(bricks))
    first = store.append("images", np.zeros(count * (2 + POINT_WORDS), np.uint32))
    own = density if isinstance(density, CloudDensity) else density.view()
    store.device_grids.append(DeviceGrid(own, bricks, first))
    return first
