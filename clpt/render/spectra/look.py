"""The importance of lights to a film, from their spectra or their colours."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from clpt.arrays import Floats
from clpt.render.records.lowering_cache import LoweringCache
from clpt.scene import Film
from clpt.scene.roles import EMISSION
from clpt.scene.textures import Bitmap
from clpt.spectra import Spectrum
from clpt.spectra.spectrum import gridded

UNSEEN = 0.1  # factor of mean power in the film's range, beside the mean of the colour
STEP = 1.0  # approximate distance of the wavelengths of that mean [nm]


@dataclass(frozen=True)
class Look:
    """The weights of lights for a film.

    spectral: by spectra from lo to hi [nm], or else by colours; cache: of costly results; unseen:
    factor of the mean power in that range, which also counts light without a visible colour.
    """

    spectral: bool
    lo: float
    hi: float
    cache: LoweringCache = field(default_factory=LoweringCache)
    unseen: float = UNSEEN

    @classmethod
    def of(cls, film: Film, cache: LoweringCache | None = None) -> Look:
        """Return the look of a film; with bands or a sensor, all wavelengths count equally."""
        unseen = 1.0 if film.bands or film.sensor != "cie1931" else UNSEEN
        range_ = film.lambda_min, film.lambda_max
        return cls(film.mode == "spectral", *range_, cache or LoweringCache(), unseen)

    @property
    def grid(self) -> Floats:
        """The wavelengths (n,) of the mean power, evenly spaced from lo to hi [nm]."""
        return np.linspace(self.lo, self.hi, max(round((self.hi - self.lo) / STEP), 1) + 1)

    def brightness(self, light: Spectrum) -> float:
        """Return the weight of an emission: the mean of its colour plus its mean in the range.

        The second term samples invisible light that a sensor or a dye may absorb: paint that glows
        under an ultraviolet lamp, a film with bands in the infrared.
        """
        seen = float(np.mean(light.to_rgb("emission")))
        if not self.spectral:
            return seen
        return seen + self.unseen * max(float(gridded(light, self.grid).mean()), 0.0)

    def levels(self, image: Bitmap) -> Floats:
        """Return the weights of the texels of an emission (h, w), top row first."""
        seen = np.maximum(image.pixels(EMISSION), 0.0).mean(axis=2, dtype=np.float64)
        spectra = image.spectral(EMISSION) if self.spectral else None
        if spectra is None:
            return seen * (1.0 + self.unseen * self.spectral)
        within = (spectra.lambdas >= self.lo) & (spectra.lambdas <= self.hi)
        power = np.maximum(spectra.values[..., within], 0.0)
        beyond = power.mean(axis=2, dtype=np.float64) if within.any() else 0.0
        return np.asarray(seen + self.unseen * beyond)
