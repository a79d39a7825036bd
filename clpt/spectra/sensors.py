"""Sensors: a film's spectral sensitivities. The CIE observers, and measured cameras.

A response is the integral of radiance times a curve, over that of the 1931 observer's y
(CIE_Y_INTEGRAL). A matrix takes the three responses to XYZ.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from clpt.arrays import Matrix
from clpt.errors import SceneError, UnknownKindError
from clpt.spectra import cie, data, files, upsampling
from clpt.spectra.spectrum import Spectrum, Tabulated, d65

Rows = tuple[tuple[float, ...], ...]

OBSERVERS = {f"cie{year}": year for year in cie.OBSERVERS}
LEVELS = (0.05, 0.3, 0.6, 0.9)  # of red, green and blue in the fitted reflectances


@dataclass(frozen=True)
class Sensor:
    """Three sensitivities of any common scale, and the matrix from their responses to XYZ.

    Without `matrix` it is fitted: see `fitted`. Raises SceneError for curves that are not three
    spectra, negative somewhere or zero everywhere, and for a matrix that is not 3 by 3.
    """

    curves: tuple[Spectrum, Spectrum, Spectrum]
    matrix: Rows | None = None

    def __post_init__(self) -> None:
        curves: tuple[object, ...] = tuple(self.curves)
        if len(curves) != 3 or not all(isinstance(curve, Spectrum) for curve in curves):
            raise SceneError("a sensor has three curves, each a spectrum")
        object.__setattr__(self, "curves", curves)
        if self.matrix is not None:
            object.__setattr__(self, "matrix", _rows(self.matrix))
        elif not self.sample(cie.GRID).any(axis=0).all():
            raise SceneError(
                "a sensor without a matrix must respond to visible light in each curve"
            )

    def sample(self, lambdas: ArrayLike) -> Matrix:
        """Sensitivities at `lambdas` [nm] (n,): (n, 3) float64."""
        return np.stack([curve.sample(lambdas) for curve in self.curves], axis=-1)

    @property
    def to_xyz(self) -> Matrix:
        """The matrix (3, 3) float64 from responses to XYZ."""
        return fitted(self) if self.matrix is None else np.array(self.matrix)

    def xyz(self, spectrum: Spectrum, lambdas: ArrayLike = cie.GRID) -> Matrix:
        """XYZ (3,) that the sensor measures: a sum over `lambdas` (n,), 1 nm apart."""
        responses = spectrum.sample(lambdas) @ self.sample(lambdas) / cie.CIE_Y_INTEGRAL
        return self.to_xyz @ responses


@cache
def observer(name: str) -> Sensor:
    """The standard observer "cie1931" (2 degrees) or "cie1964" (10 degrees).

    The constant spectrum 1 has Y = 1 with either. Raises UnknownKindError.
    """
    if name not in OBSERVERS:
        raise UnknownKindError("sensor", name, OBSERVERS)
    rows = data.table(f"cie{OBSERVERS[name]}.csv")
    scale = cie.CIE_Y_INTEGRAL / rows[:, 2].sum()
    x, y, z = (Tabulated(rows[:, 0], scale * rows[:, i]) for i in (1, 2, 3))
    return Sensor((x, y, z), _rows(np.eye(3)))


@cache
def fitted(sensor: Sensor) -> Matrix:
    """The matrix (3, 3) from responses to XYZ that fits smooth reflectances under D65 best.

    Least squares over the uplifted colours (Jakob and Hanika 2019) of a grid of LEVELS in red,
    green and blue, with the white kept exactly (Finlayson and Drew 1997). A camera sees other
    metamers than people do, so no matrix is right for every light.
    """
    light = d65().sample(cie.GRID)
    colours = np.stack(np.meshgrid(LEVELS, LEVELS, LEVELS), axis=-1).reshape(-1, 3)
    reflected = upsampling.evaluate(upsampling.uplift(colours), cie.GRID) * light
    seen = reflected @ sensor.sample(cie.GRID) / cie.CIE_Y_INTEGRAL
    white = light @ sensor.sample(cie.GRID) / cie.CIE_Y_INTEGRAL
    wanted = cie.spectrum_to_xyz(reflected)
    # Per row m of the matrix: min |seen m - wanted|^2 with white . m = white's X, Y or Z.
    scale = white.max()  # removes the curves' unit
    seen, white = seen / scale, white / scale
    normal = np.block([[seen.T @ seen, white[:, None]], [white[None, :], np.zeros((1, 1))]])
    right = np.vstack([seen.T @ wanted, cie.spectrum_to_xyz(light)])
    try:
        matrix = np.linalg.solve(normal, right)[:3].T / scale
    except np.linalg.LinAlgError:
        raise SceneError("the curves of a sensor must differ; or give its matrix") from None
    matrix.setflags(write=False)
    return matrix


def read_sensor(path: str | Path) -> Sensor:
    """Read a camera's sensitivities: rows of a wavelength [nm] and three values, ascending.

    Blanks, commas or semicolons separate fields, `#` starts a comment, a line of column titles is
    allowed. Raises SceneError with the line.
    """
    red, green, blue = files.read_columns(path, 3)
    try:
        return Sensor((red, green, blue))
    except SceneError as error:
        raise SceneError(error.message, file=path) from None


def _rows(matrix: object) -> Rows:
    """A matrix as tuples of numbers."""
    try:
        values = np.asarray(matrix, np.float64)
    except (TypeError, ValueError):
        values = np.zeros(0)
    if values.shape != (3, 3) or not np.isfinite(values).all():
        raise SceneError("a sensor's matrix must be three rows of three finite numbers")
    return tuple(tuple(row) for row in values.tolist())
