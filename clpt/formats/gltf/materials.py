"""Materials: the surface, its opacity, its normal map, and what it emits."""

from __future__ import annotations

from typing import Any

from clpt.formats.gltf import surface, volume
from clpt.formats.gltf.document import Element
from clpt.formats.gltf.textures import texture
from clpt.scene import gltf_material
from clpt.scene.lights import Area
from clpt.scene.materials import Diffuse, GltfSurface, Material
from clpt.scene.texture_values import Texture
from clpt.scene.textures import MeshAttribute, Product
from clpt.scene.values import Textured

UNLIT, EMISSIVE = "KHR_materials_unlit", "KHR_materials_emissive_strength"
EXTENSIONS: tuple[str, ...] = (
    *surface.EXTENSIONS, surface.GLOSSINESS, UNLIT, EMISSIVE,
    volume.VOLUME, *volume.SCATTER, "KHR_materials_dispersion",
)  # fmt: skip


def material(element: Element | None, *, colours: bool = False) -> tuple[Material, Area | None]:
    """Return a material and what it emits; the specification's default one if None.

    colours: the mesh has an attribute "vertex_color" that multiplies the base colour, and
    "vertex_alpha" its alpha.
    """
    if element is None:
        plain = GltfSurface(metallic=1.0, base_color=MeshAttribute() if colours else 1.0)
        return gltf_material.finished(plain, None, None, both=False)
    both = element.flag("doubleSided")
    inner: Material
    if element.extension(UNLIT) is not None:
        inner = Diffuse(reflectance=0.0, name=element.text("name", ""))
        shown = surface.base_color(element)
        if colours:
            shown = Product(first=shown, second=MeshAttribute(), rgb=True)
        emission: Area | None = Area(radiance=_scaled(shown, element), two_sided=both)
    else:
        inner = surface.surface(element, colours)
        emission = _emission(element, both)
    if inner.kind == GltfSurface.kind:
        inner = _with_normal_map(element, inner)
    return gltf_material.finished(inner, _opacity(element, colours), emission, both=both)


def _with_normal_map(element: Element, inner: Material) -> Material:
    """Return the material with its normal map, if it has one."""
    info = element.child("normalTexture")
    if info is None:
        return inner
    return gltf_material.with_normals(inner, texture(info, raw=True), info.number("scale", 1.0))


def _emission(element: Element, both: bool) -> Area | None:
    """Return the emission of a surface: the factor times the texture times the strength."""
    factor = element.numbers("emissiveFactor", 3, (0.0, 0.0, 0.0), low=0.0)
    extension = element.extension(EMISSIVE)
    strength = 1.0 if extension is None else extension.number("emissiveStrength", 1.0, low=0.0)
    radiance: Any = tuple(strength * value for value in factor)
    if not any(radiance):
        return None
    info = element.child("emissiveTexture")
    radiance = gltf_material.tinted(None if info is None else texture(info), radiance)
    return Area(radiance=_scaled(radiance, element), two_sided=both)


def _scaled(shown: Textured, element: Element) -> Textured:
    """An emission that the file counts in its own unit, as radiance."""
    scale = element.document.scale.emission
    if scale == 1.0:
        return shown
    if isinstance(shown, tuple):
        return tuple(scale * value for value in shown)
    return Product(first=shown, second=scale)


def _opacity(element: Element, colours: bool) -> float | Texture | None:
    """The share of light that meets the surface; None where all does."""
    mode = element.text("alphaMode", "OPAQUE", gltf_material.MODES)
    owner, key, image_key = surface.base(element)
    factor = 1.0 if owner is None else owner.numbers(key, 4, (1.0,) * 4, 0.0, 1.0)[3]
    info = None if owner is None else owner.child(image_key)
    image = None if info is None or mode == "OPAQUE" else texture(info, raw=True)
    cutoff = element.number("alphaCutoff", gltf_material.CUTOFF, low=0.0)
    share = gltf_material.opacity(mode, factor, image, cutoff)
    if colours and mode == "MASK":
        element.warn("the vertices' alpha is not compared with the cutoff", "alphaMode")
    if colours and mode == "BLEND":
        first = 1.0 if share is None else share
        return Product(first=first, second=MeshAttribute(name="vertex_alpha"))
    return share
