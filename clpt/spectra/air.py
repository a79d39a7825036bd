"""The air: optical depth by wavelength and density by height of gas, aerosol and ozone.

Heights are in km. Extinction has three parts: air that scatters after Rayleigh, aerosol, and ozone,
which absorbs. Air: Bodhaine et al. 1999, its depolarisation 0.0279 too. Aerosol: exponential, power
law of wavelength (Angstrom 1929), Henyey and Greenstein's phase function. Ozone lies in a layer
after Green 1964.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from clpt.arrays import Floats
from clpt.spectra.data import table

EARTH = 6371.0  # radius [km]
AEROSOL_HEIGHT = 1.2  # scale height: the density falls to 1/e [km]
OZONE_MIDDLE, OZONE_WIDTH = 23.25, 4.63  # of the layer [km]
DOBSON = 2.687e20  # molecules over a square metre
DEPOLARISED = 0.0279 / (2.0 - 0.0279)  # gamma of the phase function of air


def _solar() -> tuple[Floats, Floats, Floats]:
    rows = table("sky.csv")
    return rows[:, 0], rows[:, 1], rows[:, 2] * 1e-25


LAMBDAS, SUNLIGHT, OZONE = _solar()  # [nm], [W m^-2 nm^-1] above the air, [m^2] a molecule


def _shares() -> tuple[Floats, Floats]:
    """Return heights [km] and the logarithm of the column's share per km; linear in between."""
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


@dataclass(frozen=True)
class Atmosphere:
    """Contents of the air: aerosol and ozone.

    aerosol: optical depth at 550 nm; exponent: of its fall with wavelength; aerosol_albedo: share
    that is scattered; asymmetry: g of its phase function; ozone [Dobson units].
    """

    aerosol: float
    exponent: float
    aerosol_albedo: float
    asymmetry: float
    ozone: float

    def depths(self, lambdas: ArrayLike) -> Floats:
        """Optical depths straight up from the sea of air, aerosol and ozone, (3, n)."""
        nm = np.asarray(lambdas, np.float64)
        molecule = np.interp(nm, LAMBDAS, OZONE)
        aerosol = self.aerosol * (nm / 550.0) ** -self.exponent
        return np.stack([depth(nm), aerosol, molecule * DOBSON * self.ozone])


def densities(height: ArrayLike) -> Floats:
    """Shares of the columns of air, aerosol and ozone in a km at heights [km], (3, ...)."""
    h = np.asarray(height, np.float64)
    layer = np.exp(-np.abs(h - OZONE_MIDDLE) / OZONE_WIDTH)  # even in its argument
    return np.stack(
        [
            share(h),
            np.exp(-h / AEROSOL_HEIGHT) / AEROSOL_HEIGHT,
            layer / (OZONE_WIDTH * (1.0 + layer) ** 2),
        ]
    )
