"""Surfaces that MaterialX's nodes of scattering make: mixtures of them, and layers on a base."""

from __future__ import annotations

from typing import Any

import numpy as np

from clpt.formats.materialx.graph import Graph, Node, category
from clpt.scene.materials import Blend, Material, Openpbr, TwoSided, parts

MATT = {"specular_weight": 0.0}
EDGE = 1.0 / 7.0  # the cosine at which OpenPBR tints a metal


def material(graph: Graph, node: Node, name: str) -> Material:
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


def _color(graph: Graph, node: Node, name: str, default: float) -> Any:
    value = graph.texture(node, name, (default,) * 3, wide=True)
    return tuple(min(max(v, 0.0), 1.0) for v in value) if isinstance(value, tuple) else value


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


def _subsurface(graph: Graph, node: Node) -> dict[str, Any]:
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
    "subsurface_bsdf": _subsurface,
    "dielectric_bsdf": _dielectric,
    "conductor_bsdf": _conductor,
    "generalized_schlick_bsdf": _schlick,
    "sheen_bsdf": _sheen,
}
