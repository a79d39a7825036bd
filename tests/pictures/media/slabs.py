"""Light in plane layers that scatter, in float64: adding and doubling, and Chandrasekhar's H."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import legendre
from numpy.typing import NDArray

Array = NDArray[np.float64]
NODES = 48  # cosines of a hemisphere
THIN = 2.0**-26  # optical depth of the layer that doubling begins with
FEEBLE = 1e-9  # weight of the straight direction: it is there for the beam


def gauss(count: int) -> tuple[Array, Array]:
    """Nodes and weights of Gauss's rule from 0 to 1."""
    nodes, weights = legendre.leggauss(count)
    return (nodes + 1.0) / 2.0, weights / 2.0


def beam_on_slab(depth: float, albedo: float, g: float) -> tuple[Array, Array, Array]:
    """Return cosines (n,) and the radiances (n,) of a slab that a beam of irradiance 1 meets.

    Those above it, and those below without the beam. The beam falls straight; the phase function is
    that of Henyey and Greenstein. Reflection and transmission of a thin layer are doubled until it
    is as thick as the slab (van de Hulst 1980).
    """
    mu, weight = gauss(NODES)
    mu, weight = np.append(mu, 1.0), np.append(weight, FEEBLE)
    moments = g ** np.arange(2 * NODES) * (2 * np.arange(2 * NODES) + 1)
    basis = legendre.legvander(mu, 2 * NODES - 1)
    back = legendre.legvander(-mu, 2 * NODES - 1)
    on, off = (basis * moments) @ basis.T, (back * moments) @ basis.T
    # The sum over all directions is 2, also where the series ends.
    sums = (on + off) @ weight
    doublings = max(int(np.ceil(np.log2(depth / THIN))), 1)
    thin = depth / 2.0**doublings
    share = albedo * thin / (mu[:, None] * sums[:, None]) * weight
    r, t = share * off, share * on + np.diag(1.0 - thin / mu)
    whole = np.eye(len(mu))
    for _ in range(doublings):
        between = np.linalg.solve((whole - r @ r).T, t.T).T  # t (1 - r r)^-1
        r, t = r + between @ r @ t, between @ t
    scale = 1.0 / (2.0 * np.pi * FEEBLE)
    return mu[:-1], r[:-1, -1] * scale, t[:-1, -1] * scale


def h_function(mu: Array | float, albedo: float) -> Array:
    """Chandrasekhar's H for isotropic scattering (Radiative Transfer, 1950, V eq. 12)."""
    nodes, weights = gauss(200)
    h = np.ones(len(nodes))
    rest = np.sqrt(1.0 - albedo)

    def again(at: Array) -> Array:
        sums = (weights * nodes * h / (at[..., None] + nodes)).sum(axis=-1)
        return 1.0 / (rest + 0.5 * albedo * sums)

    for _ in range(400):
        h = 0.5 * (h + again(nodes))
    return again(np.asarray(mu, float))


def half_space(mu: float, mu0: float, albedo: float) -> float:
    """Radiance of an isotropic half space toward mu, under a beam of irradiance 1 from mu0."""
    both = h_function(mu, albedo) * h_function(mu0, albedo)
    return float(albedo / (4.0 * np.pi) * mu0 / (mu + mu0) * both)
