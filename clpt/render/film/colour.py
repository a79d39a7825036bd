"""The matrix from a film's sums to the colours of its picture, and the scale of its sums."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from clpt import spectra
from clpt.errors import SceneError
from clpt.scene.integrators import Film
from clpt.spectra import Sensor, spaces
from clpt.spectra.sensors import observer

LARGEST = 120  # exponent of 2 of a scale, which is float32
LARGEST_SCALE = 60  # exponent of 2 of an exposure that sums follow
# Exponents of 2 of the dimmest and brightest light that sums of kernels/core/fixed.cl hold well
DIMMEST, BRIGHTEST = -20, 32


def sensor(film: Film) -> Sensor:
    """Return the sensor of a film."""
    return observer(film.sensor) if isinstance(film.sensor, str) else film.sensor


def output_matrix(film: Film, mode: str) -> NDArray[np.float64]:
    """Return the matrix (3, 3) from the film's sums to its output space, times its exposure.

    Sums are responses of the film's sensor, or linear Rec. 709 in RGB mode. They become XYZ, which
    the white balance adapts (Bradford).
    """
    first = sensor(film).to_xyz if mode == "spectral" else spectra.REC709_TO_XYZ
    balance = np.eye(3)
    if film.white_balance != "none":
        balance = spaces.bradford(white(film), spaces.white(film.output_space))
    whole = spaces.from_xyz(film.output_space) @ balance @ first
    return film.exposure * np.round(whole, 12)  # from a space to itself is the identity, to the bit


def film_scale(film: Film, level: float) -> float:
    """Return the number, a power of two, that a value of 1 adds to a film's sums.

    level: of the scene's light [W m^-2 sr^-1 nm^-1], see `light_level`. The scale is the power of
    two next to the film's exposure: then well exposed light is near 1. If that light would lie
    below DIMMEST or above BRIGHTEST, the scale moves it to that bound.
    """
    exposure = 0
    if 0.0 < film.exposure < math.inf:
        exposure = min(max(round(math.log2(film.exposure)), -LARGEST_SCALE), LARGEST_SCALE)
    if not 0.0 < level < math.inf:
        return 2.0**exposure
    light = math.frexp(level)[1] + exposure
    exponent = exposure + min(max(light, DIMMEST), BRIGHTEST) - light
    return 2.0 ** min(max(exponent, -LARGEST), LARGEST)


def white(film: Film) -> NDArray[np.float64]:
    """Return XYZ (3,) of the light that the film's white balance makes white.

    The film's sensor sees an illuminant; the 1931 observer sees temperatures and (x, y). Raises
    SceneError for light that no scaling of cone responses makes white.
    """
    chosen = film.white_balance
    if isinstance(chosen, str):
        lambdas = np.arange(film.lambda_min, film.lambda_max + 1e-6)
        xyz = sensor(film).xyz(spectra.illuminant(chosen), lambdas)
    else:
        xy = spaces.xy_of_temperature(chosen) if isinstance(chosen, float) else chosen
        xyz = spaces.xyz_of(xy)
    if not (spaces.BRADFORD @ xyz > 0.0).all():
        message = f"{chosen!r} is too far from white, as the sensor sees it, to become white"
        raise SceneError(message, where="film.white_balance")
    return xyz
