"""Phase functions: the angular distribution of scattering in a medium.

A phase function has a pair kernels/media/kinds/<kind>.cl. It scatters at a point as a material
scatters at a surface: its local frame has z along the ray back to the previous vertex.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import spectra
from clpt.errors import SceneError
from clpt.scene.params import angular, host, quantity, real, reflectance, reradiation
from clpt.scene.scatterer import Scatterer, check_reradiation
from clpt.scene.values import SpectrumLike
from clpt.spectra import Reradiation, Spectrum

MOST_ROWS = 512  # of a table by wavelength


@dataclass(frozen=True, kw_only=True, eq=False)
class Phase(Scatterer):
    """Base of all phase functions, in 1/sr."""

    folder: ClassVar[str] = "media/kinds"
    is_phase = True
    # of a kind without such a parameter
    reradiation = cast("Reradiation | None", None)

    @property
    def leaves(self) -> tuple[Phase, ...]:
        """The phase functions that it is made of: itself, but of a blend."""
        return (self,)


@dataclass(frozen=True, kw_only=True, eq=False)
class Isotropic(Phase):
    """Scattering with the same strength in all directions."""


@dataclass(frozen=True, kw_only=True, eq=False)
class HenyeyGreenstein(Phase):
    """Henyey and Greenstein 1941, by the mean cosine."""

    chromatic = True

    g: SpectrumLike = quantity(0.0, "mean cosine: 1 is forward, -1 back", low=-0.999, high=0.999)


@dataclass(frozen=True, kw_only=True, eq=False)
class Draine(Phase):
    """Draine 2003: Henyey and Greenstein's with alpha 0, Cornette and Shanks's with alpha 1.

    With g = 0 and alpha = 1 it is Rayleigh's. Jendersie and d'Eon 2023 fit it to drops of water.
    """

    chromatic = True

    g: SpectrumLike = quantity(0.0, "shape: 1 is forward, -1 back", low=-0.999, high=0.999)
    alpha: SpectrumLike = quantity(1.0, "how much more goes forward and back", low=0.0, high=1e4)


@dataclass(frozen=True, kw_only=True, eq=False)
class Tabulated(Phase):
    """Measured or calculated: a table over the cosine of the scattering angle.

    values: numbers (n,) from 0, in any unit, or a row for each wavelength (m, n); cosines: of each
    number, ascending from -1 to 1, by default even; wavelengths: of each row [nm], ascending. The
    table is linear between its entries. Beyond the end rows it is constant. It is scaled so that
    its integral over directions is 1. The parameters become float64 arrays, (m, n), (n,) and (m,).

    Raises SceneError for arrays of other forms or values.
    """

    chromatic = True

    values: ArrayLike = angular("how much goes where, over the cosine; a row for each wavelength")
    cosines: ArrayLike = host((), "of each value, from -1 to 1; none: even", form="numbers")
    wavelengths: ArrayLike = host(
        (), "of each row; none: a single row for all wavelengths", "nm", form="numbers"
    )

    def check(self) -> None:
        """Check the three arrays, and scale the rows."""
        values = np.atleast_2d(self._numbers("values", self.values))
        cosines = self._numbers("cosines", self.cosines)
        lambdas = self._numbers("wavelengths", self.wavelengths)
        if values.ndim != 2 or values.shape[1] < 2:
            raise self._error("values", "must be two numbers or more, or rows of them")
        if not cosines.size:
            cosines = np.linspace(-1.0, 1.0, values.shape[1])
        if len(cosines) != values.shape[1]:
            message = f"{len(cosines)} for {values.shape[1]} values: there must be one of each"
            raise self._error("cosines", message)
        if (cosines[0], cosines[-1]) != (-1.0, 1.0) or not (np.diff(cosines) > 0.0).all():
            raise self._error("cosines", "must ascend from -1 to 1")
        if len(lambdas) != len(values) and (len(values) > 1 or len(lambdas) > 1):
            message = f"{len(lambdas)} for {len(values)} rows: there must be one of each"
            raise self._error("wavelengths", message)
        if not (np.diff(lambdas) > 0.0).all() or not (lambdas > 0.0).all():
            raise self._error("wavelengths", "must ascend, and be above 0")
        if (values < 0.0).any():
            raise self._error("values", f"{values.min():g} is negative")
        whole = _whole(values, cosines)
        if not (whole > 0.0).all():
            raise self._error("values", f"row {int(np.argmin(whole))} holds nothing but 0")
        object.__setattr__(self, "values", values / whole[:, None])
        object.__setattr__(self, "cosines", cosines)
        object.__setattr__(self, "wavelengths", lambdas)

    def device_rows(
        self, spectral: bool
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], float, float]:
        """Return cosines (n,), densities (m, n) [1/sr], and the first row's wavelength and the
        distance of two rows [nm].

        spectral: the rows are even in wavelength; else there are rows of the three colours, or a
        single row.
        """
        values, cosines, lambdas = map(np.asarray, (self.values, self.cosines, self.wavelengths))
        if len(values) == 1:
            return cosines, values, 0.0, 1.0
        if spectral:
            gaps = np.diff(lambdas)
            step = max(float(gaps.min()), float(lambdas[-1] - lambdas[0]) / (MOST_ROWS - 1))
            count = round(float(lambdas[-1] - lambdas[0]) / step) + 1
            even = np.linspace(lambdas[0], lambdas[-1], count)
            at = np.clip(np.searchsorted(lambdas, even, "right") - 1, 0, len(lambdas) - 2)
            share = ((even - lambdas[at]) / gaps[at])[:, None]
            rows = values[at] * (1.0 - share) + values[at + 1] * share
            return cosines, rows, float(even[0]), float(even[1] - even[0])
        colours = [spectra.Tabulated(lambdas, v, "hold").to_rgb("unbounded") for v in values.T]
        rows = np.maximum(np.array(colours, np.float64).T, 0.0)
        whole = _whole(rows, cosines)
        return cosines, rows / whole[:, None], 0.0, 1.0

    def _numbers(self, name: str, values: object) -> NDArray[np.float64]:
        try:
            numbers = np.array(values, np.float64)
        except (TypeError, ValueError):
            raise self._error(name, "must be numbers, in rows of one length") from None
        if not np.isfinite(numbers).all():
            raise self._error(name, "must be finite")
        return numbers

    def _error(self, name: str, message: str) -> SceneError:
        return SceneError(message, where=f"{self.kind}.{name}")


@dataclass(frozen=True, kw_only=True, eq=False)
class Blend(Phase):
    """Two phase functions; each scatters its share of the light."""

    weight: float = real(0.5, "share of the second", low=0.0, high=1.0)
    first: Phase = host(Isotropic(), "a phase function", form="phase")
    second: Phase = host(Isotropic(), "another phase function", form="phase")

    def check(self) -> None:
        """Raise SceneError for a part that is no phase function."""
        parts: dict[str, object] = {"first": self.first, "second": self.second}
        for name, part in parts.items():
            if not isinstance(part, Phase):
                message = f"must be a phase function, not {part!r}"
                raise SceneError(message, where=f"{self.kind}.{name}")

    @property
    def leaves(self) -> tuple[Phase, ...]:
        return (*self.first.leaves, *self.second.leaves)

    @property
    def mixture(self) -> tuple[Any, Scatterer, Scatterer]:
        return self.weight, self.first, self.second


@dataclass(frozen=True, kw_only=True, eq=False)
class Rayleigh(Phase):
    """Scattering by particles far smaller than the wavelength, as air: 3 (1 + cos^2) / 16 pi."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Reradiating(Phase):
    """Isotropic scattering with fluorescence: light also leaves at longer wavelengths.

    The share `reflectance` of the colliding light keeps its wavelength. `reradiation` is the
    emission at other wavelengths. The particles collide with all wavelengths equally. If the
    absorption depends on the wavelength, use `dyed`. In RGB mode the colour is that under D65, at
    most white.
    """

    fluoresces = True

    reflectance: SpectrumLike = reflectance(
        0.5, "share of the light that keeps its wavelength", textured=False
    )
    reradiation: Reradiation | None = reradiation(None, "light that leaves at other wavelengths")
    amount: float = real(1.0, "factor on the re-radiation", low=0.0, high=1.0)

    def check(self) -> None:
        """Raise SceneError where more light would leave than comes."""
        if self.reradiation is not None and not isinstance(self.reradiation, PerCollision):
            check_reradiation(self.kind, self.reflectance, self.reradiation, self.amount)


@dataclass(frozen=True, eq=False)
class PerCollision(Reradiation):
    """Re-radiation of a dye, over the collisions at the wavelength that leaves.

    factor: the dye's absorption where that of `dye` is 1, over the collisions, a spectrum.
    """

    dye: Reradiation
    factor: Spectrum

    @property
    def table(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        out, into, values = self.dye.table
        return out, into, values * self.factor.sample(out)[:, None]

    def on_nodes(self, nodes: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.dye.on_nodes(nodes) * self.factor.sample(nodes)[:, None]


def _whole(rows: NDArray[Any], cosines: NDArray[Any]) -> NDArray[np.float64]:
    """Return integrals over directions of rows (m, n) that are linear between cosines (n,)."""
    return np.pi * ((rows[:, 1:] + rows[:, :-1]) @ np.diff(cosines))


LEAVES: tuple[type[Phase], ...] = (
    Isotropic,
    HenyeyGreenstein,
    Rayleigh,
    Draine,
    Reradiating,
    Tabulated,
)
KINDS: tuple[type[Phase], ...] = (*LEAVES, Blend)
