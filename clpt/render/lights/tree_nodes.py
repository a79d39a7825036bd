"""Cones and lobes that the nodes of a light tree hold: where lights shine, and how much.

Cones are as in Conty Estevez and Kulla 2018, 4.1. Lobes tell the mean light in each direction. A
flat light sends its power in proportion to max(n . w, 0), half of n . w + |n . w|. Over many lights
the mean of the first term is the mean normal times w. The mean of the second is about the root of
the mean of (n . w)^2, a quadratic form of w: exact where normals are parallel, 2 / sqrt(3) of it
where they go to all sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.render.lights.bounds import Bounds

EMPTY = -1.0  # theta_o of an empty cone


@dataclass
class Cones:
    """The cones of n lights; see Bounds.

    axis (n, 3); theta_o, theta_e (n,) [rad]; both (n,) bool.
    """

    axis: Floats
    theta_o: Floats
    theta_e: Floats
    both: NDArray[np.bool_]

    @classmethod
    def of(cls, bounds: Bounds) -> Cones:
        return cls(bounds.axis, bounds.theta_o, bounds.theta_e, bounds.both)

    @classmethod
    def none(cls, count: int) -> Cones:
        """Return empty cones."""
        axis = np.tile([0.0, 0.0, 1.0], (count, 1))
        return cls(axis, np.full(count, EMPTY), np.zeros(count), np.zeros(count, bool))

    @property
    def arrays(self) -> tuple[Any, ...]:
        """The arrays, in the order of the fields."""
        return self.axis, self.theta_o, self.theta_e, self.both

    def __getitem__(self, rows: ArrayLike) -> Cones:
        return Cones(*(array[rows] for array in self.arrays))

    def __setitem__(self, rows: ArrayLike, others: Cones) -> None:
        for array, values in zip(self.arrays, others.arrays, strict=True):
            array[rows] = values


def around(cones: Cones, starts: NDArray[np.int64]) -> Cones:
    """Return the cones around the segments of `cones` that begin at `starts`."""
    total = np.add.reduceat(cones.axis, starts)
    length = np.linalg.norm(total, axis=1, keepdims=True)
    lost = length[:, 0] < 1e-6
    axis = np.where(lost[:, None], [0.0, 0.0, 1.0], total / np.where(length > 0.0, length, 1.0))
    counts = np.diff(np.append(starts, len(cones.theta_o)))
    leans = angle(np.repeat(axis, counts, axis=0), cones.axis) + cones.theta_o
    theta_o = np.where(lost, np.pi, np.minimum(np.maximum.reduceat(leans, starts), np.pi))
    return Cones(
        axis,
        theta_o,
        np.maximum.reduceat(cones.theta_e, starts),
        np.logical_or.reduceat(cones.both, starts),
    )


def merged(a: Cones, b: Cones) -> Cones:
    """Return the smallest cones around pairs of cones; either may be empty."""
    swap = b.theta_o > a.theta_o
    wide, thin = _where(swap, b, a), _where(swap, a, b)
    between = angle(wide.axis, thin.axis)
    inside = (thin.theta_o < 0.0) | (np.minimum(between + thin.theta_o, np.pi) <= wide.theta_o)
    theta_o = 0.5 * (wide.theta_o + between + thin.theta_o)
    whole = (theta_o >= np.pi) | (between > np.pi - 1e-6)
    turn = theta_o - wide.theta_o
    sine = np.maximum(np.sin(between), 1e-12)[:, None]
    axis = np.sin(between - turn)[:, None] / sine * wide.axis
    axis = axis + np.sin(turn)[:, None] / sine * thin.axis
    keep = inside | whole
    return Cones(
        np.where(keep[:, None], wide.axis, axis),
        np.where(inside, wide.theta_o, np.where(whole, np.pi, theta_o)),
        np.maximum(wide.theta_e, np.where(thin.theta_o < 0.0, 0.0, thin.theta_e)),
        a.both | b.both,
    )


def measure(cones: Cones) -> Floats:
    """Return the measure of the lit directions (ibid. eq. 2), (n,); 0 for an empty cone."""
    o = np.maximum(cones.theta_o, 0.0)
    w = np.minimum(o + cones.theta_e, np.pi)
    sine, cosine = np.sin(o), np.cos(o)
    edge = 2.0 * w * sine - np.cos(o - 2.0 * w) - 2.0 * o * sine + cosine
    total = 2.0 * np.pi * (1.0 - cosine) + 0.5 * np.pi * edge
    return np.where(cones.theta_o < 0.0, 0.0, total)


def _where(mask: NDArray[np.bool_], a: Cones, b: Cones) -> Cones:
    return Cones(
        np.where(mask[:, None], a.axis, b.axis),
        np.where(mask, a.theta_o, b.theta_o),
        np.where(mask, a.theta_e, b.theta_e),
        np.where(mask, a.both, b.both),
    )


def angle(a: Floats, b: Floats) -> Floats:
    """Return the angles (n,) between unit vectors (n, 3), exact for small angles too (Kahan)."""
    return 2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))


FLAT, ROUND = 0.625, 0.375  # give 1, (2 sqrt(2) / pi)^2 and 3/4 for 1, 2 and 3 equal axes
NEARLY = 1e-3  # [rad]


@dataclass
class Lobes:
    """Sums over lights: power (n,); power times normals (n, 3), times products of the normals'
    components (n, 3, 3), and times centres (n, 3) [m]."""

    power: Floats
    mean: Floats
    second: Floats
    center: Floats

    @classmethod
    def of(cls, bounds: Bounds, power: Floats) -> Lobes:
        """Return the lobes of lights whose normals spread evenly around their axes.

        A light that shines evenly into a cone, up to a hemisphere, counts at most as a surface
        along its normal: the power of several does not lie in a single direction. In a wider cone
        light spreads evenly around the axis, as normals do.
        """
        cosine = np.cos(bounds.theta_o)[:, None]
        square = (1.0 + cosine + cosine**2)[..., None] / 3.0
        outer = bounds.axis[:, :, None] * bounds.axis[:, None, :]
        second = square * outer + 0.5 * (1.0 - square) * (np.eye(3) - outer)
        mean = np.where(bounds.both[:, None], 0.0, bounds.axis * (1.0 + cosine) / 2.0)
        right = np.pi / 2.0
        narrow = (bounds.theta_e < right - NEARLY) & (bounds.theta_o < right + NEARLY)
        height = np.minimum(0.5 / np.maximum(1.0 - cosine, 1e-6), 1.0)
        mean = np.where(narrow[:, None], height * bounds.axis, mean)
        second = np.where(narrow[:, None, None], height[..., None] ** 2 * np.eye(3), second)
        weight = power[:, None]
        return cls(power, weight * mean, weight[..., None] * second, weight * bounds.center)

    def summed(self, order: NDArray[np.int64], starts: NDArray[np.int64]) -> Lobes:
        """Return the sums over the segments of `order` that begin at `starts`."""
        arrays = self.power, self.mean, self.second, self.center
        return Lobes(*(np.add.reduceat(array[order], starts) for array in arrays))

    def means(self) -> tuple[Floats, Floats, Floats]:
        """Return mean (n, 3), second (n, 3, 3) and center (n, 3) of NODE.

        The deviation from the mean in `second` is scaled down, as the root of a mean of squares is
        above the mean: by 1, (2 sqrt(2) / pi)^2 and 3/4 where normals vary equally along 1, 2 and 3
        axes. The factor is linear in the sum of the squared shares of the axes.
        """
        over = 1.0 / np.maximum(self.power, 1e-300)[:, None]
        mean, center = self.mean * over, self.center * over
        parallel = mean[:, :, None] * mean[:, None, :]
        deviation = self.second * over[..., None] - parallel
        trace = np.maximum(np.einsum("nii->n", deviation), 1e-12)
        shares = np.minimum(np.square(deviation).sum(axis=(1, 2)) / trace**2, 1.0)
        return mean, parallel + (FLAT + ROUND * shares)[:, None, None] * deviation, center


def reach(mean: Floats, cones: Cones) -> Floats:
    """Return the cosine (n,) of the largest angle between `mean` (n, 3) and a direction with light.

    -1 where it is unknown, or more than a right angle.
    """
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    between = angle(mean / np.maximum(length, 1e-12), cones.axis)
    total = between + np.maximum(cones.theta_o, 0.0) + cones.theta_e
    bounded = (cones.theta_e < np.pi / 2.0 - NEARLY) & (length[:, 0] > 1e-6)
    return np.where(bounded & (total < np.pi / 2.0), np.cos(total), -1.0)
