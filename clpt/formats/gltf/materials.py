"""Materials: the surface, its opacity, its normal map, and what it emits."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from clpt.formats.gltf import surface, volume
from clpt.formats.gltf.document import Element
from clpt.formats.gltf.textures import texture
from clpt.scene.lights import Area
from clpt.scene.materials import (
    Diffuse,
    GltfSurface,
    Mask,
    Material,
    NormalMap,
    Null,
    TwoSided,
)
from clpt.scene.params import Texture
from clpt.scene.textures import Bitmap, MeshAttribute, Product
from clpt.scene.values import Textured

UNLIT, EMISSIVE = "KHR_materials_unlit", "KHR_materials_emissive_strength"
EXTENSIONS: tuple[str, ...] = (
    *surface.EXTENSIONS, surface.GLOSSINESS, UNLIT, EMISSIVE,
    volume.VOLUME, *volume.SCATTER, "KHR_materials_dispersion",
)  # fmt: skip
ONE_SIDE = Null()  # of a surface that is drawn from its front alone


def material(element: Element | None, *, colours: bool = False) -> tuple[Material, Area | None]:
    """Return a material and what it emits; the specification's default one if None.

    colours: the mesh has an attribute "vertex_color" that multiplies the base colour, and
    "vertex_alpha" its alpha.
    """
    if element is None:
        plain = GltfSurface(metallic=1.0, base_color=MeshAttribute() if colours else 1.0)
        return TwoSided(front=plain, back=ONE_SIDE), None
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
    leaf = inner.material if isinstance(inner, NormalMap) else inner
    opacity = _opacity(element, colours)
    if opacity is not None:
        inner = Mask(material=inner, opacity=opacity)
        if emission is not None:  # what is not there does not shine
            radiance = Product(first=emission.radiance, second=opacity)
            emission = dataclasses.replace(emission, radiance=radiance)
    if leaf.transmits:
        return inner, emission
    return TwoSided(front=inner, back=None if both else ONE_SIDE), emission


def _with_normal_map(element: Element, inner: Material) -> Material:
    """Return the material with its normal map, if it has one."""
    info = element.child("normalTexture")
    if info is None:
        return inner
    scale = info.number("scale", 1.0)
    return NormalMap(material=inner, map=texture(info, raw=True), scale=scale, along_v=True)


def _emission(element: Element, both: bool) -> Area | None:
    """Return the emission of a surface: the factor times the texture times the strength."""
    factor = element.numbers("emissiveFactor", 3, (0.0, 0.0, 0.0), low=0.0)
    extension = element.extension(EMISSIVE)
    strength = 1.0 if extension is None else extension.number("emissiveStrength", 1.0, low=0.0)
    radiance: Any = tuple(strength * value for value in factor)
    if not any(radiance):
        return None
    info = element.child("emissiveTexture")
    if info is not None:
        image = texture(info)
        if radiance == surface.WHITE:
            radiance = image
        else:
            tinted = max(radiance) > min(radiance)
            radiance = Product(first=image, second=surface.unbounded(radiance), rgb=tinted)
    return Area(radiance=_scaled(radiance, element), two_sided=both)


def _scaled(shown: Textured, element: Element) -> Textured:
    """An emission that the file counts in its own unit, as radiance."""
    scale = element.document.scale.emission
    if scale == 1.0:
        return shown
    if isinstance(shown, tuple):
        return tuple(scale * value for value in shown)
    return Product(first=shown, second=scale)


def _opacity(element: Element, colours: bool) -> Any:
    """The share of light that meets the surface; None where all does."""
    mode = element.text("alphaMode", "OPAQUE", ("OPAQUE", "MASK", "BLEND"))
    if mode == "OPAQUE":
        return None
    owner, key, image_key = surface.base(element)
    factor = 1.0 if owner is None else owner.numbers(key, 4, (1.0,) * 4, 0.0, 1.0)[3]
    info = None if owner is None else owner.child(image_key)
    image = None if info is None else _alpha(texture(info, raw=True))
    if mode == "MASK":
        cutoff = element.number("alphaCutoff", 0.5, low=0.0)
        if colours:
            element.warn("the vertices' alpha is not compared with the cutoff", "alphaMode")
        if image is None:
            return None if factor >= cutoff else 0.0
        return _cut(image, cutoff / factor if factor > 0.0 else np.inf)
    opacity: float | Texture = factor
    if image is not None:
        opacity = image if factor == 1.0 else Product(first=image, second=factor)
    if colours:
        opacity = Product(first=opacity, second=MeshAttribute(name="vertex_alpha"))
    return None if isinstance(opacity, float) and opacity == 1.0 else opacity


def _alpha(image: Bitmap) -> Bitmap | None:
    """The alpha of an image as an image of its own; None where it has none."""
    pixels = np.asarray(image.image)
    if pixels.ndim < 3 or pixels.shape[2] < 4:
        return None
    return dataclasses.replace(image, image=np.ascontiguousarray(pixels[..., 3]))


def _cut(alpha: Bitmap, cutoff: float) -> Bitmap:
    """An image that is 1 where the alpha of a texel reaches the cutoff, else 0."""
    pixels = np.asarray(alpha.image)
    shares = pixels / 255.0 if pixels.dtype == np.uint8 else pixels
    return dataclasses.replace(alpha, image=(shares >= cutoff - 1e-6).astype(np.float32))
