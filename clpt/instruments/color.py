"""Color of light: temperature, color rendering and fidelity, by `colour-science`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.spectra.emission import UNIT_LUMINANCE

WAVELENGTHS = np.arange(380.0, 781.0, 5.0)  # [nm]; CIE 224:2017 asks for steps of 5 nm at most
MISSING = "color of light needs `colour-science`: pip install 'clpt[measure]'"


def tristimulus(pixels: Floats) -> Floats:
    """Return X, Y, Z (..., 3) of pixels (..., channels) of a film of XYZ; Y [lx]."""
    return UNIT_LUMINANCE * pixels[..., :3]


def temperature(pixels: Floats) -> Floats:
    """Return correlated color temperatures (...) [K] of XYZ (..., 3), by Ohno 2013.

    Light farther than .05 from Planck's locus in u, v has none (CIE 15:2018): NaN.
    """
    rows = pixels.reshape(-1, pixels.shape[-1])[:, :3]
    scale = rows @ [1.0, 15.0, 3.0]
    bright = scale > 0.0
    kelvin, offset = np.full((2, len(rows)), np.nan)
    if bright.any():
        uv = rows[bright, :2] * [4.0, 6.0] / scale[bright, None]
        kelvin[bright], offset[bright] = _colour().temperature.uv_to_CCT_Ohno2013(uv).T
    kelvin[~(np.abs(offset) <= 0.05)] = np.nan
    return kelvin.reshape(pixels.shape[:-1])


def rendering_index(pixels: Floats) -> Floats:
    """Return the general color rendering index Ra (...) (CIE 13.3) of spectra (..., bands)."""
    return _each_spectrum(_colour().colour_rendering_index, pixels)


def fidelity_index(pixels: Floats) -> Floats:
    """Return the fidelity index Rf (...) (ANSI/IES TM-30, CIE 224) of spectra (..., bands)."""
    return _each_spectrum(_colour().colour_fidelity_index, pixels)


def _each_spectrum(function: Callable[[Any], float], pixels: Floats) -> Floats:
    """Apply a function to spectra (..., bands) at WAVELENGTHS; the value of darkness is NaN."""
    distribution = _colour().SpectralDistribution
    spectra = pixels.reshape(-1, len(WAVELENGTHS))
    with _colour().utilities.suppress_warnings(colour_runtime_warnings=True):
        values = [
            function(distribution(spectrum, WAVELENGTHS)) if spectrum.any() else np.nan
            for spectrum in spectra
        ]
    return np.reshape(values, pixels.shape[:-1])


def _colour() -> Any:
    """Return the module `colour`. Raises SceneError."""
    try:
        import colour
    except ImportError:
        raise SceneError(MISSING) from None
    return colour
