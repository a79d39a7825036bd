"""What lies below a dielectric boundary: pbrt's coats and its scattering bodies, as diffuse bases.

Our plastics reflect (1 - F(wi)) (1 - F(wo)) r / (pi eta^2 (1 - f r)) from a base of albedo r, f
being the share that the boundary reflects back inside. These functions give r.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Values = Any  # a number or an array

COSINES = (np.arange(1024) + 0.5) / 1024.0
EVEN = 2.0 * COSINES / len(COSINES)  # shares of diffuse light at these cosines

# Reduced scattering and absorption [1/mm] for red, green and blue (Jensen et al. 2001, figure 5).
MEDIA = {
    "Apple": ((2.29, 2.39, 1.97), (0.0030, 0.0034, 0.046)),
    "Chicken1": ((0.15, 0.21, 0.38), (0.015, 0.077, 0.19)),
    "Chicken2": ((0.19, 0.25, 0.32), (0.018, 0.088, 0.20)),
    "Cream": ((7.38, 5.47, 3.15), (0.0002, 0.0028, 0.0163)),
    "Ketchup": ((0.18, 0.07, 0.03), (0.061, 0.97, 1.45)),
    "Marble": ((2.19, 2.62, 3.00), (0.0021, 0.0041, 0.0071)),
    "Potato": ((0.68, 0.70, 0.55), (0.0024, 0.0090, 0.12)),
    "Skimmilk": ((0.70, 1.22, 1.90), (0.0014, 0.0025, 0.0142)),
    "Skin1": ((0.74, 0.88, 1.01), (0.032, 0.17, 0.48)),
    "Skin2": ((1.09, 1.59, 1.79), (0.013, 0.070, 0.145)),
    "Spectralon": ((11.6, 20.4, 14.9), (0.0, 0.0, 0.0)),
    "Wholemilk": ((2.55, 3.21, 3.77), (0.0011, 0.0024, 0.014)),
}


def internal_fresnel(ior: float) -> np.ndarray:
    """Fresnel's reflectance of unpolarised light from inside, at COSINES; (n,) float64."""
    sin2 = ior**2 * (1.0 - COSINES**2)
    out = np.sqrt(np.maximum(1.0 - sin2, 0.0))
    across = (ior * COSINES - out) / (ior * COSINES + out)
    along = (COSINES - ior * out) / (COSINES + ior * out)
    return np.where(sin2 < 1.0, 0.5 * (across**2 + along**2), 1.0)


def under_coat(ior: float, thickness: float) -> Callable[[Values], Values]:
    """Return how a base of albedo r looks below an absorbing coat, `thickness` in mean free paths.

    pbrt's coats let exp(-thickness / cos) through even where nothing scatters. With f_d the share
    that is reflected back after two passes, and t the mean of one pass for what is refracted:
    r' / (1 - f r') = t^2 r / (1 - f_d r).
    """
    fresnel, passes = internal_fresnel(ior), np.exp(-thickness / COSINES)
    inside, damped = float(EVEN @ fresnel), float(EVEN @ (fresnel * passes**2))
    twice = transmitted(ior, thickness) ** 2

    def looks(r: Values) -> Values:
        seen = twice * r / (1.0 - damped * r)
        return seen / (1.0 + inside * seen)

    return looks


def transmitted(ior: float, thickness: float) -> float:
    """The share of even light, refracted into a coat, that arrives at its other side."""
    refracted = EVEN * (1.0 - internal_fresnel(ior))
    return float(refracted @ np.exp(-thickness / COSINES) / max(refracted.sum(), 1e-9))


def from_body_reflectance(ior: float) -> Callable[[Values], Values]:
    """Return how the reflectance of a body below its boundary, as pbrt has it, makes a base."""
    inside = float(EVEN @ internal_fresnel(ior))
    return lambda r: r / (1.0 - inside * (1.0 - r))


def body_albedo(scattering: Values, absorption: Values, g: float) -> Values:
    """Diffuse albedo of a half space of single albedo a and mean cosine g (van de Hulst 1980).

    (1 - s) (1 - 0.139 s) / (1 + 1.17 s) with s = sqrt((1 - a) / (1 - a g)).
    """
    total = np.maximum(np.add(scattering, absorption), 1e-30)
    single = np.divide(scattering, total)
    s = np.sqrt((1.0 - single) / np.maximum(1.0 - single * g, 1e-9))
    return (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)
