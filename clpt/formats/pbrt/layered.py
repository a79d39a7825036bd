"""Diffuse bases below dielectric boundaries: coated surfaces and scattering bodies of pbrt.

pbrt walks at random between the layers, and through a body; here our plastics' closed form stands
for both. It is exact for a smooth coat whose medium does nothing, and for a body seen from afar.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from clpt import spectra
from clpt.errors import SceneError, UnknownKindError
from clpt.formats.pbrt import coated_albedo
from clpt.formats.pbrt.map_values import map_values
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.roughness import alphas, isotropic, rough, smooth
from clpt.formats.pbrt.spectra import spectrum
from clpt.formats.pbrt.state import State
from clpt.formats.pbrt.textures import textured
from clpt.scene import materials
from clpt.scene.materials import Material
from clpt.scene.textures import Texture

THICKNESS = 0.01  # of pbrt's coats, in mean free paths


def both(made: Material) -> Material:
    return materials.TwoSided(front=made)


def coated_diffuse(params: Parameters, state: State) -> Material:
    eta = spectrum(params, "eta", "index", state, 1.5)
    base = textured(params, "reflectance", "reflectance", state, 0.5)
    thickness = coat(params, state)
    if thickness > 0.0:
        looks = coated_albedo.under_coat(index_at_550(eta), thickness)
        key = ("coat", base, index_at_550(eta), thickness)
        base = state.shared.once(key, params, partial(map_values, base, looks, bytes_stay=True))
    return plastic(base, eta, isotropic(alphas(params, state), params, state))


def coat(params: Parameters, state: State) -> float:
    """Take what a coat is made of: its thickness. What scatters in it is left out, warned of."""
    albedo = textured(params, "albedo", "reflectance", state, 0.0)
    params.ignore("g", "maxdepth", "nsamples")
    if isinstance(albedo, Texture) or np.any(map_values(albedo, abs)):
        state.warn(params, "'albedo' of the coat is taken as 0: it absorbs and does not scatter")
    thickness = textured(params, "thickness", "real", state, THICKNESS)
    if isinstance(thickness, Texture):
        state.warn(params, f"'thickness' cannot vary over the surface; {THICKNESS} is taken")
        return THICKNESS
    return thickness


def plastic(base: Any, eta: Any, alpha: Any) -> Material:
    given = {"diffuse_reflectance": base, "int_ior": eta, "ext_ior": 1.0, "nonlinear": True}
    if smooth(alpha):
        return both(materials.Plastic(**given))
    return both(materials.RoughPlastic(alpha=rough(alpha), **given))


def index_at_550(eta: Any) -> float:
    """Return an index at 550 nm."""
    return float(spectra.index(eta).sample(550.0)) if not isinstance(eta, float) else eta


def subsurface(params: Parameters, state: State) -> Material:
    """The body's diffuse reflection under its boundary; light leaves where it came in."""
    eta = spectrum(params, "eta", "index", state, 1.33)
    g = params.one("g", "float", 0.0)
    params.ignore("scale", "mfp")
    medium = params.one("name", "string", "")
    given = {
        name: textured(params, name, role, state)
        for name, role in (
            ("sigma_a", "coefficient"), ("sigma_s", "coefficient"), ("reflectance", "reflectance"),
        )
    }  # fmt: skip
    scattering, absorption = given["sigma_s"], given["sigma_a"]
    if medium:
        if medium not in coated_albedo.MEDIA:
            raise UnknownKindError("medium", medium, coated_albedo.MEDIA)
        (scattering, absorption), g = coated_albedo.MEDIA[medium], 0.0
    elif (scattering is None) != (absorption is None):
        raise SceneError("'sigma_a' and 'sigma_s' are given together or not at all")
    elif scattering is None and given["reflectance"] is None:
        scattering, absorption = coated_albedo.MEDIA["Wholemilk"]
    if scattering is not None:
        base = _albedo(scattering, absorption, g)
    else:
        looks = coated_albedo.from_body_reflectance(index_at_550(eta))
        base = map_values(given["reflectance"], looks, bytes_stay=True)
    state.warn(
        params, "light leaves a 'subsurface' body where it entered: a diffuse base of its albedo"
    )
    return plastic(base, eta, isotropic(alphas(params, state), params, state))


def _albedo(scattering: Any, absorption: Any, g: float) -> Any:
    albedo = coated_albedo.body_albedo(_colour(scattering), _colour(absorption), g)
    return tuple(float(v) for v in albedo)


def _colour(value: Any) -> Any:
    if isinstance(value, Texture):
        raise SceneError("'sigma_a' and 'sigma_s' cannot be textures")
    rgb = value.to_rgb("unbounded") if isinstance(value, spectra.Spectrum) else value
    return np.broadcast_to(rgb, 3)
