"""Diffuse bases below dielectric boundaries: coated surfaces and scattering bodies of pbrt.

pbrt walks at random between the layers; here our plastics' closed form stands for that. It is
exact for a smooth coat whose medium does nothing, and for a body seen from afar. Through bodies
light walks as through other media.
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
from clpt.formats.pbrt.roughness import alphas, isotropic, rough, smooth, stretched
from clpt.formats.pbrt.spectra import spectrum
from clpt.formats.pbrt.state import State
from clpt.formats.pbrt.textures import textured
from clpt.scene import materials
from clpt.scene.materials import Material
from clpt.scene.media import Homogeneous
from clpt.scene.phases import HenyeyGreenstein, Isotropic
from clpt.scene.roles import COEFFICIENT, INDEX, REAL, REFLECTANCE
from clpt.scene.textures import Texture
from clpt.scene.values import IndexLike, Textured, TexturedNumber

THICKNESS = 0.01  # of pbrt's coats, in mean free paths


def both(result: Material) -> Material:
    return materials.TwoSided(front=result)


def coated_diffuse(params: Parameters, state: State) -> Material:
    eta = spectrum(params, "eta", INDEX, state, 1.5)
    base = textured(params, "reflectance", REFLECTANCE, state, 0.5)
    thickness = coat(params, state)
    if thickness > 0.0:
        looks = coated_albedo.under_coat(index_at_550(eta), thickness)
        key = ("coat", base, index_at_550(eta), thickness)
        base = state.shared.once(key, params, partial(map_values, base, looks, bytes_stay=True))
    return plastic(base, eta, isotropic(alphas(params, state), params, state))


def coat(params: Parameters, state: State) -> float:
    """Take what a coat is made of: its thickness. What scatters in it is left out, warned of."""
    albedo = textured(params, "albedo", REFLECTANCE, state, 0.0)
    params.ignore("g", "maxdepth", "nsamples")
    if isinstance(albedo, Texture) or np.any(map_values(albedo, abs)):
        state.warn(params, "'albedo' of the coat is taken as 0: it absorbs and does not scatter")
    thickness = textured(params, "thickness", REAL, state, THICKNESS)
    if isinstance(thickness, Texture):
        state.warn(params, f"'thickness' cannot vary over the surface; {THICKNESS} is taken")
        return THICKNESS
    return thickness


def plastic(base: Textured, eta: IndexLike, alpha: TexturedNumber) -> Material:
    values: dict[str, Any] = {
        "diffuse_reflectance": base,
        "int_ior": eta,
        "ext_ior": 1.0,
        "nonlinear": True,
    }
    if smooth(alpha):
        return both(materials.Plastic(**values))
    return both(materials.RoughPlastic(alpha=rough(alpha), **values))


def index_at_550(eta: Any) -> float:
    """Return an index at 550 nm."""
    return float(spectra.index(eta).sample(550.0)) if not isinstance(eta, float) else eta


def subsurface(params: Parameters, state: State) -> Material:
    """The boundary of a body; or, where light cannot walk in it, what is seen of it from afar.

    Light sources off shapes, which a path inside cannot meet, and a reflectance from a texture ask
    for the second: light leaves where it came in.
    """
    eta = spectrum(params, "eta", INDEX, state, 1.33)
    alpha_u, alpha_v = alphas(params, state)
    if body(params, state) is not None:
        values = {"int_ior": eta, "ext_ior": 1.0}
        if smooth(alpha_u, alpha_v):
            return materials.Dielectric(**values)
        return materials.RoughDielectric(**stretched(alpha_u, alpha_v), **values)
    scattering, absorption, reflectance, g = _given(params, state)
    if reflectance is None:
        base = _albedo(scattering, absorption, g)
    else:
        looks = coated_albedo.from_body_reflectance(index_at_550(eta))
        base = map_values(reflectance, looks, bytes_stay=True)
    state.warn(
        params, "light leaves a 'subsurface' body where it entered: a diffuse base of its albedo"
    )
    return plastic(base, eta, isotropic((alpha_u, alpha_v), params, state))


def body(params: Parameters, state: State) -> Homogeneous | None:
    """The medium inside of a `subsurface` material; None where its light does not walk."""
    scattering, absorption, reflectance, g = _given(params, state)
    scale, mfp = (
        params.one("scale", "float", 1.0),
        spectrum(params, "mfp", COEFFICIENT, state, 1.0),
    )
    if not state.shared.walks or isinstance(reflectance, Texture):
        return None
    phase = HenyeyGreenstein(g=g) if g else Isotropic()
    if reflectance is None:
        scattering, absorption = (_coefficient(item) for item in (scattering, absorption))
        return Homogeneous(sigma_a=absorption, sigma_s=scattering, scale=scale, phase=phase)
    eta = spectrum(params, "eta", INDEX, state, 1.33)
    inner = map_values(reflectance, coated_albedo.from_body_reflectance(index_at_550(eta)))
    path = map_values(mfp, lambda v: scale * np.asarray(v))
    return Homogeneous.from_albedo(inner, path, g=g)


def _coefficient(value: object) -> Any:
    if isinstance(value, Texture):
        raise SceneError("'sigma_a' and 'sigma_s' cannot be textures")
    return spectra.RGBUnbounded(*value) if isinstance(value, tuple) else value


def _given(params: Parameters, state: State) -> tuple[Any, Any, Any, float]:
    """Scattering, absorption, reflectance and g, of one of the four ways to say them."""
    params.ignore("scale", "mfp")
    medium, g = params.one("name", "string", ""), params.one("g", "float", 0.0)
    scattering = textured(params, "sigma_s", COEFFICIENT, state)
    absorption = textured(params, "sigma_a", COEFFICIENT, state)
    reflectance = textured(params, "reflectance", REFLECTANCE, state)
    if medium:
        if medium not in coated_albedo.MEDIA:
            raise UnknownKindError("medium", medium, coated_albedo.MEDIA)
        return *coated_albedo.MEDIA[medium], None, 0.0
    if (scattering is None) != (absorption is None):
        raise SceneError("'sigma_a' and 'sigma_s' are given together or not at all")
    if scattering is not None:
        return scattering, absorption, None, g
    if reflectance is not None:
        return None, None, reflectance, g
    return *coated_albedo.MEDIA["Wholemilk"], None, g


def _albedo(scattering: object, absorption: object, g: float) -> Any:
    albedo = coated_albedo.body_albedo(_colour(scattering), _colour(absorption), g)
    return tuple(float(v) for v in albedo)


def _colour(value: Any) -> Any:
    if isinstance(value, Texture):
        raise SceneError("'sigma_a' and 'sigma_s' cannot be textures")
    rgb = value.to_rgb("unbounded") if isinstance(value, spectra.Spectrum) else value
    return np.broadcast_to(rgb, 3)
