"""Spectra as plain immutable data of a scene, sampled in nm.

`to_rgb(role)` is an RGB renderer's stand-in for a spectrum, by Mitsuba 3's rules: a "reflectance"
is seen under D65 and clamped to [0, 1], an "unbounded" quantity (eta, k, extinction) is seen under
D65 and clamped from below at 0, an "emission" is integrated as it is.
"""

from __future__ import annotations

import dataclasses
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats, real
from clpt.errors import SceneError
from clpt.files import budget
from clpt.spectra import cie, data, upsampling

Role = Literal["reflectance", "unbounded", "emission"]
Outside = Literal["zero", "hold"]

SHORTEST, LONGEST = 200.0, 2500.0  # [nm], the ends of a film's widest range
WIDEST = np.arange(SHORTEST, LONGEST + 0.5)  # that range, whole nanometres


class Spectrum(ABC):
    """A function of the wavelength, a dataclass whose fields of type float are numbers."""

    def __post_init__(self) -> None:
        for name in _numbers_of(type(self)):
            value = vars(self)[name]
            if type(value) is not float:
                object.__setattr__(self, name, real(value, f"{type(self).__name__}.{name}"))

    @abstractmethod
    def sample(self, lambdas: ArrayLike) -> Floats:
        """Values at `lambdas` [nm], of the same shape, float64."""

    @property
    def knots(self) -> tuple[Floats, Floats] | None:
        """Wavelengths [nm] and values (n,) of a spectrum that is linear between them; else None.

        The wavelengths ascend; a wavelength that stands twice is a step. The first and the last
        value hold beyond the ends.
        """
        return None

    def to_rgb(self, role: Role = "reflectance") -> Floats:
        """Linear Rec.709 stand-in (3,) float64 for the given role; never negative.

        An emission that Rec. 709 cannot show keeps its luminance.
        """
        values = gridded(self, cie.GRID)
        if role == "emission":
            xyz = cie.spectrum_to_xyz(values)
            emitted = np.maximum(cie.xyz_to_rgb(xyz), 0.0)
            shown = float(cie.luminance(emitted))
            return emitted * (max(float(xyz[1]), 0.0) / shown) if shown > 0.0 else emitted
        rgb = cie.xyz_to_rgb(cie.spectrum_to_xyz(values * d65().sample(cie.GRID)))
        return np.clip(rgb, 0.0, 1.0 if role == "reflectance" else None)


@dataclass(frozen=True)
class Constant(Spectrum):
    """A spectrum with the same value at every wavelength."""

    value: float

    def sample(self, lambdas: ArrayLike) -> Floats:
        return np.full(np.shape(lambdas), self.value, np.float64)

    def to_rgb(self, role: Role = "reflectance") -> Floats:
        """(value, value, value), but as emission the colour of the equal-energy spectrum."""
        return super().to_rgb(role) if role == "emission" else np.full(3, float(self.value))


@dataclass(frozen=True, init=False)
class Tabulated(Spectrum):
    """Linear between points; outside them zero, or the end values if `outside` is "hold".

    Raises SceneError for wavelengths that do not ascend, and for values of another number or that
    are not finite.
    """

    lambdas: tuple[float, ...]
    values: tuple[float, ...]
    outside: Outside = "zero"

    def __init__(
        self, lambdas: Iterable[float], values: Iterable[float], outside: Outside = "zero"
    ) -> None:
        object.__setattr__(self, "lambdas", _floats(lambdas))
        object.__setattr__(self, "values", _floats(values))
        object.__setattr__(self, "outside", outside)
        if len(self.lambdas) != len(self.values) or not self.lambdas:
            raise SceneError(
                f"a spectrum needs as many values as wavelengths, found {len(self.values)} and "
                f"{len(self.lambdas)}"
            )
        if not np.isfinite([*self.lambdas, *self.values]).all():
            raise SceneError("a spectrum has a value that is not finite")
        if not (np.diff(self.lambdas) > 0.0).all():
            raise SceneError("the wavelengths of a spectrum must ascend")
        if outside not in ("zero", "hold"):
            raise SceneError(f"outside its points a spectrum is zero or holds, not {outside!r}")

    @property
    def knots(self) -> tuple[Floats, Floats]:
        """Its points, and a step at each end if it is zero outside."""
        lambdas, values = np.array(self.lambdas), np.array(self.values)
        if self.outside == "hold":
            return lambdas, values
        return np.pad(lambdas, 1, "edge"), np.pad(values, 1)

    def sample(self, lambdas: ArrayLike) -> Floats:
        end = 0.0 if self.outside == "zero" else None
        lambdas = np.asarray(lambdas, np.float64)
        return np.asarray(np.interp(lambdas, self.lambdas, self.values, end, end))


@dataclass(frozen=True)
class _Colour(Spectrum):
    """Linear Rec.709 that an RGB renderer uses as it is."""

    r: float
    g: float
    b: float

    def to_rgb(self, role: Role = "reflectance") -> Floats:
        """The colour itself, whatever the role."""
        return np.array([self.r, self.g, self.b], np.float64)


@dataclass(frozen=True)
class RGB(_Colour):
    """A reflectance in [0, 1] (clipped), made a smooth spectrum by `uplift`."""

    def sample(self, lambdas: ArrayLike) -> Floats:
        return upsampling.evaluate(upsampling.uplift(self.to_rgb()), lambdas)


@dataclass(frozen=True)
class RGBUnbounded(_Colour):
    """A colour that may exceed 1, such as an index or an extinction coefficient."""

    def sample(self, lambdas: ArrayLike) -> Floats:
        scale, coefficients = upsampling.unbounded(self.to_rgb())
        return scale * upsampling.evaluate(coefficients, lambdas)


@dataclass(frozen=True)
class RGBIlluminant(RGBUnbounded):
    """Emission of a colour: its unbounded spectrum times D65; (1, 1, 1) has luminance 1."""

    def sample(self, lambdas: ArrayLike) -> Floats:
        return super().sample(lambdas) * d65().sample(lambdas)


@dataclass(frozen=True)
class Sellmeier(Spectrum):
    """Index with n^2 = a + sum b l^2 / (l^2 - c), l and sqrt(c) in um (Sellmeier 1871)."""

    b: tuple[float, ...]
    c: tuple[float, ...]
    a: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "b", _floats(self.b))
        object.__setattr__(self, "c", _floats(self.c))
        if len(self.b) != len(self.c):
            raise SceneError(
                f"Sellmeier's formula needs as many b as c, found {len(self.b)} and {len(self.c)}"
            )

    def sample(self, lambdas: ArrayLike) -> Floats:
        squared = (np.asarray(lambdas, np.float64)[..., None] * 1e-3) ** 2
        terms = np.array(self.b) * squared / (squared - np.array(self.c))
        # Beyond a resonance the formula turns negative; there is no glass to describe there.
        return np.sqrt(np.maximum(self.a + terms.sum(axis=-1), 0.0))


@dataclass(frozen=True)
class Cauchy(Spectrum):
    """Index n = a + b / l^2 + c / l^4 with l in um."""

    a: float
    b: float = 0.0
    c: float = 0.0

    def sample(self, lambdas: ArrayLike) -> Floats:
        inverse = (np.asarray(lambdas, np.float64) * 1e-3) ** -2.0
        return self.a + (self.b + self.c * inverse) * inverse


def absorption(k: Spectrum) -> Spectrum:
    """Absorption coefficient [1/m] where the extinction coefficient is k: 4 pi k / lambda.

    Born and Wolf, Principles of Optics, 7th ed., 14.1 eq. 19. Whole nanometres, 200 to 2500. Raises
    SceneError for a table that lies elsewhere.
    """
    if isinstance(k, Tabulated):
        check_reach(k.lambdas[0], k.lambdas[-1])
    values = 4e9 * np.pi * k.sample(WIDEST) / WIDEST
    return Tabulated(WIDEST, values, "hold") if values.any() else Constant(0.0)


def check_reach(first: float, last: float) -> None:
    """Raise SceneError for data from `first` to `last` [nm] that lie outside every film's range."""
    if last < SHORTEST or first > LONGEST:
        raise SceneError(
            f"its wavelengths are {first:g} to {last:g} nm, but films lie within {SHORTEST:g} to"
            f" {LONGEST:g} nm; give wavelengths in nm"
        )


@lru_cache(maxsize=4096)
def extremes(
    spectrum: Spectrum, low: float = SHORTEST, high: float = LONGEST
) -> tuple[tuple[float, float], tuple[float, float]]:
    """The least and the largest value from `low` to `high` [nm], each with its wavelength [nm].

    A table's are exact; a formula is sampled at whole nanometres and at the ends. A value that is
    not a number counts as both.
    """
    points = [low, *np.arange(np.ceil(low), high), high]
    if spectrum.knots is not None:
        points += [at for at in spectrum.knots[0] if low < at < high]
    lambdas = np.array(points)
    with np.errstate(divide="ignore", invalid="ignore"):
        values = spectrum.sample(lambdas)
    least, largest = int(np.argmin(values)), int(np.argmax(values))
    return (
        (float(values[least]), float(lambdas[least])),
        (float(values[largest]), float(lambdas[largest])),
    )


@cache
def _numbers_of(cls: type[Spectrum]) -> tuple[str, ...]:
    """Return the names of a dataclass's fields of type float."""
    fields = dataclasses.fields(cls)  # type: ignore[arg-type]
    return tuple(field.name for field in fields if field.type == "float")


@cache
def d65() -> Tabulated:
    """CIE standard illuminant D65 with luminance 1."""
    return with_luminance_one(data.table("illuminants/D65.csv"))


@cache
def primaries() -> tuple[Tabulated, Tabulated, Tabulated]:
    """Reflectances of the colours red, green and blue of Rec. 709, which add up to 1.

    r, g and b times them has the colour (r, g, b) under D65, exactly (Mallett and Yuksel 2019).
    """
    rows = data.table("primaries.csv")
    red, green, blue = (Tabulated(rows[:, 0], rows[:, i], "hold") for i in (1, 2, 3))
    return red, green, blue


def with_luminance_one(rows: Floats) -> Tabulated:
    """Emission from (wavelength [nm], relative power) rows (n, 2), scaled to luminance 1."""
    on_observer = np.interp(cie.GRID, rows[:, 0], rows[:, 1], 0.0, 0.0)
    return Tabulated(rows[:, 0], rows[:, 1] / cie.spectrum_to_xyz(on_observer)[1])


def on_grid(spectrum: Spectrum, lo: float, hi: float, step: float = 1.0) -> NDArray[np.float32]:
    """Values of `gridded` at lo, lo + step, ... up to hi or the first step past it [nm], float32.

    Raises SceneError for an empty range or a step that is not above 0.
    """
    if not (0.0 < lo < hi and step > 0.0):
        raise SceneError(f"cannot tabulate a spectrum over [{lo}, {hi}] nm in steps of {step}")
    count = int(np.ceil((hi - lo) / step - 1e-9)) + 1
    grid = lo + step * np.arange(count, dtype=np.float64)
    return gridded(spectrum, grid).astype(np.float32)


def gridded(spectrum: Spectrum, grid: Floats) -> Floats:
    """The spectrum at the nodes of an even grid (n,) [nm], float64; linear between, it keeps power.

    A spectrum that has `knots` between the nodes is averaged around each node (`hat_means`), so
    that lines between the nodes keep their power. Any other spectrum is sampled.
    """
    budget.check_time()
    if spectrum.knots is None:
        return spectrum.sample(grid)
    at, values = spectrum.knots
    within = at[(at > grid[0]) & (at < grid[-1])]
    steps = (within - grid[0]) / (grid[1] - grid[0])
    if np.abs(steps - np.rint(steps)).max(initial=0.0) < 1e-9:
        return spectrum.sample(grid)
    return hat_means(at, values, grid)


def hat_means(at: Floats, values: Floats, grid: Floats) -> Floats:
    """Means around an even grid's nodes (n,) of a curve that is linear between points `at` (m,).

    Weights fall linearly to 0 at the next nodes ("hats"). So the means, joined linearly, have the
    same integral as `values` (m,) from the first node to the last.
    """
    points = np.union1d(grid, at[(at > grid[0]) & (at < grid[-1])])
    near, far = points[:-1], points[1:]
    width, step = far - near, grid[1] - grid[0]
    # A step may stand at either end of a piece: the ends follow from two values inside.
    p, q = (np.interp(near + share * width, at, values) for share in (0.25, 0.75))
    first, last = 1.5 * p - 0.5 * q, 1.5 * q - 0.5 * p
    cell = np.searchsorted(grid, near + 0.5 * width) - 1
    s, t = (near - grid[cell]) / step, (far - grid[cell]) / step
    right = width / 6.0 * (first * (2.0 * s + t) + last * (s + 2.0 * t))
    left = width / 2.0 * (first + last) - right
    sums = np.bincount(cell, left, len(grid)) + np.bincount(cell + 1, right, len(grid))
    weights = np.full(len(grid), step)
    weights[[0, -1]] = 0.5 * step
    return np.asarray(sums / weights)


def _floats(values: Iterable[float]) -> tuple[float, ...]:
    return tuple(real(value) for value in values)
