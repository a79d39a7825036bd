"""Directions and random valid parameters of material kinds, generated from their declarations."""

from __future__ import annotations

import numpy as np

from clpt.scene.params import Kind, Param, device_params


def directions(rng: np.random.Generator, n: int) -> np.ndarray:
    """Uniform on the sphere, (n, 3)."""
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def cosine_pairs(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of directions (n, 3): uniform ones, and pairs near mirror reflection."""
    wo, wi = directions(rng, n), directions(rng, n)
    near = wi * 0.3 + wo * [-1.0, -1.0, 1.0]
    near /= np.linalg.norm(near, axis=1, keepdims=True)
    half = np.arange(n) % 2 == 0
    return wo, np.where(half[:, None], wi, near)
