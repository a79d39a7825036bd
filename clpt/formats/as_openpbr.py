"""Materials as OpenPBR, for files of other programs; clpt's other kinds are approximated.

The equations of metals: Fresnel (Born and Wolf 1999, 14.2); the color at 82 degrees is that of
OpenPBR's F82 model (Kutz et al. 2021).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from clpt import spectra
from clpt.arrays import Floats
from clpt.scene import materials as m
from clpt.scene.params import params
from clpt.scene.roles import REAL
from clpt.scene.textures import Bitmap, Mix
from clpt.scene.values import is_texture
from clpt.spectra import RGBUnbounded, Spectrum, cie

LINES = (587.56, 486.13, 656.28)  # d, F, C [nm]
COSINE_82 = 1.0 / 7.0  # of the angle at which the tint of a metal counts
GLASS = 1.5  # index of coats that have none


@dataclass(frozen=True)
class Surface:
    """A material as OpenPBR, with all that lies around it.

    opacity: share of the surface that is there. normals: a map of normals, or None. bump: heights
    [m] by texture, or None. scale: factor on either. both: whether the back is like the front.
    """

    base: m.Openpbr
    opacity: Any = 1.0
    normals: Any = None
    bump: Any = None
    scale: float = 1.0
    both: bool = False


def surface(material: m.Material, warn: Callable[[str], None]) -> Surface:
    """Return a material as OpenPBR. warn: is told what is approximated, or left out."""
    if isinstance(material, m.TwoSided):
        front = surface(material.front, warn)
        back = material.back
        if back is not None and back is not material.front and not isinstance(back, m.Null):
            warn("the back of a two_sided material becomes like its front")
        return dataclasses.replace(front, both=not isinstance(back, m.Null))
    if isinstance(material, m.Mask):
        inner = surface(material.material, warn)
        if inner.opacity != 1.0:
            warn("of masks in masks the outer one counts")
        return dataclasses.replace(inner, opacity=material.opacity)
    if isinstance(material, m.NormalMap):
        inner = surface(material.material, warn)
        return dataclasses.replace(inner, normals=material.map, scale=material.scale)
    if isinstance(material, m.BumpMap):
        inner = surface(material.material, warn)
        return dataclasses.replace(inner, bump=material.height, scale=material.scale)
    if isinstance(material, m.Null):
        return Surface(m.Openpbr(name=material.name), opacity=0.0, both=True)
    if isinstance(material, m.Blend):
        return _blend(material, warn)
    convert, exact = CONVERTERS.get(type(material), (_grey, False))
    base = convert(material)
    if not exact:
        left = "grey stands for" if convert is _grey else "OpenPBR approximates"
        warn(f"{left} {material.kind}")
    return Surface(dataclasses.replace(base, name=material.name), both=material.transmits)


def _blend(material: m.Blend, warn: Callable[[str], None]) -> Surface:
    first, second = surface(material.first, warn), surface(material.second, warn)
    if isinstance(material.first, m.Null):
        return dataclasses.replace(second, opacity=material.weight)
    warn("a blend of materials becomes a blend of their parameters, with the first's index")
    values = {
        name: _between(getattr(first.base, name), getattr(second.base, name), material.weight)
        for name, param in params(m.Openpbr).items()
        if param.textured
    }
    base = dataclasses.replace(first.base, name=material.name, **values)
    opacity = _between(first.opacity, second.opacity, material.weight)
    return dataclasses.replace(first, base=base, opacity=opacity)


def _between(first: Any, second: Any, weight: Any) -> Any:
    """Return a parameter of a blend. weight: the share of the second."""
    if first is second or (not any(is_texture(v) for v in (first, second)) and first == second):
        return first
    if any(is_texture(value) for value in (first, second, weight)):
        return Mix(first=first, second=second, amount=weight)
    if isinstance(first, Spectrum) or isinstance(second, Spectrum):
        a, b = (rgb(value, "unbounded") for value in (first, second))
        return RGBUnbounded(*(a + (b - a) * weight).tolist())
    return first + (second - first) * weight


def rgb(value: Any, role: Any) -> Floats:
    """Return a spectrum, a name of an index or numbers as linear Rec. 709 (3,)."""
    if isinstance(value, str):
        value = spectra.index(value)
    if isinstance(value, Spectrum):
        return value.to_rgb(role)
    return np.broadcast_to(np.asarray(value, np.float64), 3)


def dispersion(value: Any) -> tuple[float, float]:
    """Return an index of refraction at the d line, and its Abbe number; 0 without dispersion."""
    spectrum = spectra.index(value) if isinstance(value, str) else value
    if not isinstance(spectrum, Spectrum):
        return float(spectrum), 0.0
    d, f, c = spectrum.sample(np.array(LINES)).tolist()
    return d, (d - 1.0) / (f - c) if f - c > 1e-6 and d > 1.0 else 0.0


def _relative(inside: Any, outside: Any) -> Any:
    """Return the index of what is inside, relative to what is outside."""
    inner, outer = (
        spectra.index(value) if isinstance(value, str) else value for value in (inside, outside)
    )
    curve = np.ones(len(cie.GRID))
    for value, power in ((inner, 1.0), (outer, -1.0)):
        curve = curve * (value.sample(cie.GRID) if isinstance(value, Spectrum) else value) ** power
    return float(curve[0]) if np.ptp(curve) < 1e-9 else spectra.Tabulated(cie.GRID, curve, "hold")


def _root(alpha: Any) -> Any:
    """Return the roughness whose square is alpha; 1/2 stands for patterns."""
    if isinstance(alpha, Bitmap):
        pixels = np.sqrt(np.clip(alpha.pixels(REAL), 0.0, 1.0))
        return dataclasses.replace(alpha, image=pixels, raw=True, channel="luminance")
    return 0.5 if is_texture(alpha) else math.sqrt(min(alpha, 1.0))


def _facets(u: Any, v: Any) -> dict[str, Any]:
    """Return roughness and anisotropy of alphas along u and v, by OpenPBR's formula."""
    if is_texture(u) or is_texture(v) or u == v:
        return {"specular_roughness": _root(u)}
    wide, narrow = max(u, v), min(u, v)
    squared = wide / math.sqrt(2.0 / (1.0 + (narrow / wide) ** 2))
    turned = {"anisotropy_rotation": 90.0} if v > u else {}
    return {
        "specular_roughness": math.sqrt(min(squared, 1.0)),
        "specular_roughness_anisotropy": 1.0 - narrow / wide,
        **turned,
    }


def _diffuse(material: Any) -> m.Openpbr:
    return m.Openpbr(base_weight=1.0, base_color=material.reflectance, specular_weight=0.0)


def _rough_diffuse(material: Any) -> m.Openpbr:
    sigma = material.sigma
    roughness = 0.3 if is_texture(sigma) else min(math.radians(sigma) / (0.5 * math.pi), 1.0)
    return dataclasses.replace(_diffuse(material), base_diffuse_roughness=roughness)


def _plastic(material: Any) -> m.Openpbr:
    return m.Openpbr(
        base_weight=1.0,
        base_color=material.diffuse_reflectance,
        specular_color=material.specular_reflectance,
        specular_ior=_relative(material.int_ior, material.ext_ior),
        specular_roughness=_root(getattr(material, "alpha", 0.0)),
    )


def _fresnel(eta: Floats, k: Floats, cosine: float) -> Floats:
    """Return the reflectance of a conductor by its index eta + i k."""
    sine2, n2, k2 = 1.0 - cosine * cosine, eta * eta, k * k
    inner = n2 - k2 - sine2
    root = np.sqrt(inner * inner + 4.0 * n2 * k2)
    a = np.sqrt(np.maximum(0.5 * (root + inner), 0.0))
    s = (root + cosine**2 - 2.0 * a * cosine) / (root + cosine**2 + 2.0 * a * cosine)
    across = cosine**2 * root + sine2**2
    p = (across - 2.0 * a * cosine * sine2) / (across + 2.0 * a * cosine * sine2)
    return 0.5 * (s + s * p)


def _mirror(eta: Any, k: Any, factor: Any) -> tuple[Any, Any]:
    """Return OpenPBR's colors of a metal: head-on, and the factor at 82 degrees."""

    def sampled(value: Any) -> Floats:
        spectrum = spectra.index(value) if isinstance(value, str) else value
        if isinstance(spectrum, Spectrum):
            return spectrum.sample(cie.GRID)
        return np.full(len(cie.GRID), float(spectrum))

    def color(cosine: float) -> Floats:
        curve = _fresnel(sampled(eta), sampled(k), cosine)
        return spectra.Tabulated(cie.GRID, curve, "hold").to_rgb()

    head_on, grazing = color(1.0), color(COSINE_82)
    power = (1.0 - COSINE_82) ** 5
    schlick = head_on + (1.0 - head_on) * power
    tint = tuple(np.clip(grazing / np.maximum(schlick, 1e-6), 0.0, 1.0).tolist())
    if is_texture(factor):
        return factor, tint
    return tuple(np.clip(head_on * rgb(factor, "reflectance"), 0.0, 1.0).tolist()), tint


def _conductor(material: Any) -> m.Openpbr:
    color, tint = _mirror(material.eta, material.k, material.specular_reflectance)
    u = getattr(material, "alpha_u", 0.0)
    return m.Openpbr(
        base_weight=1.0, base_color=color, specular_color=tint, base_metalness=1.0,
        **_facets(u, getattr(material, "alpha_v", u)),
    )  # fmt: skip


def _coated_conductor(material: Any) -> m.Openpbr:
    return dataclasses.replace(
        _conductor(material),
        coat_weight=1.0,
        coat_roughness=_root(material.coat_alpha),
        coat_ior=min(max(dispersion(_relative(material.coat_ior, material.ext_ior))[0], 1.0), 3.0),
        coat_darkening=1.0,
    )


def _dielectric(material: Any) -> m.Openpbr:
    u = getattr(material, "alpha_u", 0.0)
    return m.Openpbr(
        specular_ior=_relative(material.int_ior, material.ext_ior),
        specular_color=material.specular_reflectance,
        transmission_weight=1.0,
        transmission_tint=material.specular_transmittance,
        absorption=getattr(material, "absorption", 0.0),
        thin_walled=isinstance(material, m.ThinDielectric),
        **_facets(u, getattr(material, "alpha_v", u)),
    )


def _gltf(material: m.GltfSurface) -> m.Openpbr:
    roughness = material.roughness
    return m.Openpbr(
        base_weight=1.0,
        base_color=material.base_color,
        base_metalness=material.metallic,
        specular_weight=material.specular,
        specular_color=_kept(material.specular_color),
        specular_ior=material.ior if material.ior else GLASS,
        specular_roughness=roughness,
        transmission_weight=material.transmission,
        transmission_tint=material.base_color,
        absorption=material.absorption,
        thin_walled=material.thin and material.transmission != 0.0,
        coat_weight=material.clearcoat,
        coat_roughness=material.clearcoat_roughness,
        coat_ior=GLASS,
        coat_darkening=0.0,
        fuzz_weight=0.0 if _is_black(material.sheen_color) else 1.0,
        fuzz_color=_kept(material.sheen_color),
        fuzz_roughness=material.sheen_roughness,
        thin_film_weight=material.iridescence,
        thin_film_ior=material.iridescence_ior,
        thin_film_thickness=_micrometres(material.iridescence_thickness),
    )


def _micrometres(nanometres: Any) -> Any:
    return 0.4 if is_texture(nanometres) else min(nanometres / 1000.0, 100.0)


def _kept(color: Any) -> Any:
    """Return a color as a reflectance: at most 1."""
    if is_texture(color):
        return color
    return tuple(np.clip(rgb(color, "unbounded"), 0.0, 1.0).tolist())


def _is_black(color: Any) -> bool:
    return not is_texture(color) and not rgb(color, "unbounded").any()


def _principled(material: Any) -> m.Openpbr:
    gloss = getattr(material, "clearcoat_gloss", 0.0)
    return m.Openpbr(
        base_weight=1.0,
        base_color=material.base_color,
        base_metalness=getattr(material, "metallic", 0.0),
        specular_roughness=material.roughness,
        specular_ior=material.eta or GLASS,
        transmission_weight=material.spec_trans,
        transmission_tint=material.base_color,
        coat_weight=_quarter(getattr(material, "clearcoat", 0.0)),
        coat_roughness=0.1 if is_texture(gloss) else math.sqrt(0.1 + gloss * (0.001 - 0.1)),
        coat_ior=GLASS,
        coat_darkening=0.0,
        fuzz_weight=material.sheen,
        thin_walled=isinstance(material, m.PrincipledThin),
    )


def _quarter(value: Any) -> Any:
    """Return the weight of a clearcoat, whose reflection is a quarter of a coat's."""
    return value if is_texture(value) else 0.25 * value


def _two_lobes(material: Any) -> m.Openpbr:
    """Return a diffuse part below facets: Phong, Ward, Ashikhmin and Shirley."""
    exponent = getattr(material, "exponent", None)
    if exponent is None or is_texture(exponent):
        u = getattr(material, "alpha_u", 0.1)
        facets = _facets(u, getattr(material, "alpha_v", u))
    else:
        facets = {"specular_roughness": (2.0 / (exponent + 2.0)) ** 0.25}
    head_on = (
        0.04
        if is_texture(material.specular)
        else float(rgb(material.specular, "reflectance").mean())
    )
    root = math.sqrt(min(head_on, 0.9))
    return m.Openpbr(
        base_weight=1.0,
        base_color=material.diffuse,
        specular_ior=max((1.0 + root) / (1.0 - root), 1.0),
        **facets,
    )


def _sheet(material: m.DiffuseTransmission) -> m.Openpbr:
    """Return paper: OpenPBR shares what it scatters between its sides by an asymmetry."""
    through, back = (
        0.5 if is_texture(v) else float(rgb(v, "reflectance").mean())
        for v in (material.transmittance, material.reflectance)
    )
    total = through + back
    color = material.transmittance if through >= back else material.reflectance
    if not is_texture(color):
        sides = (
            rgb(v, "reflectance")
            for v in (material.transmittance, material.reflectance)
            if not is_texture(v)
        )
        color = tuple(np.clip(sum(sides), 0.0, 1.0).tolist())
    return m.Openpbr(
        specular_weight=0.0,
        subsurface_weight=1.0,
        subsurface_color=color,
        subsurface_scatter_anisotropy=(through - back) / total if total > 0.0 else 0.0,
        thin_walled=True,
    )


def _grey(material: Any) -> m.Openpbr:
    color = getattr(material, "reflectance", 0.5)
    return m.Openpbr(base_weight=1.0, base_color=color, specular_weight=0.0)


def _itself(material: m.Openpbr) -> m.Openpbr:
    return material


CONVERTERS: dict[type, tuple[Callable[[Any], m.Openpbr], bool]] = {  # and whether it is the same
    m.Openpbr: (_itself, True),
    m.Diffuse: (_diffuse, True),
    m.OrenNayar: (_rough_diffuse, False),
    m.Plastic: (_plastic, False),
    m.RoughPlastic: (_plastic, False),
    m.Conductor: (_conductor, True),
    m.RoughConductor: (_conductor, True),
    m.CoatedConductor: (_coated_conductor, False),
    m.Dielectric: (_dielectric, True),
    m.RoughDielectric: (_dielectric, True),
    m.ThinDielectric: (_dielectric, True),
    m.GltfSurface: (_gltf, False),
    m.Principled: (_principled, False),
    m.PrincipledThin: (_principled, False),
    m.Phong: (_two_lobes, False),
    m.Ward: (_two_lobes, False),
    m.AshikhminShirley: (_two_lobes, False),
    m.DiffuseTransmission: (_sheet, False),
}
