"""Surface shaders of MaterialX as materials: OpenPBR, standard_surface, gltf_pbr and others.

Nodes of scattering make surfaces too: mixtures of them, and layers on a base.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from clpt.errors import SceneError
from clpt.formats.materialx import document
from clpt.formats.materialx.graph import Graph, Host, Node, category
from clpt.formats.materialx.nodes import READERS as NODES
from clpt.scene import gltf_material, insides
from clpt.scene.lights import Area
from clpt.scene.materials import (
    Blend,
    BumpMap,
    Diffuse,
    GltfSurface,
    Mask,
    Material,
    Openpbr,
    TwoSided,
    parts,
)
from clpt.scene.media import Homogeneous
from clpt.scene.params import defaults, params
from clpt.scene.phases import HenyeyGreenstein, Isotropic
from clpt.scene.textures import Bitmap, Product, Texture
from clpt.scene.textures import Graph as GraphTexture
from clpt.spectra import RGBUnbounded

MATT = {"specular_weight": 0.0}
EDGE = 1.0 / 7.0  # the cosine at which OpenPBR tints a metal


def scattering_material(graph: Graph, node: Node, name: str) -> Material:
    """Return a node of scattering as a material; grey, with a warning, for one that is not read.

    It has two sides, unless light goes through a part: then others have a front alone.
    """
    inner = _front(graph, node, name)
    clear = any(part.transmits for part in parts(inner))
    return inner if clear else TwoSided(front=inner, name=name)


def _front(graph: Graph, node: Node, name: str) -> Material:
    if category(node.kind) == "mix_bsdf":
        first, second = (_part(graph, node, end, name) for end in ("bg", "fg"))
        weight = graph.texture(node, "mix", 0.0, wide=False)
        return Blend(first=first, second=second, weight=weight, name=name)
    values = _values(graph, node)
    if values is None:
        graph.host.warn(f"{node.kind} is not read; grey stands for it", node.path)
        values = {}
    return Openpbr(**values, name=name)


def _part(graph: Graph, node: Node, end: str, name: str) -> Material:
    source = node.source(end)
    return Openpbr() if source is None else _front(graph, source[0], name)


def _values(graph: Graph, node: Node) -> dict[str, Any] | None:
    """Return parameters of OpenPBR; None for a node that it does not have."""
    kind = category(node.kind)
    if kind == "layer_bsdf":
        top, base = (source and _values(graph, source[0]) for source in _ends(node))
        if not top or not base:
            return None
        over = GLOSS if "specular_ior" in top else FUZZ if "fuzz_weight" in top else ()
        return {**base, **{key: top[key] for key in over}} if over else None
    read = LOBES.get(kind)
    return None if read is None else read(graph, node)


def _ends(node: Node) -> tuple[Any, Any]:
    return node.source("top"), node.source("base")


GLOSS = ("specular_weight", "specular_color", "specular_ior", "specular_roughness")
FUZZ = ("fuzz_weight", "fuzz_color", "fuzz_roughness")


def _share(graph: Graph, node: Node, name: str, default: float) -> Any:
    value = graph.texture(node, name, default, wide=False)
    return min(max(value, 0.0), 1.0) if isinstance(value, float) else value


def _roughness(graph: Graph, node: Node) -> float:
    """Return OpenPBR's roughness for the two alphas of a node."""
    alpha = np.clip(graph.constant(node, "roughness", (0.05, 0.05)), 0.0, 1.0)
    return float(np.sqrt(alpha.prod() ** (1.0 / len(alpha))))


def _diffuse(graph: Graph, node: Node) -> dict[str, Any]:
    grooves = _share(graph, node, "roughness", 0.0) if "oren" in node.kind else 0.0
    color = _color(graph, node, "color", 0.18)
    weight = _share(graph, node, "weight", 1.0)
    return {**MATT, "base_weight": weight, "base_color": color, "base_diffuse_roughness": grooves}


def _translucent(graph: Graph, node: Node) -> dict[str, Any]:
    color = _color(graph, node, "color", 1.0)
    through = {"subsurface_weight": 1.0, "subsurface_scatter_anisotropy": 1.0, "thin_walled": True}
    return {**MATT, "subsurface_color": color, **through}


def _subsurface_bsdf(graph: Graph, node: Node) -> dict[str, Any]:
    return {
        **MATT,
        "subsurface_weight": 1.0,
        "subsurface_color": _color(graph, node, "color", 0.18),
    }


def _dielectric(graph: Graph, node: Node) -> dict[str, Any]:
    tint = _color(graph, node, "tint", 1.0)
    values = {
        "base_weight": 0.0,
        "specular_weight": _share(graph, node, "weight", 1.0),
        "specular_color": tint,
        "specular_ior": max(float(graph.constant(node, "ior", 1.5)[0]), 0.1),
        "specular_roughness": _roughness(graph, node),
    }
    if "T" not in str(node.value("scatter_mode", "R")):
        return values
    return {**values, "transmission_weight": 1.0, "transmission_color": tint}


def _metal(color: object, edge: object, graph: Graph, node: Node) -> dict[str, Any]:
    return {
        "base_metalness": 1.0,
        "base_color": color,
        "specular_color": edge,
        "specular_weight": _share(graph, node, "weight", 1.0),
        "specular_roughness": _roughness(graph, node),
    }


def _schlick(graph: Graph, node: Node) -> dict[str, Any]:
    color, edge = (_color(graph, node, name, 1.0) for name in ("color0", "color82"))
    return _metal(color, edge, graph, node)


def _conductor(graph: Graph, node: Node) -> dict[str, Any]:
    """Reflectances head-on and at 82 degrees, by Fresnel's equations."""
    eta = graph.constant(node, "ior", (0.183, 0.421, 1.373))
    k = graph.constant(node, "extinction", (3.424, 2.346, 1.770))
    index = eta + 1j * k
    inside = np.sqrt(1.0 - (1.0 - EDGE**2) / index**2)
    across = (EDGE - index * inside) / (EDGE + index * inside)
    along = (index * EDGE - inside) / (index * EDGE + inside)
    at_edge = 0.5 * (np.abs(across) ** 2 + np.abs(along) ** 2)
    head_on = np.abs((index - 1.0) / (index + 1.0)) ** 2
    plain = head_on + (1.0 - head_on) * (1.0 - EDGE) ** 5
    edge = np.clip(at_edge / plain, 0.0, 1.0)
    return _metal(tuple(head_on.tolist()), tuple(edge.tolist()), graph, node)


def _sheen(graph: Graph, node: Node) -> dict[str, Any]:
    values = {
        "fuzz_weight": _share(graph, node, "weight", 1.0),
        "fuzz_color": _color(graph, node, "color", 1.0),
        "fuzz_roughness": _share(graph, node, "roughness", 0.3),
    }
    return {**MATT, "base_weight": 0.0, **values}


LOBES = {
    "oren_nayar_diffuse_bsdf": _diffuse,
    "burley_diffuse_bsdf": _diffuse,
    "translucent_bsdf": _translucent,
    "subsurface_bsdf": _subsurface_bsdf,
    "dielectric_bsdf": _dielectric,
    "conductor_bsdf": _conductor,
    "generalized_schlick_bsdf": _schlick,
    "sheen_bsdf": _sheen,
}


GREY = (0.18, 0.18, 0.18)
NORMALS = ("normalmap", "bump")
SHORTEST = 1e-4  # of a mean free path [m]
STEEPEST = 0.99  # mean cosine of scattering
COLORS = ("base_color", "specular_color", "transmission_color", "subsurface_color", "coat_color",
          "fuzz_color")  # fmt: skip
NUMBERS = (
    "base_weight", "base_metalness", "base_diffuse_roughness", "specular_weight",
    "specular_roughness", "specular_roughness_anisotropy", "transmission_weight",
    "subsurface_weight", "subsurface_scatter_anisotropy", "coat_weight", "coat_roughness",
    "coat_roughness_anisotropy", "coat_ior", "coat_darkening", "fuzz_weight", "fuzz_roughness",
    "thin_film_weight", "thin_film_thickness",
)  # fmt: skip


@dataclass(frozen=True)
class Surface:
    """A material, what its shape emits, and what is inside of a shape that is closed."""

    material: Material
    emission: Area | None = None
    interior: Homogeneous | None = None


def surface(node: Node, host: Host, name: str = "", *, walk: bool = True) -> Surface:
    """Return a surface shader as a material.

    node: of a document, or what a reader of stages has for a shader. walk: light goes into bodies
    with subsurface scattering; else it is scattered where it enters. What is left out is told to
    the host once.
    """
    kind = category(node.kind)
    if kind in document.TRANSLATED:
        try:
            document.standard()
            node, kind = document.Translated(node), "open_pbr_surface"
        except SceneError as error:
            host.warn(error.message, node.path)
    if kind not in READERS:
        named = node.kind or "a shader without a kind"
        host.warn(f"{named} is not read; grey stands for it", node.path)
        return Surface(*gltf_material.finished(_grey(name), None, None, both=True))
    read: Surface = READERS[kind](Graph(host, NODES, document.inner), node, name, walk)
    return read


def _grey(name: str) -> Material:
    return Openpbr(base_color=GREY, specular_roughness=0.5, name=name)


def _number(graph: Graph, node: Node, name: str, kind: type, parameter: str = "") -> Any:
    """Return a number or texture for a parameter of a kind, within its limits."""
    parameter = parameter or name
    param, default = params(kind)[parameter], defaults(kind)[parameter]
    value = graph.texture(node, name, default, wide=False)
    return min(max(value, param.low), param.high) if isinstance(value, float) else value


def _color(graph: Graph, node: Node, name: str, default: float | tuple[float, ...] = 1.0) -> Any:
    """Return a reflectance: three numbers in [0, 1], or a texture."""
    value = graph.texture(node, name, np.broadcast_to(default, 3), wide=True)
    return tuple(min(max(v, 0.0), 1.0) for v in value) if isinstance(value, tuple) else value


def _one(graph: Graph, node: Node, name: str, default: float) -> float:
    return float(graph.constant(node, name, default)[0])


def _openpbr(graph: Graph, node: Node, name: str, walk: bool) -> Surface:
    """Return OpenPBR; colors at a depth, dispersion and media by their formulas in version 1.1."""
    usual = defaults(Openpbr)
    values = {key: _number(graph, node, key, Openpbr) for key in NUMBERS}
    values |= {key: _color(graph, node, key, usual.get(key, 1.0)) for key in COLORS}
    values["thin_walled"] = thin = bool(_one(graph, node, "geometry_thin_walled", 0.0))
    values["thin_film_ior"] = min(max(_one(graph, node, "thin_film_ior", 1.4), 1.0), 5.0)
    if values["specular_roughness_anisotropy"] != 0.0:
        values["anisotropy_rotation"] = _turn(graph, node)
    ior = max(_one(graph, node, "specular_ior", 1.5), 0.1)
    scale = _one(graph, node, "transmission_dispersion_scale", 0.0)
    abbe = _one(graph, node, "transmission_dispersion_abbe_number", 20.0)
    lets_through = values["transmission_weight"] != 0.0
    disperses = scale > 0.0 and ior > 1.0 and lets_through
    values["specular_ior"] = insides.dispersed(ior, max(abbe / scale, 1.0)) if disperses else ior
    interior = None
    if lets_through and not thin:
        interior = _transmission(graph, node, values)
    if walk and not thin and interior is None and values["subsurface_weight"] != 0.0:
        interior = _subsurface(graph, node, values)
    inner = Openpbr(name=name, **values)
    share = graph.texture(node, "geometry_opacity", 1.0, wide=False)
    emission = _emission(graph, node, "emission_color", "emission_luminance", values)
    return _finished(graph, node, "geometry_normal", inner, share, emission, interior)


def _turn(graph: Graph, node: Node) -> float:
    """Return how far a tangent is turned about the normal [degrees]."""
    source, turn = node.source("geometry_tangent"), 0.0
    while source is not None and (kind := category(source[0].kind)) in ("normalize", "rotate3d"):
        turn += _one(graph, source[0], "amount", 0.0) if kind == "rotate3d" else 0.0
        source = source[0].source("in")
    return math.remainder(turn, 180.0)


def _transmission(graph: Graph, node: Node, values: dict[str, Any]) -> Homogeneous | None:
    """Set the color at a depth, and return what scatters light inside; None where nothing does."""
    depth = _one(graph, node, "transmission_depth", 0.0)
    if depth <= 0.0:
        return None
    color = graph.constant(node, "transmission_color", (1.0,) * 3)
    scatter = np.broadcast_to(graph.constant(node, "transmission_scatter", (0.0,) * 3), 3) / depth
    values["transmission_color"] = tuple(np.clip(color, 0.0, 1.0).tolist())
    values["transmission_depth"] = depth
    if not scatter.any():
        return None
    taken = insides.absorbed(values.pop("transmission_color"), values.pop("transmission_depth"))
    rgb = (taken.r, taken.g, taken.b) if isinstance(taken, RGBUnbounded) else taken
    absorbs = np.broadcast_to(rgb, 3) - scatter
    absorbs -= min(absorbs.min(), 0.0)
    g = _one(graph, node, "transmission_scatter_anisotropy", 0.0)
    a, s = (RGBUnbounded(*rgb.tolist()) for rgb in (absorbs, scatter))
    return Homogeneous(sigma_a=a, sigma_s=s, phase=_phase(g))


def _phase(g: float) -> Any:
    return HenyeyGreenstein(g=min(max(g, -STEEPEST), STEEPEST)) if g else Isotropic()


def _subsurface(graph: Graph, node: Node, values: dict[str, Any]) -> Homogeneous:
    """Set that light goes inside, and return what scatters it there."""
    color = np.clip(graph.constant(node, "subsurface_color", (0.8,) * 3), 0.0, 0.999)
    radius = graph.constant(node, "subsurface_radius", 1.0)
    scale = graph.constant(node, "subsurface_radius_scale", (1.0, 0.5, 0.25))
    path = np.maximum(np.broadcast_to(radius * scale, 3), SHORTEST)
    g = min(max(_one(graph, node, "subsurface_scatter_anisotropy", 0.0), -STEEPEST), STEEPEST)
    values["subsurface_inside"] = True
    return Homogeneous.from_albedo(tuple(color.tolist()), tuple(path.tolist()), g)


def _emission(
    graph: Graph, node: Node, color: str, strength: str, values: dict[str, Any] | None = None
) -> Area | None:
    """Return what a surface emits; a coat of one color over it dims that.

    values: parameters of OpenPBR, where the shader is that.
    """
    light = graph.texture(node, color, (1.0 if values else 0.0,) * 3, wide=True)
    amount = graph.texture(node, strength, 0.0 if values else 1.0, wide=False)
    if amount == 0.0 or light == (0.0, 0.0, 0.0):
        return None
    dim = _through_coat(**{key: (values or {}).get(key) for key in COAT})
    if isinstance(amount, Texture):
        first = light if isinstance(light, Texture) else _times(light, dim)
        return Area(radiance=Product(first=first, second=amount), two_sided=True)
    factor = tuple(amount * d for d in dim)
    if isinstance(light, tuple):
        return Area(radiance=_times(light, factor), two_sided=True)
    return Area(radiance=gltf_material.tinted(light, factor), two_sided=True)


COAT = ("coat_weight", "coat_color", "coat_ior")


def _through_coat(coat_weight: object, coat_color: object, coat_ior: object) -> tuple[float, ...]:
    """Return what a coat lets out of light from below it; (1, 1, 1) for textures."""
    if not isinstance(coat_weight, float) or not isinstance(coat_ior, float):
        return (1.0, 1.0, 1.0)
    if not isinstance(coat_color, tuple):
        return (1.0, 1.0, 1.0)
    f0 = ((coat_ior - 1.0) / (coat_ior + 1.0)) ** 2
    return tuple(1.0 + ((1.0 - f0) * c - 1.0) * coat_weight for c in coat_color)


def _times(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, ...]:
    return tuple(max(x, 0.0) * y for x, y in zip(a, b, strict=True))


def _finished(
    graph: Graph,
    node: Node,
    normal: str,
    inner: Material,
    share: float | Texture,
    emission: Area | None,
    interior: Homogeneous | None = None,
) -> Surface:
    """Return a surface with its normals, its opacity and its sides."""
    bent = _with_normals(graph, node, normal, inner)
    opacity = None if share == 1.0 else share
    if opacity is not None and isinstance(opacity, float):
        opacity = min(max(opacity, 0.0), 1.0)
    if isinstance(bent, BumpMap) and inner.transmits:
        masked = bent if opacity is None else Mask(material=bent, opacity=opacity)
        return Surface(masked, emission, interior)
    return Surface(*gltf_material.finished(bent, opacity, emission, both=True), interior)


def _with_normals(graph: Graph, node: Node, name: str, inner: Material) -> Material:
    """Return a material with the normal map or the heights that its normal is connected to."""
    source = node.source(name)
    while source is not None and category(source[0].kind) not in NORMALS:
        kind = category(source[0].kind)
        found = source[0].source("in") if kind == "normalize" else document.inner(*source)
        if found is None and kind not in ("normal", "property Nworld", "property Tworld"):
            graph.host.warn(f"{source[0].kind} is not read as normals", node.path)
        source = found
    if source is None:
        return inner
    map_node = source[0]
    scale, raised = _one(graph, map_node, "scale", 1.0), map_node.source("in")
    heights = raised is not None and category(raised[0].kind) == "heighttonormal"
    if category(map_node.kind) == "bump" or heights:
        if raised is not None and heights:
            scale *= _one(graph, raised[0], "scale", 1.0)
            height = graph.texture(raised[0], "in", 0.0, wide=False)
        else:
            height = graph.texture(map_node, "height", 0.0, wide=False)
        if isinstance(height, float):
            return inner
        return BumpMap(material=inner, height=height, scale=scale)
    map_ = graph.texture(map_node, "in", (0.5, 0.5, 1.0), wide=True)
    image = map_ if isinstance(map_, (Bitmap, GraphTexture)) else None
    return gltf_material.with_normals(inner, image, scale)


GLTF = {
    "metallic": "metallic", "roughness": "roughness", "specular": "specular",
    "transmission": "transmission", "clearcoat": "clearcoat",
    "clearcoat_roughness": "clearcoat_roughness", "sheen_roughness": "sheen_roughness",
    "iridescence": "iridescence",
    "iridescence_thickness": "iridescence_thickness", "anisotropy_strength": "anisotropy",
}  # fmt: skip


def _gltf(graph: Graph, node: Node, name: str, walk: bool) -> Surface:
    values = {
        parameter: _number(graph, node, key, GltfSurface, parameter)
        for key, parameter in GLTF.items()
    }
    values |= {
        "base_color": _color(graph, node, "base_color"),
        "specular_color": _color(graph, node, "specular_color"),
        "sheen_color": _color(graph, node, "sheen_color", 0.0),
        "iridescence_ior": min(max(_one(graph, node, "iridescence_ior", 1.3), 1.0), 5.0),
    }
    ior, dispersion = _one(graph, node, "ior", 1.5), _one(graph, node, "dispersion", 0.0)
    values["ior"] = insides.dispersed(ior, max(20.0 / dispersion, 1.0)) if dispersion > 0 else ior
    values["thin"] = thin = _one(graph, node, "thickness", 0.0) == 0.0
    distance = _one(graph, node, "attenuation_distance", 0.0)
    if not thin and 0.0 < distance < 1e30:
        color = graph.constant(node, "attenuation_color", (1.0,) * 3)
        values["absorption"] = insides.absorbed(tuple(color.tolist()), distance)
    alpha = graph.texture(node, "alpha", 1.0, wide=False)
    mode = int(_one(graph, node, "alpha_mode", 0.0))
    if mode == 1:
        cutoff = _one(graph, node, "alpha_cutoff", 0.5)
        if isinstance(alpha, float):
            alpha = float(alpha >= cutoff)
        else:
            graph.host.warn("alpha_cutoff is left out: alpha is a share", node.path)
    emission = _emission(graph, node, "emissive", "emissive_strength")
    inner = GltfSurface(name=name, **values)
    return _finished(graph, node, "normal", inner, alpha if mode else 1.0, emission)


PREVIEW = {
    "metallic": ("metallic", 0.0), "roughness": ("roughness", 0.5), "clearcoat": ("clearcoat", 0.0),
    "clearcoatRoughness": ("clearcoat_roughness", 0.01),
}  # fmt: skip


def _preview(graph: Graph, node: Node, name: str, walk: bool) -> Surface:
    values: dict[str, Any] = {"base_color": _color(graph, node, "diffuseColor", 0.18)}
    for key, (parameter, default) in PREVIEW.items():
        value = graph.texture(node, key, default, wide=False)
        values[parameter] = min(max(value, 0.0), 1.0) if isinstance(value, float) else value
    values["ior"] = max(_one(graph, node, "ior", 1.5), 1.0)
    if _one(graph, node, "useSpecularWorkflow", 0.0):
        specular = _color(graph, node, "specularColor", 0.0)
        values |= {"ior": 0.0, "metallic": 0.0, "specular_color": specular}
    share = graph.texture(node, "opacity", 1.0, wide=False)
    threshold = _one(graph, node, "opacityThreshold", 0.0)
    if threshold > 0.0 and isinstance(share, float):
        share = float(share >= threshold)
    emission = _emission(graph, node, "emissiveColor", "")
    return _finished(graph, node, "normal", GltfSurface(name=name, **values), share, emission)


def _unlit(graph: Graph, node: Node, name: str, walk: bool) -> Surface:
    inner = Diffuse(reflectance=0.0, name=name)
    share = graph.texture(node, "opacity", 1.0, wide=False)
    light = _emission(graph, node, "emission_color", "emission")
    return _finished(graph, node, "", inner, share, light)


def _scattering(graph: Graph, node: Node, name: str, walk: bool) -> Surface:
    """Return a surface of nodes of scattering and of light."""
    source, light = node.source("bsdf"), node.source("edf")
    inner = _grey(name) if source is None else scattering_material(graph, source[0], name)
    share = graph.texture(node, "opacity", 1.0, wide=False)
    emission = None
    if light is not None and category(light[0].kind) == "uniform_edf":
        emission = _emission(graph, light[0], "color", "")
    elif light is not None:
        graph.host.warn(f"{light[0].kind} is not read: the surface is dark", node.path)
    return Surface(inner if share == 1.0 else Mask(material=inner, opacity=share), emission)


READERS: dict[str, Any] = {
    "surface": _scattering,
    "open_pbr_surface": _openpbr,
    "gltf_pbr": _gltf,
    "UsdPreviewSurface": _preview,
    "surface_unlit": _unlit,
}
