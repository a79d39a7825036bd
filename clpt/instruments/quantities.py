"""Quantities of light: the film that measures each, and what turns its pixels into the unit.

A film of XYZ holds Y: luminance over `UNIT_LUMINANCE`. A band of a film holds the mean over its
wavelengths [W m^-2 sr^-1 nm^-1]. Where light is counted by the cosine to a normal, a steradian is
gone from both.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from clpt.arrays import Floats
from clpt.instruments import color
from clpt.scene.integrators import Film
from clpt.spectra.emission import LIGHT, PLANCK, UNIT_LUMINANCE

AVOGADRO = 6.02214076e23  # of the SI of 2019, exact
PHOTOSYNTHESIS = 400.0, 700.0  # [nm], light that plants use (McCree 1972)
BANDS = 60  # of a quantity that weighs wavelengths


@dataclass(frozen=True)
class Quantity:
    """A quantity of light.

    unit: of its values. at: "points", with normals, or "rays", with directions. weighs: "eye" for
    the photopic observer, "photons" for their count, "" for energy; spectral: a value for each band
    [unit per nm]; everywhere: all directions count alike; color: turns pixels
    into values, of light as the eye ("eye") or a spectrometer ("spectrum") has it.
    """

    unit: str
    at: str
    weighs: str = ""
    spectral: bool = False
    everywhere: bool = False
    color: Callable[[Floats], Floats] | None = None

    @property
    def linear(self) -> bool:
        """Whether the value of mixed light is the mixture of values."""
        return self.color is None or self.color is color.tristimulus

    def film(self, film: Film, bands: int) -> Film:
        """Return a film that measures it; bands: of a spectral quantity."""
        film = dataclasses.replace(
            film, mode="spectral", sensor="cie1931", white_balance="none", exposure=1.0,
            alpha=False, layers=(), time_bins=0,
        )  # fmt: skip
        if self.weighs == "eye":
            return dataclasses.replace(film, bands=0, output_space="xyz")
        if self.weighs == "photons":
            low, high = PHOTOSYNTHESIS
            return dataclasses.replace(film, lambda_min=low, lambda_max=high, bands=BANDS)
        if self.weighs == "spectrum":
            low, high = color.WAVELENGTHS[0] - 2.5, color.WAVELENGTHS[-1] + 2.5
            bands = len(color.WAVELENGTHS)
            return dataclasses.replace(film, lambda_min=low, lambda_max=high, bands=bands)
        return dataclasses.replace(film, bands=bands if self.spectral else 1)

    def value(self, pixels: Floats, film: Film) -> Floats:
        """Return values (...) or (..., bands) of a film's pixels (..., channels).

        Raises SceneError for a quantity of color where `colour-science` is not installed.
        """
        if self.color is not None:
            return self.color(pixels)
        if self.weighs == "eye":
            return UNIT_LUMINANCE * pixels[..., 1]
        if self.spectral:
            return pixels
        width = (film.lambda_max - film.lambda_min) / film.bands
        if self.weighs == "photons":
            energy = PLANCK * LIGHT / (film.band_centres * 1e-9)
            return np.asarray(pixels @ (1e6 * width / (energy * AVOGADRO)))
        return np.asarray(pixels.sum(axis=-1) * width)


QUANTITIES = {
    "irradiance": Quantity("W/m^2", "points"),
    "spectral_irradiance": Quantity("W/m^2/nm", "points", spectral=True),
    "scalar_irradiance": Quantity("W/m^2", "points", everywhere=True),
    "illuminance": Quantity("lx", "points", "eye"),
    "scalar_illuminance": Quantity("lx", "points", "eye", everywhere=True),
    "tristimulus": Quantity("lx", "points", "eye", color=color.tristimulus),
    "cct": Quantity("K", "points", "eye", color=color.temperature),
    "cri": Quantity("Ra", "points", "spectrum", color=color.rendering_index),
    "rf": Quantity("Rf", "points", "spectrum", color=color.fidelity_index),
    "photon_flux_density": Quantity("umol/m^2/s", "points", "photons"),
    "radiance": Quantity("W/m^2/sr", "rays"),
    "spectral_radiance": Quantity("W/m^2/sr/nm", "rays", spectral=True),
    "luminance": Quantity("cd/m^2", "rays", "eye"),
}
