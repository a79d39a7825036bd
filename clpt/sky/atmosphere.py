"""The air over a round earth: its columns along rays, and its phase functions.

Lengths are in km. `clpt.spectra.air` has the air's constituents. Rays are straight.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.spectra.air import DEPOLARISED, EARTH, densities

TOP = EARTH + 100.0  # radius of the top of the air
NODES = 32  # of a column to the top


def to_top(radius: Floats, cosine: Floats) -> Floats:
    """Return distances to the top [km] of rays from a radius, with a cosine to the vertical."""
    square = np.maximum(TOP**2 - radius**2 * (1.0 - cosine**2), 0.0)
    return np.maximum(np.sqrt(square) - radius * cosine, 0.0)


def columns(radius: ArrayLike, cosine: ArrayLike) -> Floats:
    """Return columns (3, ...) from a radius [km] to the top, over the vertical columns at the sea.

    cosine: to the vertical, 0 to 1.
    """
    r, mu = np.broadcast_arrays(np.asarray(radius, np.float64), np.asarray(cosine, np.float64))
    x, w = np.polynomial.legendre.leggauss(NODES)
    x, w = 0.5 + 0.5 * x, 0.5 * w
    far, total = to_top(r, mu), np.zeros((3, *r.shape))
    for u, weight in zip(x, w, strict=True):
        t = far * u**3
        height = np.sqrt(r * r + t * t + 2.0 * r * mu * t) - EARTH
        total += densities(height) * (weight * 3.0 * u * u * far)
    return total


def sun_columns(radius: ArrayLike, cosine: ArrayLike) -> tuple[Floats, NDArray[np.bool_]]:
    """Return columns (3, ...) toward the sun, and whether the earth leaves it visible.

    cosine: of the sun's direction to the vertical, -1 to 1.
    """
    r, mu = np.broadcast_arrays(np.asarray(radius, np.float64), np.asarray(cosine, np.float64))
    nearest = r * np.sqrt(np.maximum(1.0 - mu * mu, 0.0))
    seen = (mu >= 0.0) | (nearest > EARTH)
    depths = columns(r, np.abs(mu))
    past = (mu < 0.0) & seen
    if past.any():
        depths[:, past] = 2.0 * columns(nearest[past], np.zeros(int(past.sum()))) - depths[:, past]
    return depths, seen


def rayleigh_phase(cosine: ArrayLike) -> Floats:
    """Phase function of air [1/sr] (Chandrasekhar 1960, with its depolarisation)."""
    square = np.asarray(cosine, np.float64) ** 2
    g = DEPOLARISED
    return 3.0 / (16.0 * np.pi * (1.0 + 2.0 * g)) * ((1.0 + 3.0 * g) + (1.0 - g) * square)


def aerosol_phase(cosine: ArrayLike, g: float) -> Floats:
    """Henyey and Greenstein's phase function [1/sr]."""
    below = 1.0 + g * g - 2.0 * g * np.asarray(cosine, np.float64)
    return (1.0 - g * g) / (4.0 * np.pi * below**1.5)
