"""Measured reflection of a material, by direction and wavelength."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import in_memory
from clpt.errors import SceneError

REDUCTIONS = (1, 2, 4)  # equal parts of the azimuths of which one is stored
AXES = {
    "ndf": "(rows, columns)", "sigma": "(rows, columns)",
    "vndf": "(phi, theta, rows, columns)", "luminance": "(phi, theta, rows, columns)",
    "spectra": "(phi, theta, wavelengths, rows, columns)",
}  # fmt: skip
MOST_VALUES = 1 << 28


@dataclass(frozen=True, eq=False, kw_only=True)
class Measurement:
    """A reflection in the adaptive coordinates of Dupuy and Jakob 2018, as their files have it.

    The viewer is at `phi_i`, `theta_i` [rad]; one azimuth: the material is isotropic. The halfway
    direction lies at (sqrt(2 theta / pi), (phi + pi) / 2 pi) in the unit square, x over columns;
    its phi is from the viewer's where the material is isotropic. `vndf` is a density there: a
    `clpt.measured.warp` makes of a point of a second square a halfway direction. Over that second
    square lie `spectra`, the reflected light f cos(theta) [1/sr] over ndf / (4 sigma), and
    `luminance`, a density by which it is sampled. `jacobian`: whether `spectra` are over that, or
    f cos(theta) itself.

    wavelengths: (n,) [nm]; () where `spectra` have three, of red, green and blue.

    Raises SceneError for shapes that do not match, angles or wavelengths that do not ascend, and
    numbers that are negative or not finite.
    """

    phi_i: NDArray[Any]
    theta_i: NDArray[Any]
    ndf: NDArray[Any]
    sigma: NDArray[Any]
    vndf: NDArray[Any]
    luminance: NDArray[Any]
    spectra: NDArray[Any]
    wavelengths: NDArray[Any] = field(default_factory=lambda: np.zeros(0, np.float32))
    jacobian: bool = True
    description: str = ""

    def __post_init__(self) -> None:
        given = dict(vars(self))
        for name in ("phi_i", "theta_i", "wavelengths"):
            object.__setattr__(self, name, _ascending(name, given[name]))
        for name in AXES:
            object.__setattr__(self, name, _table(name, given[name]))
        if not len(self.phi_i) or not len(self.theta_i):
            raise SceneError("'phi_i' and 'theta_i' must have an angle each, at least")
        if self.theta_i[0] < -1e-3 or self.theta_i[-1] > 0.5 * math.pi + 1e-3:
            raise SceneError("'theta_i' must lie within 0 and pi / 2")
        both = len(self.phi_i), len(self.theta_i)
        tables = {"vndf": self.vndf, "luminance": self.luminance, "spectra": self.spectra}
        for name, table in tables.items():
            if (found := table.shape)[:2] != both:
                raise SceneError(
                    f"{name!r} is of {found[0]} x {found[1]} viewers, but 'phi_i' and 'theta_i'"
                    f" of {both[0]} x {both[1]}"
                )
        if self.spectra.shape[3:] != self.luminance.shape[2:]:
            raise SceneError("'luminance' and 'spectra' must have the same rows and columns")
        expected = len(self.wavelengths) or 3
        if self.spectra.shape[2] != expected:
            raise SceneError(f"'spectra' has {self.spectra.shape[2]} colours, not {expected}")
        if not self.isotropic and self.reduction not in REDUCTIONS:
            raise SceneError(
                f"'phi_i' covers 1 / {self.reduction} of the circle; known are all, 1 / 2 and 1 / 4"
            )
        if not self.ndf.any() or not self.sigma.all():
            raise SceneError("'ndf' and 'sigma' must be above 0")

    @property
    def isotropic(self) -> bool:
        """Whether turning the surface changes nothing."""
        return len(self.phi_i) <= 2

    @property
    def reduction(self) -> int:
        """The number of equal parts of the azimuths; only one part is stored."""
        if self.isotropic:
            return 1
        return round(2.0 * math.pi / float(self.phi_i[-1] - self.phi_i[0]))


def _ascending(name: str, values: ArrayLike) -> NDArray[Any]:
    made = np.asarray(in_memory(values), np.float32)
    if made.ndim != 1 or not np.isfinite(made).all() or not (np.diff(made) > 0.0).all():
        raise SceneError(f"{name!r} must be finite numbers that ascend")
    return made


def _table(name: str, values: ArrayLike) -> NDArray[Any]:
    made = np.asarray(in_memory(values), np.float32)
    if made.ndim != AXES[name].count(",") + 1:
        raise SceneError(f"{name!r} must be {AXES[name]}, not {made.shape}")
    if min(made.shape[-2:]) < 2 or not made.size:
        raise SceneError(f"{name!r} must have two rows and columns at least, not {made.shape}")
    if made.size > MOST_VALUES:
        raise SceneError(f"{name!r} has {made.size:,} numbers; at most {MOST_VALUES:,} are read")
    if not (np.isfinite(made) & (made >= 0.0)).all():
        raise SceneError(f"{name!r} has a number that is negative or not finite")
    return made
