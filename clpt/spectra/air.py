"""Clear air: how deep it is by wavelength, and how dense by height."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.spectra.data import table

Floats = NDArray[np.float64]


def _shares() -> tuple[Floats, Floats]:
    """Heights [km], and the logarithm of the share of the column in a km, linear in between."""
    height, density = table("air.csv").T
    fall = np.diff(np.log(density))
    return height, np.log(density / (np.diff(density) / fall * np.diff(height)).sum())


SHARES = _shares()


def depth(lambdas: ArrayLike) -> Floats:
    """Optical depth of clear air over the sea at lambdas [nm] (Bodhaine et al. 1999, eq. 30)."""
    square = (np.asarray(lambdas, np.float64) / 1000.0) ** 2
    above = 1.0455996 - 341.29061 / square - 0.90230850 * square
    return 0.0021520 * above / (1.0 + 0.0027059889 / square - 85.968563 * square)


def share(height: ArrayLike) -> Floats:
    """The share of the column in a km at heights [km] (U.S. Standard Atmosphere 1976)."""
    return np.exp(np.interp(np.asarray(height, np.float64), *SHARES))
