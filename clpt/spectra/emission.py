"""Emission spectra: black bodies, spectral lines, LEDs and illuminants by name."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clpt.arrays import Floats
from clpt.errors import SceneError, UnknownKindError
from clpt.spectra import cie, data
from clpt.spectra.spectrum import (
    RGB,
    Constant,
    RGBIlluminant,
    RGBUnbounded,
    Spectrum,
    Tabulated,
    gridded,
    with_luminance_one,
)

# CODATA 2018, exact: Planck [J s], light [m/s], Boltzmann [J/K].
PLANCK, LIGHT, BOLTZMANN = 6.62607015e-34, 299792458.0, 1.380649e-23
LUMENS = 683.0  # [lm/W] at 555 nm: the candela's definition
UNIT_LUMINANCE = LUMENS * cie.CIE_Y_INTEGRAL  # [cd/m^2] where a picture's luminance is 1


@dataclass(frozen=True)
class Blackbody(Spectrum):
    """Planck's law at `kelvin`: radiance [W m^-2 sr^-1 nm^-1], or luminance 1 if `normalised`.

    Either is multiplied by `scale`. Raises SceneError for a temperature that is not positive, or
    too low to have a luminance in float64.
    """

    kelvin: float
    scale: float = 1.0
    normalised: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 < self.kelvin < np.inf:
            raise SceneError(f"a black body's temperature must be positive, found {self.kelvin} K")
        _check_scale(self.scale)
        if self.normalised and not planck(cie.GRID, self.kelvin).max() > 1e-30:
            raise SceneError(f"a black body of {self.kelvin} K is dark and cannot be normalised")

    def sample(self, lambdas: ArrayLike) -> Floats:
        values = self.scale * planck(lambdas, self.kelvin)
        if not self.normalised:
            return values
        return values / cie.spectrum_to_xyz(planck(cie.GRID, self.kelvin))[1]


@dataclass(frozen=True, init=False)
class Lines(Spectrum):
    """Spectral lines: `powers` [W m^-2 sr^-1] at `wavelengths` [nm], each a triangle `width` wide.

    The width [nm] is at half the height and a whole number: samples 1 nm apart add up to the powers
    exactly, wherever the lines lie between them. Raises SceneError.
    """

    wavelengths: tuple[float, ...]
    powers: tuple[float, ...]
    width: float = 1.0
    scale: float = 1.0

    def __init__(
        self,
        wavelengths: Iterable[float],
        powers: Iterable[float],
        width: float = 1.0,
        scale: float = 1.0,
    ) -> None:
        lists = {"wavelengths": wavelengths, "powers": powers}
        for name, values in lists.items():
            object.__setattr__(self, name, tuple(float(value) for value in values))
        object.__setattr__(self, "width", float(width))
        object.__setattr__(self, "scale", float(scale))
        if len(self.wavelengths) != len(self.powers) or not self.powers:
            raise SceneError(
                f"line spectra need as many powers as wavelengths, found {len(self.powers)} and "
                f"{len(self.wavelengths)}"
            )
        if not np.isfinite([*self.wavelengths, *self.powers]).all() or min(self.powers) < 0.0:
            raise SceneError("a line has a wavelength or a power that is not finite, or below 0")
        _check_scale(self.scale)
        if not (self.width >= 1.0 and self.width.is_integer()):
            raise SceneError(f"the width of lines is a whole number of nm, not {self.width:g}")

    @property
    def knots(self) -> tuple[Floats, Floats]:
        """Wavelengths [nm] and values at each line's two feet and its top."""
        at = np.unique(np.add.outer(self.wavelengths, [-self.width, 0.0, self.width]))
        return at, self.sample(at)

    def sample(self, lambdas: ArrayLike) -> Floats:
        off = np.abs(np.asarray(lambdas, np.float64)[..., None] - np.array(self.wavelengths))
        shape = np.maximum(1.0 - off / self.width, 0.0) / self.width
        return self.scale * (shape * np.array(self.powers)).sum(axis=-1)


@dataclass(frozen=True)
class LED(Spectrum):
    """A coloured LED: `scale` [W m^-2 sr^-1 nm^-1] at its `peak` [nm], and its `width` [nm].

    The model is (g + 2 g^5) / 3 with g = exp(-((lambda - peak) / width)^2) (Ohno 2005); at half its
    height it is 0.92 of the nominal width wide. Raises SceneError.
    """

    peak: float
    width: float = 20.0
    scale: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (0.0 < self.peak < np.inf and 0.0 < self.width < np.inf):
            raise SceneError(f"an LED's peak and width must be positive: {self.peak}, {self.width}")
        _check_scale(self.scale)

    def sample(self, lambdas: ArrayLike) -> Floats:
        g = np.exp(-(((np.asarray(lambdas, np.float64) - self.peak) / self.width) ** 2))
        return self.scale * (g + 2.0 * g**5) / 3.0


@dataclass(frozen=True)
class Illuminant(Spectrum):
    """A lamp by its name, of luminance `scale`. Raises UnknownKindError."""

    name: str
    scale: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.name not in illuminants():
            raise UnknownKindError("illuminant", self.name, illuminants())
        _check_scale(self.scale)

    def sample(self, lambdas: ArrayLike) -> Floats:
        return self.scale * _of_luminance_one(self.name).sample(lambdas)

    @property
    def knots(self) -> tuple[Floats, Floats] | None:
        """Wavelengths [nm] and values of the illuminant's table or lines."""
        known = _of_luminance_one(self.name).knots
        return None if known is None else (known[0], self.scale * known[1])


def illuminants() -> tuple[str, ...]:
    """Names that `illuminant` knows."""
    return (*data.names("illuminants"), *_discharges(), "E")


def illuminant(name: str, scale: float = 1.0) -> Spectrum:
    """Emission of a named lamp with luminance `scale`.

    CIE illuminants: A; D50 and D65; E; fluorescent lamps F1 to F12; HP1 and HP2 (high-pressure
    sodium), HP3 to HP5 (metal halide); LED-B1 to LED-V2 (white LEDs). Discharges of lines only:
    sodium (low pressure), mercury and hydrogen. Raises UnknownKindError.
    """
    return Constant(scale) if name == "E" else Illuminant(name, scale)


@cache
def _of_luminance_one(name: str) -> Spectrum:
    if name in _discharges():
        lines = Lines(*np.transpose(_discharges()[name]["lines"]))
        luminance = cie.spectrum_to_xyz(lines.sample(cie.GRID))[1]
        return Lines(lines.wavelengths, lines.powers, scale=1.0 / luminance)
    if name == "E":
        return Constant(1.0)
    return with_luminance_one(data.table(f"illuminants/{name}.csv"))


@cache
def _discharges() -> dict[str, Any]:
    return json.loads((data.ROOT / "discharges.json").read_text("utf-8"))


def scaled(spectrum: Spectrum, factor: float) -> Spectrum:
    """Return an emitted spectrum times a number; a colour emits its spectrum times D65."""
    if factor == 1.0:
        return spectrum
    if isinstance(spectrum, (RGB, RGBUnbounded)):
        return RGBIlluminant(*(factor * float(c) for c in spectrum.to_rgb("emission")))
    if isinstance(spectrum, Constant):
        return Constant(factor * spectrum.value)
    if isinstance(spectrum, (Blackbody, Illuminant, LED)):
        return replace(spectrum, scale=factor * spectrum.scale)
    if isinstance(spectrum, Lines):
        powers, width = spectrum.powers, spectrum.width
        return Lines(spectrum.wavelengths, powers, width, factor * spectrum.scale)
    if isinstance(spectrum, Tabulated):
        values = factor * np.array(spectrum.values)
        return Tabulated(spectrum.lambdas, values, spectrum.outside)
    return Tabulated(cie.GRID, factor * spectrum.sample(cie.GRID))


def watts(spectrum: Spectrum) -> float:
    """Return the integral of an emitted spectrum over 360 to 830 nm [nm times its unit]."""
    return float(_emitted(spectrum).sum())


def lumens(spectrum: Spectrum) -> float:
    """Return the luminous flux of an emitted spectrum: 683 lm/W times its integral with V."""
    return LUMENS * float(_emitted(spectrum) @ cie.cie_xyz(cie.GRID)[:, 1])


def _emitted(spectrum: Spectrum) -> Floats:
    """Return means of an emitted spectrum around each whole nanometre from 360 to 830."""
    if isinstance(spectrum, RGB):
        spectrum = RGBIlluminant(spectrum.r, spectrum.g, spectrum.b)
    return gridded(spectrum, cie.GRID)


def _check_scale(scale: float) -> None:
    if not 0.0 <= scale < np.inf:
        raise SceneError(f"a lamp's scale cannot be {scale:g}")


def planck(lambdas: ArrayLike, kelvin: ArrayLike) -> Floats:
    """Radiance [W m^-2 sr^-1 nm^-1] of a black body at wavelengths [nm]."""
    metres = np.asarray(lambdas, np.float64) * 1e-9
    exponent = PLANCK * LIGHT / (metres * BOLTZMANN * np.asarray(kelvin, np.float64))
    per_metre = 2.0 * PLANCK * LIGHT**2 / metres**5 / np.expm1(np.minimum(exponent, 700.0))
    return 1e-9 * per_metre
