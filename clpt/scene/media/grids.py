"""Media whose density varies at the points of a grid: clouds, grids, soot and mixtures."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import spectra
from clpt.arrays import on_host
from clpt.errors import SceneError
from clpt.records import CLOUD_OCTAVES
from clpt.scene.media.medium import (
    COLDEST,
    Dyed,
    Homogeneous,
    Lattice,
    Medium,
    alone,
    combined,
    is_zero,
)
from clpt.scene.params import (
    fields_of,
    host,
    real,
)
from clpt.scene.phases import Isotropic, Phase
from clpt.scene.values import Matrix4, Vector3
from clpt.scene.volumes import Volume, check_volume, resampled
from clpt.spectra import (
    Spectrum,
)
from clpt.spectra.spectrum import WIDEST

SOOT = 0.26  # E(m), the imaginary part of (m^2 - 1) / (m^2 + 2) without its sign
ON_POINTS = ("emission_grid", "temperature", "albedo_grid", "color_grid")  # of a `Grid`
OCTAVE = CLOUD_OCTAVES["finer"]
CLOUD_LEAST, CLOUD_MOST, CLOUD_FINEST = 32, 256, 1024  # points along a cloud's longest side
MOST_PARTS = 8  # of a mixture


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
        dark = self.brightness == 0.0 or is_zero(self.coefficients(spectral=True)[0])
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
        return combined([soot, absorbs], sum, spectral), scatters


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
            combined(list(each), lambda v: sum(map(np.multiply, self._densest, v)), spectral)
            for each in zip(*self.of_parts(spectral), strict=True)
        )
        return absorbs, scatters

    def of_parts(self, spectral: bool) -> list[tuple[Spectrum, Spectrum]]:
        """Return the absorption and scattering of each part [1/m].

        Tables are at whole nanometres, so that their sums are exact.
        """
        coefficients = [part.coefficients(spectral) for part in self.parts]
        return [
            (alone(absorbs, spectral), alone(scatters, spectral))
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
