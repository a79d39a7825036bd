"""Integrals over the normals of microfacets, in float64: what coats and facets let through.

Isotropic microfacets of roughness alpha; eta: index behind the facets over that before them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial.legendre import leggauss

from clpt.arrays import Floats

BOUNCE = 0.77  # cosine of light within a coat, see kernels/materials/kinds/coated_conductor.cl
_RADII, _AZIMUTHS = leggauss(40), 48


def facing(cos_i: Floats, alpha: float) -> Floats:
    """Return a typical cosine between a direction of cosine cos_i and the facets that it sees."""
    return np.sqrt(cos_i**2 + alpha**2 * (1.0 - cos_i**2))


def fresnel(cos_i: Floats, eta: float) -> Floats:
    """Reflectance of a smooth boundary, met at cosines above 0 (Born and Wolf 1999, 1.5.2)."""
    cos2 = 1.0 - (1.0 - cos_i**2) / eta**2
    cos_t = np.sqrt(np.maximum(cos2, 0.0))
    across = (cos_i - eta * cos_t) / np.maximum(cos_i + eta * cos_t, 1e-300)
    along = (eta * cos_i - cos_t) / np.maximum(eta * cos_i + cos_t, 1e-300)
    return np.where(cos2 <= 0.0, 1.0, 0.5 * (across**2 + along**2))


def masking(distribution: str, alpha: float, z: Floats) -> Floats:
    """Smith's G1 of directions with these cosines, as in kernels/materials/microfacet.cl."""
    z = np.clip(z, 0.0, 1.0)
    spread = alpha * np.sqrt(1.0 - z**2)
    if distribution == "ggx":
        return 2.0 * z / np.maximum(z + np.sqrt(z**2 + spread**2), 1e-300)
    a = z / np.maximum(spread, 1e-300)
    near = np.minimum(a, 1.6)
    fit = near * (3.535 + 2.181 * near) / (1.0 + near * (2.276 + 2.577 * near))
    return np.where(a < 1.6, fit, 1.0)


def _mean(distribution: str, alpha: float, cos_i: Floats, value: Callable[..., Floats]) -> Floats:
    """Mean of value(cosine to the normal, normal's z) over the normals that cos_i (n,) sees."""
    nodes, weights = _RADII
    v = 0.5 * (nodes + 1.0)  # 1 - v^2: share of projected area with smaller slopes
    slope = np.sqrt(1.0 - v**2) / v if distribution == "ggx" else np.sqrt(-2.0 * np.log(v))
    radius = (alpha * slope)[:, None]
    turn = np.cos((np.arange(_AZIMUTHS) + 0.5) / _AZIMUTHS * np.pi)
    cos_i = cos_i[:, None, None]
    cos_h = 1.0 / np.sqrt(1.0 + radius**2)
    area = np.maximum(cos_i + np.sqrt(1.0 - cos_i**2) * radius * turn, 0.0)
    cosine = np.minimum(area * cos_h, 1.0)
    area = area * (weights * v)[:, None]
    weighted = area * value(cos_i, np.maximum(cosine, 1e-12), cos_h)
    return weighted.sum((1, 2)) / area.sum((1, 2))


def transmittance(distribution: str, alpha: float, eta: float, cos_i: Floats) -> Floats:
    """Mean of (1 - F) G1(refracted direction) for light from outside: what Mitsuba 3 tabulates."""

    def passed(cos_i: Floats, c: Floats, cos_h: Floats) -> Floats:
        cos_t = np.sqrt(np.maximum(1.0 - (1.0 - c**2) / eta**2, 0.0))
        z = cos_i / eta + (cos_t - c / eta) * cos_h
        return (1.0 - fresnel(c, eta)) * masking(distribution, alpha, z)

    return _mean(distribution, alpha, cos_i, passed)


def reflectance(distribution: str, alpha: float, eta: float, cos_i: Floats) -> Floats:
    """Mean of F(c) G1(reflected direction), for eta behind the facets over that before them."""

    def thrown(cos_i: Floats, c: Floats, cos_h: Floats) -> Floats:
        return fresnel(c, eta) * masking(distribution, alpha, 2.0 * c * cos_h - cos_i)

    return _mean(distribution, alpha, cos_i, thrown)


def inside_reflectance(distribution: str, alpha: float, eta: float) -> float:
    """Return the share of diffuse light from below that a coat reflects, less what facets mask.

    A mean over 64 cosines, ends included, as Mitsuba 3 takes it: of a smooth coat of index 1.5 that
    is 1.5 % less than the integral.
    """
    cos_i = np.maximum(np.linspace(0.0, 1.0, 64), 1e-6)
    return float(2.0 * (cos_i * reflectance(distribution, alpha, 1.0 / eta, cos_i)).mean())


def bounce(distribution: str, alpha: float) -> float:
    """Return the share of light of cosine BOUNCE that leaves facets which reflect all."""

    def kept(cos_i: Floats, c: Floats, cos_h: Floats) -> Floats:
        return masking(distribution, alpha, 2.0 * c * cos_h - cos_i)

    return float(_mean(distribution, alpha, np.array([BOUNCE]), kept)[0])


def within(cos_i: Floats, eta: float) -> Floats:
    """Return the cosines of refracted light within a smooth coat."""
    return np.sqrt(1.0 - (1.0 - cos_i**2) / eta**2)


def thrown_back(distribution: str, alpha: float, eta: float, cos_i: Floats) -> Floats:
    """Return the share of light from white facets below that a smooth coat throws back.

    cos_i (n,): the cosines of the incident light outside of the coat.
    """

    def thrown(cos_i: Floats, c: Floats, cos_h: Floats) -> Floats:
        z = np.clip(2.0 * c * cos_h - cos_i, 1e-12, 1.0)
        return masking(distribution, alpha, z) * fresnel(z, 1.0 / eta)

    return _mean(distribution, alpha, within(cos_i, eta), thrown)


def diffuse_mean(share: Callable[[Floats], Floats]) -> float:
    """Return the mean over diffuse light of a share by cosine."""
    nodes, weights = leggauss(32)
    root = 0.5 * (nodes + 1.0)  # of the cosine
    return float((weights * 2.0 * root**3 * share(root**2)).sum())
