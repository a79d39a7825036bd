"""Media: what light does between surfaces.

A phase function has a pair kernels/phase/<kind>.cl. It scatters at a point as a material does at a
surface: its local frame has z along the ray back to where light was last.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from clpt.errors import SceneError
from clpt.scene.params import Kind, coefficient, host, real, reflectance
from clpt.scene.scatterer import Scatterer
from clpt.scene.values import SpectrumLike
from clpt.spectra import RGB, Constant, RGBUnbounded, Spectrum, Tabulated
from clpt.spectra.spectrum import WIDEST


@dataclass(frozen=True, kw_only=True, eq=False)
class Phase(Scatterer):
    """Base of all phase functions: how much light a point of a medium sends where, in 1/sr."""

    folder: ClassVar[str] = "phase"
    is_phase = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Isotropic(Phase):
    """The same in all directions."""


@dataclass(frozen=True, kw_only=True, eq=False)
class HenyeyGreenstein(Phase):
    """Henyey and Greenstein 1941: one number tells how much goes forward."""

    g: float = real(0.0, "mean cosine: 1 is forward, -1 back", low=-0.999, high=0.999)


@dataclass(frozen=True, kw_only=True, eq=False)
class Rayleigh(Phase):
    """Of what is far smaller than the wavelength, as the air: 3 (1 + cos^2) / 16 pi."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Medium(Kind):
    """Base of all media."""

    name: str = host("", "for messages and for references in scene files")
    phase: Phase = host(Isotropic(), "what a point of it sends where", form="phase")

    @property
    def scatters(self) -> bool:
        """Whether it scatters light of any wavelength."""
        raise NotImplementedError

    @property
    def is_chromatic(self) -> bool:
        """Whether its extinction depends on the wavelength."""
        raise NotImplementedError

    def coefficients(self, spectral: bool) -> tuple[Spectrum, Spectrum]:
        """Return how much a metre absorbs and scatters [1/m].

        spectral: whether they are for wavelengths, or for three numbers.
        """
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True, eq=False)
class Homogeneous(Medium):
    """The same everywhere: given by `sigma_a` and `sigma_s`, or by `sigma_t` and `albedo`."""

    sigma_a: SpectrumLike = coefficient(0.0, "how much a metre absorbs")
    sigma_s: SpectrumLike = coefficient(0.0, "how much a metre scatters")
    sigma_t: SpectrumLike = coefficient(0.0, "how much it does of both; 0: the two above say it")
    albedo: SpectrumLike = reflectance(1.0, "share of `sigma_t` that is scattered", textured=False)
    scale: float = real(1.0, "factor of all coefficients", low=0.0)

    def check(self) -> None:
        """Raise SceneError where coefficients are given in both ways."""
        both = not (_is_zero(self.sigma_a) and _is_zero(self.sigma_s))
        if both and not _is_zero(self.sigma_t):
            message = "give sigma_a and sigma_s, or sigma_t and albedo, not both"
            raise SceneError(message, where=self.kind)

    @property
    def scatters(self) -> bool:
        return not _is_zero(self.coefficients(spectral=True)[1])

    @property
    def is_chromatic(self) -> bool:
        given = (self.sigma_a, self.sigma_s, self.sigma_t)
        return not all(map(_is_grey, given))

    def coefficients(self, spectral: bool) -> tuple[Spectrum, Spectrum]:
        a: Any = self.sigma_a
        s: Any = self.sigma_s
        if not _is_zero(self.sigma_t):
            t, albedo = self.sigma_t, self.albedo
            a = _combined([t, albedo], lambda v: v[0] * (1.0 - v[1]), spectral)
            s = _combined([t, albedo], lambda v: v[0] * v[1], spectral)
        if self.scale == 1.0:
            return a, s
        scaled = [_combined([value], lambda v: self.scale * v[0], spectral) for value in (a, s)]
        return scaled[0], scaled[1]


def _combined(values: list[Any], combine: Callable[[list[Any]], Any], spectral: bool) -> Spectrum:
    """What becomes of spectra at each wavelength, or of each of three numbers."""
    if all(isinstance(value, Constant) for value in values):
        return Constant(float(combine([value.value for value in values])))
    if not spectral:
        return RGBUnbounded(*map(float, combine([value.to_rgb("unbounded") for value in values])))
    return Tabulated(WIDEST, combine([value.sample(WIDEST) for value in values]), "hold")


def _is_grey(value: Any) -> bool:
    grey = isinstance(value, RGB | RGBUnbounded) and value.r == value.g == value.b
    return grey or isinstance(value, Constant)


def _is_zero(value: Any) -> bool:
    return _is_grey(value) and not value.to_rgb("unbounded").any()


PHASES: tuple[type[Phase], ...] = (Isotropic, HenyeyGreenstein, Rayleigh)
KINDS: tuple[type[Medium], ...] = (Homogeneous,)
