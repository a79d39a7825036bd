# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees of materials as materials and textures of a scene file.

A node that has no counterpart is told once; the value of its socket stands for it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from . import measured
from .graphs import Graph, Json, Site, Value, origin, socket_of
from .textures import TEXTURES

GREY = [0.8, 0.8, 0.8]
METAL_FILMS = bpy.app.version >= (5, 0)  # before, thin films were on dielectrics alone
told: dict[str, list[str]] = {}  # by names of data: what is lost, for the panels


class Expression:
    """A graph in the making: what nodes that are no shaders compute."""

    def __init__(self, tree: Tree):
        self.tree, self.g, self.tell, self.image = tree, Graph(), tree.tell, tree.image
        self.object, self.random = tree.object, tree.random
        self.known: dict[tuple[Any, ...], Value] = {}

    def input(self, at: Site, key: str | int) -> Value:
        """Return an input of a node, by its number, identifier or name; 0 if it has none."""
        socket = socket_of(at.node, key)
        return self.g.value(0.0) if socket is None else self.socket(at.groups, socket)

    def socket(self, groups: tuple[bpy.types.Node, ...], socket: Any) -> Value:
        site, end = origin(groups, socket)
        if site is None:
            return self._own(end)
        key = (site.node.as_pointer(), *(g.as_pointer() for g in site.groups), site.output)
        if key not in self.known:
            read = TEXTURES.get(site.node.type)
            value = None if read is None else read(self, site)
            if value is None:
                label = f"{site.node.bl_label} ({site.output})"
                self.tell(f"{label} is not read; the socket's own value stands for it")
                value = self._own(socket)
            self.known[key] = value
        value = self.known[key]
        if socket.type in ("VALUE", "INT", "BOOLEAN") and value.width > 1:
            color = end.type == "RGBA"
            value = self.g.gray(value) if color else (value[0] + value[1] + value[2]) / 3.0
        return value

    def _own(self, socket: Any) -> Value:
        if socket is None or socket.type in ("SHADER", "STRING", "MENU"):
            return self.g.value(0.0)
        value = socket.default_value
        return self.g.value(value if isinstance(value, (int, float)) else list(value)[:3])

    def vector(self, at: Site, coordinates: str) -> Value:
        """Return where a texture is looked up; unlinked: at the coordinates of that name."""
        if not at.node.inputs["Vector"].is_linked:
            return self.attribute(coordinates)
        return self.input(at, "Vector")

    def constant(self, at: Site, key: str, default: float) -> float:
        """Return a number that cannot vary; `default` where it does."""
        value = self.input(at, key).constant()
        if value is None:
            self.tell(f"{key} of {at.node.bl_label} cannot vary: it is {default:g}")
        return default if value is None else value[0]

    def told(self, at: Site, text: str, value: float) -> Value:
        self.tell(text)
        return self.g.value(value)

    def attribute(self, kind: str, name: str = "") -> Value:
        """Return coordinates or an attribute of meshes; of a world its directions."""
        if not self.tree.surface:
            return Value(self.g, "position", 3)
        if kind == "uv" and not name:
            return self.g("convert", Value(self.g, "texcoord", 2), channels=3)
        number = self.tree.attributes.setdefault((kind, name), len(self.tree.attributes))
        self.tree.used.add(number)
        return self.g.look({"type": "mesh_attribute", "name": f"vertex_b{number}"}, 3)

    def of_object(self, source: bpy.types.Object) -> Value:
        """Return the place as another object has it."""
        rows, place = source.matrix_world.inverted_safe(), Value(self.g, "position", 3)
        parts = (self.g("dotproduct", place, list(row)[:3]) + row[3] for row in list(rows)[:3])
        return self.g("combine3", *parts)

    def stops(self, value: Value, rows: list[list[float]], how: int) -> Value:
        """Return a ramp's color (4 channels); rows: positions that rise, and 1, 3 or 4 numbers."""
        rows = sorted(rows, key=lambda row: row[0])
        return self.g("ramp", value, stops=rows, interpolation=how)


class Tree:
    """The nodes of materials.

    image: writes the image of a node and returns its bitmap, without coordinates; tell: takes what
    is lost. attributes: of meshes that the materials read, by what they are, with their numbers.
    object, random: what Object Info knows; surface: False while a world is read; tables: takes the
    IES files of a lamp.
    """

    def __init__(self, image: Callable[[bpy.types.Node], Json | None], tell: Callable[[str], None]):
        self.image, self.tell = image, tell
        self.attributes: dict[tuple[str, str], int] = {}
        self.used: set[int] = set()  # attributes that the material reads
        self.personal = False  # whether it reads what only its object knows
        self.object: bpy.types.Object | None = None
        self.random, self.surface = 0.0, True
        self.tables: list[str] | None = None

    def material(self, material: bpy.types.Material | None) -> tuple[Json, Any]:
        """Return a material and the radiance that it emits, None if it is dark."""
        if material is None:
            return {"type": "diffuse", "reflectance": GREY}, None
        if material.clpt.kind != "NODES":
            try:
                return measured.surface(material.clpt), None
            except ValueError as error:
                self.tell(str(error))
                return {"type": "diffuse", "reflectance": GREY}, None
        if not material.use_nodes or material.node_tree is None:
            return {"type": "diffuse", "reflectance": list(material.diffuse_color)[:3]}, None
        output = material.node_tree.get_output_node("CYCLES")
        shader = None if output is None else self.linked(Site(output, (), ""), "Surface")
        if shader is None:
            filled = output is not None and output.inputs["Volume"].is_linked
            return {"type": "null"} if filled else {"type": "diffuse", "reflectance": 0.0}, None
        return shader

    def linked(self, at: Site, key: str | int) -> tuple[Json, Any] | None:
        """Return the material and the light of a linked shader, None without one."""
        site, _ = origin(at.groups, socket_of(at.node, key))
        return None if site is None else self.shader(site)

    def shader(self, at: Site) -> tuple[Json, Any]:
        """Return the material of a shader node, and what it emits."""
        read = SHADERS.get(at.node.type)
        if read is None:
            self.tell(f"{at.node.bl_label} is not read; grey stands for it")
            return {"type": "diffuse", "reflectance": GREY}, None
        return read(self, at)

    def color(self, at: Site, key: str) -> Any:
        """Return a color input: three numbers in [0, 1] or a texture."""
        color = self.made(lambda e: e.input(at, key), wide=True)
        return [min(max(c, 0.0), 1.0) for c in color] if isinstance(color, list) else color

    def share(self, at: Site, key: str, default: float) -> Any:
        """Return a number in [0, 1] or a texture."""
        value = self.number(at, key, default)
        return min(max(value, 0.0), 1.0) if isinstance(value, float) else value

    def number(self, at: Site, key: str, default: float = 0.0) -> Any:
        """Return an input that is a number or a texture; `default` where a node lacks it."""
        if socket_of(at.node, key) is None:
            return default
        expression = Expression(self)
        value = expression.input(at, key)
        return expression.g.finished(expression.g.gray(value), wide=False)

    def single(self, at: Site, key: str, default: float = 0.0) -> float:
        """Return an input that cannot vary; `default` where it does, or where a node lacks it."""
        value = self.number(at, key, default)
        if isinstance(value, float):
            return value
        self.tell(f"{key} of {at.node.bl_label} cannot vary: it is {default:g}")
        return default

    def made(self, compute: Callable[[Expression], Value], *, wide: bool = False) -> Any:
        """Return what is computed: numbers or a texture."""
        expression = Expression(self)
        return expression.g.finished(compute(expression), wide=wide)

    def light(self, at: Site, color: str, strength: str) -> Any:
        """Return what a node emits, None for nothing."""
        shown = self.made(lambda e: e.input(at, color) * e.input(at, strength), wide=True)
        return None if isinstance(shown, list) and not any(v > 0.0 for v in shown) else shown

    def bent(self, at: Site, material: Json) -> Json:
        """Return a material with the normal map or the heights of a shader's input."""
        socket = socket_of(at.node, "Normal")
        site = None if socket is None else origin(at.groups, socket)[0]
        if site is None:
            return material
        node = site.node
        if node.type == "NORMAL_MAP" and node.space == "TANGENT":
            map_ = self.color(site, "Color")
            if isinstance(map_, dict):
                raw = {"raw": True} if map_["type"] == "bitmap" else {}
                scale = self.single(site, "Strength", 1.0)
                return {
                    "type": "normal_map", "material": material, "map": {**map_, **raw},
                    "scale": scale,
                }  # fmt: skip
        if node.type == "BUMP":
            height = self.number(site, "Height")
            scale = self.single(site, "Strength", 1.0) * self.single(site, "Distance", 1.0)
            material = self.bent(site, material)
            if not isinstance(height, dict):
                return material
            scale *= -1.0 if node.invert else 1.0
            return {"type": "bump_map", "material": material, "height": height, "scale": scale}
        self.tell(f"{node.bl_label} as a normal is not read")
        return material


PRINCIPLED = {  # inputs that are values of OpenPBR, and parts with a tint
    "base_metalness": "Metallic", "base_diffuse_roughness": "Diffuse Roughness",
    "transmission_weight": "Transmission Weight", "coat_weight": "Coat Weight",
    "coat_roughness": "Coat Roughness", "fuzz_weight": "Sheen Weight",
    "fuzz_roughness": "Sheen Roughness", "subsurface_weight": "Subsurface Weight",
}  # fmt: skip
TINTED = {"specular": "Specular", "coat": "Coat", "fuzz": "Sheen"}


def _principled(tree: Tree, at: Site) -> tuple[Json, Any]:
    color, through = tree.color(at, "Base Color"), tree.number(at, "Transmission Weight")
    coat = tree.number(at, "Coat Weight")
    coat_ior = min(max(tree.single(at, "Coat IOR", 1.5), 1.0), 3.0)
    index = tree.single(at, "IOR", 1.5)
    if coat != 0.0 and through == 0.0:  # Cycles' base meets air, that of OpenPBR its coat
        index *= 1.0 + (coat_ior - 1.0) * (coat if isinstance(coat, float) else 1.0)
    values: Json = {
        "base_weight": 1.0, "base_color": color, "subsurface_color": color,
        "specular_ior": min(max(index, 1.0), 4.0), "coat_ior": coat_ior, "coat_darkening": 0.0,
        "specular_weight": tree.made(lambda e: e.input(at, "Specular IOR Level") * 2.0),
        **{name: tree.number(at, key) for name, key in PRINCIPLED.items()},
        **{f"{part}_color": tree.color(at, f"{key} Tint") for part, key in TINTED.items()},
        **_stretched(tree, at, "Anisotropic", "Anisotropic Rotation"),
    }  # fmt: skip
    if through != 0.0:
        values["transmission_tint"] = color
    metal = _filmed_metal(tree, at, values)
    if METAL_FILMS or values["base_metalness"] != 1.0:
        values |= _thin_film(tree, at)
    material = tree.bent(at, metal or {"type": "openpbr", **_plain(values)})
    alpha = tree.share(at, "Alpha", 1.0)
    if alpha != 1.0:
        material = {"type": "mask", "material": material, "opacity": alpha}
    return _both(material, through), tree.light(at, "Emission Color", "Emission Strength")


def _thin_film(tree: Tree, at: Site) -> Json:
    """Return the thin film of OpenPBR, {} without one."""
    if tree.number(at, "Thin Film Thickness") == 0.0:
        return {}
    return {
        "thin_film_weight": 1.0, "thin_film_ior": tree.single(at, "Thin Film IOR", 1.33),
        "thin_film_thickness": tree.made(lambda e: e.input(at, "Thin Film Thickness") * 1e-3),
    }  # fmt: skip


def _films(tree: Tree, at: Site) -> Json:
    """Return the thin film of a shader, which `layers` of clpt's materials are; {} without one."""
    thickness = tree.single(at, "Thin Film Thickness")
    film = {"eta": tree.single(at, "Thin Film IOR", 1.33), "thickness": thickness}
    return {"layers": [film]} if thickness > 0.0 else {}


def _filmed_metal(tree: Tree, at: Site, values: Json) -> Json | None:
    """Return a metal of even color under a film, by an index; None for other surfaces.

    The index is that of Gulbrandsen 2014 for the reflectances straight on and at 82 degrees.
    """
    settings = "base_metalness", "coat_weight", "fuzz_weight", "specular_roughness_anisotropy"
    plain = [values[name] for name in settings] == [1.0, 0.0, 0.0, 0.0]
    colors = values["base_color"], values["specular_color"]
    if not plain or not all(isinstance(color, list) for color in colors):
        return None
    even = METAL_FILMS and isinstance(tree.number(at, "Thin Film Thickness"), float)
    films = _films(tree, at) if even else {}
    if not films:
        return None
    r, tint = np.minimum(colors[0], 0.999), np.array(colors[1])
    edge, root = (r + (1.0 - r) * (6.0 / 7.0) ** 5) * tint, np.sqrt(r)
    eta = (1.0 - edge) * (1.0 + root) / (1.0 - root) + edge * (1.0 - r) / (1.0 + r)
    k = np.sqrt(np.maximum((r * (eta + 1.0) ** 2 - (eta - 1.0) ** 2) / (1.0 - r), 0.0))
    return _conductor(tree, at, {"eta": eta.tolist(), "k": k.tolist(), **films})


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


def _diffuse(tree: Tree, at: Site) -> tuple[Json, Any]:
    color, roughness = tree.color(at, "Color"), tree.number(at, "Roughness")
    if roughness != 0.0:
        return _open(tree, at, base_color=color, base_diffuse_roughness=roughness)
    return _both(tree.bent(at, {"type": "diffuse", "reflectance": color})), None


def _open(tree: Tree, at: Site, **values: Any) -> tuple[Json, Any]:
    """Return OpenPBR without a dielectric's reflection, unless `values` say so."""
    plain = {"type": "openpbr", "base_weight": 1.0, "specular_weight": 0.0}
    return _both(tree.bent(at, {**plain, **_plain(values)})), None


def _stretched(tree: Tree, at: Site, key: str, turn: str) -> Json:
    """Return facets of OpenPBR. Cycles' alphas are r^2 by a number and over it."""
    rough, amount = tree.number(at, "Roughness", 0.5), tree.number(at, key)
    angle = tree.made(lambda e: e.input(at, turn) * 360.0)
    if isinstance(rough, float) and isinstance(amount, float) and amount != 0.0:
        glossy = at.node.type == "BSDF_GLOSSY"  # whose stretch is along the bitangent
        ratio = (1.0 - min(abs(amount), 0.95)) ** 2 if glossy else 1.0 - 0.9 * min(amount, 1.0)
        rough = min(rough * ((1.0 + ratio**2) / (2.0 * ratio)) ** 0.25, 1.0)
        amount = 1.0 - ratio
        angle = angle + 90.0 if glossy and isinstance(angle, float) else angle
    return {
        "specular_roughness": rough, "specular_roughness_anisotropy": amount,
        "anisotropy_rotation": angle,
    }  # fmt: skip


def _glossy(tree: Tree, at: Site) -> tuple[Json, Any]:
    return _open(
        tree, at, base_metalness=1.0, base_color=tree.color(at, "Color"), specular_weight=1.0,
        **_stretched(tree, at, "Anisotropy", "Rotation"),
    )  # fmt: skip


def _metallic(tree: Tree, at: Site) -> tuple[Json, Any]:
    if at.node.fresnel_type == "PHYSICAL_CONDUCTOR":
        index = {
            key: list(at.node.inputs[name].default_value)
            for key, name in (("eta", "IOR"), ("k", "Extinction"))
        }
        return _both(tree.bent(at, _conductor(tree, at, index | _films(tree, at)))), None
    values = {
        "base_metalness": 1.0, "base_color": tree.color(at, "Base Color"), "specular_weight": 1.0,
        "specular_color": tree.color(at, "Edge Tint"), "coat_weight": 0.0, "fuzz_weight": 0.0,
        **_stretched(tree, at, "Anisotropy", "Rotation"),
    }  # fmt: skip
    metal = _filmed_metal(tree, at, values)
    if metal is None:
        return _open(tree, at, **values, **_thin_film(tree, at))
    return _both(tree.bent(at, metal)), None


def _conductor(tree: Tree, at: Site, values: Json) -> Json:
    return {"type": "rough_conductor", **_alphas(tree, at), **values}


def _alphas(tree: Tree, at: Site) -> Json:
    """Return how rough facets are, as Cycles' roughness says it."""
    alpha = tree.made(lambda e: e.input(at, "Roughness") * e.input(at, "Roughness"))
    alpha = min(max(alpha, 1e-4), 1.0) if isinstance(alpha, float) else alpha
    return {"alpha_u": alpha, "alpha_v": alpha}


def _glass(tree: Tree, at: Site) -> tuple[Json, Any]:
    color = tree.color(at, "Color")
    values: Json = {
        "int_ior": max(tree.single(at, "IOR", 1.5), 1.0), "ext_ior": 1.0,
        "specular_transmittance": color, **_films(tree, at),
        "specular_reflectance": 0.0 if at.node.type == "BSDF_REFRACTION" else color,
    }  # fmt: skip
    smooth = tree.number(at, "Roughness") == 0.0
    kind = {"type": "dielectric"} if smooth else {
        "type": "rough_dielectric", **_alphas(tree, at),
    }  # fmt: skip
    return tree.bent(at, {**kind, **values}), None


def _translucent(tree: Tree, at: Site) -> tuple[Json, Any]:
    color = tree.color(at, "Color")
    return {"type": "diffuse_transmission", "transmittance": color, "reflectance": 0.0}, None


def _transparent(tree: Tree, at: Site) -> tuple[Json, Any]:
    color = tree.color(at, "Color")
    if color == [1.0, 1.0, 1.0]:
        return {"type": "null"}, None
    values = {"int_ior": 1.0, "ext_ior": 1.0, "specular_transmittance": color}
    return {"type": "thin_dielectric", **values}, None


def _emission(tree: Tree, at: Site) -> tuple[Json, Any]:
    return {"type": "diffuse", "reflectance": 0.0}, tree.light(at, "Color", "Strength")


def _hair(tree: Tree, at: Site) -> tuple[Json, Any]:
    """Principled Hair by Chiang et al. 2016; colors and melanin by Benedikt et al. 2011."""
    old, along = at.node.type == "BSDF_HAIR", tree.single(at, "Roughness", 0.3)
    around = tree.single(at, "Radial Roughness", 0.3)
    kind = "COLOR" if old else at.node.parametrization
    if kind == "ABSORPTION":
        absorbed = list(at.node.inputs["Absorption Coefficient"].default_value)
    elif kind == "MELANIN":
        amount = -np.log(max(1.0 - tree.single(at, "Melanin", 0.8), 1e-4))
        red = tree.single(at, "Melanin Redness", 1.0)
        pigments = np.array([[0.506, 0.841, 1.653], [0.343, 0.733, 1.924]])
        absorbed = (amount * np.array([1.0 - red, red]) @ pigments).tolist()
    else:
        b = around if not old else 0.3
        scale = 5.969 - 0.215 * b + 2.532 * b**2 - 10.73 * b**3 + 5.574 * b**4 + 0.245 * b**5
        color = tree.color(at, "Color")
        color = color if isinstance(color, list) else GREY
        absorbed = [float((np.log(max(c, 1e-3)) / scale) ** 2) for c in color]
    return {
        "type": "hair", "sigma_a": absorbed, "longitudinal_roughness": along,
        "azimuthal_roughness": around, "eta": tree.single(at, "IOR", 1.55),
        "scale_tilt": float(np.degrees(tree.single(at, "Offset", 0.035))),
    }, None  # fmt: skip


def _sheen(tree: Tree, at: Site) -> tuple[Json, Any]:
    return _open(
        tree, at, base_color=0.0, fuzz_weight=1.0, fuzz_color=tree.color(at, "Color"),
        fuzz_roughness=tree.number(at, "Roughness", 0.5),
    )  # fmt: skip


def _subsurface(tree: Tree, at: Site) -> tuple[Json, Any]:
    color = tree.color(at, "Color")
    return _open(tree, at, base_color=color, subsurface_weight=1.0, subsurface_color=color)


def _toon(tree: Tree, at: Site) -> tuple[Json, Any]:
    tree.tell(f"{at.node.bl_label} is read as diffuse")
    return _both({"type": "diffuse", "reflectance": tree.color(at, "Color")}), None


def _holdout(tree: Tree, at: Site) -> tuple[Json, Any]:
    portal = at.node.type == "BSDF_RAY_PORTAL"
    tree.tell(f"{at.node.bl_label} is {'not there' if portal else 'black, and not transparent'}")
    return {"type": "null"} if portal else {"type": "diffuse", "reflectance": 0.0}, None


def _mix(tree: Tree, at: Site) -> tuple[Json, Any]:
    nothing: tuple[Json, Any] = ({"type": "null"}, None)
    factor = origin(at.groups, socket_of(at.node, "Fac"))[0]
    parts = [tree.linked(at, i) or nothing for i in (1, 2)]
    if factor is not None and factor.output == "Backfacing":
        (front, light), (back, _) = parts
        fronts = [part.get("front", part) for part in (front, back)]
        return {"type": "two_sided", "front": fronts[0], "back": fronts[1]}, light
    coated = None if factor is None else _coated(tree, at, factor)
    if coated is not None:
        return coated
    share = tree.share(at, "Fac", 0.5)
    if share in (0.0, 1.0):
        return parts[int(share)]
    made, light = _blended(tree, *parts, share)
    gone = [part["type"] == "null" for part, _ in parts]
    if any(gone) and not all(gone):
        there = parts[int(gone[0])][0]
        opacity = share if gone[0] else tree.made(lambda e: 1.0 - e.input(at, "Fac").clamped())
        made = _masked(there, opacity)
    return made, light


def _masked(material: Json, opacity: Any) -> Json:
    """Return a material that is there by a share; masks lie within two sides."""
    if material["type"] == "two_sided" and "back" not in material:
        return _both(_masked(material["front"], opacity))
    return {"type": "mask", "material": material, "opacity": opacity}


def _coated(tree: Tree, at: Site, factor: Site) -> tuple[Json, Any] | None:
    """Return a matte base below a dielectric: a mixture by Fresnel of the two; None for others."""
    ends = [origin(at.groups, at.node.inputs[i])[0] for i in (1, 2)]
    matte, gloss = ends
    if matte is None or gloss is None or factor.output not in ("Fac", "Fresnel"):
        return None
    kinds = (matte.node.type, gloss.node.type, factor.node.type)
    if kinds[:2] != ("BSDF_DIFFUSE", "BSDF_GLOSSY") or kinds[2] not in ("FRESNEL", "LAYER_WEIGHT"):
        return None
    index = tree.single(factor, "IOR", 1.5)
    if kinds[2] == "LAYER_WEIGHT":
        index = 1.0 / max(1.0 - tree.single(factor, "Blend", 0.5), 0.25)
    return _open(
        tree, matte, base_color=tree.color(matte, "Color"), specular_weight=1.0,
        specular_color=tree.color(gloss, "Color"), specular_ior=min(max(index, 1.0), 4.0),
        specular_roughness=tree.number(gloss, "Roughness", 0.5),
    )  # fmt: skip


def _blended(
    tree: Tree, below: tuple[Json, Any], above: tuple[Json, Any], share: Any
) -> tuple[Json, Any]:
    (first, light), (second, glow) = below, above
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


def _add(tree: Tree, at: Site) -> tuple[Json, Any]:
    """Return the sum of a material and an emission; of two materials their mean, told."""
    parts = [part for i in (0, 1) if (part := tree.linked(at, i)) is not None]
    if not parts:
        return {"type": "null"}, None
    lights = [light for _, light in parts if light is not None]
    scattering = [part for part, light in parts if light is None] or [parts[0][0]]
    if len(scattering) == 2:
        tree.tell("Add Shader of two surfaces is read as their mean")
        return _blend(*scattering, 0.5), None
    return scattering[0], lights[0] if lights else None


SHADERS: dict[str, Callable[[Tree, Site], tuple[Json, Any]]] = {
    "BSDF_PRINCIPLED": _principled, "BSDF_DIFFUSE": _diffuse, "BSDF_GLOSSY": _glossy,
    "BSDF_METALLIC": _metallic, "BSDF_GLASS": _glass, "BSDF_REFRACTION": _glass,
    "BSDF_TRANSLUCENT": _translucent, "BSDF_TRANSPARENT": _transparent, "BSDF_SHEEN": _sheen,
    "BSDF_HAIR": _hair, "BSDF_HAIR_PRINCIPLED": _hair, "BSDF_TOON": _toon, "EMISSION": _emission,
    "BACKGROUND": _emission, "SUBSURFACE_SCATTERING": _subsurface, "HOLDOUT": _holdout,
    "BSDF_RAY_PORTAL": _holdout, "MIX_SHADER": _mix, "ADD_SHADER": _add,
}  # fmt: skip
