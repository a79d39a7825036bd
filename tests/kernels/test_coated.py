"""Coated materials against random walks between a rough boundary and what lies under it.

The walk is that of pbrt's layered materials without a medium between the layers (Guo et al. 2018),
in float64 and with its masking, that of microfacets whose heights go together (Heitz 2014 eq. 99);
the kernels take shares and masking of the two directions as independent, which is what tells at
grazing angles. Standard errors of the walks are below 0.003.
"""

from __future__ import annotations

import numpy as np
import pytest

from clpt.scene import materials as m
from clpt.testing.settings import tilted
from tests.kernels.harness import Probe

ANGLES = (1.0, 30.0, 60.0, 75.0)
WALKS, BOUNCES, INDEX = 30_000, 40, 1.5
ALUMINIUM, DULL = 1.0 + 6.7j, 1.44 + 1.6j


def smith(w, alpha):
    """Smith's Lambda of GGX, (n,)."""
    z2 = np.maximum(w[:, 2] ** 2, 1e-20)
    return 0.5 * np.sqrt(1.0 + alpha**2 * (w[:, 0] ** 2 + w[:, 1] ** 2) / z2) - 0.5


def masked(w, out, alpha):
    """Share of what leaves toward `out` that is not hidden, for normals that w sees."""
    return (1.0 + smith(w, alpha)) / (1.0 + smith(w, alpha) + smith(out, alpha))


def visible(w, alpha, rng):
    """GGX normals (n, 3) that w (n, 3) on the front sees (Dupuy and Benyoub 2023)."""
    v = w * [alpha, alpha, 1.0]
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    turn, z = 2.0 * np.pi * rng.random(len(w)), (1.0 - rng.random(len(w))) * (1.0 + v[:, 2])
    z -= v[:, 2]
    r = np.sqrt(np.maximum(1.0 - z * z, 0.0))
    h = (np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1) + v) * [alpha, alpha, 1.0]
    h[:, 2] = np.maximum(h[:, 2], 1e-9)
    return h / np.linalg.norm(h, axis=1, keepdims=True)


def fresnel(cos, eta):
    """Reflectance, from eta that may be complex; the cosine of refraction beside it."""
    t = np.sqrt(1.0 - (1.0 - cos * cos) / eta**2 + 0j)
    s = np.abs((cos - eta * t) / (cos + eta * t)) ** 2
    p = np.abs((eta * cos - t) / (eta * cos + t)) ** 2
    return 0.5 * (s + p), t.real


def boundary(w, alpha, eta, rng):
    """What becomes of light at a rough boundary: direction, whether reflected, weight."""
    h = visible(w, alpha, rng)
    cos = np.clip(np.einsum("ij,ij->i", w, h), 1e-9, 1.0)
    share, t = fresnel(cos, eta)
    reflected = rng.random(len(w)) < share
    mirrored = 2.0 * cos[:, None] * h - w
    out = np.where(reflected[:, None], mirrored, h * (cos / eta - t)[:, None] - w / eta)
    kept = np.where(reflected, out[:, 2] > 0.0, out[:, 2] < 0.0)
    return out, reflected, np.where(kept, masked(w, out, alpha), 0.0)


def metal(eta, alpha):
    def bounce(w, rng):
        h = visible(w, alpha, rng)
        cos = np.clip(np.einsum("ij,ij->i", w, h), 1e-9, 1.0)
        out = 2.0 * cos[:, None] * h - w
        return out, np.where(out[:, 2] > 0.0, fresnel(cos, eta)[0] * masked(w, out, alpha), 0.0)

    return bounce


def paint(albedo):
    def bounce(w, rng):
        r, turn = np.sqrt(rng.random(len(w))), 2.0 * np.pi * rng.random(len(w))
        out = np.stack([r * np.cos(turn), r * np.sin(turn), np.sqrt(1.0 - r * r)], axis=1)
        return out, np.full(len(w), albedo)

    return bounce


def walked(degrees, coat, base, seed=1):
    """Albedo for light at an angle to a coat of roughness `coat` over `base`."""
    rng = np.random.default_rng(seed)
    w = np.tile(tilted(degrees), (WALKS, 1))
    out, reflected, weight = boundary(w, coat, INDEX, rng)
    left = weight[reflected].sum()
    w, beta = out[~reflected] * [1.0, 1.0, -1.0], weight[~reflected]
    for _ in range(BOUNCES):
        w, beta = w[beta > 1e-6], beta[beta > 1e-6]
        up, share = base(w, rng)
        up, beta = up[share > 0.0], (beta * share)[share > 0.0]
        w, kept, weight = boundary(up, coat, 1.0 / INDEX, rng)  # the coat's underside, mirrored
        beta = beta * weight
        left += beta[~kept].sum()
        w, beta = w[kept], beta[kept]
    return left / WALKS


def albedo(cls, params, degrees):
    """Albedo of a kind by its own sampling."""
    n = 64
    grid = np.stack(np.meshgrid(*[(np.arange(n) + 0.5) / n] * 2), -1).reshape(-1, 2)
    choice = np.random.default_rng(2).permutation(n * n)[:, None] / (n * n)
    r = Probe(cls, "rgb")(params, *[tilted(degrees)[None]] * 2, np.hstack([grid, choice]))
    return np.where(r["sampled_pdf"] > 0.0, r["weight"][:, 0], 0.0).mean()


def difference(cls, params, coat, base):
    """Ours less the walk's, at ANGLES."""
    return np.array([albedo(cls, params, a) - walked(a, coat, base) for a in ANGLES])


def coated(coat, alpha, eta):
    given = {"coat_ior": INDEX, "ext_ior": 1.0, "coat_alpha": coat, "distribution": 0}
    given |= {"alpha_u": alpha, "alpha_v": alpha, "eta": eta.real, "k": eta.imag}
    vectors = {k: np.full(3, given[k]) for k in ("coat_ior", "ext_ior", "eta", "k")}
    return given | vectors | {"specular_reflectance": np.ones(3)}


@pytest.mark.parametrize(
    ("coat", "alpha", "eta", "bound"),
    [
        (1e-3, 1e-3, ALUMINIUM, 0.008),  # smooth on smooth: by equations, and tables
        (1e-3, 0.3, DULL, 0.006),
        (1e-3, 0.1, ALUMINIUM, 0.075),
        (0.1, 0.3, ALUMINIUM, 0.02),
        (0.3, 0.1, ALUMINIUM, 0.06),
        (0.6, 1e-3, DULL, 0.03),
        (0.6, 0.3, ALUMINIUM, 0.03),
    ],
)
def test_coated_metal_is_near_a_walk(coat, alpha, eta, bound):
    off = difference(m.CoatedConductor, coated(coat, alpha, eta), coat, metal(eta / INDEX, alpha))
    assert np.all(np.abs(off) < bound), off


@pytest.mark.parametrize("share", [0.2, 0.9])
@pytest.mark.parametrize(("alpha", "bound"), [(1e-3, 0.012), (0.1, 0.016), (0.3, 0.02)])
def test_rough_plastic_is_a_walk(alpha, bound, share):
    params = {"int_ior": np.full(3, INDEX), "ext_ior": np.ones(3), "alpha": alpha}
    params |= {"diffuse_reflectance": np.full(3, share), "specular_reflectance": np.ones(3)}
    params |= {"distribution": 0, "nonlinear": 1}
    off = difference(m.RoughPlastic, params, alpha, paint(share))
    assert np.all(np.abs(off) < bound), off
