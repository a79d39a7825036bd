"""Analytic reflections that tests measure."""

from __future__ import annotations

import numpy as np


def metal(alpha_u, alpha_v=None, colour=(0.9, 0.6, 0.3)):
    """f [1/sr] of facets after GGX (Walter et al. 2007), by Schlick's Fresnel; (n, 3) to (n, c)."""
    alpha_v, colour = alpha_u if alpha_v is None else alpha_v, np.asarray(colour)

    def masked(w):
        slope = (alpha_u * w[:, 0]) ** 2 + (alpha_v * w[:, 1]) ** 2
        return 2.0 / (1.0 + np.sqrt(1.0 + slope / w[:, 2] ** 2))

    def f(wo, wi):
        h = wo + wi
        h = h / np.maximum(np.linalg.norm(h, axis=1, keepdims=True), 1e-12)
        lit = (wo[:, 2] > 0.0) & (wi[:, 2] > 0.0)
        wo, wi = (np.where(lit[:, None], w, [0.0, 0.0, 1.0]) for w in (wo, wi))
        bounce = (1.0 - np.clip((h * wo).sum(axis=1), 0.0, 1.0))[:, None] ** 5
        value = facets(h, alpha_u, alpha_v) * masked(wo) * masked(wi) / (4.0 * wo[:, 2] * wi[:, 2])
        return np.where(lit, value, 0.0)[:, None] * (colour + (1.0 - colour) * bounce)

    return f


def facets(h, alpha_u, alpha_v):
    """GGX's distribution of normals [1/sr]."""
    stretched = (h[:, 0] / alpha_u) ** 2 + (h[:, 1] / alpha_v) ** 2 + h[:, 2] ** 2
    return 1.0 / (np.pi * alpha_u * alpha_v * stretched**2)


def directions(rng, n, least=0.1):
    """Directions (n, 3) of the upper hemisphere, with a cosine of `least` at least."""
    z, phi = rng.uniform(least, 1.0, n), rng.uniform(0.0, 2.0 * np.pi, n)
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)
