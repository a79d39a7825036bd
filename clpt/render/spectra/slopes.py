"""Slopes of indices of refraction over the wavelength: pulses go at the speed of groups."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from clpt.arrays import Floats
from clpt.scene import materials as mt
from clpt.scene.params import fields_of
from clpt.scene.scatterer import Scatterer
from clpt.spectra import Constant, Spectrum, index

NEAR = 1e-4  # of a wavelength, to both sides


@dataclass(frozen=True)
class Slope(Spectrum):
    """The slope d ln n / d ln lambda of a ratio of indices: groups have the index n (1 - slope)."""

    inside: Spectrum
    outside: Spectrum

    @classmethod
    def of(cls, material: Scatterer) -> Slope | None:
        """Return the slope behind a boundary less that before it; None where neither disperses."""
        if not isinstance(material, mt.Material) or not material.transmits or material.is_sheet:
            return None
        sides = material.inside_index, fields_of(material).get("ext_ior", Constant(1.0))
        inside, outside = (index(cast("Spectrum | str", side)) for side in sides)
        even = isinstance(inside, Constant) and isinstance(outside, Constant)
        return None if even else cls(inside, outside)

    def sample(self, lambdas: ArrayLike) -> Floats:
        at = np.asarray(lambdas, np.float64)
        low, high = (
            np.log(self.inside.sample(at * near) / self.outside.sample(at * near))
            for near in (1.0 - NEAR, 1.0 + NEAR)
        )
        return np.asarray((high - low) / np.log((1.0 + NEAR) / (1.0 - NEAR)))
