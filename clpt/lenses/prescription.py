"""Surfaces of a lens from the front to the film, as patents and lens files list them, and glasses.

Lengths are in millimetres. A radius is above 0 where the centre lies behind the surface; 0 is a
plane. Light of a picture enters at the first surface. A glass has a name, or an index and an Abbe
number.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from clpt import spectra
from clpt.errors import SceneError, nearest
from clpt.spectra import Cauchy, Constant, Spectrum

LINE_D, LINE_F, LINE_C = 587.5618, 486.1327, 656.2725  # [nm]
AIR = Constant(1.0)
HIGHEST = 5.0  # index


def by_number(n: float, abbe: float = 0.0) -> Spectrum:
    """Return the index of a glass from its index `n` at the line d and its Abbe number.

    The model is Cauchy's formula with two terms, which fits n_d and n_F - n_C exactly; an Abbe
    number of 0 makes the index constant. Raises SceneError for numbers outside of glasses' range.
    """
    if not 1.0 <= n <= HIGHEST:
        raise SceneError(f"an index lies between 1 and {HIGHEST:g}, not {n:g}")
    if not (abbe == 0.0 or 5.0 <= abbe <= 200.0):
        raise SceneError(f"an Abbe number lies between 5 and 200, not {abbe:g}")
    if abbe == 0.0 or n == 1.0:
        return Constant(n)
    slope = (n - 1.0) / abbe / ((LINE_F * 1e-3) ** -2 - (LINE_C * 1e-3) ** -2)
    return Cauchy(n - slope * (LINE_D * 1e-3) ** -2, slope)


def known(name: str) -> Spectrum | None:
    """Return the index of a glass by its name in any case, or None where clpt has no formula.

    N-BK7 and BK7, a glass without lead and its forerunner, stand for each other.
    """
    wanted = name.strip().lower().replace("_", " ")
    for each in (wanted, f"n-{wanted}", wanted.removeprefix("n-")):
        if each in spectra.glasses():
            return spectra.glass(each)
    return None


def by_name(name: str, n: float = 0.0, abbe: float = 0.0) -> Spectrum:
    """Return the index of a glass by its name, else by `n` and `abbe` where `n` is not 0.

    Raises SceneError where neither is known.
    """
    index = known(name)
    if index is not None:
        return index
    if n == 0.0:
        raise SceneError(
            f"the glass {name!r} is not known{nearest(name.lower(), spectra.glasses())}; give its"
            " index and Abbe number"
        )
    return by_number(n, abbe)


MOST_SURFACES = 100
MOST_TERMS = 8  # aspheric, of r^4 to r^18
MOST_COATS = 6
DESIGN = 550.0  # [nm], the wavelength of a film's quarter wave


@dataclass(frozen=True)
class Coat:
    """A thin film of a coating: its index, and its thickness [nm]."""

    index: Spectrum
    thickness: float


@dataclass(frozen=True, eq=False)
class Surface:
    """A surface of a lens.

    radius, thickness to the next surface, semi_diameter: [mm]; glass: behind it; conic: 0 is a
    sphere, -1 a parabola; aspheric: factors of r^4, r^6, ... [mm^-3, mm^-5, ...] added to the sag;
    coating: its films from the front; stop: whether the diaphragm stands here.
    """

    radius: float
    thickness: float
    glass: Spectrum = AIR
    semi_diameter: float = 0.0
    conic: float = 0.0
    aspheric: tuple[float, ...] = ()
    coating: tuple[Coat, ...] = ()
    stop: bool = False

    @property
    def curvature(self) -> float:
        """1 / radius [1/mm]; 0 for a plane."""
        return 0.0 if self.radius == 0.0 else 1.0 / self.radius

    def check(self) -> None:
        """Raise SceneError for impossible numbers."""
        numbers = (self.radius, self.thickness, self.semi_diameter, self.conic, *self.aspheric)
        if not all(map(math.isfinite, numbers)):
            raise SceneError("a number is not finite")
        if not self.semi_diameter > 0.0:
            raise SceneError(f"a semi-diameter must be above 0, not {self.semi_diameter:g}")
        if (
            self.radius
            and (1.0 + self.conic) * (self.semi_diameter / self.radius) ** 2 > 1.0 + 1e-6
        ):
            raise SceneError(
                f"a surface of radius {self.radius:g} cannot reach to its semi-diameter"
                f" {self.semi_diameter:g}"
            )
        if len(self.aspheric) > MOST_TERMS:
            raise SceneError(f"at most {MOST_TERMS} aspheric terms, not {len(self.aspheric)}")
        if len(self.coating) > MOST_COATS:
            raise SceneError(f"at most {MOST_COATS} films in a coating, not {len(self.coating)}")
        index = float(self.glass.sample(LINE_D))
        if not 1.0 - 1e-3 <= index <= 5.0:
            raise SceneError(f"an index lies between 1 and 5, not {index:g}")


@dataclass(frozen=True, eq=False)
class Prescription:
    """A lens: its surfaces from the front to the film, its name, and the source of its numbers."""

    surfaces: tuple[Surface, ...]
    name: str = ""
    source: str = ""

    def __post_init__(self) -> None:
        if not 1 <= len(self.surfaces) <= MOST_SURFACES:
            count = len(self.surfaces)
            raise SceneError(f"a lens has 1 to {MOST_SURFACES} surfaces, not {count}")
        for i, surface in enumerate(self.surfaces, 1):
            try:
                surface.check()
            except SceneError as error:
                raise SceneError(f"surface {i}: {error.message}", where=error.where) from None
        stops = sum(surface.stop for surface in self.surfaces)
        if stops != 1:
            raise SceneError(f"a lens has one stop, not {stops}")
        if self.surfaces[-1].glass != AIR:
            raise SceneError("behind its last surface a lens must end in air")
        for i, surface in enumerate(self.surfaces[:-1], 1):
            if not surface.thickness >= 0.0:
                raise SceneError(f"surface {i}: its thickness {surface.thickness:g} is below 0")

    @cached_property
    def stop(self) -> int:
        """The number of the surface where the diaphragm stands, from 0."""
        return next(i for i, surface in enumerate(self.surfaces) if surface.stop)

    @cached_property
    def vertices(self) -> tuple[float, ...]:
        """Positions of the surfaces along the axis, from the first towards the film [mm]."""
        places = [0.0]
        for surface in self.surfaces[:-1]:
            places.append(places[-1] + surface.thickness)
        return tuple(places)

    @property
    def length(self) -> float:
        """From the first to the last surface [mm]."""
        return self.vertices[-1]

    @property
    def disperses(self) -> bool:
        """Whether the index of any of its glasses depends on the wavelength."""
        return any(not isinstance(surface.glass, Constant) for surface in self.surfaces)

    def indices(self, wavelength: float) -> list[float]:
        """Return the index in front of the lens and behind each surface, at a wavelength [nm]."""
        return [1.0, *(float(surface.glass.sample(wavelength)) for surface in self.surfaces)]

    def scaled(self, factor: float) -> Prescription:
        """Return the same lens in another size; coatings stay as they are."""
        return replace(self, surfaces=tuple(_scaled(each, factor) for each in self.surfaces))

    def with_stop(self, semi_diameter: float) -> Prescription:
        """Return the lens with a stop of another semi-diameter [mm]."""
        surfaces = list(self.surfaces)
        surfaces[self.stop] = replace(surfaces[self.stop], semi_diameter=semi_diameter)
        return replace(self, surfaces=tuple(surfaces))

    def with_coating(self, coating: Sequence[Coat]) -> Prescription:
        """Return the lens with a coating on each bare surface between air and glass.

        coating: from the air to the glass.
        """
        before: Spectrum = AIR
        surfaces = []
        for surface in self.surfaces:
            films = surface.coating
            if not films and before != surface.glass and AIR in (before, surface.glass):
                films = tuple(coating) if before == AIR else tuple(reversed(coating))
            surfaces.append(replace(surface, coating=films))
            before = surface.glass
        return replace(self, surfaces=tuple(surfaces))


def _scaled(surface: Surface, factor: float) -> Surface:
    aspheric = tuple(a * factor ** -(3.0 + 2.0 * i) for i, a in enumerate(surface.aspheric))
    return replace(
        surface,
        radius=surface.radius * factor,
        thickness=surface.thickness * factor,
        semi_diameter=surface.semi_diameter * factor,
        aspheric=aspheric,
    )


def quarter_wave(index: float, waves: float = 0.25) -> Coat:
    """Return a film of an index, its thickness in `waves` of the wavelength DESIGN inside it."""
    return Coat(Constant(index), waves * DESIGN / index)


# From the air to the glass. "single" is magnesium fluoride; "multi" has zirconia and alumina below
# it: a quarter, a half and a quarter of a wave (Macleod 2010, 4.3).
COATINGS: dict[str, tuple[Coat, ...]] = {
    "none": (),
    "single": (quarter_wave(1.38),),
    "multi": (quarter_wave(1.38), quarter_wave(2.06, 0.5), quarter_wave(1.65)),
}


def reflectance(
    n: float, beyond: float, coating: tuple[Coat, ...], lambdas: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the reflectance (n,) at normal incidence, at wavelengths [nm].

    n, beyond: indices in front and behind; coating: from the front. The recursion of amplitudes
    begins at the back (Rouard 1937).
    """
    r, below = np.zeros(len(lambdas), np.complex128), np.full(len(lambdas), beyond)
    for coat in reversed(coating):
        index = coat.index.sample(lambdas)
        edge = (index - below) / (index + below)
        r = (edge + r) / (1.0 + edge * r)
        r = r * np.exp(4j * np.pi * index * coat.thickness / lambdas)
        below = index
    edge = (n - below) / (n + below)
    return np.asarray(np.abs((edge + r) / (1.0 + edge * r)) ** 2)
