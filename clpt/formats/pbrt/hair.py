"""The hair material of a PBRT scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt.errors import SceneError
from clpt.formats.pbrt.map_values import map_values
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.state import State
from clpt.formats.pbrt.textures import textured
from clpt.scene.materials import Hair, Material, pigment
from clpt.scene.roles import FACTOR, REAL, REFLECTANCE

DARKEST = 1e-4  # a colour of hair; black would need an absorption without limit


def hair(params: Parameters, state: State) -> Material:
    """Make pbrt's `hair`. Raises SceneError."""
    around = textured(params, "beta_n", REAL, state, 0.3)
    return Hair(
        sigma_a=_absorption(params, state, around),
        longitudinal_roughness=textured(params, "beta_m", REAL, state, 0.3),
        azimuthal_roughness=around,
        scale_tilt=params.one("alpha", "float", 2.0),
        eta=params.one("eta", "float", 1.55),
    )


def _absorption(params: Parameters, state: State, around: object) -> Any:
    """Take the absorption, the colour of many fibres, or the concentrations of pigments."""
    values = textured(params, "sigma_a", FACTOR, state)
    colour = textured(params, "reflectance", REFLECTANCE, state)
    names = [name for name in ("eumelanin", "pheomelanin") if name in params]
    if (values is not None) + (colour is not None) + bool(names) > 1:
        raise SceneError("give one of 'sigma_a', 'reflectance' and pigments")
    if values is not None:
        return values
    if colour is not None:
        if not isinstance(around, float):
            raise SceneError("with 'reflectance', 'beta_n' must be a number")
        return map_values(colour, lambda c: _of_colour(c, around))
    if names:
        return pigment(*(params.one(n, "float", 0.0) for n in ("eumelanin", "pheomelanin")))
    return pigment(1.3, 0.0)


def _of_colour(colour: Any, around: float) -> Any:
    """The absorption that gives many fibres a colour (Chiang et al. 2016 eq. 9)."""
    fit = np.polyval([0.245, 5.574, -10.73, 2.532, -0.215, 5.969], around)
    return (np.log(np.clip(colour, DARKEST, 1.0)) / fit) ** 2
