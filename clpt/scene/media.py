"""Media: what light does between surfaces."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import spectra
from clpt.arrays import is_number, on_host
from clpt.errors import SceneError
from clpt.records import CLOUD_OCTAVES
from clpt.scene.params import (
    Kind,
    coefficient,
    fields_of,
    host,
    real,
    reflectance,
    reradiation,
)
from clpt.scene.params import emission as emitted
from clpt.scene.phases import HenyeyGreenstein, Isotropic, PerCollision, Phase, Reradiating
from clpt.scene.values import Matrix4, SpectrumLike, Vector3
from clpt.scene.volumes import Volume, check_volume, resampled
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

SOOT = 0.26  # E(m), the imaginary part of (m^2 - 1) / (m^2 + 2) without its sign
COLDEST = 100.0  # [K], of the coldest visible black body
ON_POINTS = ("emission_grid", "temperature", "albedo_grid", "color_grid")  # of a `Grid`
OCTAVE = CLOUD_OCTAVES["finer"]
CLOUD_LEAST, CLOUD_MOST, CLOUD_FINEST = 32, 256, 1024  # points along a cloud's longest side
MOST_PARTS = 8  # of a mixture
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
        both = not (_is_zero(self.sigma_a) and _is_zero(self.sigma_s))
        if both and not _is_zero(self.sigma_t):
            message = "give sigma_a and sigma_s, or sigma_t and albedo, not both"
            raise SceneError(message, where=self.kind)

    @property
    def scatters(self) -> bool:
        return not _is_zero(self.coefficients(spectral=True)[1])

    @property
    def light(self) -> Spectrum | None:
        value: Any = self.emission
        dark = _is_dark(value) or _is_zero(self.coefficients(spectral=True)[0])
        return None if dark else _lit(value)

    @property
    def is_chromatic(self) -> bool:
        coefficients = (self.sigma_a, self.sigma_s, self.sigma_t)
        return not all(map(_is_grey, coefficients))

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
        absorbed = _combined([absorbs, dye.absorption], lambda v: v[0] + strength * v[1], spectral)
        if not spectral or not self.glows:
            return absorbed, scatters
        emitted = self._emitted
        return (
            _combined([absorbed, emitted], lambda v: v[0] - strength * v[1], spectral),
            _combined([scatters, emitted], lambda v: v[0] + strength * v[1], spectral),
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


@dataclass(frozen=True, kw_only=True, eq=False)
class Cloud(Lattice, Homogeneous):
    """A homogeneous medium whose coefficients are multiplied by the density of a cloud.

    The density is that of PBRT's cloud: five octaves of Perlin's noise, at points that two more
    octaves shift. In the cloud's own space y is the height. The density is full up to 1/2, and ends
    at 1. `to_world` converts this space to the world. `low` and `high` are the corners of the
    cloud's box in its space.

    The device computes the density at the points of a lattice. `resolution` is the number of points
    along the longest side of the box. A point takes two bytes.

    Raises SceneError for a box without an inside, and for a lattice too fine.
    """

    density: float = real(1.0, "how much of the noise becomes cloud", low=0.0)
    wispiness: float = real(1.0, "how much the noise is shifted", low=0.0, high=100.0)
    frequency: float = real(5.0, "cells of the first octave along a unit length", low=0.0, high=1e4)
    low: Vector3 = host((0.0, 0.0, 0.0), "a corner of the box", form="vector")
    high: Vector3 = host((1.0, 1.0, 1.0), "the opposite corner", form="vector")
    resolution: int = host(
        0, "points along the longest side of the box; 0: two for each cell of the finest octave, "
        f"from {CLOUD_LEAST} to {CLOUD_MOST}"
    )  # fmt: skip

    def check(self) -> None:
        for name, corner in (("low", self.low), ("high", self.high)):
            point = np.asarray(corner, float)
            if point.shape != (3,) or not np.isfinite(point).all():
                raise SceneError("must be three numbers", where=f"{self.kind}.{name}")
        corners = np.array([self.low, self.high], float)
        object.__setattr__(self, "low", tuple(corners.min(axis=0).tolist()))
        object.__setattr__(self, "high", tuple(corners.max(axis=0).tolist()))
        if not (self._sides > 0.0).all():
            raise SceneError("the box is flat: it equals `low`", where=f"{self.kind}.high")
        if not 0 <= self.resolution <= CLOUD_FINEST:
            message = f"must be 0 to {CLOUD_FINEST}, not {self.resolution!r}"
            raise SceneError(message, where=f"{self.kind}.resolution")
        super().check()

    @property
    def noise(self) -> tuple[float, ...]:
        """Density, wispiness and frequency, see kernels/stage/density.cl."""
        return self.density, self.wispiness, self.frequency

    @property
    def _sides(self) -> NDArray[np.float64]:
        sides: NDArray[np.float64] = np.asarray(self.high, float) - np.asarray(self.low, float)
        return sides

    @property
    def size(self) -> tuple[int, ...]:
        sides = self._sides
        wanted = 2.0 * self.frequency * OCTAVE**4 * sides.max()
        along = self.resolution or int(np.clip(np.ceil(wanted), CLOUD_LEAST, CLOUD_MOST))
        return tuple(int(n) for n in np.maximum(np.rint(along * sides / sides.max()), 1))

    @property
    def box(self) -> NDArray[np.float64]:
        matrix = np.diag([*self._sides, 1.0])
        matrix[:3, 3] = self.low
        return np.asarray(self.to_world, float) @ matrix


@dataclass(frozen=True, kw_only=True, eq=False)
class Grid(Lattice, Homogeneous):
    """A homogeneous medium whose coefficients are multiplied by a density on a grid.

    The density (nx, ny, nz) holds values at the centres of the cells of a box. Between centres it
    is trilinear. Beyond the outermost centres it is constant, and outside of the box it is 0. It is
    an array of numpy or of pyopencl, or a `Volume`. `to_world` moves the box of a `Volume`. By
    default the density is 1.

    `emission_grid` and `temperature` are such grids for the emission. An array fills the box of the
    density. The coarser of both grids is refined to the points of the other grid. A `Volume` is
    sampled at the points of the density. `temperature` is in kelvin. With it the emission is that
    of a black body.

    Raises SceneError for a density with less or more than three axes, or with numbers that are
    negative or not finite.
    """

    density: Any = host(
        np.ones((1, 1, 1), np.float32),
        "numbers (nx, ny, nz) that multiply the coefficients",
        form="volume",
    )
    bits: int = host(16, "of a number of the density on the device: 16 or 8")
    albedo_grid: NDArray[Any] | Volume | None = host(
        None, "colours (nx, ny, nz, 3) that multiply the scattering; the lost light is absorbed",
        form="colour_volume",
    )  # fmt: skip
    albedo_with_density: bool = host(
        False, "True: density times `albedo_grid` is interpolated; False: each by itself"
    )
    color_grid: NDArray[Any] | Volume | None = host(
        None, "colours (nx, ny, nz, 3) up to 1 that multiply the extinction",
        form="colour_volume",
    )  # fmt: skip
    emission_grid: Any = host(None, "numbers (nx, ny, nz) that multiply `emission`", form="volume")
    temperature: Any = host(
        None, "of a black body that is the emission, (nx, ny, nz)", "K", form="volume"
    )
    brightness: float = real(1.0, "factor on the emission of a temperature", low=0.0)
    normalised: bool = host(
        False, "whether a black body of any temperature has 1 at its brightest wavelength"
    )

    @property
    def size(self) -> tuple[int, ...]:
        shape: tuple[int, ...] = self.density.shape
        return shape

    def check(self) -> None:
        to_world = np.asarray(self.to_world, float)
        if isinstance(self.density, Volume):
            object.__setattr__(
                self, "to_world", to_world @ np.asarray(self.density.to_world, float)
            )
            object.__setattr__(self, "density", self.density.values)
        super().check()
        check_volume(self.density, f"{self.kind}.density")
        if self.bits not in (8, 16):
            raise SceneError(f"must be 16 or 8, not {self.bits!r}", where=f"{self.kind}.bits")
        if self.temperature is not None and self.emission_grid is not None:
            message = "give `emission_grid` or `temperature`, not both"
            raise SceneError(message, where=self.kind)
        for name in ON_POINTS:
            self._fit(name, to_world)

    def _fit(self, name: str, to_world: Matrix4) -> None:
        """Bring numbers to the points of the density, or that to theirs where they are more."""
        volume, where = fields_of(self)[name], f"{self.kind}.{name}"
        if volume is None:
            return
        values = volume.values if isinstance(volume, Volume) else volume
        coloured = name in ("albedo_grid", "color_grid")
        check_volume(values, where, colours=coloured)
        if coloured and not (isinstance(values, np.ndarray) and values.max() <= 1.0):
            raise SceneError("must be an array of numpy, of numbers up to 1", where=where)
        box = np.asarray(self.to_world, float)
        placed = (
            to_world @ np.asarray(volume.to_world, float) if isinstance(volume, Volume) else box
        )
        if values.shape[:3] != self.density.shape or not np.allclose(placed, box, 1e-6, 1e-9):
            if not (isinstance(values, np.ndarray) and isinstance(self.density, np.ndarray)):
                raise SceneError("on a device it must have the density's shape", where=where)
            finer = np.prod(values.shape[:3]) > np.prod(self.density.shape)
            if finer and not isinstance(volume, Volume):
                density = resampled(self.density, box, values.shape[:3], box)
                object.__setattr__(self, "density", density)
            else:
                values = resampled(values, placed, self.density.shape, box)
        object.__setattr__(self, name, values)

    @property
    def is_chromatic(self) -> bool:
        return self.color_grid is not None or super().is_chromatic

    @property
    def light(self) -> Spectrum | None:
        if self.temperature is None:
            return super().light
        dark = self.brightness == 0.0 or _is_zero(self.coefficients(spectral=True)[0])
        temperature = self.temperature
        hottest = 0.0 if dark else float(np.max(on_host(temperature)))
        return spectra.Blackbody(hottest, self.brightness) if hottest > COLDEST else None


@dataclass(frozen=True, kw_only=True, eq=False)
class Soot(Grid):
    """The soot of a flame: particles far smaller than the wavelength, which absorb and emit.

    The absorption is 6 pi E f / lambda (Rayleigh). f is the share of soot in the volume. E is 0.26,
    by the index 1.57 - 0.56i (Smyth and Shaddix 1996). The other coefficients are those of the
    matter around the soot.
    """

    share: float = real(
        1e-6, "of the volume that is soot, where the density is 1", low=0.0, high=1.0
    )

    @property
    def is_chromatic(self) -> bool:
        return True

    def coefficients(self, spectral: bool) -> tuple[Spectrum, Spectrum]:
        absorbs, scatters = super().coefficients(spectral)
        factor = 6.0 * np.pi * SOOT * self.share * self.scale
        if factor == 0.0:
            return absorbs, scatters
        soot = spectra.Tabulated(WIDEST, factor / (WIDEST * 1e-9), "hold")
        return _combined([soot, absorbs], sum, spectral), scatters


def _combined(values: list[Any], combine: Callable[[list[Any]], Any], spectral: bool) -> Spectrum:
    """Combine spectra at each wavelength, or each of three numbers."""
    if all(isinstance(value, Constant) for value in values):
        return Constant(float(combine([value.value for value in values])))
    if not spectral:
        return RGBUnbounded(*map(float, combine([value.to_rgb("unbounded") for value in values])))
    return spectra.Tabulated(WIDEST, combine([value.sample(WIDEST) for value in values]), "hold")


def _alone(value: Spectrum, spectral: bool) -> Spectrum:
    """A spectrum as `_combined` makes them."""
    return _combined([value], lambda v: v[0], spectral)


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


def _is_zero(value: Any) -> bool:
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


@dataclass(frozen=True, kw_only=True, eq=False)
class Mixture(Lattice):
    """Several media in the same place: coefficients add up, and each keeps its phase function.

    A `homogeneous` part fills the box. A `grid` has its own density. All grids have the same box,
    which `to_world` moves. Along each axis the number of points is that of the finest grid. A point
    takes 2 bytes, and 4 more for each part.

    Raises SceneError for parts that emit, that have a dye, colours on a grid or another box than
    the first grid, and for a `phase` of the mixture.
    """

    is_mixture = True

    parts: tuple[Medium, ...] = host(
        (Homogeneous(),), f"the media that it is made of, up to {MOST_PARTS}", form="media"
    )

    def check(self) -> None:
        """Check the parts."""
        if not isinstance(self.parts, tuple | list) or not 1 <= len(self.parts) <= MOST_PARTS:
            message = f"must be a list of 1 to {MOST_PARTS} media"
            raise SceneError(message, where=f"{self.kind}.parts")
        object.__setattr__(self, "parts", tuple(self.parts))
        for i, part in enumerate(self.parts):
            self._check_part(part, f"{self.kind}.parts[{i}]")
        if not isinstance(self.phase, Isotropic):
            message = "a mixture has the phase functions of its parts: leave it out"
            raise SceneError(message, where=f"{self.kind}.phase")
        super().check()

    def _check_part(self, part: object, where: str) -> None:
        if not isinstance(part, Homogeneous) or isinstance(part, Cloud | Dyed):
            shown = part.kind if isinstance(part, Medium) else repr(part)
            raise SceneError(f"must be homogeneous or a grid, not {shown}", where=where)
        if part.light is not None:
            raise SceneError("gives out light, as no part of a mixture can", where=where)
        if not isinstance(part, Grid):
            return
        if part.albedo_grid is not None or part.color_grid is not None:
            raise SceneError("has colours on its grid, as no part of a mixture can", where=where)
        if not np.allclose(part.box, self.grids[0].box, 1e-6, 1e-9):
            raise SceneError("its box is not that of the first grid", where=where)

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The parts that are grids, with a density of their own."""
        return tuple(part for part in self.parts if isinstance(part, Grid))

    @property
    def size(self) -> tuple[int, ...]:
        shapes = [(1, 1, 1), *(grid.density.shape for grid in self.grids)]
        return tuple(max(axis) for axis in zip(*shapes, strict=True))

    @property
    def box(self) -> NDArray[np.float64]:
        to_world = np.asarray(self.to_world, float)
        return to_world @ self.grids[0].box if self.grids else to_world

    @property
    def scatters(self) -> bool:
        return any(part.scatters for part in self.parts)

    def collisions(self, spectral: bool) -> tuple[Phase, ...]:
        return tuple(phase for p in self.parts if p.scatters for phase in p.collisions(spectral))

    @property
    def is_chromatic(self) -> bool:
        return True  # which part light meets depends on the wavelength

    @property
    def light(self) -> Spectrum | None:
        return None

    def coefficients(self, spectral: bool) -> tuple[Spectrum, Spectrum]:
        """Return the sums over all parts at their greatest densities [1/m], an upper bound."""
        absorbs, scatters = (
            _combined(list(each), lambda v: sum(map(np.multiply, self._densest, v)), spectral)
            for each in zip(*self.of_parts(spectral), strict=True)
        )
        return absorbs, scatters

    def of_parts(self, spectral: bool) -> list[tuple[Spectrum, Spectrum]]:
        """Return the absorption and scattering of each part [1/m].

        Tables are at whole nanometres, so that their sums are exact.
        """
        coefficients = [part.coefficients(spectral) for part in self.parts]
        return [
            (_alone(absorbs, spectral), _alone(scatters, spectral))
            for absorbs, scatters in coefficients
        ]

    @cached_property
    def _densest(self) -> list[float]:
        densities: list[Any] = [
            part.density if isinstance(part, Grid) else None for part in self.parts
        ]
        return [
            1.0 if density is None else float(np.max(on_host(density))) for density in densities
        ]


KINDS: tuple[type[Medium], ...] = (Homogeneous, Grid, Cloud, Dyed, Soot, Mixture)
