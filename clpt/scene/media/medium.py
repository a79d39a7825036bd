"""Media: homogeneous, with dyes, and the base of those on grids."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import spectra
from clpt.arrays import is_number
from clpt.errors import SceneError
from clpt.scene.params import (
    Kind,
    coefficient,
    host,
    real,
    reflectance,
    reradiation,
)
from clpt.scene.params import emission as emitted
from clpt.scene.phases import HenyeyGreenstein, Isotropic, PerCollision, Phase, Reradiating
from clpt.scene.values import Matrix4, SpectrumLike
from clpt.spectra import (
    RGB,
    Constant,
    Fluorophore,
    Reradiation,
    RGBIlluminant,
    RGBUnbounded,
    Spectrum,
)
from clpt.spectra.spectrum import WIDEST, extremes

COLDEST = 100.0  # [K], of the coldest visible black body
RADIANCE = "W m^-2 sr^-1 nm^-1"


@dataclass(frozen=True, kw_only=True, eq=False)
class Medium(Kind):
    """Base of all media."""

    is_mixture: ClassVar[bool] = False  # `parts` are other media

    name: str = host("", "for messages and for references in scene files")
    phase: Phase = host(Isotropic(), "directions into which a point scatters", form="phase")

    # of a kind without such a parameter
    dye = cast("Reradiation | None", None)

    @property
    def parts(self) -> tuple[Medium, ...]:
        """The media that fill its place together: itself, or those of a mixture."""
        return (self,)

    @property
    def lattice(self) -> Lattice | None:
        """The medium itself if a density on a lattice multiplies its coefficients, else None."""
        return None

    @property
    def glows(self) -> bool:
        """Whether it has a dye that gives out light."""
        return False

    @property
    def scatters(self) -> bool:
        """Whether it scatters light of any wavelength."""
        raise NotImplementedError

    def collisions(self, spectral: bool) -> tuple[Phase, ...]:
        """Return what becomes of light that collides, with each part of the medium that scatters.

        spectral: whether it has wavelengths, or three numbers.
        """
        return (self.phase,)

    @property
    def is_chromatic(self) -> bool:
        """Whether its extinction depends on the wavelength."""
        raise NotImplementedError

    @property
    def light(self) -> Spectrum | None:
        """The radiance that a body of it too thick to see through would emit; None: no light."""
        raise NotImplementedError

    def coefficients(self, spectral: bool) -> tuple[Spectrum, Spectrum]:
        """Return how much a metre absorbs and scatters [1/m].

        spectral: whether they are for wavelengths, or for three numbers.
        """
        raise NotImplementedError

    def of_parts(self, spectral: bool) -> list[tuple[Spectrum, Spectrum]]:
        """Return the `coefficients` of each of `parts`."""
        return [self.coefficients(spectral)]


@dataclass(frozen=True, kw_only=True, eq=False)
class Homogeneous(Medium):
    """A uniform medium, given by `sigma_a` and `sigma_s`, or by `sigma_t` and `albedo`."""

    sigma_a: SpectrumLike = coefficient(0.0, "how much a metre absorbs")
    sigma_s: SpectrumLike = coefficient(0.0, "how much a metre scatters")
    sigma_t: SpectrumLike = coefficient(0.0, "how much it does of both; 0: the two above say it")
    albedo: SpectrumLike = reflectance(1.0, "share of `sigma_t` that is scattered", textured=False)
    scale: float = real(1.0, "factor of all coefficients", low=0.0)
    emission: SpectrumLike = emitted(
        0.0, "radiance of an opaque body; a metre emits sigma_a times it", RADIANCE
    )

    @classmethod
    def from_albedo(
        cls, albedo: SpectrumLike, mean_free_path: SpectrumLike, g: float = 0.0, **parameters: Any
    ) -> Homogeneous:
        """Return a medium by how it looks: a thick body of it reflects `albedo` of even light.

        albedo: a number, a colour or a spectrum in [0, 1], of light that comes evenly from all
        sides and of a body without a reflecting boundary, right within .005; mean_free_path: how
        far light goes before it scatters or is absorbed, likewise [m]; g: of Henyey and
        Greenstein; parameters: of the medium, such as `name` or `phase`.

        The inverse of van de Hulst 1980: (1 - s) (1 - 0.139 s) / (1 + 1.17 s), with s = sqrt((1 -
        a) / (1 - a g)) of a medium that scatters the share a.

        Raises SceneError for values outside.
        """
        checked = cls(albedo=albedo, sigma_t=mean_free_path)
        path: Any = checked.sigma_t
        if any(low <= 0.0 for low, _ in extremes(path)):
            raise SceneError("must be above 0", where="homogeneous.mean_free_path")
        if not (is_number(g) and -1.0 < g < 1.0):
            raise SceneError(f"must be between -1 and 1, not {g!r}", where="homogeneous.g")
        parameters.setdefault("phase", HenyeyGreenstein(g=g) if g else Isotropic())
        return cls(
            albedo=_mapped(checked.albedo, lambda r: _single_albedo(r, g)),
            sigma_t=_mapped(_unbounded(path), lambda v: 1.0 / v),
            **parameters,
        )

    def check(self) -> None:
        """Raise SceneError where coefficients are given in both ways."""
        both = not (is_zero(self.sigma_a) and is_zero(self.sigma_s))
        if both and not is_zero(self.sigma_t):
            message = "give sigma_a and sigma_s, or sigma_t and albedo, not both"
            raise SceneError(message, where=self.kind)

    @property
    def scatters(self) -> bool:
        return not is_zero(self.coefficients(spectral=True)[1])

    @property
    def light(self) -> Spectrum | None:
        value: Any = self.emission
        dark = _is_dark(value) or is_zero(self.coefficients(spectral=True)[0])
        return None if dark else _lit(value)

    @property
    def is_chromatic(self) -> bool:
        coefficients = (self.sigma_a, self.sigma_s, self.sigma_t)
        return not all(map(_is_grey, coefficients))

    def coefficients(self, spectral: bool) -> tuple[Spectrum, Spectrum]:
        a: Any = self.sigma_a
        s: Any = self.sigma_s
        if not is_zero(self.sigma_t):
            t, albedo = self.sigma_t, self.albedo
            a = combined([t, albedo], lambda v: v[0] * (1.0 - v[1]), spectral)
            s = combined([t, albedo], lambda v: v[0] * v[1], spectral)
        if self.scale == 1.0:
            return a, s
        scaled = [combined([value], lambda v: self.scale * v[0], spectral) for value in (a, s)]
        return scaled[0], scaled[1]


@dataclass(frozen=True, kw_only=True, eq=False)
class Dyed(Homogeneous):
    """A homogeneous medium with a dye, which emits light at longer wavelengths.

    The dye adds the absorption `strength` times its `absorption` to that of the medium. For each
    absorbed photon it emits `quantum_yield` photons on average. They follow its emission, uniformly
    in all directions (Mojzik et al. 2018). Elastic scattering is uniform too. In RGB mode the dye
    only absorbs.

    Raises SceneError for another re-radiation than that of a dye, and for a `phase` beside it.
    """

    dye: Reradiation | None = reradiation(None, "a fluorophore")
    strength: float = real(
        1.0, "how much a metre absorbs [1/m] where the dye's absorption is 1", low=0.0
    )

    def check(self) -> None:
        super().check()
        if self.dye is None:
            return
        if not isinstance(self.dye, Fluorophore):
            message = "must be a dye: `absorption`, `emission` and `quantum_yield`"
            raise SceneError(message, where=f"{self.kind}.dye")
        if not isinstance(self.phase, Isotropic):
            message = "a medium with a dye scatters alike in all directions: leave it out"
            raise SceneError(message, where=f"{self.kind}.phase")
        if not _is_dark(self.emission):
            message = "a medium with a dye gives out no light by itself: leave it out"
            raise SceneError(message, where=f"{self.kind}.emission")

    @property
    def glows(self) -> bool:
        """Whether it has a dye that gives out light."""
        dye = self.dye
        emits = isinstance(dye, Fluorophore) and dye.quantum_yield > 0.0
        return emits and self.strength * self.scale > 0.0

    @property
    def is_chromatic(self) -> bool:
        return self.dye is not None or super().is_chromatic

    def coefficients(self, spectral: bool) -> tuple[Spectrum, Spectrum]:
        """Return the absorption and the collisions of a metre [1/m].

        Collisions are its scattering and the dye's emission under light that is equal at all
        wavelengths. The absorption is the extinction without the collisions; it may be below zero,
        since the dye absorbs at other wavelengths than it emits.
        """
        absorbs, scatters = super().coefficients(spectral)
        dye, strength = self.dye, self.strength * self.scale
        if not isinstance(dye, Fluorophore) or strength == 0.0:
            return absorbs, scatters
        absorbed = combined([absorbs, dye.absorption], lambda v: v[0] + strength * v[1], spectral)
        if not spectral or not self.glows:
            return absorbed, scatters
        emitted = self._emitted
        return (
            combined([absorbed, emitted], lambda v: v[0] - strength * v[1], spectral),
            combined([scatters, emitted], lambda v: v[0] + strength * v[1], spectral),
        )

    def collisions(self, spectral: bool) -> tuple[Phase, ...]:
        return (self._collisions if spectral and self.glows else self.phase,)

    @cached_property
    def _collisions(self) -> Phase:
        dye = self.dye
        assert dye is not None
        scatters, sent = super().coefficients(True)[1], self.coefficients(True)[1]
        strength = self.strength * self.scale
        over = np.maximum(sent.sample(WIDEST), 1e-30)
        elastic = np.clip(scatters.sample(WIDEST) / over, 0.0, 1.0)
        factor = np.where(over > 1e-30, strength / over, 0.0)
        return Reradiating(
            reflectance=spectra.Tabulated(WIDEST, elastic, "hold"),
            reradiation=PerCollision(dye, spectra.Tabulated(WIDEST, factor, "hold")),
        )

    @property
    def _emitted(self) -> Spectrum:
        """Return the spectrum that the dye emits under light that is equal at all wavelengths."""
        assert self.dye is not None
        out, into, values = self.dye.table
        sums = 0.5 * (values[:, 1:] + values[:, :-1]) @ np.diff(into)
        return spectra.Tabulated(out, sums)


@dataclass(frozen=True, kw_only=True, eq=False)
class Lattice(Medium):
    """Base of media whose coefficients a density multiplies, at points of a lattice in a box."""

    to_world: Matrix4 = host(np.eye(4), "takes the unit cube to the grid's box")

    @property
    def lattice(self) -> Lattice:
        return self

    @property
    def bits(self) -> int:
        """The bits of a point's density on the device: 16 or 8."""
        return 16

    @property
    def noise(self) -> tuple[float, ...] | None:
        """The parameters of the noise that kernels turn into the density; None for an array."""
        return None

    @property
    def size(self) -> tuple[int, ...]:
        """The number of points along x, y and z."""
        raise NotImplementedError

    @property
    def box(self) -> NDArray[np.float64]:
        """A matrix (4, 4) from the unit cube to the box in the world."""
        return np.asarray(self.to_world, float)

    def check(self) -> None:
        """Raise SceneError for a box without an inside."""
        super().check()
        if not abs(np.linalg.det(self.box[:3, :3])) > 0.0:
            raise SceneError("has no inverse", where=f"{self.kind}.to_world")


def combined(values: list[Any], combine: Callable[[list[Any]], Any], spectral: bool) -> Spectrum:
    """Combine spectra at each wavelength, or each of three numbers."""
    if all(isinstance(value, Constant) for value in values):
        return Constant(float(combine([value.value for value in values])))
    if not spectral:
        return RGBUnbounded(*map(float, combine([value.to_rgb("unbounded") for value in values])))
    return spectra.Tabulated(WIDEST, combine([value.sample(WIDEST) for value in values]), "hold")


def alone(value: Spectrum, spectral: bool) -> Spectrum:
    """A spectrum as `combined` makes them."""
    return combined([value], lambda v: v[0], spectral)


def _mapped(value: Any, function: Callable[[Any], Any]) -> Spectrum:
    """Apply a function to a spectrum at each wavelength, or to a colour's three numbers."""
    if isinstance(value, RGB | RGBUnbounded):
        return type(value)(*(float(function(v)) for v in (value.r, value.g, value.b)))
    if isinstance(value, Constant):
        return Constant(float(function(value.value)))
    return spectra.Tabulated(WIDEST, function(value.sample(WIDEST)), "hold")


def _unbounded(value: object) -> Any:
    return RGBUnbounded(value.r, value.g, value.b) if isinstance(value, RGB) else value


def _single_albedo(reflected: ArrayLike, g: float) -> Any:
    """Return the single-scattering albedo of a thick body from its diffuse reflectance."""
    r = np.clip(np.asarray(reflected, np.float64), 0.0, 1.0)
    b = 1.139 + 1.17 * r
    s2 = (2.0 * (1.0 - r) / (b + np.sqrt(b * b - 0.556 * (1.0 - r)))) ** 2
    return (1.0 - s2) / (1.0 - g * s2)


def _is_grey(value: object) -> bool:
    grey = isinstance(value, RGB | RGBUnbounded) and value.r == value.g == value.b
    return grey or isinstance(value, Constant)


def is_zero(value: Any) -> bool:
    return _is_grey(value) and not value.to_rgb("unbounded").any()


def _is_dark(value: object) -> bool:
    """Whether an emission is black."""
    if isinstance(value, RGB | RGBIlluminant | RGBUnbounded):
        return max(value.r, value.g, value.b) == 0.0
    return isinstance(value, Constant) and value.value == 0.0


def _lit(value: Any) -> Spectrum:
    """An emission as a spectrum: a colour is a multiple of D65."""
    lit: Spectrum = RGBIlluminant(value.r, value.g, value.b) if isinstance(value, RGB) else value
    return lit
