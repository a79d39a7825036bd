"""Parts that materials of pbrt share: roughness, coats and their albedo, bodies, hair."""

from __future__ import annotations

import dataclasses
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from clpt import spectra
from clpt.errors import SceneError, UnknownKindError
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.spectra import spectrum
from clpt.formats.pbrt.state import State
from clpt.formats.pbrt.textures import map_values, textured
from clpt.scene import materials
from clpt.scene.materials import Hair, Material, pigment
from clpt.scene.media import Homogeneous
from clpt.scene.params import fields_of
from clpt.scene.phases import HenyeyGreenstein, Isotropic
from clpt.scene.roles import COEFFICIENT, FACTOR, INDEX, REAL, REFLECTANCE
from clpt.scene.textures import Texture
from clpt.scene.values import IndexLike, Textured, TexturedNumber

Values = Any  # a number or an array

COSINES = (np.arange(1024) + 0.5) / 1024.0
EVEN = 2.0 * COSINES / len(COSINES)  # shares of diffuse light at these cosines


def _measured() -> dict[str, tuple[tuple[float, ...], tuple[float, ...]]]:
    """Reduced scattering and absorption [1/mm] by name, see measured_media.csv."""
    text = (Path(__file__).parent / "measured_media.csv").read_text("utf-8")
    rows = [line.split(",") for line in text.splitlines() if not line.startswith("#")]
    values = {name: tuple(map(float, numbers)) for name, *numbers in rows}
    return {name: (numbers[:3], numbers[3:]) for name, numbers in values.items()}


MEDIA = _measured()


def internal_fresnel(ior: float) -> np.ndarray:
    """Fresnel's reflectance of unpolarised light from inside, at COSINES; (n,) float64."""
    sin2 = ior**2 * (1.0 - COSINES**2)
    out = np.sqrt(np.maximum(1.0 - sin2, 0.0))
    across = (ior * COSINES - out) / (ior * COSINES + out)
    along = (COSINES - ior * out) / (COSINES + ior * out)
    return np.where(sin2 < 1.0, 0.5 * (across**2 + along**2), 1.0)


def under_coat(r: Values, ior: float, thickness: float) -> Values:
    """Return a base of albedo r as below an absorbing coat, `thickness` in mean free paths.

    pbrt's coats let exp(-thickness / cos) through even where nothing scatters. With f_d the share
    that is reflected back after two passes, and t the mean of a pass of refracted light:
    r' / (1 - f r') = t^2 r / (1 - f_d r).
    """
    fresnel, passes = internal_fresnel(ior), np.exp(-thickness / COSINES)
    inside, damped = float(EVEN @ fresnel), float(EVEN @ (fresnel * passes**2))
    seen = transmitted(ior, thickness) ** 2 * r / (1.0 - damped * r)
    return seen / (1.0 + inside * seen)


def transmitted(ior: float, depth: ArrayLike) -> Values:
    """Return the mean transmittance of a coat for even light that is refracted into it.

    ior: relative index; depth: optical depth along the normal, of any shape, which is returned.
    """
    refracted = EVEN * (1.0 - internal_fresnel(ior))
    passes = np.exp(-np.multiply.outer(np.asarray(depth, np.float64), 1.0 / COSINES))
    return passes @ refracted / max(refracted.sum(), 1e-9)


def from_body_reflectance(r: Values, ior: float) -> Values:
    """Return the albedo of a base for pbrt's reflectance of a body below its boundary."""
    inside = float(EVEN @ internal_fresnel(ior))
    return r / (1.0 - inside * (1.0 - r))


def body_albedo(scattering: Values, absorption: Values, g: float) -> Values:
    """Diffuse albedo of a half space of single albedo a and mean cosine g (van de Hulst 1980).

    (1 - s) (1 - 0.139 s) / (1 + 1.17 s) with s = sqrt((1 - a) / (1 - a g)).
    """
    total = np.maximum(np.add(scattering, absorption), 1e-30)
    single = np.divide(scattering, total)
    s = np.sqrt((1.0 - single) / np.maximum(1.0 - single * g, 1e-9))
    return (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)


SMOOTH = 1e-3  # alpha below which pbrt takes a surface for smooth
SMOOTHEST = 1e-4


def alphas(params: Parameters, state: State, prefix: str = "") -> tuple[Any, Any]:
    """Take the roughness along and across as alpha; pbrt remaps it by its square root."""
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
    """Return a single roughness for a coat, which is isotropic."""
    u, v = alphas
    if u is v:
        return u
    if isinstance(u, Texture) or isinstance(v, Texture):
        state.warn(params, "a coat is rough alike in all directions; 'uroughness' is taken")
        return u
    state.warn(params, "a coat is rough alike in all directions; the geometric mean is taken")
    return float(np.sqrt(u * v))


THICKNESS = 0.01  # of pbrt's coats, in mean free paths


def both(result: Material) -> Material:
    return materials.TwoSided(front=result)


def coated_diffuse(params: Parameters, state: State) -> Material:
    eta = spectrum(params, "eta", INDEX, state, 1.5)
    base = textured(params, "reflectance", REFLECTANCE, state, 0.5)
    thickness = coat(params, state)
    if thickness > 0.0:
        looks = partial(under_coat, ior=index_at_550(eta), thickness=thickness)
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
        base = _layer_albedo(scattering, absorption, g)
    else:
        looks = partial(from_body_reflectance, ior=index_at_550(eta))
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
    inner = map_values(reflectance, partial(from_body_reflectance, ior=index_at_550(eta)))
    path = map_values(mfp, lambda v: scale * np.asarray(v))
    return Homogeneous.from_albedo(inner, path, g=g)


def _coefficient(value: object) -> Any:
    if isinstance(value, Texture):
        raise SceneError("'sigma_a' and 'sigma_s' cannot be textures")
    return spectra.RGBUnbounded(*value) if isinstance(value, tuple) else value


def _given(params: Parameters, state: State) -> tuple[Any, Any, Any, float]:
    """Take scattering, absorption, reflectance and g, in any of four parametrisations."""
    params.ignore("scale", "mfp")
    medium, g = params.one("name", "string", ""), params.one("g", "float", 0.0)
    scattering = textured(params, "sigma_s", COEFFICIENT, state)
    absorption = textured(params, "sigma_a", COEFFICIENT, state)
    reflectance = textured(params, "reflectance", REFLECTANCE, state)
    if medium:
        if medium not in MEDIA:
            raise UnknownKindError("medium", medium, MEDIA)
        return *MEDIA[medium], None, 0.0
    if (scattering is None) != (absorption is None):
        raise SceneError("'sigma_a' and 'sigma_s' are given together or not at all")
    if scattering is not None:
        return scattering, absorption, None, g
    if reflectance is not None:
        return None, None, reflectance, g
    return *MEDIA["Wholemilk"], None, g


def _layer_albedo(scattering: object, absorption: object, g: float) -> Any:
    albedo = body_albedo(_colour(scattering), _colour(absorption), g)
    return tuple(float(v) for v in albedo)


def _colour(value: Any) -> Any:
    if isinstance(value, Texture):
        raise SceneError("'sigma_a' and 'sigma_s' cannot be textures")
    rgb = value.to_rgb("unbounded") if isinstance(value, spectra.Spectrum) else value
    return np.broadcast_to(rgb, 3)


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


def blended(
    first: Material, second: Material, weight: TexturedNumber, params: Parameters, state: State
) -> Material:
    """Return a mixture; opaque parts beside those that let light through have their front alone."""
    result = materials.Blend(first=first, second=second, weight=weight)
    kinds = list(materials.parts(result))
    if any(part.transmits for part in kinds) and materials.TwoSided in map(type, kinds):
        state.warn(params, "beside what lets light through, the rest is black from behind")
        return _one_sided(result)
    return result


def _one_sided(result: Material) -> Material:
    """Return the material with the front sides of its two-sided parts."""
    if isinstance(result, materials.TwoSided):
        return _one_sided(result.front)
    inner: dict[str, Any] = {
        name: _one_sided(part)
        for name, part in fields_of(result).items()
        if name in ("material", "first", "second") and isinstance(part, Material)
    }
    return dataclasses.replace(result, **inner) if inner else result
