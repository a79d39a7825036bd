"""Numbers on a grid in a box, as in files of volumes and in media."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import in_memory
from clpt.errors import SceneError
from clpt.scene.values import Matrix4


@dataclass(frozen=True, eq=False)
class Volume:
    """Numbers on a grid, and where its box is.

    values: (nx, ny, nz), in a numpy array or a pyopencl.array.Array; to_world: 4x4, which takes the
    unit cube from (0, 0, 0) to (1, 1, 1) to the grid's box.
    """

    values: Any
    to_world: Matrix4

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", in_memory(self.values))


def check_density(values: np.ndarray, where: str) -> None:
    """Raise SceneError for numbers that are negative or not finite."""
    if values.dtype.kind not in "fui":
        raise SceneError(f"must hold numbers, not {values.dtype}", where=where)
    low, high = float(values.min()), float(values.max())
    if not (np.isfinite(low) and np.isfinite(high)):
        raise SceneError("has numbers that are not finite", where=where)
    if low < 0.0:
        raise SceneError(f"is negative somewhere: {low:g}", where=where)


def check_volume(values: object, where: str, colours: bool = False) -> None:
    """Raise SceneError unless values are (nx, ny, nz), or (nx, ny, nz, 3) for `colours`.

    The numbers must be finite and not negative. Arrays on a device are not read.
    """
    axes, shown = ((3,), "(nx, ny, nz, 3)") if colours else ((), "(nx, ny, nz)")
    if not hasattr(values, "shape"):
        raise SceneError("must be an array with the axes x, y and z", where=where)
    if len(values.shape) != 3 + len(axes) or values.shape[3:] != axes or not all(values.shape):
        raise SceneError(f"must be an array {shown}, not of the shape {values.shape}", where=where)
    if isinstance(values, np.ndarray):
        check_density(values, where)


def resampled(
    values: NDArray[Any],
    to_world: Matrix4,
    shape: tuple[int, ...],
    onto: Matrix4,
    *,
    hold: bool = False,
) -> NDArray[np.float32]:
    """Return the numbers of a grid at the points of another: (*shape, ...) float32.

    values: (nx, ny, nz, ...) in the box of `to_world`, trilinear between the centres of cells;
    shape, onto: of the other grid. Beyond the box there is 0, or, to hold, what is at its ends.
    """
    size = np.array(values.shape[:3])
    axes = [(np.arange(n) + 0.5) / n for n in shape]
    matrix = np.linalg.inv(np.asarray(to_world, float)) @ np.asarray(onto, float)
    points = np.empty((*shape, *values.shape[3:]), np.float32)
    y, z = (axis.ravel() for axis in np.meshgrid(axes[1], axes[2], indexing="ij"))
    for i, x in enumerate(axes[0]):  # a slice at a time: grids may be large
        unit = np.stack([np.full_like(y, x), y, z], axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
        inside = ((unit >= -1e-9) & (unit <= 1.0 + 1e-9)).all(axis=1) | hold
        at = np.clip(unit * size - 0.5, 0.0, size - 1.0)
        low = np.minimum(at.astype(int), np.maximum(size - 2, 0))
        share = at - low
        sums = np.zeros((len(at), *values.shape[3:]))
        for corner in np.ndindex(2, 2, 2):
            weight = np.where(corner, share, 1.0 - share).prod(axis=1) * inside
            index = tuple(np.minimum(low + corner, size - 1).T)
            sums += weight.reshape(-1, *[1] * (values.ndim - 3)) * values[index]
        points[i] = sums.reshape(points.shape[1:])
    return points
