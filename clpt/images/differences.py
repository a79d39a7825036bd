"""Differences of two images, in figures that renderers are compared by."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats

EPSILON = 0.01  # beside the square of the reference, where that is dark


@dataclass(frozen=True)
class Differences:
    """Figures of a - b over all values of two images; b is the reference.

    means: of a and of b; bias: mean of a - b; absolute: mean of |a - b|; mean_square;
    relative_square: mean of (a - b)^2 / (b^2 + EPSILON), as renderers are compared by; largest:
    |a - b|; where: x, y and channel of that; lost: values that are not finite in one of the two,
    which are left out.
    """

    means: tuple[float, float]
    bias: float
    absolute: float
    mean_square: float
    relative_square: float
    largest: float
    where: tuple[int, int, int]
    lost: int

    @property
    def root_mean_square(self) -> float:
        """The root of the mean square."""
        return math.sqrt(self.mean_square)


def differences(a: NDArray[np.float32], b: NDArray[np.float32]) -> Differences:
    """Compare two images (h, w, n) of one shape."""
    first, second = a.astype(np.float64), b.astype(np.float64)
    known = np.isfinite(first) & np.isfinite(second)
    first, second = np.where(known, first, 0.0), np.where(known, second, 0.0)
    count, apart = max(int(known.sum()), 1), first - second
    y, x, channel = np.unravel_index(int(np.abs(apart).argmax()), apart.shape)
    return Differences(
        means=(float(first.sum() / count), float(second.sum() / count)),
        bias=float(apart.sum() / count),
        absolute=float(np.abs(apart).sum() / count),
        mean_square=float((apart**2).sum() / count),
        relative_square=float((apart**2 / (second**2 + EPSILON)).sum() / count),
        largest=float(np.abs(apart).max()),
        where=(int(x), int(y), int(channel)),
        lost=known.size - int(known.sum()),
    )


def size_of(a: NDArray[np.float32], b: NDArray[np.float32]) -> Floats:
    """Return the root of the mean square of a - b over the channels of each pixel, (h, w)."""
    apart = np.nan_to_num(a.astype(np.float64) - b, nan=0.0, posinf=0.0, neginf=0.0)
    return np.asarray(np.sqrt((apart**2).mean(axis=2)))
