"""The way in which a film looks at lights: in spectra or in colours."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from clpt.arrays import Floats
from clpt.render.records.lowering_cache import LoweringCache
from clpt.scene import Film
from clpt.scene.pixels import pixels, spectral_image
from clpt.scene.roles import EMISSION
from clpt.scene.textures import Bitmap
from clpt.spectra import Spectrum
from clpt.spectra.spectrum import gridded

UNSEEN = 0.1  # share of the power within the film's range in how much light of the eye's counts
STEP = 1.0  # of wavelengths at which that power is looked at [nm], about


@dataclass(frozen=True)
class Look:
    """The way in which a film looks at lights.

    spectral: whether in spectra, from lo to hi [nm], or in colours; cache: of costly pieces.
    unseen: how much light counts that has no colour, over what the same power counts that has one.
    """

    spectral: bool
    lo: float
    hi: float
    cache: LoweringCache = field(default_factory=LoweringCache)
    unseen: float = UNSEEN

    @classmethod
    def of(cls, film: Film, cache: LoweringCache | None = None) -> Look:
        """Return that of a film; one of bands, or with a sensor, sees all wavelengths alike."""
        unseen = 1.0 if film.bands or film.sensor != "cie1931" else UNSEEN
        range_ = film.lambda_min, film.lambda_max
        return cls(film.mode == "spectral", *range_, cache or LoweringCache(), unseen)

    @property
    def grid(self) -> Floats:
        """The wavelengths (n,) at which power is looked at [nm], even, from lo to hi."""
        return np.linspace(self.lo, self.hi, max(round((self.hi - self.lo) / STEP), 1) + 1)

    def brightness(self, light: Spectrum) -> float:
        """Return how much an emission counts: the mean of its colour, and its mean in the range.

        The latter keeps chances of light that no eye sees, which a sensor or a dye may: paint that
        glows under a lamp of ultraviolet, a film of bands in the infrared.
        """
        seen = float(np.mean(light.to_rgb("emission")))
        if not self.spectral:
            return seen
        return seen + self.unseen * max(float(gridded(light, self.grid).mean()), 0.0)

    def levels(self, image: Bitmap) -> Floats:
        """Return how much the texels of an emission count (h, w), top row first."""
        seen = np.maximum(pixels(image, EMISSION), 0.0).mean(axis=2, dtype=np.float64)
        found = spectral_image(image, EMISSION) if self.spectral else None
        if found is None:
            return seen * (1.0 + self.unseen * self.spectral)
        within = (found.lambdas >= self.lo) & (found.lambdas <= self.hi)
        power = np.maximum(found.values[..., within], 0.0)
        beyond = power.mean(axis=2, dtype=np.float64) if within.any() else 0.0
        return np.asarray(seen + self.unseen * beyond)
