"""A medium of small spheres, far from each other: fog, mist, milk."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import scalars, spectra
from clpt.errors import SceneError
from clpt.mie.sizes import Sizes
from clpt.mie.sphere import spheres
from clpt.mie.water import water_index
from clpt.scene.media import Homogeneous
from clpt.scene.phases import Tabulated
from clpt.spectra import Spectrum

DENSE = 0.1  # share of the volume above which spheres do not scatter on their own
WATER = "water"
EVEN, FINE = 721, 100  # angles from 0 to 180 degrees, and more of them near either end


def angles(size: float) -> NDArray[np.float64]:
    """Return cosines from -1 to 1 for a table of spheres up to a size parameter.

    They are even in angle, and dense at both ends, where the corona and the glory have rings of
    1 / size radians.
    """
    least = np.pi / max(200.0 * min(size, 100.0), 4.0 * size)
    near = np.geomspace(min(least, 0.02), 0.3, FINE)
    theta = np.concatenate([np.linspace(0.0, np.pi, EVEN), near, np.pi - near])
    cosines = np.unique(np.round(np.cos(theta), 12))
    apart = np.concatenate([[True], np.diff(cosines) > 2e-7])  # as float32 tells them
    apart[-1] = apart[0] = True
    cosines = cosines[apart]
    cosines[0], cosines[-1] = -1.0, 1.0
    return cosines


def _wavelengths(lambdas: ArrayLike) -> NDArray[np.float64]:
    at = np.asarray(lambdas, np.float64) if np.size(lambdas) else np.arange(360.0, 831.0, 10.0)
    if not (np.isfinite(at) & (at > 0.0)).all() or not (np.diff(at) > 0.0).all():
        raise SceneError("must ascend, and be above 0", where="lambdas")
    return at


def droplets(
    of: Sizes,
    share: float,
    *,
    index: float | str | Spectrum = WATER,
    k: float | Spectrum = 0.0,
    host: float | str | Spectrum = 1.0,
    lambdas: ArrayLike = (),
    name: str = "",
) -> Homogeneous:
    """Return the medium of spheres that take a share of its volume.

    of: their sizes; share: 1e-7 is .1 g of water in a cubic metre, 0.04 the fat of milk; index, k,
    host: of the spheres, their absorption, and what is around, which does not absorb: a number, a
    spectrum, the name of a glass or "water" (IAPWS 1997, 15 C); lambdas: [nm], by default every
    10 nm from 360 to 830.

    The medium has sigma_t and albedo by wavelength, and a Tabulated phase function. Raises
    SceneError for a share above DENSE or not above 0, and as `spheres` does.
    """
    at = _wavelengths(lambdas)
    if not 0.0 < share <= DENSE:
        raise SceneError(
            f"{share:g} of the volume; it must be above 0 and up to {DENSE:g}, as denser spheres do"
            " not scatter on their own",
            where="share",
        )
    outside = _index(host, at)
    inside = (_index(index, at) + 1j * _values(k, at)) / outside
    waves = 2.0e9 * np.pi * outside / at  # [1/m]
    cosines = angles(float(waves.max() * of.radii[-1]))
    sigma_t, scattered = np.empty((2, len(at)))
    rows = np.empty((len(at), len(cosines)))
    number = share / (4.0 / 3.0 * np.pi * of.mean(3))
    area = number * of.shares * np.pi * of.radii**2
    for i, (wave, m) in enumerate(zip(waves, inside, strict=True)):
        found = spheres(wave * of.radii, m, cosines)
        own = area * found.scattering
        sigma_t[i], scattered[i] = area @ found.extinction, own.sum()
        rows[i] = own @ found.phase
    albedo = np.clip(scattered / sigma_t, 0.0, 1.0)
    return Homogeneous(
        sigma_t=spectra.Tabulated(at, sigma_t, "hold"),
        albedo=spectra.Tabulated(at, albedo, "hold"),
        phase=Tabulated(values=rows, cosines=cosines, wavelengths=at if len(at) > 1 else ()),
        name=name,
    )


def _index(value: float | str | Spectrum, at: NDArray[np.float64]) -> NDArray[np.float64]:
    if isinstance(value, str) and value == WATER:
        return water_index(at)
    return _values(spectra.index(value) if isinstance(value, (str, Spectrum)) else value, at)


def _values(value: float | Spectrum, at: NDArray[np.float64]) -> NDArray[np.float64]:
    if isinstance(value, Spectrum):
        return np.asarray(value.sample(at), np.float64)
    return np.full(len(at), scalars.number(value))
