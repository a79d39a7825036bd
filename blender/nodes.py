# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees of materials as materials and textures of a scene file.

A node that has no counterpart is told once; the value of its socket stands for it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

Json = dict[str, Any]
PASSING = ("REROUTE",)
GREY = [0.8, 0.8, 0.8]


class Tree:
    """The nodes of a material.

    image: writes an image and returns its bitmap, without coordinates; tell: takes what is lost.
    """

    def __init__(
        self, image: Callable[[bpy.types.Image], Json | None], tell: Callable[[str], None]
    ):
        self.image, self.tell = image, tell

    def material(self, material: bpy.types.Material | None) -> tuple[Json, Any]:
        """Return a material and the radiance that it emits, None if it is dark."""
        if material is None:
            return {"type": "diffuse", "reflectance": GREY}, None
        if material.clpt.kind != "NODES":
            return named(material.clpt), None
        if not material.use_nodes or material.node_tree is None:
            return {"type": "diffuse", "reflectance": list(material.diffuse_color)[:3]}, None
        output = material.node_tree.get_output_node("CYCLES")
        source = None if output is None else _source(output.inputs["Surface"])
        if output is not None and _source(output.inputs["Volume"]) is not None:
            self.tell(f"material {material.name!r}: its volume is left out")
        if source is None:
            return {"type": "diffuse", "reflectance": 0.0}, None
        return self.shader(source)

    def shader(self, node: bpy.types.Node) -> tuple[Json, Any]:
        """Return the material of a shader node, and what it emits."""
        read = SHADERS.get(node.type)
        if read is None:
            self.tell(f"{node.bl_label} is not read; grey stands for it")
            return {"type": "diffuse", "reflectance": GREY}, None
        return read(self, node)

    def color(self, node: bpy.types.Node, name: str) -> Any:
        """Return a color input: three numbers or a texture."""
        socket = node.inputs[name]
        source = _source(socket)
        if source is not None:
            texture = self.texture(source, socket, wide=True)
            if texture is not None:
                return texture
        return [max(value, 0.0) for value in list(socket.default_value)[:3]]

    def number(self, node: bpy.types.Node, name: str, default: float = 0.0) -> Any:
        """Return an input that is a number or a texture; `default` where a node lacks it."""
        socket = node.inputs.get(name)
        if socket is None:
            return default
        source = _source(socket)
        if source is not None:
            texture = self.texture(source, socket, wide=False)
            if texture is not None:
                return texture
        value = socket.default_value
        return float(value if isinstance(value, (int, float)) else np.mean(list(value)[:3]))

    def texture(self, node: bpy.types.Node, socket: Any, *, wide: bool) -> Any:
        """Return a texture, a color or a number for a node; None where it is not read."""
        read = TEXTURES.get(node.type)
        if read is None:
            self.tell(f"{node.bl_label} is not read; the socket's own value stands for it")
            return None
        value = read(self, node, _output(socket))
        if value is None or isinstance(value, dict):
            return value
        if wide:
            return value if isinstance(value, list) else [value] * 3
        return float(np.mean(value))

    def bent(self, node: bpy.types.Node, material: Json) -> Json:
        """Return a material with the normal map or the heights of a shader's input."""
        socket = node.inputs.get("Normal")
        source = None if socket is None else _source(socket)
        if source is None:
            return material
        if source.type == "NORMAL_MAP" and source.space == "TANGENT":
            map_ = self.color(source, "Color")
            if isinstance(map_, dict) and map_["type"] == "bitmap":
                scale = self.number(source, "Strength", 1.0)
                return {
                    "type": "normal_map", "material": material, "map": {**map_, "raw": True},
                    "scale": scale if isinstance(scale, float) else 1.0,
                }  # fmt: skip
        if source.type == "BUMP":
            height = self.number(source, "Height", 0.0)
            strength, distance = (self.number(source, n, 1.0) for n in ("Strength", "Distance"))
            if isinstance(height, dict) and isinstance(strength, float):
                sign = -1.0 if source.invert else 1.0
                return {
                    "type": "bump_map", "material": material, "height": height,
                    "scale": sign * strength * (distance if isinstance(distance, float) else 1.0),
                }  # fmt: skip
        self.tell(f"{source.bl_label} as a normal is not read")
        return material


def named(settings: bpy.types.PropertyGroup) -> Json:
    """Return the glass or the metal that a material's panel names, with its film."""
    rough = settings.roughness > 0.0
    facets = {"roughness": settings.roughness} if rough else {}
    film = {"layers": [{"eta": settings.film_ior, "thickness": settings.film_thickness}]}
    layers = film if settings.film_thickness > 0.0 else {}
    if settings.kind == "GLASS":
        kind = "rough_dielectric" if rough else "dielectric"
        return {"type": kind, "int_ior": settings.glass, "ext_ior": "air", **facets, **layers}
    kind = "rough_conductor" if rough else "conductor"
    return _both({"type": kind, "metal": settings.metal, **facets, **layers})


def _source(socket: Any) -> bpy.types.Node | None:
    """Return the node that a socket is linked to, past reroutes and muted links."""
    while socket.is_linked:
        link = socket.links[0]
        if link.is_muted or not link.is_valid:
            return None
        if link.from_node.type not in PASSING:
            return link.from_node
        socket = link.from_node.inputs[0]
    return None


def _output(socket: Any) -> str:
    """Return the name of the output that a socket is linked to."""
    while socket.links[0].from_node.type in PASSING:
        socket = socket.links[0].from_node.inputs[0]
    return socket.links[0].from_socket.name


def _alpha(roughness: Any) -> Any:
    """Return the square of a roughness."""
    if isinstance(roughness, float):
        return max(roughness * roughness, 1e-4)
    return {"type": "product", "first": roughness, "second": roughness}


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, dict):
        return {"type": "product", "first": value, "second": factor}
    return [part * factor for part in value] if isinstance(value, list) else value * factor


def _light(tree: Tree, node: bpy.types.Node, color: str, strength: str) -> Any:
    """Return what a node emits, None for nothing."""
    amount, shown = tree.number(node, strength, 1.0), tree.color(node, color)
    if isinstance(amount, dict):
        return {"type": "product", "first": shown, "second": amount}
    dark = isinstance(shown, list) and not any(shown)
    return None if amount <= 0.0 or dark else _times(shown, amount)


def _principled(tree: Tree, node: bpy.types.Node) -> tuple[Json, Any]:
    color, level = tree.color(node, "Base Color"), tree.number(node, "Specular IOR Level", 0.5)
    through = tree.number(node, "Transmission Weight")
    values: Json = {
        "base_weight": 1.0,
        "base_color": color,
        "base_metalness": tree.number(node, "Metallic"),
        "base_diffuse_roughness": tree.number(node, "Diffuse Roughness"),
        "specular_weight": _times(level, 2.0),
        "specular_roughness": tree.number(node, "Roughness", 0.5),
        "transmission_weight": through,
        "coat_weight": tree.number(node, "Coat Weight"),
        "coat_roughness": tree.number(node, "Coat Roughness"),
        "coat_color": tree.color(node, "Coat Tint"),
        "coat_darkening": 0.0,
        "fuzz_weight": tree.number(node, "Sheen Weight"),
        "fuzz_roughness": tree.number(node, "Sheen Roughness", 0.5),
        "fuzz_color": tree.color(node, "Sheen Tint"),
        "subsurface_weight": tree.number(node, "Subsurface Weight"),
        "subsurface_color": color,
        "specular_roughness_anisotropy": tree.number(node, "Anisotropic"),
    }
    for name, key, low, high in (
        ("IOR", "specular_ior", 1.0, 4.0),
        ("Coat IOR", "coat_ior", 1.0, 3.0),
    ):
        index = tree.number(node, name, 1.5)
        values[key] = min(max(index, low), high) if isinstance(index, float) else 1.5
    if through != 0.0:
        values["transmission_tint"] = color
    thickness = tree.number(node, "Thin Film Thickness")
    if thickness != 0.0:
        film = tree.number(node, "Thin Film IOR", 1.33)
        values |= {
            "thin_film_weight": 1.0, "thin_film_thickness": _times(thickness, 1e-3),
            "thin_film_ior": film if isinstance(film, float) else 1.33,
        }  # fmt: skip
    material = tree.bent(node, {"type": "openpbr", **_plain(values)})
    alpha = tree.number(node, "Alpha", 1.0)
    if alpha != 1.0:
        material = {"type": "mask", "material": material, "opacity": alpha}
    return _both(material, through), _light(tree, node, "Emission Color", "Emission Strength")


def _plain(values: Json) -> Json:
    """Return the values, with shares cut to [0, 1]."""
    shares = ("weight", "metalness", "roughness", "anisotropy")
    return {
        key: min(max(value, 0.0), 2.0 if key == "specular_weight" else 1.0)
        if isinstance(value, float) and key.endswith(shares)
        else value
        for key, value in values.items()
    }


def _both(material: Json, through: Any = 0.0) -> Json:
    """Return a material that is alike on both sides, unless light goes through."""
    return material if through != 0.0 else {"type": "two_sided", "front": material}


def _diffuse(tree: Tree, node: bpy.types.Node) -> tuple[Json, Any]:
    color, roughness = tree.color(node, "Color"), tree.number(node, "Roughness")
    matte = {"type": "diffuse", "reflectance": color}
    if isinstance(roughness, float) and roughness > 0.0:
        sigma = 90.0 * roughness * 0.5
        matte = {"type": "oren_nayar", "reflectance": color, "sigma": sigma}
    return _both(tree.bent(node, matte)), None


def _glossy(tree: Tree, node: bpy.types.Node) -> tuple[Json, Any]:
    metal = {
        "type": "openpbr", "base_weight": 1.0, "base_metalness": 1.0,
        "base_color": tree.color(node, "Color"),
        "specular_roughness": tree.number(node, "Roughness", 0.5),
        "specular_roughness_anisotropy": 0.0,
    }  # fmt: skip
    return _both(tree.bent(node, metal)), None


def _glass(tree: Tree, node: bpy.types.Node) -> tuple[Json, Any]:
    index, roughness = tree.number(node, "IOR", 1.5), tree.number(node, "Roughness")
    color = tree.color(node, "Color")
    values: Json = {
        "int_ior": max(index, 1.0) if isinstance(index, float) else 1.5, "ext_ior": 1.0,
        "specular_transmittance": color,
    }  # fmt: skip
    if node.type == "REFRACTION":
        values["specular_reflectance"] = 0.0
    smooth = isinstance(roughness, float) and roughness < 1e-3
    kind: Json = {"type": "dielectric"} if smooth else {
        "type": "rough_dielectric", "alpha_u": _alpha(roughness), "alpha_v": _alpha(roughness),
    }  # fmt: skip
    return tree.bent(node, {**kind, **values}), None


def _translucent(tree: Tree, node: bpy.types.Node) -> tuple[Json, Any]:
    color = tree.color(node, "Color")
    return {"type": "diffuse_transmission", "transmittance": color, "reflectance": 0.0}, None


def _transparent(tree: Tree, node: bpy.types.Node) -> tuple[Json, Any]:
    color = tree.color(node, "Color")
    if color != [1.0, 1.0, 1.0]:
        tree.tell("the color of Transparent BSDF is read as white")
    return {"type": "null"}, None


def _emission(tree: Tree, node: bpy.types.Node) -> tuple[Json, Any]:
    return {"type": "diffuse", "reflectance": 0.0}, _light(tree, node, "Color", "Strength")


def _mix(tree: Tree, node: bpy.types.Node) -> tuple[Json, Any]:
    share = tree.number(node, "Factor" if "Factor" in node.inputs else "Fac", 0.5)
    sources = [_source(node.inputs[i]) for i in (1, 2)]
    (first, light), (second, glow) = (
        ({"type": "null"}, None) if source is None else tree.shader(source) for source in sources
    )
    return _blended(tree, first, second, share, light, glow)


def _blended(
    tree: Tree, first: Json, second: Json, share: Any, light: Any, glow: Any
) -> tuple[Json, Any]:
    emitted = None
    if light is not None or glow is not None:
        before, after = (part if part is not None else [0.0] * 3 for part in (light, glow))
        emitted = {"type": "mix", "first": before, "second": after, "amount": share}
        if isinstance(share, float) and isinstance(before, list) and isinstance(after, list):
            emitted = [a + (b - a) * share for a, b in zip(before, after, strict=True)]
    return _blend(first, second, share), emitted


def _blend(first: Json, second: Json, share: Any) -> Json:
    """Return a blend; where light goes through a part, the backs of the other part are black."""
    fronts = [part["front"] if part["type"] == "two_sided" else part for part in (first, second)]
    blend = {"type": "blend", "first": fronts[0], "second": fronts[1], "weight": share}
    opaque = first["type"] == second["type"] == "two_sided"
    return {"type": "two_sided", "front": blend} if opaque else blend


def _add(tree: Tree, node: bpy.types.Node) -> tuple[Json, Any]:
    """Return the sum of a material and an emission; of two materials their mean, told."""
    parts = [tree.shader(source) for i in (0, 1) if (source := _source(node.inputs[i])) is not None]
    if not parts:
        return {"type": "null"}, None
    lights = [light for _, light in parts if light is not None]
    scattering = [part for part, light in parts if light is None] or [parts[0][0]]
    if len(scattering) == 2:
        tree.tell("Add Shader of two surfaces is read as their mean")
        return _blend(*scattering, 0.5), None
    return scattering[0], lights[0] if lights else None


SHADERS: dict[str, Callable[[Tree, bpy.types.Node], tuple[Json, Any]]] = {
    "BSDF_PRINCIPLED": _principled,
    "BSDF_DIFFUSE": _diffuse,
    "BSDF_GLOSSY": _glossy,
    "BSDF_ANISOTROPIC": _glossy,
    "BSDF_GLASS": _glass,
    "BSDF_REFRACTION": _glass,
    "BSDF_TRANSLUCENT": _translucent,
    "BSDF_TRANSPARENT": _transparent,
    "EMISSION": _emission,
    "MIX_SHADER": _mix,
    "ADD_SHADER": _add,
}


def _image(tree: Tree, node: bpy.types.Node, output: str) -> Any:
    if node.image is None:
        return [1.0, 0.0, 1.0]
    bitmap = tree.image(node.image)
    if bitmap is None:
        return [1.0, 0.0, 1.0]
    wraps = {"REPEAT": "repeat", "EXTEND": "clamp", "CLIP": "zero", "MIRROR": "mirror"}
    to_uv = _placed(tree, node)
    placed = {} if np.array_equal(to_uv, np.eye(3)) else {"to_uv": to_uv.tolist()}
    channel = {"channel": "a"} if output == "Alpha" else {}
    nearest = {"filter": "nearest"} if node.interpolation == "Closest" else {}
    return {**bitmap, "wrap": wraps[node.extension], **placed, **channel, **nearest}


def _placed(tree: Tree, node: bpy.types.Node) -> np.ndarray:
    """Return the transform of texture coordinates that Mapping nodes before a texture make."""
    matrix, source = np.eye(3), _source(node.inputs["Vector"])
    while source is not None and source.type == "MAPPING":
        turn = list(source.inputs["Rotation"].default_value)[2]
        scale = list(source.inputs["Scale"].default_value)[:2]
        move = list(source.inputs["Location"].default_value)[:2]
        cosine, sine = math.cos(turn), math.sin(turn)
        step = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]) @ np.diag(
            [*scale, 1.0]
        )
        step[:2, 2] = move
        matrix, source = matrix @ step, _source(source.inputs["Vector"])
    if source is not None and source.type not in ("TEX_COORD", "UVMAP"):
        tree.tell(
            f"{source.bl_label} before an image is not read; its own coordinates stand for it"
        )
    return matrix


def _checker(tree: Tree, node: bpy.types.Node, output: str) -> Any:
    scale = tree.number(node, "Scale", 5.0)
    size = scale if isinstance(scale, float) else 5.0
    tree.tell("Checker Texture follows texture coordinates")
    return {
        "type": "checkerboard", "color0": tree.color(node, "Color1"),
        "color1": tree.color(node, "Color2"),
        "to_uv": (np.diag([size / 2.0, size / 2.0, 1.0]) @ _placed(tree, node)).tolist(),
    }  # fmt: skip


def _constant_color(tree: Tree, node: bpy.types.Node, output: str) -> Any:
    return list(node.outputs[0].default_value)[:3]


def _constant(tree: Tree, node: bpy.types.Node, output: str) -> Any:
    return float(node.outputs[0].default_value)


def _mix_colors(tree: Tree, node: bpy.types.Node, output: str) -> Any:
    """Return a mixture; of the blend types Mix and Multiply."""
    old = node.type == "MIX_RGB"
    if not old and node.data_type not in ("RGBA", "FLOAT"):
        tree.tell("Mix of vectors is not read")
        return None
    wide = old or node.data_type == "RGBA"
    sockets = [socket for socket in node.inputs if socket.enabled]
    names = {socket.name: socket for socket in sockets}
    share = _input(tree, names.get("Factor") or names.get("Fac") or sockets[0], wide=False)
    ends = [names.get(new) or names[former] for new, former in (("A", "Color1"), ("B", "Color2"))]
    first, second = (_input(tree, end, wide=wide) for end in ends)
    blend = node.blend_type if wide else "MIX"
    if blend == "MULTIPLY":
        second = {"type": "product", "first": first, "second": second}
    elif blend != "MIX":
        tree.tell(f"Mix of the blend type {blend.title()} is read as Mix")
    return {"type": "mix", "first": first, "second": second, "amount": share}


def _input(tree: Tree, socket: Any, *, wide: bool) -> Any:
    source = _source(socket)
    texture = None if source is None else tree.texture(source, socket, wide=wide)
    if texture is not None:
        return texture
    value = socket.default_value
    numbers = [float(value)] if isinstance(value, (int, float)) else list(value)[:3]
    return (numbers * 3)[:3] if wide else float(np.mean(numbers))


TEXTURES: dict[str, Callable[[Tree, bpy.types.Node, str], Any]] = {
    "TEX_IMAGE": _image,
    "TEX_CHECKER": _checker,
    "RGB": _constant_color,
    "VALUE": _constant,
    "MIX": _mix_colors,
    "MIX_RGB": _mix_colors,
}
