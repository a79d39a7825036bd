"""Materials of a PBRT scene. Surfaces look the same from both sides, so most are `TwoSided`."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from clpt import measured
from clpt.errors import SceneError, UnknownKindError
from clpt.formats.pbrt import old_materials, scattering
from clpt.formats.pbrt.params import Parameters
from clpt.formats.pbrt.scattering import (
    alphas,
    blended,
    both,
    coat,
    coated_diffuse,
    hair,
    index_at_550,
    isotropic,
    rough,
    smooth,
    stretched,
    subsurface,
)
from clpt.formats.pbrt.spectra import named, spectrum
from clpt.formats.pbrt.state import Maker, State
from clpt.formats.pbrt.textures import map_values, normals, textured
from clpt.scene import materials
from clpt.scene.materials import Material
from clpt.scene.roles import INDEX, REAL, REFLECTANCE
from clpt.scene.textures import Product, Texture

PLAIN: dict[str, Any] = {
    "flip_invalid": False,
    "shadowing": False,
}  # pbrt uses a bent normal as it comes


def material(kind: str, params: Parameters, state: State, name: str = "") -> Material:
    """Make what a `Material` or `MakeNamedMaterial` directive describes. Raises SceneError."""
    if state.shared.old and old_materials.is_known(kind):
        with params.locating():
            result = old_materials.material(kind, params, state)
            return replace(_bumped(result, params, state), name=name)
    if old_materials.is_known(kind) and kind not in MAKERS:
        raise params.error(f"{kind!r} is a material of pbrt-v3, but the file is of version 4")
    if kind not in MAKERS:
        known = old_materials.MAKERS if state.shared.old else MAKERS
        state.stand_in(UnknownKindError("material", kind, known, **params.location()), params)
        return both(materials.Diffuse(name=name))
    with params.locating():
        return replace(_bumped(MAKERS[kind](params, state), params, state), name=name)


def _bumped(result: Material, params: Parameters, state: State) -> Material:
    """The material with the relief of its "displacement" or its "normalmap"."""
    height = textured(params, "displacement", REAL, state)
    file = params.one("normalmap", "string", "")
    if isinstance(height, Texture) and file:
        raise SceneError("give either 'displacement' or 'normalmap', not both")
    if isinstance(height, Texture):
        return materials.BumpMap(material=result, height=height, **PLAIN)
    if file:
        return materials.NormalMap(material=result, map=normals(file, state), **PLAIN)
    return result


def _diffuse(params: Parameters, state: State) -> Material:
    reflectance = textured(params, "reflectance", REFLECTANCE, state, 0.5)
    return both(materials.Diffuse(reflectance=reflectance))


def _diffuse_transmission(params: Parameters, state: State) -> Material:
    scale = params.one("scale", "float", 1.0)
    shares = {
        name: _times(textured(params, name, REFLECTANCE, state, 0.25), scale)
        for name in ("reflectance", "transmittance")
    }
    return materials.DiffuseTransmission(**shares)


def _times(value: object, scale: float) -> Any:
    if scale == 1.0:
        return value
    if isinstance(value, Texture) and scale < 1.0:
        return Product(first=value, second=scale)
    return map_values(value, lambda v: np.minimum(scale * v, 1.0))


def _conductor(params: Parameters, state: State) -> Material:
    alpha_u, alpha_v = alphas(params, state)
    metal = _metal(params, state, "")
    if smooth(alpha_u, alpha_v):
        return both(materials.Conductor(**metal))
    return both(materials.RoughConductor(**stretched(alpha_u, alpha_v), **metal))


def _metal(params: Parameters, state: State, prefix: str) -> dict[str, Any]:
    """Take eta and k, or a reflectance at normal incidence: eta = 1, k = 2 sqrt(r / (1 - r))."""
    eta = textured(params, f"{prefix}eta", INDEX, state)
    k = textured(params, f"{prefix}k", INDEX, state)
    reflectance = textured(params, "reflectance", REFLECTANCE, state)
    if reflectance is None:
        copper = {part: named(f"metal-Cu-{part}") for part in ("eta", "k")}
        return {"eta": copper["eta"] if eta is None else eta, "k": copper["k"] if k is None else k}
    if eta is not None or k is not None:
        raise SceneError("give either 'reflectance' or 'eta' and 'k', not both")
    return {"eta": 1.0, "k": map_values(reflectance, _extinction)}


def _damped(metal: dict[str, Any], ior: float, thickness: float) -> dict[str, Any]:
    """A metal under a coat that absorbs, which is a factor on its reflection."""
    return {**metal, "specular_reflectance": float(scattering.transmitted(ior, thickness)) ** 2}


def _extinction(r: Any) -> Any:
    r = np.clip(r, 0.0, 0.9999)
    return 2.0 * np.sqrt(r / (1.0 - r))


def _coated_conductor(params: Parameters, state: State) -> Material:
    ior = spectrum(params, "interface.eta", INDEX, state, 1.5)
    outer = isotropic(alphas(params, state, "interface."), params, state)
    alpha_u, alpha_v = alphas(params, state, "conductor.")
    return both(
        materials.CoatedConductor(
            coat_ior=ior,
            ext_ior=1.0,
            coat_alpha=rough(outer),
            **stretched(alpha_u, alpha_v),
            **_damped(_metal(params, state, "conductor."), index_at_550(ior), coat(params, state)),
        )
    )


def _dielectric(params: Parameters, state: State) -> Material:
    eta = spectrum(params, "eta", INDEX, state, 1.5)
    alpha_u, alpha_v = alphas(params, state)
    if smooth(alpha_u, alpha_v):
        return materials.Dielectric(int_ior=eta, ext_ior=1.0)
    return materials.RoughDielectric(int_ior=eta, ext_ior=1.0, **stretched(alpha_u, alpha_v))


def _thin_dielectric(params: Parameters, state: State) -> Material:
    return materials.ThinDielectric(int_ior=spectrum(params, "eta", INDEX, state, 1.5), ext_ior=1.0)


def _mix(params: Parameters, state: State) -> Material:
    names = params.several("materials", "string") or []
    if len(names) != 2:
        raise SceneError(f"'materials' must be two names of materials, not {len(names)}")
    first, second = (state.named_material(name, params) for name in names)
    weight = textured(params, "amount", REAL, state, 0.5)
    return blended(first, second, weight, params, state)


def _interface(params: Parameters, state: State) -> Material:
    return materials.Null()


def _measured(params: Parameters, state: State) -> Material:
    name = params.one("filename", "string", "")
    if not name:
        raise SceneError("needs a 'filename'")
    return both(materials.Measured(data=measured.read(state.existing_file(name))))


MAKERS: dict[str, Maker[Material]] = {
    "diffuse": _diffuse,
    "diffusetransmission": _diffuse_transmission,
    "coateddiffuse": coated_diffuse,
    "conductor": _conductor,
    "coatedconductor": _coated_conductor,
    "dielectric": _dielectric,
    "thindielectric": _thin_dielectric,
    "subsurface": subsurface,
    "mix": _mix,
    "interface": _interface,
    "": _interface,
    "none": _interface,
    "measured": _measured,
    "hair": hair,
}
