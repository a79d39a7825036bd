"""Materials as glTF's surface: a `gltf_surface` as it is, other kinds by way of OpenPBR."""

from __future__ import annotations

import math
from typing import Any

from clpt.formats import as_openpbr
from clpt.formats.as_openpbr import Surface, Warn, dispersion, rgb
from clpt.scene import materials as m
from clpt.scene.textures import Product
from clpt.scene.values import Texture, Textured, TexturedNumber

COAT = 1.5  # index of glTF's coat


def surface(material: m.Material, warn: Warn) -> tuple[m.GltfSurface, Surface, bool]:
    """Return glTF's surface, what lies around it, and whether its back is invisible.

    warn: is told what is approximated, or left out.
    """
    leaf, culled = material, False
    while isinstance(leaf, (m.TwoSided, m.Mask, m.NormalMap, m.BumpMap)):
        if isinstance(leaf, m.TwoSided):
            culled = culled or isinstance(leaf.back, m.Null)
        leaf = leaf.front if isinstance(leaf, m.TwoSided) else leaf.material
    exact = isinstance(leaf, m.GltfSurface)

    def told(message: str) -> None:
        if not (exact and message.endswith(m.GltfSurface.kind)):
            warn(message.replace("OpenPBR", "glTF"))

    around = as_openpbr.surface(material, told)
    if isinstance(leaf, m.GltfSurface):
        return leaf, around, culled
    return _of_openpbr(around.base, warn), around, culled


def _of_openpbr(b: m.Openpbr, warn: Warn) -> m.GltfSurface:
    values: dict[str, Any] = {
        "base_color": _times(b.base_color, b.base_weight),
        "metallic": b.base_metalness,
        "roughness": b.specular_roughness,
        "ior": b.specular_ior,
        "clearcoat": b.coat_weight,
        "clearcoat_roughness": b.coat_roughness,
        "transmission": b.transmission_weight,
        "absorption": b.absorption,
    }
    if b.base_metalness != 1.0:
        values["specular_color"] = b.specular_color
    elif not _is_white(b.specular_color):
        warn("the color of metals at grazing angles; it is white")
    _strength(b, values, warn)
    _anisotropy(b, values, warn)
    _below(b, values, warn)
    _layers(b, values, warn)
    return m.GltfSurface(name=b.name, **values)


def _strength(b: m.Openpbr, values: dict[str, Any], warn: Warn) -> None:
    """Say how much the facets reflect: OpenPBR's weight changes the index."""
    index, weight = dispersion(b.specular_ior)[0], b.specular_weight
    if index < 1.0:
        warn("an index of refraction below that of air; 1 stands for it")
        values["ior"] = index = 1.0
    if isinstance(weight, Texture) or b.transmission_weight != 0.0 or weight == 0.0:
        values["specular"] = weight if isinstance(weight, Texture) else min(weight, 1.0)
    elif weight != 1.0:
        root = min(math.sqrt(weight) * (index - 1.0) / (index + 1.0), 0.99)
        values["ior"] = (1.0 + root) / (1.0 - root)


def _anisotropy(b: m.Openpbr, values: dict[str, Any], warn: Warn) -> None:
    """Solve glTF's alphas for OpenPBR's: alpha along u is a + (1 - a) strength^2."""
    rough, stretch = b.specular_roughness, b.specular_roughness_anisotropy
    if stretch == 0.0:
        return
    if isinstance(rough, Texture) or isinstance(stretch, Texture):
        warn("anisotropy by a texture")
        return
    along = min(rough * rough * math.sqrt(2.0 / (1.0 + (1.0 - stretch) ** 2)), 1.0)
    across = min((1.0 - stretch) * along, 0.999)
    values["roughness"] = math.sqrt(across)
    values["anisotropy"] = math.sqrt((along - across) / (1.0 - across))
    values["anisotropy_rotation"] = b.anisotropy_rotation


def _below(b: m.Openpbr, values: dict[str, Any], warn: Warn) -> None:
    """Say what light does below the facets: it passes, or scatters to either side."""
    passes = b.transmission_weight != 0.0
    if passes:
        values["base_color"] = b.transmission_tint
        if b.transmission_weight != 1.0:
            warn("that what reflects and what passes have different colors")
    if b.base_diffuse_roughness != 0.0:
        warn("the roughness of diffuse reflection")
    if b.subsurface_weight == 0.0:
        values["thin"] = b.thin_walled and passes
        return
    if not passes:
        ends = _times(b.base_color, b.base_weight), b.subsurface_color
        weight = b.subsurface_weight
        values["base_color"] = ends[1] if weight == 1.0 else as_openpbr.between(*ends, weight)
    if b.thin_walled:
        g = b.subsurface_scatter_anisotropy
        share = 0.5 if isinstance(g, Texture) else 0.5 * (1.0 + g)
        values |= {
            "thin": True,
            "diffuse_transmission": _scaled(b.subsurface_weight, share),
            "diffuse_transmission_color": b.subsurface_color,
        }
    elif b.subsurface_inside:
        values["diffuse_transmission"] = b.subsurface_weight
    else:
        warn("the path of light below surfaces; their color stays")


def _layers(b: m.Openpbr, values: dict[str, Any], warn: Warn) -> None:
    """Say what lies above: coat, fuzz and film."""
    if b.coat_weight != 0.0:
        if not _is_white(b.coat_color):
            warn("the colors of coats")
        if b.coat_ior != COAT or b.coat_darkening != 0.0:
            warn("the index of coats, and how they darken; they have 1.5")
    if b.fuzz_weight != 0.0:
        warn("glTF approximates fuzz")
        values["sheen_color"] = _times(b.fuzz_color, b.fuzz_weight)
        values["sheen_roughness"] = b.fuzz_roughness
    if b.thin_film_weight != 0.0:
        thickness = b.thin_film_thickness
        if isinstance(thickness, Texture):
            warn("the thickness of films by a texture")
            thickness = 0.4
        values["iridescence"] = b.thin_film_weight
        values["iridescence_ior"] = b.thin_film_ior
        values["iridescence_thickness"] = 1000.0 * thickness


def _scaled(number: TexturedNumber, factor: float) -> TexturedNumber:
    if isinstance(number, Texture):
        return number if factor == 1.0 else Product(first=number, second=factor)
    return factor * number


def _times(color: Textured, weight: TexturedNumber) -> Textured:
    """Return a color times a number."""
    if isinstance(color, Texture) or isinstance(weight, Texture):
        return color if weight == 1.0 else Product(first=color, second=weight)
    return color if weight == 1.0 else tuple((weight * rgb(color, "reflectance")).tolist())


def _is_white(color: Textured) -> bool:
    return not isinstance(color, Texture) and bool((rgb(color, "reflectance") > 0.999).all())
