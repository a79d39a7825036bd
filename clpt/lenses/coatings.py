"""Anti-reflection coatings, and the reflectance of a coated surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt.lenses.prescription import Coat
from clpt.spectra import Constant

DESIGN = 550.0  # [nm], the wavelength of a film's quarter wave


def quarter_wave(index: float, waves: float = 0.25, at: float = DESIGN) -> Coat:
    """Return a film of an index, its thickness in `waves` of the wavelength `at` [nm] inside it."""
    return Coat(Constant(index), waves * at / index)


# From the air to the glass. "single" is magnesium fluoride; "multi" has zirconia and alumina below
# it: a quarter, a half and a quarter of a wave (Macleod 2010, 4.3).
COATINGS: dict[str, tuple[Coat, ...]] = {
    "none": (),
    "single": (quarter_wave(1.38),),
    "multi": (quarter_wave(1.38), quarter_wave(2.06, 0.5), quarter_wave(1.65)),
}


def reflectance(
    n: float, beyond: float, coating: tuple[Coat, ...], lambdas: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the reflectance (n,) at normal incidence, at wavelengths [nm].

    n, beyond: indices in front and behind; coating: from the front. The recursion of amplitudes
    begins at the back (Rouard 1937).
    """
    r, below = np.zeros(len(lambdas), np.complex128), np.full(len(lambdas), beyond)
    for coat in reversed(coating):
        index = coat.index.sample(lambdas)
        edge = (index - below) / (index + below)
        r = (edge + r) / (1.0 + edge * r)
        r = r * np.exp(4j * np.pi * index * coat.thickness / lambdas)
        below = index
    edge = (n - below) / (n + below)
    return np.asarray(np.abs((edge + r) / (1.0 + edge * r)) ** 2)
