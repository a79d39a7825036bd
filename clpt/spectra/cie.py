"""Standard observers, colour spaces and the sampling of wavelengths.

A spectrum's XYZ is its sum with the observer at 1 nm over [LAMBDA_MIN, LAMBDA_MAX], divided by
CIE_Y_INTEGRAL: the constant spectrum 1 has luminance 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.errors import SceneError
from clpt.records import IMPORTANCE
from clpt.spectra import data

LAMBDA_MIN, LAMBDA_MAX = 360.0, 830.0  # [nm], the observers' range

# ITU-R BT.709 primaries (x, y); the white is D65 as tabulated, so that grey stays exactly grey.
REC709_PRIMARIES = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))

# Centre [nm] and slope [1/nm] of the visible-importance density (Radziszewski et al. 2009).
SAMPLING_CENTRE, SAMPLING_SLOPE = IMPORTANCE["peak"], IMPORTANCE["slope"]

OBSERVERS = ("1931", "1964")


def cie_xyz(lambdas: ArrayLike, observer: str = "1931") -> NDArray[np.float64]:
    """Colour matching functions at `lambdas` [nm] (n,), linear between 1 nm rows: (n, 3) float64.

    Zero outside the table. Raises SceneError for an observer other than "1931" (2 degrees) and
    "1964" (10 degrees).
    """
    if observer not in OBSERVERS:
        raise SceneError(f"unknown observer {observer!r}; known: {', '.join(OBSERVERS)}")
    rows = data.table(f"cie{observer}.csv")
    lambdas = np.asarray(lambdas, np.float64)
    columns = [np.interp(lambdas, rows[:, 0], rows[:, i], 0.0, 0.0) for i in (1, 2, 3)]
    return np.stack(columns, axis=-1)


GRID = np.arange(LAMBDA_MIN, LAMBDA_MAX + 1.0)
_OBSERVER = cie_xyz(GRID)
CIE_Y_INTEGRAL = float(_OBSERVER[:, 1].sum())  # [nm], 106.856895


def spectrum_to_xyz(values: ArrayLike) -> NDArray[np.float64]:
    """XYZ (1931 observer) of spectra given on GRID, (..., 471) -> (..., 3) float64."""
    return np.asarray(values, np.float64) @ _OBSERVER / CIE_Y_INTEGRAL


def _d65_white() -> NDArray[np.float64]:
    rows = data.table("illuminants/D65.csv")
    xyz = spectrum_to_xyz(np.interp(GRID, rows[:, 0], rows[:, 1]))
    return xyz / xyz[1]


def primaries_to_xyz(primaries_xy: ArrayLike, white: NDArray[np.float64]) -> NDArray[np.float64]:
    """The matrix (3, 3) to XYZ from primaries (3, 2) that are (x, y), whose sum is `white` (3,)."""
    xy = np.asarray(primaries_xy, np.float64).T
    primaries = np.vstack([xy[0] / xy[1], np.ones(3), (1.0 - xy[0] - xy[1]) / xy[1]])
    return primaries * np.linalg.solve(primaries, white)


D65_WHITE = _d65_white()
REC709_TO_XYZ = primaries_to_xyz(REC709_PRIMARIES, D65_WHITE)
XYZ_TO_REC709 = np.linalg.inv(REC709_TO_XYZ).astype(np.float64)
for _constant in (GRID, _OBSERVER, D65_WHITE, REC709_TO_XYZ, XYZ_TO_REC709):
    _constant.setflags(write=False)


def xyz_to_rgb(xyz: ArrayLike) -> NDArray[np.float64]:
    """XYZ to linear Rec.709, (..., 3) -> (..., 3) float64; not clamped."""
    return np.asarray(xyz, np.float64) @ XYZ_TO_REC709.T


def rgb_to_xyz(rgb: ArrayLike) -> NDArray[np.float64]:
    """Linear Rec.709 to XYZ, (..., 3) -> (..., 3) float64."""
    return np.asarray(rgb, np.float64) @ REC709_TO_XYZ.T


def luminance(rgb: ArrayLike) -> NDArray[np.float64]:
    """Relative luminance Y of linear Rec.709, (..., 3) -> (...) float64."""
    return np.asarray(rgb, np.float64) @ REC709_TO_XYZ[1]


def sample_wavelengths(
    u: ArrayLike, lo: float = LAMBDA_MIN, hi: float = LAMBDA_MAX
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Wavelengths [nm] and their pdf [1/nm] for uniform `u` in [0, 1), by visible importance.

    The density is sech^2(0.0072 (lambda - 538)) truncated to [lo, hi] (Radziszewski et al. 2009);
    its distribution function is a tanh, so the inverse is exact for every range.
    """
    first, last = tanh_ends(lo, hi)
    t = first + np.asarray(u, np.float64) * (last - first)
    lambdas = np.clip(SAMPLING_CENTRE + np.arctanh(t) / SAMPLING_SLOPE, lo, hi)
    return lambdas, SAMPLING_SLOPE * (1.0 - t * t) / (last - first)


def wavelength_pdf(
    lambdas: ArrayLike, lo: float = LAMBDA_MIN, hi: float = LAMBDA_MAX
) -> NDArray[np.float64]:
    """Density [1/nm] of `sample_wavelengths`; zero outside [lo, hi]."""
    first, last = tanh_ends(lo, hi)
    lambdas = np.asarray(lambdas, np.float64)
    t = np.tanh(SAMPLING_SLOPE * (lambdas - SAMPLING_CENTRE))
    inside = (lambdas >= lo) & (lambdas <= hi)
    return np.where(inside, SAMPLING_SLOPE * (1.0 - t * t) / (last - first), 0.0)


def tanh_ends(lo: float, hi: float) -> tuple[float, float]:
    """Return the distribution function's tanh at both ends of a range [nm]. Raises SceneError."""
    if not 0.0 < lo < hi:
        raise SceneError(f"the range of wavelengths [{lo}, {hi}] nm is empty or not positive")
    first, last = np.tanh(SAMPLING_SLOPE * (np.array([lo, hi]) - SAMPLING_CENTRE))
    return float(first), float(last)
