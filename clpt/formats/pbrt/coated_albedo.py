"""Diffuse bases below a dielectric boundary, for pbrt's coats and its scattering bodies.

Our plastics reflect (1 - F(wi)) (1 - F(wo)) r / (pi eta^2 (1 - f r)) from a base of albedo r, f
being the share that the boundary reflects back inside. These functions give r.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources import files
from typing import Any

import numpy as np

Values = Any  # a number or an array

COSINES = (np.arange(1024) + 0.5) / 1024.0
EVEN = 2.0 * COSINES / len(COSINES)  # shares of diffuse light at these cosines


def _measured() -> dict[str, tuple[tuple[float, ...], tuple[float, ...]]]:
    """Reduced scattering and absorption [1/mm] by name, see measured_media.csv."""
    text = files("clpt.formats.pbrt").joinpath("measured_media.csv").read_text("utf-8")
    rows = [line.split(",") for line in text.splitlines() if not line.startswith("#")]
    values = {name: tuple(map(float, numbers)) for name, *numbers in rows}
    return {name: (numbers[:3], numbers[3:]) for name, numbers in values.items()}


MEDIA = _measured()


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
