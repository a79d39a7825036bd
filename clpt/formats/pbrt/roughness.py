"""Roughness of pbrt's surfaces, as the alpha of microfacets."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt.errors import SceneError
from clpt.formats.pbrt.map_values import map_values
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.state import State
from clpt.formats.pbrt.textures import textured
from clpt.scene.roles import REAL
from clpt.scene.textures import Texture

SMOOTH = 1e-3  # alpha below which pbrt takes a surface for smooth
SMOOTHEST = 1e-4


def alphas(params: Parameters, state: State, prefix: str = "") -> tuple[Any, Any]:
    """Take the roughness along and across, as alpha; pbrt remaps one by its square root."""
    even = textured(params, f"{prefix}roughness", REAL, state, 0.0)
    u, v = (textured(params, f"{prefix}{axis}roughness", REAL, state, even) for axis in "uv")
    remap = params.one("remaproughness", "bool", True)
    alpha_u = _alpha(u, remap)
    return alpha_u, alpha_u if v is u or v == u else _alpha(v, remap)


def _alpha(roughness: Any, remap: bool) -> Any:
    if isinstance(roughness, Texture):
        return map_values(roughness, lambda r: np.clip(np.sqrt(r) if remap else r, SMOOTHEST, 1.0))
    if roughness < 0.0:
        raise SceneError(f"a roughness cannot be negative: {roughness:g}")
    return roughness**0.5 if remap else roughness


def smooth(*alphas: Any) -> bool:
    return all(not isinstance(alpha, Texture) and alpha < SMOOTH for alpha in alphas)


def rough(alpha: Any) -> Any:
    return alpha if isinstance(alpha, Texture) else float(np.clip(alpha, SMOOTHEST, 1.0))


def stretched(alpha_u: object, alpha_v: object) -> dict[str, Any]:
    return {"alpha_u": rough(alpha_u), "alpha_v": rough(alpha_v)}


def isotropic(alphas: tuple[Any, Any], params: Parameters, state: State) -> Any:
    """The one roughness of a coat that can be rough alike in all directions only."""
    u, v = alphas
    if u is v:
        return u
    if isinstance(u, Texture) or isinstance(v, Texture):
        state.warn(params, "a coat is rough alike in all directions; 'uroughness' is taken")
        return u
    state.warn(params, "a coat is rough alike in all directions; the geometric mean is taken")
    return float(np.sqrt(u * v))
