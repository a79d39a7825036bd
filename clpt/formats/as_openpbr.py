"""Materials as OpenPBR, for files of other programs; clpt's other kinds are approximated.

The equations of metals: Fresnel (Born and Wolf 1999, 14.2); the color at 82 degrees is that of
OpenPBR's F82 model (Kutz et al. 2021).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial, singledispatch
from typing import Any

import numpy as np

from clpt import spectra
from clpt.arrays import Floats, Floats32
from clpt.scene import facets, insides
from clpt.scene import materials as m
from clpt.scene.params import fields_of, params
from clpt.scene.roles import REAL, REFLECTANCE
from clpt.scene.textures import Bitmap, Checkerboard, Mix, Product
from clpt.scene.values import IndexLike, SpectrumLike, Texture, Textured, TexturedNumber
from clpt.spectra import RGBUnbounded, Spectrum, cie
from clpt.spectra.spectrum import Role

Warn = Callable[[str], None]
GREY = 0.5
COSINE_82 = 1.0 / 7.0  # OpenPBR's specular_color of a metal is for this angle
GLASS = 1.5  # index of coats that have none
# Of Beckmann's alpha: that of GGX facets with the nearest shares of slopes below each slope. They
# differ by .11 at most; by .20 at an equal alpha.
FROM_BECKMANN = 0.75


@dataclass(frozen=True)
class Surface:
    """A material as OpenPBR, with all that lies around it.

    opacity: share of the surface that is there. normals: a map of normals, or None. bump: heights
    [m] by texture, or None. scale: factor on either. both: whether the back is like the front.
    """

    base: m.Openpbr
    opacity: TexturedNumber = 1.0
    normals: Textured | None = None
    bump: Textured | None = None
    scale: float = 1.0
    both: bool = False


def of_lamp(material: m.Material, emits: bool, warn: Warn) -> m.Material:
    """Return the material of a shape, black where it emits and does not stop light.

    What is not there does not emit in OpenPBR and glTF.
    """
    if not (emits and isinstance(material, m.Null)):
        return material
    warn("that light passes through lamps; they are black")
    return m.Diffuse(reflectance=0.0, name=material.name)


MIRRORED = "that the picture is mirrored, left for right"


@singledispatch
def surface(material: m.Material, warn: Warn) -> Surface:
    """Return a material as OpenPBR. warn: is told what is approximated, or left out."""
    warn(f"grey stands for {material.kind}")
    return Surface(m.Openpbr(base_weight=1.0, base_color=GREY, specular_weight=0.0))


@surface.register
def _two_sided(material: m.TwoSided, warn: Warn) -> Surface:
    front, back = surface(material.front, warn), material.back
    if back is not None and back is not material.front and not isinstance(back, m.Null):
        warn("the back of a two_sided material becomes like its front")
    return dataclasses.replace(front, both=not isinstance(back, m.Null))


@surface.register
def _mask(material: m.Mask, warn: Warn) -> Surface:
    inner = surface(material.material, warn)
    if inner.opacity != 1.0:
        warn("of masks in masks the outer one counts")
    return dataclasses.replace(inner, opacity=material.opacity)


@surface.register
def _normal_map(material: m.NormalMap, warn: Warn) -> Surface:
    inner = surface(material.material, warn)
    return dataclasses.replace(inner, normals=material.map, scale=material.scale)


@surface.register
def _bump_map(material: m.BumpMap, warn: Warn) -> Surface:
    inner = surface(material.material, warn)
    return dataclasses.replace(inner, bump=material.height, scale=material.scale)


@surface.register
def _null(material: m.Null, warn: Warn) -> Surface:
    return Surface(m.Openpbr(name=material.name), opacity=0.0, both=True)


@surface.register
def _blend(material: m.Blend, warn: Warn) -> Surface:
    first, second = surface(material.first, warn), surface(material.second, warn)
    if isinstance(material.first, m.Null):
        return dataclasses.replace(second, opacity=material.weight)
    warn("a blend of materials becomes a blend of their parameters, with the first's index")
    before, after = fields_of(first.base), fields_of(second.base)
    values = {
        name: between(before[name], after[name], material.weight)
        for name, param in params(m.Openpbr).items()
        if param.textured
    }
    base = dataclasses.replace(first.base, name=material.name, **values)
    opacity = between(first.opacity, second.opacity, material.weight)
    return dataclasses.replace(first, base=base, opacity=opacity)


def between(first: Textured, second: Textured, weight: TexturedNumber) -> Any:
    """Return a parameter of a blend. weight: the share of the second."""
    if first is second:
        return first
    if isinstance(first, Texture) or isinstance(second, Texture) or isinstance(weight, Texture):
        return Mix(first=first, second=second, amount=weight)
    if first == second:
        return first
    a, b = rgb(first, "unbounded"), rgb(second, "unbounded")
    mixed = a + (b - a) * np.asarray(weight, np.float64)
    return float(mixed[0]) if isinstance(first, float) else RGBUnbounded(*mixed.tolist())


def rgb(value: SpectrumLike | Textured, role: Role) -> Floats:
    """Return a spectrum or numbers as linear Rec. 709 (3,)."""
    if isinstance(value, Spectrum):
        return value.to_rgb(role)
    return np.broadcast_to(np.asarray(value, np.float64), 3)


def split(color: Floats) -> tuple[float, Floats]:
    """Return the greatest part of a color (3,), and the color over it; black stays black."""
    strength = float(color.max())
    return strength, color / strength if strength > 0.0 else color


def two_by_two(texture: Checkerboard) -> Bitmap:
    """Return a checkerboard of constants as an image of 2 x 2 pixels."""
    colors = [
        np.full(3, 0.5) if isinstance(value, Texture) else rgb(value, "reflectance")
        for value in (texture.color0, texture.color1)
    ]
    pixels: Floats32 = np.array([[colors[1], colors[0]], [colors[0], colors[1]]], np.float32)
    return Bitmap(
        image=pixels, raw=True, filter="nearest", mapping=texture.mapping, to_uv=texture.to_uv
    )


def _curve(index: IndexLike) -> Floats:
    """Return an index of refraction on the grid of wavelengths (n,)."""
    spectrum = spectra.index(index) if isinstance(index, str) else index
    if isinstance(spectrum, Spectrum):
        return spectrum.sample(cie.GRID)
    return np.full(len(cie.GRID), np.asarray(spectrum, np.float64))


def dispersion(index: IndexLike) -> tuple[float, float]:
    """Return an index of refraction at the d line, and its Abbe number; 0 without dispersion."""
    lines = 1e3 * np.array(insides.LINES)  # [nm]
    f, d, c = np.interp(lines, cie.GRID, _curve(index)).tolist()
    return d, (d - 1.0) / (f - c) if f - c > 1e-6 and d > 1.0 else 0.0


def _relative(inside: IndexLike, outside: IndexLike) -> IndexLike:
    """Return the index of what is inside, relative to what is outside."""
    curve = _curve(inside) / _curve(outside)
    return float(curve[0]) if np.ptp(curve) < 1e-9 else spectra.Tabulated(cie.GRID, curve, "hold")


def _scale(distribution: str) -> float:
    return FROM_BECKMANN if distribution == "beckmann" else 1.0


def _root(alpha: TexturedNumber, distribution: str) -> TexturedNumber:
    """Return the roughness whose square is GGX's alpha; 1/2 stands for patterns."""
    scale = _scale(distribution)
    if isinstance(alpha, Bitmap):
        pixels = np.sqrt(np.clip(scale * alpha.pixels(REAL), 0.0, 1.0))
        return dataclasses.replace(alpha, image=pixels, raw=True, channel="luminance")
    return 0.5 if isinstance(alpha, Texture) else math.sqrt(min(scale * alpha, 1.0))


def _facets(u: TexturedNumber, v: TexturedNumber, distribution: str = "ggx") -> dict[str, Any]:
    """Return roughness and anisotropy of alphas along u and v, by OpenPBR's formula."""
    if isinstance(u, Texture) or isinstance(v, Texture) or u == v:
        return {"specular_roughness": _root(u, distribution)}
    wide, narrow = (_scale(distribution) * end(u, v) for end in (max, min))
    squared = wide / math.sqrt(2.0 / (1.0 + (narrow / wide) ** 2))
    turned = {"anisotropy_rotation": 90.0} if v > u else {}
    return {
        "specular_roughness": math.sqrt(min(squared, 1.0)),
        "specular_roughness_anisotropy": 1.0 - narrow / wide,
        **turned,
    }


@surface.register
def _openpbr(material: m.Openpbr, warn: Warn) -> Surface:
    return Surface(material, both=material.transmits)


@surface.register
def _diffuse(material: m.Diffuse, warn: Warn) -> Surface:
    return _matte(material.reflectance)


@surface.register
def _oren_nayar(material: m.OrenNayar, warn: Warn) -> Surface:
    warn("OpenPBR approximates oren_nayar")
    sigma = 27.0 if isinstance(material.sigma, Texture) else material.sigma
    return _matte(material.reflectance, min(sigma / 90.0, 1.0))


@surface.register
def _fluorescent(material: m.Fluorescent, warn: Warn) -> Surface:
    warn("the fluorescence of materials")
    return _matte(material.reflectance)


def _matte(reflectance: Textured, roughness: float = 0.0) -> Surface:
    return Surface(
        m.Openpbr(
            base_weight=1.0,
            base_color=reflectance,
            base_diffuse_roughness=roughness,
            specular_weight=0.0,
        )
    )


@surface.register
def _plastic(material: m.Plastic, warn: Warn) -> Surface:
    return _under_gloss(material, 0.0, "ggx", warn)


@surface.register
def _rough_plastic(material: m.RoughPlastic, warn: Warn) -> Surface:
    return _under_gloss(material, material.alpha, material.distribution, warn)


def _under_gloss(
    material: m.Plastic | m.RoughPlastic, alpha: TexturedNumber, distribution: str, warn: Warn
) -> Surface:
    warn(f"OpenPBR approximates {material.kind}")
    index = _relative(material.int_ior, material.ext_ior)
    d_line, saturates = dispersion(index)[0], material.nonlinear
    share = _base_share(d_line, _mean_alpha(alpha, warn), distribution, saturates)
    return Surface(
        m.Openpbr(
            base_weight=1.0,
            base_color=_mapped(material.diffuse_reflectance, share, saturates, warn),
            specular_color=material.specular_reflectance,
            specular_ior=index,
            specular_roughness=_root(alpha, distribution),
        )
    )


def _mean_alpha(alpha: TexturedNumber, warn: Warn) -> float:
    """Return a roughness; of a texture the mean, 1/4 of a pattern."""
    if not isinstance(alpha, Texture):
        return alpha
    warn("that a plastic is brighter where it is smoother; its mean roughness counts")
    return float(alpha.pixels(REAL).mean()) if isinstance(alpha, Bitmap) else 0.25


def _base_share(
    index: float, alpha: float, distribution: str, saturates: bool
) -> Callable[[Floats], Floats]:
    """Return the color of OpenPBR's base by that of a plastic: both scatter as much even light.

    A plastic's facets mask what leaves it, see kernels/materials/kinds/rough_plastic.cl; OpenPBR
    loses nothing.
    """
    index = max(index, 1.0 + 1e-6)
    if alpha == 0.0:
        gloss = facets.diffuse_mean(lambda cosines: facets.fresnel(cosines, index))
        into, back = 1.0 - gloss, 1.0 - (1.0 - gloss) / index**2
    else:
        own = max(_scale(distribution) * alpha, 1e-3)
        gloss, white = (
            facets.diffuse_mean(partial(facets.reflectance, "ggx", own, behind))
            for behind in (index, 1e9)
        )
        into = facets.diffuse_mean(partial(facets.transmittance, distribution, alpha, index))
        back = facets.inside_reflectance(distribution, alpha, index)
        head_on = ((index - 1.0) / (index + 1.0)) ** 2
        mean = head_on + (1.0 - head_on) / 21.0  # of Schlick's reflectance, at each further facet
        gloss += mean**2 * white / (1.0 - mean * (1.0 - white)) * (1.0 - white)
    all_passed = into**2 / (index**2 * (1.0 - gloss))

    def share(albedo: Floats) -> Floats:
        inside = back * albedo if saturates else back
        return np.asarray(albedo * all_passed / (1.0 - inside))

    return share


def _mapped(
    color: Textured, share: Callable[[Floats], Floats], saturates: bool, warn: Warn
) -> Textured:
    """Return the shares of a color; of a pattern, and without saturation, in proportion."""
    factor = 2.0 * np.broadcast_to(share(np.full(3, 0.5)), 3)
    if not saturates and np.allclose(factor, 1.0):
        return color
    if not isinstance(color, Texture):
        return _color(share(rgb(color, "reflectance")))
    if saturates and isinstance(color, Bitmap):
        pixels = share(np.clip(color.pixels(REFLECTANCE), 0.0, 1.0)).astype(np.float32)
        return dataclasses.replace(color, image=pixels, raw=True)
    if saturates:
        warn("that reflections within a coat saturate a pattern")
    return Product(first=color, second=_color(factor), rgb=True)


def _fresnel(eta: Floats, k: Floats, cosine: float | Floats) -> Floats:
    """Return the reflectance of a conductor by its index eta + i k."""
    sine2, n2, k2 = 1.0 - cosine * cosine, eta * eta, k * k
    inner = n2 - k2 - sine2
    root = np.sqrt(inner * inner + 4.0 * n2 * k2)
    a = np.sqrt(np.maximum(0.5 * (root + inner), 0.0))
    s = (root + cosine**2 - 2.0 * a * cosine) / (root + cosine**2 + 2.0 * a * cosine)
    across = cosine**2 * root + sine2**2
    p = (across - 2.0 * a * cosine * sine2) / (across + 2.0 * a * cosine * sine2)
    return np.asarray(0.5 * (s + s * p))


def _metal(
    eta: IndexLike | Texture, k: IndexLike | Texture, factor: Textured, facets: dict[str, Any]
) -> m.Openpbr:
    """Return a conductor: its color head-on, and the factor on it at 82 degrees.

    Silver stands for indices by texture.
    """
    if isinstance(eta, Texture) or isinstance(k, Texture):
        eta, k = spectra.metal("Ag")
    n, extinction = _curve(eta), _curve(k)
    head_on, grazing = (
        spectra.Tabulated(cie.GRID, _fresnel(n, extinction, cosine), "hold").to_rgb()
        for cosine in (1.0, COSINE_82)
    )
    schlick = head_on + (1.0 - head_on) * (1.0 - COSINE_82) ** 5
    tint = np.clip(grazing / np.maximum(schlick, 1e-6), 0.0, 1.0)
    color = factor if isinstance(factor, Texture) else head_on * rgb(factor, "reflectance")
    return m.Openpbr(
        base_weight=1.0,
        base_color=color if isinstance(color, Texture) else _color(np.asarray(color)),
        specular_color=_color(tint),
        base_metalness=1.0,
        **facets,
    )


def _color(values: Floats) -> tuple[float, ...]:
    """Return three numbers as a reflectance: at most 1."""
    return tuple(np.clip(values, 0.0, 1.0).tolist())


@surface.register
def _conductor(material: m.Conductor, warn: Warn) -> Surface:
    smooth = {"specular_roughness": 0.0}
    return Surface(_metal(material.eta, material.k, material.specular_reflectance, smooth))


@surface.register
def _rough_conductor(material: m.RoughConductor, warn: Warn) -> Surface:
    facets = _facets(material.alpha_u, material.alpha_v, material.distribution)
    return Surface(_metal(material.eta, material.k, material.specular_reflectance, facets))


@surface.register
def _coated_conductor(material: m.CoatedConductor, warn: Warn) -> Surface:
    warn("OpenPBR approximates coated_conductor")
    facets = _facets(material.alpha_u, material.alpha_v, material.distribution)
    metal = _metal(material.eta, material.k, material.specular_reflectance, facets)
    index = dispersion(_relative(material.coat_ior, material.ext_ior))[0]
    roughness = _root(material.coat_alpha, material.distribution)
    coated = dataclasses.replace(
        metal, coat_weight=1.0, coat_roughness=roughness, coat_ior=min(max(index, 1.0), 3.0)
    )
    return Surface(coated)


@surface.register
def _dielectric(material: m.Dielectric, warn: Warn) -> Surface:
    return _glass(material, {"specular_roughness": 0.0, "absorption": material.absorption})


@surface.register
def _rough_dielectric(material: m.RoughDielectric, warn: Warn) -> Surface:
    facets = _facets(material.alpha_u, material.alpha_v, material.distribution)
    return _glass(material, {**facets, "absorption": material.absorption})


@surface.register
def _thin_dielectric(material: m.ThinDielectric, warn: Warn) -> Surface:
    return _glass(material, {"specular_roughness": 0.0, "thin_walled": True})


def _glass(
    material: m.Dielectric | m.RoughDielectric | m.ThinDielectric, values: dict[str, Any]
) -> Surface:
    glass = m.Openpbr(
        specular_ior=_relative(material.int_ior, material.ext_ior),
        specular_color=material.specular_reflectance,
        transmission_weight=1.0,
        transmission_tint=material.specular_transmittance,
        **values,
    )
    return Surface(glass, both=True)


@surface.register
def _gltf(material: m.GltfSurface, warn: Warn) -> Surface:
    warn("OpenPBR approximates gltf_surface")
    sheen, thickness = material.sheen_color, material.iridescence_thickness
    micrometres = 0.4 if isinstance(thickness, Texture) else min(thickness / 1000.0, 100.0)
    has_sheen = isinstance(sheen, Texture) or rgb(sheen, "unbounded").any()
    base = m.Openpbr(
        base_weight=1.0,
        base_color=material.base_color,
        base_metalness=material.metallic,
        specular_weight=material.specular,
        specular_color=_limited(material.specular_color),
        specular_ior=material.ior if material.ior else GLASS,
        specular_roughness=material.roughness,
        transmission_weight=material.transmission,
        transmission_tint=material.base_color,
        absorption=material.absorption,
        thin_walled=material.thin and material.transmission != 0.0,
        coat_weight=material.clearcoat,
        coat_roughness=material.clearcoat_roughness,
        coat_ior=GLASS,
        coat_darkening=0.0,
        fuzz_weight=1.0 if has_sheen else 0.0,
        fuzz_color=_limited(sheen),
        fuzz_roughness=material.sheen_roughness,
        thin_film_weight=material.iridescence,
        thin_film_ior=material.iridescence_ior,
        thin_film_thickness=micrometres,
    )
    return Surface(base, both=material.transmits)


def _limited(color: Textured) -> Textured:
    return color if isinstance(color, Texture) else _color(rgb(color, "unbounded"))


@surface.register
def _principled(material: m.Principled, warn: Warn) -> Surface:
    coat, gloss = material.clearcoat, material.clearcoat_gloss
    values = {
        "base_metalness": material.metallic,
        "coat_weight": coat if isinstance(coat, Texture) else 0.25 * coat,  # it reflects a quarter
        "coat_roughness": 0.1 if isinstance(gloss, Texture) else math.sqrt(0.1 - 0.099 * gloss),
    }
    return _disney(material, values, warn)


@surface.register
def _principled_thin(material: m.PrincipledThin, warn: Warn) -> Surface:
    return _disney(material, {"thin_walled": True}, warn)


def _disney(
    material: m.Principled | m.PrincipledThin, values: dict[str, Any], warn: Warn
) -> Surface:
    warn(f"OpenPBR approximates {material.kind}")
    base = m.Openpbr(
        base_weight=1.0,
        base_color=material.base_color,
        specular_roughness=material.roughness,
        specular_ior=material.eta or GLASS,
        transmission_weight=material.spec_trans,
        transmission_tint=material.base_color,
        coat_ior=GLASS,
        coat_darkening=0.0,
        fuzz_weight=material.sheen,
        **values,
    )
    return Surface(base, both=material.transmits)


@surface.register
def _phong(material: m.Phong, warn: Warn) -> Surface:
    exponent = 30.0 if isinstance(material.exponent, Texture) else material.exponent
    facets: dict[str, Any] = {"specular_roughness": (2.0 / (exponent + 2.0)) ** 0.25}
    return _two_lobes(material, facets, warn)


@surface.register(m.Ward)
@surface.register(m.AshikhminShirley)
def _stretched(material: m.Ward | m.AshikhminShirley, warn: Warn) -> Surface:
    return _two_lobes(material, _facets(material.alpha_u, material.alpha_v), warn)


def _two_lobes(
    material: m.Phong | m.Ward | m.AshikhminShirley, facets: dict[str, Any], warn: Warn
) -> Surface:
    """Return a diffuse part below facets with the mean reflectance of the specular part."""
    warn(f"OpenPBR approximates {material.kind}")
    color = material.specular
    head_on = 0.04 if isinstance(color, Texture) else float(rgb(color, "reflectance").mean())
    root = math.sqrt(min(head_on, 0.9))
    ior = max((1.0 + root) / (1.0 - root), 1.0)
    return Surface(
        m.Openpbr(base_weight=1.0, base_color=material.diffuse, specular_ior=ior, **facets)
    )


def _mean(color: Textured) -> float:
    """Return the mean of a reflectance; 1/2 stands for textures."""
    return 0.5 if isinstance(color, Texture) else float(rgb(color, "reflectance").mean())


@surface.register
def _sheet(material: m.DiffuseTransmission, warn: Warn) -> Surface:
    """Return paper: OpenPBR shares what it scatters between its sides by an asymmetry."""
    warn("OpenPBR approximates diffuse_transmission")
    sides = material.transmittance, material.reflectance
    through, back = (
        0.5 if isinstance(side, Texture) else float(rgb(side, "reflectance").mean())
        for side in sides
    )
    colors = [rgb(side, "reflectance") for side in sides if not isinstance(side, Texture)]
    color = _color(np.sum(colors, axis=0)) if len(colors) == 2 else sides[back > through]
    total = through + back
    base = m.Openpbr(
        specular_weight=0.0,
        subsurface_weight=1.0,
        subsurface_color=color,
        subsurface_scatter_anisotropy=(through - back) / total if total > 0.0 else 0.0,
        thin_walled=True,
    )
    return Surface(base, both=True)
