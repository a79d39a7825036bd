"""Materials: surface, opacity, normal map, emission, interior medium, and variants.

docs/gltf.md gives the meaning of every parameter, and the sources of the formulas.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from clpt.formats.gltf.document import ROUNDING, Document, Element
from clpt.formats.gltf.textures import texture
from clpt.scene import gltf_material
from clpt.scene.gltf_material import WHITE
from clpt.scene.insides import absorbed, dispersed
from clpt.scene.lights import Area
from clpt.scene.materials import Diffuse, GltfSurface, Material
from clpt.scene.media import Homogeneous
from clpt.scene.textures import Bitmap, MeshAttribute, Mix, Product, turned
from clpt.scene.values import Texture, Textured, TexturedNumber

CLEARCOAT = "KHR_materials_clearcoat"
DIFFUSE_TRANSMISSION = "KHR_materials_diffuse_transmission"
GLOSSINESS = "KHR_materials_pbrSpecularGlossiness"
NORMAL = "clearcoatNormalTexture"
AXES = {"x": "r", "y": "g", "z": "b"}  # of a normal, in the channels of its image
LEAST_ABBE = 1.0  # of any glass is above 9


def surface(element: Element, colours: bool) -> GltfSurface:
    """Return the material of a surface; `colours`: times those of the vertices."""
    glossy = element.extension(GLOSSINESS)
    values = _rough(element) if glossy is None else _glossy(glossy)
    if colours:
        values["base_color"] = Product(first=MeshAttribute(), second=values["base_color"], rgb=True)
    for name, read in OF_SURFACES.items():
        extension = element.extension(name)
        if extension is not None:
            values |= read(extension)
    _body(element, values)
    _specular_color(element, values)
    _directions_of_normals(element, values)
    if values.get("clearcoat", 0.0) != 0.0 and "normalTexture" in element:
        values["clearcoat_apart"] = 1.0  # a coat without a map of its own is smooth
    if element.document.multiple_scattering:
        values["multiple_scattering"] = element.document.multiple_scattering
    return GltfSurface(name=element.text("name", ""), **values)


def base(element: Element) -> tuple[Element | None, str, str]:
    """Return the object that holds the base colour and its alpha, and its two keys there."""
    glossy = element.extension(GLOSSINESS)
    if glossy is not None:
        return glossy, "diffuseFactor", "diffuseTexture"
    return element.child("pbrMetallicRoughness"), "baseColorFactor", "baseColorTexture"


def base_color(element: Element) -> Any:
    """Return the base colour, without its alpha."""
    owner, factor, info = base(element)
    return WHITE if owner is None else colour(owner, factor, info, WHITE, 4)


def colour(
    owner: Element, factor: str, info: str, default: tuple[float, ...], count: int = 3
) -> Any:
    """Return a factor, times its texture if there is a texture; the first three of four numbers."""
    rgb = owner.numbers(factor, count, (*default, 1.0)[:count], low=0.0)[:3]
    rgb = tuple(1.0 if 1.0 < value <= 1.0 + ROUNDING else value for value in rgb)
    child = owner.child(info)
    return gltf_material.tinted(None if child is None else texture(child), rgb)


def number(owner: Element, factor: str, info: str, channel: str, default: float) -> Any:
    """Return a factor in [0, 1], times a texture's channel if there is a texture."""
    value = owner.number(factor, default, low=0.0, high=1.0)
    child = owner.child(info)
    image = None if child is None else texture(child, raw=True, channel=channel)
    return gltf_material.times(image, value)


def _rough(element: Element) -> dict[str, Any]:
    """Return the parameters of the core material; omitted factors are 1."""
    owner = element.child("pbrMetallicRoughness")
    if owner is None:
        return {"base_color": WHITE, "metallic": 1.0, "roughness": 1.0}
    return {
        "base_color": base_color(element),
        "metallic": number(owner, "metallicFactor", "metallicRoughnessTexture", "b", 1.0),
        "roughness": number(owner, "roughnessFactor", "metallicRoughnessTexture", "g", 1.0),
    }


def _glossy(owner: Element) -> dict[str, Any]:
    """Diffuse, specular and glossiness: a dielectric of index 0, whose F0 is specular_color."""
    gloss = number(owner, "glossinessFactor", "specularGlossinessTexture", "a", 1.0)
    rough = 1.0 - gloss if isinstance(gloss, float) else Mix(first=1.0, second=0.0, amount=gloss)
    return {
        "base_color": colour(owner, "diffuseFactor", "diffuseTexture", WHITE, 4),
        "specular_color": colour(owner, "specularFactor", "specularGlossinessTexture", WHITE),
        "roughness": rough,
        "ior": 0.0,
    }


def _specular(owner: Element) -> dict[str, Any]:
    return {
        "specular": number(owner, "specularFactor", "specularTexture", "a", 1.0),
        "specular_color": colour(owner, "specularColorFactor", "specularColorTexture", WHITE),
    }


def _ior(owner: Element) -> dict[str, Any]:
    index = owner.number("ior", 1.5, low=0.0)
    if 0.0 < index < 1.0:
        raise owner.error(f"{index:g} is neither 0 nor at least 1", "ior")
    return {"ior": index}


def _clearcoat(owner: Element) -> dict[str, Any]:
    return {
        "clearcoat": number(owner, "clearcoatFactor", "clearcoatTexture", "r", 0.0),
        "clearcoat_roughness": number(
            owner, "clearcoatRoughnessFactor", "clearcoatRoughnessTexture", "g", 0.0
        ),
        **_coat_normals(owner),
    }


def _coat_normals(owner: Element) -> dict[str, Any]:
    """The coat's own normals: those of its texture, else of the surface."""
    info = owner.child(NORMAL)
    if info is None:
        return {}
    images = {f"clearcoat_normal_{x}": texture(info, raw=True, channel=c) for x, c in AXES.items()}
    scale = info.number("scale", 1.0)
    return {"clearcoat_apart": 1.0, "clearcoat_normal_scale": scale, **images}


def _sheen(owner: Element) -> dict[str, Any]:
    return {
        "sheen_color": colour(owner, "sheenColorFactor", "sheenColorTexture", (0.0, 0.0, 0.0)),
        "sheen_roughness": number(owner, "sheenRoughnessFactor", "sheenRoughnessTexture", "a", 0.0),
    }


def _transmission(owner: Element) -> dict[str, Any]:
    return {"transmission": number(owner, "transmissionFactor", "transmissionTexture", "r", 0.0)}


def _diffuse_transmission(owner: Element) -> dict[str, Any]:
    kind = "diffuseTransmission"
    return {
        "diffuse_transmission": number(owner, f"{kind}Factor", f"{kind}Texture", "a", 0.0),
        "diffuse_transmission_color": colour(
            owner, f"{kind}ColorFactor", f"{kind}ColorTexture", WHITE
        ),
    }


def _iridescence(owner: Element) -> dict[str, Any]:
    ends = {"Minimum": 100.0, "Maximum": 400.0}
    low, high = (
        owner.number(f"iridescenceThickness{name}", default, low=0.0, high=1e5)
        for name, default in ends.items()
    )
    info = owner.child("iridescenceThicknessTexture")
    thickness: TexturedNumber = high
    if info is not None and low != high:
        share = texture(info, raw=True, channel="g")
        thickness = Mix(first=low, second=high, amount=share)
    return {
        "iridescence": number(owner, "iridescenceFactor", "iridescenceTexture", "r", 0.0),
        "iridescence_ior": owner.number("iridescenceIor", 1.3, low=1.0, high=5.0),
        "iridescence_thickness": thickness,
    }


def _anisotropy(owner: Element) -> dict[str, Any]:
    turn = math.remainder(math.degrees(owner.number("anisotropyRotation", 0.0)), 180.0)
    values: dict[str, Any] = {
        "anisotropy": number(owner, "anisotropyStrength", "anisotropyTexture", "b", 0.0),
        "anisotropy_rotation": turn,
    }
    info = owner.child("anisotropyTexture")
    if info is not None:
        values["anisotropy_rotation"] = _directions(texture(info, raw=True), turn)
    return values


def _directions(image: Bitmap, turn: float) -> Any:
    """The angles [degrees] of directions in an image's red and green; not interpolated."""
    pixels = np.asarray(image.image)
    scale = 255.0 if pixels.dtype == np.uint8 else 1.0
    if pixels.ndim < 3 or pixels.shape[2] < 2:
        return turn
    x, y = (2.0 * pixels[..., i] / scale - 1.0 for i in range(2))
    angles = (np.degrees(np.arctan2(y, x)) + turn).astype(np.float32)
    return dataclasses.replace(image, image=angles, filter="nearest")


def _directions_of_normals(element: Element, values: dict[str, Any]) -> None:
    """Count a turn that no image tells from where the normal map's coordinates run."""
    info, turn = element.child("normalTexture"), values.get("anisotropy_rotation")
    if info is None or not isinstance(turn, float) or values["anisotropy"] == 0.0:
        return
    normals = texture(info, raw=True)
    if turned(normals):
        image = np.full((1, 1), turn, np.float32)
        values["anisotropy_rotation"] = dataclasses.replace(normals, image=image, filter="nearest")


OF_SURFACES = {
    CLEARCOAT: _clearcoat,
    DIFFUSE_TRANSMISSION: _diffuse_transmission,
    "KHR_materials_anisotropy": _anisotropy,
    "KHR_materials_ior": _ior,
    "KHR_materials_iridescence": _iridescence,
    "KHR_materials_sheen": _sheen,
    "KHR_materials_specular": _specular,
    "KHR_materials_transmission": _transmission,
}


def _body(element: Element, values: dict[str, Any]) -> None:
    """Return the parameters of a body: a surface with a thickness absorbs and disperses."""
    lets_through = any(values.get(k, 0.0) != 0.0 for k in ("transmission", "diffuse_transmission"))
    inside = body(element)
    values["thin"] = lets_through and inside is None
    if inside is None:
        return
    absorption = extinction(inside)
    if absorption != 0.0 and medium(element) is None:
        values["absorption"] = absorption
    dispersion = element.extension("KHR_materials_dispersion")
    strength = 0.0 if dispersion is None else dispersion.number("dispersion", 0.0, low=0.0)
    ior = values.get("ior", 1.5)
    if strength > 0.0 and ior > 1.0:
        values["ior"] = dispersed(ior, max(20.0 / strength, LEAST_ABBE))


def _specular_color(element: Element, values: dict[str, Any]) -> None:
    """Move factors above 1 into the index of refraction, if the surface does not transmit."""
    rgb = values.get("specular_color")
    if not isinstance(rgb, tuple) or max(rgb) <= 1.0:
        return
    ior = values.get("ior", 1.5)
    if isinstance(ior, float) and (values["thin"] or not values.get("transmission", 0.0)):
        f0 = min(((ior - 1.0) / (ior + 1.0)) ** 2 * max(rgb), 1.0)
        root = math.sqrt(f0)
        values["ior"] = 0.0 if f0 == 1.0 else (1.0 + root) / (1.0 - root)
    else:
        element.warn("specularColorFactor above 1 is cut off where light is refracted")
    scale = max(rgb) if values.get("ior") != 0.0 else 1.0
    values["specular_color"] = tuple(min(v / scale, 1.0) for v in rgb)


VOLUME = "KHR_materials_volume"
SCATTER = ("KHR_materials_volume_scatter", "KHR_materials_scatter")  # the same draft's two names
COLOURS = ("multiscatterColor", "multiscatterColorFactor", "scatterAlbedo")  # its drafts' names
SHARES = {  # of light that goes through a surface
    "KHR_materials_transmission": "transmissionFactor",
    "KHR_materials_diffuse_transmission": "diffuseTransmissionFactor",
}
STEEPEST = 0.99  # mean cosine: at 1 nothing would be scattered


def body(element: Element) -> Element | None:
    """Return the volume of a material with an inside; None for thin and for opaque surfaces."""
    volume = element.extension(VOLUME)
    if volume is None or volume.number("thicknessFactor", 0.0, low=0.0) == 0.0:
        return None
    scattering = {factor: element.extension(name) for name, factor in SHARES.items()}
    shares = [e.number(factor, 0.0) for factor, e in scattering.items() if e is not None]
    return volume if any(shares) else None


def extinction(volume: Element) -> Any:
    """Return how much light a metre takes away [1/m]: a number or RGBUnbounded.

    Raises SceneError for a distance of 0.
    """
    distance = volume.number("attenuationDistance", math.inf, low=0.0)
    if distance == 0.0:
        raise volume.error("must be above 0", "attenuationDistance")
    left = volume.numbers("attenuationColor", 3, (1.0, 1.0, 1.0), low=0.0, high=1.0)
    return absorbed(left, distance)


def medium(element: Element | None) -> Homogeneous | None:
    """Return the medium inside of a material's body; None where nothing scatters light.

    Raises SceneError for numbers out of range.
    """
    volume = None if element is None else body(element)
    if element is None or volume is None:
        return None
    scatter = next((e for e in map(element.extension, SCATTER) if e is not None), None)
    if scatter is None:
        return None
    key = next((name for name in COLOURS if name in scatter), COLOURS[0])
    colour = scatter.numbers(key, 3, (0.0, 0.0, 0.0), low=0.0, high=1.0)
    g = scatter.number("scatterAnisotropy", 0.0, low=-1.0, high=1.0)
    if "multiscatterColorTexture" in scatter:
        scatter.warn("left out, since a body has one colour inside", "multiscatterColorTexture")
    taken = extinction(volume)
    if not any(colour) or taken == 0.0:
        return None
    unit_medium = Homogeneous.from_albedo(colour, 1.0, max(-STEEPEST, min(g, STEEPEST)))
    return Homogeneous(
        name=element.text("name", ""),
        phase=unit_medium.phase,
        albedo=unit_medium.albedo,
        sigma_t=taken,
    )


VARIANTS = "KHR_materials_variants"


def variant_names(document: Document) -> list[str]:
    """Return the names of a file's variants."""
    extension = document.root.extension(VARIANTS)
    variants = [] if extension is None else extension.children("variants")
    return [variant.text("name", str(i)) for i, variant in enumerate(variants)]


def chosen_variant(document: Document, wanted: str | None) -> int | None:
    """Return the number of the variant of a name or number; None: the default materials.

    Raises SceneError where there is none of that name.
    """
    if wanted is None:
        return None
    known = variant_names(document)
    for number, name in enumerate(known):
        if wanted in (name, str(number)):
            return number
    message = f"has no material variant {wanted!r}; it has: {', '.join(known) or 'none'}"
    raise document.root.error(message)


def shown_material(primitive: Element) -> Element | None:
    """Return the material that a primitive shows under the document's variant."""
    number, usual = primitive.document.variant, primitive.entry("material", "materials")
    extension = None if number is None else primitive.extension(VARIANTS)
    if extension is None:
        return usual
    for mapping in extension.children("mappings"):
        if number in mapping.numbers("variants", None, ()):
            return mapping.entry("material", "materials") or usual
    return usual


UNLIT, EMISSIVE = "KHR_materials_unlit", "KHR_materials_emissive_strength"
EXTENSIONS: tuple[str, ...] = (
    *OF_SURFACES, GLOSSINESS, UNLIT, EMISSIVE,
    VOLUME, *SCATTER, "KHR_materials_dispersion",
)  # fmt: skip


def material(element: Element | None, *, colours: bool = False) -> tuple[Material, Area | None]:
    """Return a material and its emission; for None the specification's default material.

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
        shown = base_color(element)
        if colours:
            shown = Product(first=shown, second=MeshAttribute(), rgb=True)
        emission: Area | None = Area(radiance=_scaled(shown, element), two_sided=both)
    else:
        inner = surface(element, colours)
        emission = _emission(element, both)
    if inner.kind == GltfSurface.kind:
        inner = _with_normal_map(element, inner)
    return gltf_material.finished(inner, _opacity(element, colours), emission, both=both)


def _with_normal_map(element: Element, inner: Material) -> Material:
    """Return the material with its normal map, if the element names a normal map."""
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
    owner, key, image_key = base(element)
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
