"""Materials of PBRT versions 2 and 3, by the formulas of pbrt-v3 (src/materials).

A sum of lobes becomes a blend, see lobes.py.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from clpt.errors import UnknownKindError
from clpt.formats.pbrt.lobes import Lobe, Values, is_dark, rgb, summed
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.scattering import blended, both, hair, rough, subsurface
from clpt.formats.pbrt.spectra import named, spectrum
from clpt.formats.pbrt.state import Contents, Definition, Maker, State
from clpt.formats.pbrt.textures import map_values, textured
from clpt.scene import materials
from clpt.scene.materials import Material
from clpt.scene.roles import INDEX, REAL, REFLECTANCE
from clpt.scene.textures import Product, Texture
from clpt.spectra import RGB, Constant, RGBUnbounded

MIRRORS = ("mirror", "glass")
VERSION_1 = ("bluepaint", "brushedmetal", "clay", "felt", "primer", "shinymetal", "skin")


def material(kind: str, params: Parameters, state: State) -> Material:
    """Make what a material of version 2 or 3 describes. Raises SceneError."""
    if kind in VERSION_1:
        state.warn(params, "is a material of version 1, which version 3 replaces by matte")
        kind = "matte"
    if kind == "fourier":
        raise params.error("tabulated Fourier materials (.bsdf of version 3) are not supported")
    if kind not in MAKERS:
        raise UnknownKindError("material", kind, MAKERS, **params.location())
    return MAKERS[kind](params, state)


def is_known(kind: str) -> bool:
    """Return whether versions 2 and 3 have a material of this name."""
    return kind in MAKERS or kind in VERSION_1 or kind == "fourier"


def has_mirrors(contents: Contents) -> bool:
    """Return whether some material has a specular (delta) lobe."""
    definitions = [item for versions in contents.shared.materials.values() for _, item in versions]
    parts = [contents.shapes, *contents.objects.values()]
    used = [item.state.material for part in parts for item in part]
    definitions += [item for item in used if isinstance(item, Definition)]
    return any(
        item.kind in MIRRORS or "Kr" in item.params or "Kt" in item.params for item in definitions
    )


def _matte(params: Parameters, state: State) -> Material:
    reflectance = textured(params, "Kd", REFLECTANCE, state, 0.5)
    sigma = textured(params, "sigma", REAL, state, 0.0)
    if not isinstance(sigma, Texture):
        sigma = float(np.clip(sigma, 0.0, 90.0))  # src/materials/matte.cpp
    if sigma == 0.0:
        return both(materials.Diffuse(reflectance=reflectance))
    rough_facets = {"sigma": sigma, "interreflection": False}
    return both(materials.OrenNayar(reflectance=reflectance, **rough_facets))


def _mirror(params: Parameters, state: State) -> Material:
    return both(_mirror_of(textured(params, "Kr", REFLECTANCE, state, 0.9)))


def _mirror_of(reflectance: Values) -> Material:
    return materials.Conductor(eta=0.0, k=1.0, specular_reflectance=reflectance)


def _glass(params: Parameters, state: State) -> Material:
    dielectric = {
        "int_ior": _index(params, state),
        "ext_ior": 1.0,
        "specular_reflectance": textured(params, "Kr", REFLECTANCE, state, 1.0),
        "specular_transmittance": textured(params, "Kt", REFLECTANCE, state, 1.0),
    }
    u, v = (textured(params, f"{axis}roughness", REAL, state, 0.0) for axis in "uv")
    remap = params.one("remaproughness", "bool", True)
    if u == 0.0 and v == 0.0:
        return materials.Dielectric(**dielectric)
    alphas = {"alpha_u": _alpha(u, remap), "alpha_v": _alpha(v, remap)}
    return materials.RoughDielectric(**dielectric, **alphas)


def _index(params: Parameters, state: State) -> Values:
    eta = spectrum(params, "eta", INDEX, state)
    index = spectrum(params, "index", INDEX, state, 1.5)
    return index if eta is None else eta


def _metal(params: Parameters, state: State) -> Material:
    eta, k = (
        textured(params, part, INDEX, state, named(f"metal-Cu-{part}")) for part in ("eta", "k")
    )
    return both(materials.RoughConductor(eta=eta, k=k, **_alphas(params, state, 0.01)))


def _alphas(params: Parameters, state: State, usual: float) -> dict[str, Any]:
    even = textured(params, "roughness", REAL, state, usual)
    remap = params.one("remaproughness", "bool", True)
    return {
        f"alpha_{axis}": _alpha(textured(params, f"{axis}roughness", REAL, state, even), remap)
        for axis in "uv"
    }


def _alpha(roughness: Values, remap: bool) -> Values:
    """Return alpha: src/core/microfacet.h, RoughnessToAlpha."""

    def remapped(r: Values) -> Values:
        x = np.log(np.maximum(r, 1e-3))
        alpha = 1.62142 + x * (0.819955 + x * (0.1734 + x * (0.0171201 + x * 0.000640711)))
        return np.clip(alpha if remap else r, 1e-4, 1.0)

    if isinstance(roughness, Texture):
        return map_values(roughness, remapped)
    return rough(float(remapped(roughness)))


def _plastic(params: Parameters, state: State) -> Material:
    alphas = _alphas(params, state, 0.1)
    diffuse = textured(params, "Kd", REFLECTANCE, state, 0.25)
    specular = textured(params, "Ks", REFLECTANCE, state, 0.25)
    warn = partial(state.warn, params)
    return both(summed([(diffuse, _diffuse_of), (specular, _coat_of(1.5, alphas))], warn))


def _diffuse_of(reflectance: Values) -> Material:
    return materials.Diffuse(reflectance=reflectance)


def _coat_of(eta: Values, alphas: dict[str, Any]) -> Callable[[Any], Material]:
    """Return how the reflection of a rough dielectric is made, by its factor.

    A conductor without extinction has the Fresnel factor of a dielectric, and is opaque.
    """

    def coat(reflectance: Values) -> Material:
        return materials.RoughConductor(eta=eta, k=0.0, specular_reflectance=reflectance, **alphas)

    return coat


def _uber(params: Parameters, state: State) -> Material:
    eta, alphas = _index(params, state), _alphas(params, state, 0.1)

    def _transmission(factor: Values) -> Material:
        return materials.Dielectric(
            int_ior=eta, ext_ior=1.0, specular_reflectance=0.0, specular_transmittance=factor
        )

    shares = {"Kd": 0.25, "Ks": 0.25, "Kr": 0.0, "Kt": 0.0}
    values = {name: textured(params, name, REFLECTANCE, state, v) for name, v in shares.items()}
    lobes: list[Lobe] = [
        (values["Kd"], _diffuse_of),
        (values["Ks"], _coat_of(eta, alphas)),
        (values["Kr"], lambda v: materials.Conductor(eta=eta, k=0.0, specular_reflectance=v)),
        (values["Kt"], _transmission),
    ]
    blend = summed(lobes, partial(state.warn, params))
    if not is_dark(values["Kt"]):
        state.warn(params, "beside 'Kt' the rest is as seen from the front alone")
    else:
        blend = both(blend)
    opacity = _number(textured(params, "opacity", REFLECTANCE, state, 1.0), params, state)
    if opacity == 1.0:
        return blend
    return materials.Mask(material=blend, opacity=opacity)


def _substrate(params: Parameters, state: State) -> Material:
    return both(
        materials.AshikhminShirley(
            diffuse=textured(params, "Kd", REFLECTANCE, state, 0.5),
            specular=textured(params, "Ks", REFLECTANCE, state, 0.5),
            **_alphas(params, state, 0.1),
        )
    )


def _translucent(params: Parameters, state: State) -> Material:
    base = textured(params, "Kd", REFLECTANCE, state, 0.25)
    specular = textured(params, "Ks", REFLECTANCE, state, 0.25)
    params.ignore("roughness", "remaproughness")
    if not is_dark(specular):
        state.warn(params, "'Ks' of translucent is left out: the diffuse lobes remain")
    names = {"reflectance": "reflect", "transmittance": "transmit"}
    shares = {
        ours: _product(base, textured(params, name, REFLECTANCE, state, 0.5))
        for ours, name in names.items()
    }
    return materials.DiffuseTransmission(**shares)


def _product(first: Values, second: Values) -> Values:
    if isinstance(first, Texture) or isinstance(second, Texture):
        return Product(first=first, second=second)
    return tuple(float(v) for v in np.broadcast_to(rgb(first), 3) * rgb(second))


def _disney(params: Parameters, state: State) -> Material:
    numbers = {
        "metallic": ("metallic", 0.0), "roughness": ("roughness", 0.5),
        "spec_tint": ("speculartint", 0.0), "anisotropic": ("anisotropic", 0.0),
        "sheen": ("sheen", 0.0), "sheen_tint": ("sheentint", 0.5), "spec_trans": ("spectrans", 0.0),
        "clearcoat": ("clearcoat", 0.0), "clearcoat_gloss": ("clearcoatgloss", 1.0),
        "flatness": ("flatness", 0.0), "diff_trans": ("difftrans", 1.0),
    }  # fmt: skip
    values = {ours: textured(params, name, REAL, state, v) for ours, (name, v) in numbers.items()}
    values["base_color"] = textured(params, "color", REFLECTANCE, state, 0.5)
    values["eta"] = spectrum(params, "eta", INDEX, state, 1.5)
    distance = textured(params, "scatterdistance", REFLECTANCE, state, 0.0)
    if not is_dark(distance):
        state.warn(params, "'scatterdistance' is left out: light leaves where it entered")
    if params.one("thin", "bool", False):
        for name in ("metallic", "clearcoat", "clearcoat_gloss"):
            values.pop(name)
        return materials.PrincipledThin(**values)
    del values["diff_trans"], values["flatness"]
    principled = materials.Principled(**values)
    return principled if values["spec_trans"] != 0.0 else both(principled)


def _mix(params: Parameters, state: State) -> Material:
    """amount counts the first: src/materials/mixmat.cpp."""
    names = [params.one(f"namedmaterial{i}", "string", "") for i in (1, 2)]
    first, second = (state.named_material(name, params) for name in names)
    amount = _number(textured(params, "amount", REFLECTANCE, state, 0.5), params, state)
    return blended(second, first, amount, params, state)


def _none(params: Parameters, state: State) -> Material:
    return materials.Null()


def _number(value: Values, params: Parameters, state: State) -> Values:
    """Return a colour as a number: its mean, with a warning where it is not grey."""
    if isinstance(value, (Texture, float)):
        return value
    if isinstance(value, Constant):
        return value.value
    channels = np.broadcast_to(rgb(value), 3)
    if np.ptp(channels) > 1e-3 and isinstance(value, (tuple, RGB, RGBUnbounded)):
        state.warn(params, "a share is a number here: the mean of its colour is taken")
    return float(np.clip(channels.mean(), 0.0, 1.0))


MAKERS: dict[str, Maker[Material]] = {
    "matte": _matte,
    "mirror": _mirror,
    "glass": _glass,
    "metal": _metal,
    "plastic": _plastic,
    "uber": _uber,
    "substrate": _substrate,
    "translucent": _translucent,
    "subsurface": subsurface,
    "disney": _disney,
    "mix": _mix,
    "hair": hair,
    "": _none,
    "none": _none,
}
