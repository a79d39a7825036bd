"""Distributions of the radii of a cloud's spheres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt.choices import DROP_SIZES
from clpt.errors import SceneError

BEYOND = 1e-6  # share of the cross sections that may be left out at each end
WIDEST = 2.0  # of `spread`: of these laws nobody measured any wider


@dataclass(frozen=True)
class Sizes:
    """Radii (s,) float64 [m], ascending, and the share of the spheres that each stands for (s,)."""

    radii: NDArray[np.float64]
    shares: NDArray[np.float64]

    def mean(self, power: int) -> float:
        """Return the mean of a power of the radius [m^power]."""
        return float(self.shares @ self.radii**power)


def sizes(law: str, radius: float, spread: float = 0.0, count: int = 200) -> Sizes:
    """Return radii and shares of a law of sizes.

    law: "mono", all have `radius` [m]; "log_normal": `radius` is the median, `spread` the standard
    deviation of the radius's logarithm; "gamma": `radius` and `spread` are the effective radius and
    the effective variance of Hansen and Travis 1974, so that shares go as
    r^(1 / spread - 3) exp(-r / (radius spread)). count: of radii.

    Raises SceneError for another law, and numbers that it cannot have.
    """
    if law not in DROP_SIZES:
        raise SceneError(f"{law!r} is none of {', '.join(DROP_SIZES)}", where="law")
    if not (np.isfinite(radius) and radius > 0.0):
        raise SceneError(f"{radius:g} m; it must be above 0", where="radius")
    if law == "mono":
        return Sizes(np.array([radius], np.float64), np.ones(1))
    most = 0.5 if law == "gamma" else WIDEST
    if not 0.0 < spread < most:
        raise SceneError(
            f"{spread:g}; of the law {law!r} it is above 0 and below {most:g}", where="spread"
        )
    if count < 2:
        raise SceneError("must be 2 or more", where="count")
    # in s = ln(r / radius): shares of spheres, of whose weight r^2 nearly all is kept
    s = np.linspace(-12.0, 12.0, 48001)
    if law == "log_normal":
        exponent = -0.5 * (s / spread) ** 2
    else:
        exponent = (1.0 / spread - 2.0) * s - np.exp(s) / spread
    weight = np.exp(exponent + 2.0 * s - np.max(exponent + 2.0 * s))
    running = np.cumsum(weight) / weight.sum()
    low, high = s[np.searchsorted(running, BEYOND)], s[np.searchsorted(running, 1.0 - BEYOND)]
    at = low + (high - low) * (np.arange(count) + 0.5) / count
    shares = np.exp(np.interp(at, s, exponent - exponent.max()))
    return Sizes(radius * np.exp(at), shares / shares.sum())
