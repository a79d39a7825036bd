"""The refractive index of water: IAPWS 1997, release on the refractive index of ordinary water."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.errors import SceneError

RANGE = (200.0, 1900.0)  # [nm] within which the release holds
A = (
    0.244257733, 9.74634476e-3, -3.73234996e-3, 2.68678472e-4,
    1.58920570e-3, 2.45934259e-3, 0.900704920, -1.66626219e-2,
)  # fmt: skip
ULTRAVIOLET, INFRARED = 0.2292020, 5.432937


def water_index(
    lambdas: ArrayLike, celsius: float = 15.0, density: float = 0.0
) -> NDArray[np.float64]:
    """Return the index of liquid water at wavelengths [nm] in vacuum, float64.

    celsius: its temperature; density: [kg/m^3], 0 for that of water at 1 atm (Kell 1975). Raises
    SceneError for a wavelength outside 200 to 1900 nm or water that is not liquid.
    """
    given = np.asarray(lambdas, np.float64)
    if given.size and not (RANGE[0] <= given.min() and given.max() <= RANGE[1]):
        raise SceneError(
            f"of water it is known from {RANGE[0]:g} to {RANGE[1]:g} nm, not at {given.min():g} to"
            f" {given.max():g} nm",
            where="index",
        )
    if not -12.0 <= celsius <= 100.0:
        raise SceneError(f"water of {celsius:g} C; it must be -12 to 100 C", where="celsius")
    rho, t = (density or _density(celsius)) / 1000.0, (celsius + 273.15) / 273.15
    square = (given / 589.0) ** 2
    right = (
        A[0] + A[1] * rho + A[2] * t + A[3] * square * t + A[4] / square
        + A[5] / (square - ULTRAVIOLET**2) + A[6] / (square - INFRARED**2) + A[7] * rho**2
    )  # fmt: skip
    ratio = rho * right
    return np.asarray(np.sqrt((1.0 + 2.0 * ratio) / (1.0 - ratio)))


def _density(t: float) -> float:
    """Kell 1975: of water at 1 atm [kg/m^3]."""
    top = 999.83952 + t * (16.945176 + t * (-7.9870401e-3 + t * (
        -46.170461e-6 + t * (105.56302e-9 - 280.54253e-12 * t))))  # fmt: skip
    return top / (1.0 + 16.879850e-3 * t)
