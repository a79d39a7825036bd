"""A node's share of light to each side, as a tree over lights knows it.

A flat light sends its power in proportion to max(n . w, 0), which is half of n . w + |n . w|. Of
many lights the mean of the first term is that of the normals, times w. The mean of the second one
is about the root of the mean of (n . w)^2, a quadratic form of w: exact where normals are parallel,
2 / sqrt(3) of it where they go to all sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.render.lights.bounds import Bounds
from clpt.render.lights.cones import Cones, angle

FLAT, ROUND = 0.625, 0.375  # so that one, two and three equal axes give 1, (2 sqrt(2) / pi)^2, 3/4
NEARLY = 1e-3  # [rad]


@dataclass
class Lobes:
    """Sums over lights: power (n,); power times their normals (n, 3) and times the products of
    their normals' components (n, 3, 3); power times their centres (n, 3) [m]."""

    power: Floats
    mean: Floats
    second: Floats
    center: Floats

    @classmethod
    def of(cls, bounds: Bounds, power: Floats) -> Lobes:
        """Return what lights send, whose normals lean evenly from their axes.

        One that shines in a cone, up to a hemisphere, sends as much along all of it, but is taken
        to send at most what the normal of a surface sends along it: of several the power is not in
        one direction. In a wider cone light is taken to lean evenly from the axis, as normals do.
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
        """Return mean (n, 3), second (n, 3, 3) and center (n, 3), as NODE has them.

        What differs from the mean in `second` is smaller than in the sums, as the root of a mean of
        squares is above the mean: by 1, (2 sqrt(2) / pi)^2 and 3/4 where normals differ along one,
        two and three axes alike, which a line through the sum of the squares of shares gives.
        """
        over = 1.0 / np.maximum(self.power, 1e-300)[:, None]
        mean, center = self.mean * over, self.center * over
        parallel = mean[:, :, None] * mean[:, None, :]
        apart = self.second * over[..., None] - parallel
        trace = np.maximum(np.einsum("nii->n", apart), 1e-12)
        shares = np.minimum(np.square(apart).sum(axis=(1, 2)) / trace**2, 1.0)
        return mean, parallel + (FLAT + ROUND * shares)[:, None, None] * apart, center


def reach(mean: Floats, cones: Cones) -> Floats:
    """Return the cosine (n,) of the angle from `mean` (n, 3) beyond which nothing shines.

    -1 where that is not known, or more than a right angle.
    """
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    between = angle(mean / np.maximum(length, 1e-12), cones.axis)
    total = between + np.maximum(cones.theta_o, 0.0) + cones.theta_e
    bounded = (cones.theta_e < np.pi / 2.0 - NEARLY) & (length[:, 0] > 1e-6)
    return np.where(bounded & (total < np.pi / 2.0), np.cos(total), -1.0)
