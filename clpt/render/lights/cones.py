"""Cones of the directions in which lights shine (Conty Estevez and Kulla 2018, 4.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.render.lights.bounds import Bounds

EMPTY = -1.0  # theta_o of a cone that holds nothing


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
        """Return the cones of lights."""
        return cls(bounds.axis, bounds.theta_o, bounds.theta_e, bounds.both)

    @classmethod
    def none(cls, count: int) -> Cones:
        """Return cones that hold nothing."""
        axis = np.tile([0.0, 0.0, 1.0], (count, 1))
        return cls(axis, np.full(count, EMPTY), np.zeros(count), np.zeros(count, bool))

    @property
    def arrays(self) -> tuple[Any, ...]:
        """The arrays, in the order of the fields."""
        return self.axis, self.theta_o, self.theta_e, self.both

    def __getitem__(self, rows: ArrayLike) -> Cones:
        return Cones(*(array[rows] for array in self.arrays))

    def __setitem__(self, rows: ArrayLike, others: Cones) -> None:
        for own, given in zip(self.arrays, others.arrays, strict=True):
            own[rows] = given


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
    """Return the smallest cones around pairs of cones, either of which may be empty."""
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
    """Return how much of the sphere light goes to (ibid. eq. 2), (n,); 0 for an empty cone."""
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
    """Return the angles (n,) between unit vectors (n, 3), exact for small ones too (Kahan)."""
    return 2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))
