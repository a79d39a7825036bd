# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of Cycles that are no shaders, as nodes of clpt's graphs.

A function takes the tree that is read and a site, and returns the value of the site's output; None
where it has no counterpart, which is told.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from typing import Any

import bpy
import numpy as np

from .graphs import Graph, Site, Value, hashed, origin, turned

TABLE = 256  # samples of curves and of ramps that are not linear, as Cycles has
TURN = 2.0 * math.pi
PERLIN = {"1D": "noise1d", "2D": "noise2d", "3D": "noise3d", "4D": "noise4d"}
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
Read = Callable[[Any, Site], Value | None]  # of a nodes.Expression, whose `graph` is called g


def _trunc(g: Graph, x: Value) -> Value:
    return g("sign", x) * g("floor", g("absval", x))


def _wrapped(g: Graph, x: Value, high: Value, low: Value) -> Value:
    span = high - low
    return x - span * g("floor", (x - low) / span)


def _pingpong(g: Graph, x: Value, scale: Value) -> Value:
    return g("absval", g("fract", (x - scale) / (scale * 2.0)) * scale * 2.0 - scale)


def _least(g: Graph, a: Value, b: Value, k: Value) -> Value:
    """The smaller number, with a round edge of the width k."""
    h = g("max", k - g("absval", a - b), 0.0) / k
    return g("min", a, b) - h * h * h * k * (1.0 / 6.0)


Operation = Callable[..., Value]
UNARY = {
    "SQRT": "sqrt", "ABSOLUTE": "absval", "EXPONENT": "exp", "SIGN": "sign", "FLOOR": "floor",
    "CEIL": "ceil", "FRACT": "fract", "FRACTION": "fract", "SINE": "sin", "COSINE": "cos",
    "TANGENT": "tan", "ARCSINE": "asin", "ARCCOSINE": "acos", "ROUND": "round",
}  # fmt: skip
BINARY = {
    "ADD": "add", "SUBTRACT": "subtract", "MULTIPLY": "multiply", "DIVIDE": "divide",
    "POWER": "power", "MINIMUM": "min", "MAXIMUM": "max", "FLOORED_MODULO": "modulo",
    "ARCTAN2": "atan2",
}  # fmt: skip
MATH: dict[str, Operation] = {
    **{name: lambda g, a, b, c, kind=kind: g(kind, a) for name, kind in UNARY.items()},
    **{name: lambda g, a, b, c, kind=kind: g(kind, a, b) for name, kind in BINARY.items()},
    "MULTIPLY_ADD": lambda g, a, b, c: a * b + c,
    "LOGARITHM": lambda g, a, b, c: g("ln", a) / g("ln", b),
    "INVERSE_SQRT": lambda g, a, b, c: 1.0 / g("sqrt", a),
    "LESS_THAN": lambda g, a, b, c: g("ifgreater", b, a, 1.0, 0.0),
    "GREATER_THAN": lambda g, a, b, c: g("ifgreater", a, b, 1.0, 0.0),
    "COMPARE": lambda g, a, b, c: g("ifgreater", g("absval", a - b), g("max", c, 1e-5), 0.0, 1.0),
    "SMOOTH_MIN": _least, "SMOOTH_MAX": lambda g, a, b, c: -_least(g, -a, -b, c),
    "TRUNC": lambda g, a, b, c: _trunc(g, a), "WRAP": _wrapped,
    "MODULO": lambda g, a, b, c: a - b * _trunc(g, a / b),
    "SNAP": lambda g, a, b, c: g("floor", a / b) * b,
    "PINGPONG": lambda g, a, b, c: _pingpong(g, a, b),
    "ARCTANGENT": lambda g, a, b, c: g("atan2", a, 1.0),
    "SINH": lambda g, a, b, c: (g("exp", a) - g("exp", -a)) * 0.5,
    "COSH": lambda g, a, b, c: (g("exp", a) + g("exp", -a)) * 0.5,
    "TANH": lambda g, a, b, c: 1.0 - 2.0 / (g("exp", a * 2.0) + 1.0),
    "RADIANS": lambda g, a, b, c: a * (math.pi / 180.0),
    "DEGREES": lambda g, a, b, c: a * (180.0 / math.pi),
}  # fmt: skip


def _project(g: Graph, a: Value, b: Value) -> Value:
    return b * (g("dotproduct", a, b) / g("dotproduct", b, b))


def _reflect(g: Graph, a: Value, b: Value) -> Value:
    normal = g("normalize", b)
    return a - normal * (g("dotproduct", normal, a) * 2.0)


def _refract(g: Graph, a: Value, b: Value, eta: Value) -> Value:
    normal = g("normalize", b)
    cosine = g("dotproduct", normal, a)
    k = 1.0 - eta * eta * (1.0 - cosine * cosine)
    bent = a * eta - normal * (eta * cosine + g("sqrt", k))
    return g("ifgreater", 0.0, k, 0.0, bent)


VECTOR_MATH: dict[str, Operation] = {
    **MATH,
    "CROSS_PRODUCT": lambda g, a, b, c, s: g("crossproduct", a, b),
    "PROJECT": lambda g, a, b, c, s: _project(g, a, b),
    "REFLECT": lambda g, a, b, c, s: _reflect(g, a, b),
    "REFRACT": lambda g, a, b, c, s: _refract(g, a, b, s),
    "FACEFORWARD": lambda g, a, b, c, s: g("ifgreater", 0.0, g("dotproduct", c, b), a, -a),
    "DOT_PRODUCT": lambda g, a, b, c, s: g("dotproduct", a, b),
    "DISTANCE": lambda g, a, b, c, s: g("distance", a, b),
    "LENGTH": lambda g, a, b, c, s: g("magnitude", a),
    "SCALE": lambda g, a, b, c, s: a * s,
    "NORMALIZE": lambda g, a, b, c, s: g("normalize", a),
}


def _math(tree: Any, at: Site) -> Value:
    a, b, c = (tree.input(at, i) for i in range(3))
    value = MATH[at.node.operation](tree.g, a, b, c)
    return value.clamped() if at.node.use_clamp else value


def _vector_math(tree: Any, at: Site) -> Value:
    a, b, c, s = (tree.input(at, i) for i in range(4))
    operation = at.node.operation
    own = operation not in MATH
    return VECTOR_MATH[operation](tree.g, a, b, c, *([s] if own else []))


# ---- colors


def _overlay(g: Graph, a: Value, b: Value) -> Value:
    return g("ifgreater", 0.5, a, a * b * 2.0, 1.0 - (1.0 - a) * (1.0 - b) * 2.0)


def _soft(g: Graph, a: Value, b: Value) -> Value:
    screen = 1.0 - (1.0 - a) * (1.0 - b)
    return (1.0 - a) * a * b + a * screen


def _burn(g: Graph, a: Value, b: Value, t: Value) -> Value:
    """As Blender has it: of 1 - t + t b."""
    s = 1.0 - t + t * b
    return g("ifgreater", s, 0.0, (1.0 - (1.0 - a) / s).clamped(), 0.0)


def _dodge(g: Graph, a: Value, b: Value, t: Value) -> Value:
    s = 1.0 - t * b
    return g("ifequal", a, 0.0, 0.0, g("ifgreater", s, 0.0, g("min", a / s, 1.0), 1.0))


BLEND: dict[str, Operation] = {  # of what lies below and above
    "MIX": lambda g, a, b: b, "DARKEN": lambda g, a, b: g("min", a, b),
    "MULTIPLY": lambda g, a, b: a * b, "LIGHTEN": lambda g, a, b: g("max", a, b),
    "SCREEN": lambda g, a, b: 1.0 - (1.0 - a) * (1.0 - b), "ADD": lambda g, a, b: a + b,
    "OVERLAY": _overlay, "SOFT_LIGHT": _soft, "DIFFERENCE": lambda g, a, b: g("absval", a - b),
    "EXCLUSION": lambda g, a, b: a + b - a * b * 2.0, "SUBTRACT": lambda g, a, b: a - b,
    "DIVIDE": lambda g, a, b: g("ifequal", b, 0.0, a, a / b),
    "HUE": lambda g, a, b: _hsv_of(g, a, b, "baa"),
    "SATURATION": lambda g, a, b: _hsv_of(g, a, b, "aba"),
    "COLOR": lambda g, a, b: _hsv_of(g, a, b, "bba"),
    "VALUE": lambda g, a, b: _hsv_of(g, a, b, "aab"),
}  # fmt: skip


def _hsv_of(g: Graph, a: Value, b: Value, whose: str) -> Value:
    """Return a color with the hue, saturation and value of either; a where hues do not exist."""
    colors = {"a": g("rgbtohsv", a), "b": g("rgbtohsv", b)}
    made = g("hsvtorgb", g("combine3", *(colors[w][i] for i, w in enumerate(whose))))
    asked = {"baa": "b", "bba": "b", "aba": "a"}.get(whose)
    return made if asked is None else g("ifgreater", colors[asked][1], 0.0, made, a)


def _blended(g: Graph, kind: str, a: Value, b: Value, t: Value) -> Value:
    if kind == "LINEAR_LIGHT":
        return a + t * (b * 2.0 - 1.0)
    if kind in ("BURN", "DODGE"):
        return (_burn if kind == "BURN" else _dodge)(g, a, b, t)
    if kind == "OVERLAY":
        low = a * (1.0 - t + t * b * 2.0)
        high = 1.0 - (1.0 - t + t * (1.0 - b) * 2.0) * (1.0 - a)
        return g("ifgreater", 0.5, a, low, high)
    return g("mix", BLEND[kind](g, a, b), a, t)


def _mix(tree: Any, at: Site) -> Value:
    node, g = at.node, tree.g
    if node.type == "MIX_RGB":
        a, b, t = (tree.input(at, i) for i in (1, 2, 0))
        value = _blended(g, node.blend_type, a, b, t.clamped())
        return value.clamped() if node.use_clamp else value
    kind = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.data_type, "Float")
    each = kind == "Vector" and node.factor_mode == "NON_UNIFORM"
    t = tree.input(at, "Factor_Vector" if each else "Factor_Float")
    t = t.clamped() if node.clamp_factor else t
    a, b = (tree.input(at, f"{end}_{kind}") for end in "AB")
    value = _blended(g, node.blend_type, a, b, t) if kind == "Color" else g("mix", b, a, t)
    return value.clamped() if kind == "Color" and node.clamp_result else value


def _ramp(tree: Any, at: Site) -> Value:
    ramp, kind = at.node.color_ramp, at.node.color_ramp.interpolation
    stops = [(stop.position, *stop.color) for stop in ramp.elements]
    plain = ramp.color_mode == "RGB" and kind in ("LINEAR", "CONSTANT", "EASE")
    if not plain:
        axis = np.linspace(0.0, 1.0, TABLE).tolist()
        stops, kind = [(x, *ramp.evaluate(x)) for x in axis], "LINEAR"
    if len(stops) == 1:
        stops *= 2
    how = {"LINEAR": 0, "CONSTANT": 1, "EASE": 2}[kind]
    rows = [list(stop) for stop in stops]
    color = tree.stops(tree.input(at, "Fac"), rows, how)
    return color[3] if at.output == "Alpha" else tree.g("convert", color, channels=3)


def _sampled(mapping: Any, curve: int) -> list[list[float]]:
    mapping.initialize()
    low, high = (mapping.clip_min_x, mapping.clip_max_x) if mapping.use_clip else (0.0, 1.0)
    axis = np.linspace(low, high, TABLE).tolist()
    return [[x, mapping.evaluate(mapping.curves[curve], x)] for x in axis]


def _curves(tree: Any, at: Site) -> Value:
    g, mapping, kind = tree.g, at.node.mapping, at.node.type
    if kind == "CURVE_FLOAT":
        value = tree.input(at, "Value")
        made = tree.stops(value, _sampled(mapping, 0), 0)[0]
        return g("mix", made, value, tree.input(at, "Factor"))
    value = tree.input(at, "Color" if kind == "CURVE_RGB" else "Vector")
    parts = [value[i] for i in range(3)]
    if kind == "CURVE_RGB":
        parts = [tree.stops(part, _sampled(mapping, 3), 0)[0] for part in parts]
    made = g("combine3", *(
        tree.stops(part, _sampled(mapping, i), 0)[0] for i, part in enumerate(parts)
    ))  # fmt: skip
    return g("mix", made, value, tree.input(at, "Fac"))


def _hue_saturation(tree: Any, at: Site) -> Value:
    g, color = tree.g, tree.input(at, "Color")
    hsv = g("rgbtohsv", color)
    hue = g("fract", hsv[0] + tree.input(at, "Hue") + 0.5)
    saturation = (hsv[1] * tree.input(at, "Saturation")).clamped()
    made = g("hsvtorgb", g("combine3", hue, saturation, hsv[2] * tree.input(at, "Value")))
    return g("max", g("mix", made, color, tree.input(at, "Fac")), 0.0)


def _contrast(tree: Any, at: Site) -> Value:
    bright, contrast = (tree.input(at, key) for key in ("Bright", "Contrast"))
    color = tree.input(at, "Color")
    return tree.g("max", color * (contrast + 1.0) + bright - contrast * 0.5, 0.0)


def _invert(tree: Any, at: Site) -> Value:
    color = tree.input(at, "Color")
    return tree.g("mix", 1.0 - color, color, tree.input(at, "Fac"))


def _gamma(tree: Any, at: Site) -> Value:
    g, color = tree.g, tree.input(at, "Color")
    return g("ifgreater", color, 0.0, g("power", color, tree.input(at, "Gamma")), color)


def _hsl(g: Graph, color: Value) -> Value:
    r, b = (g("max", g("max", color[0], color[1]), color[2]), g("rgbtohsv", color))
    low = g("min", g("min", color[0], color[1]), color[2])
    light, spread = (r + low) * 0.5, r - low
    saturation = spread / (1.0 - g("absval", light * 2.0 - 1.0))
    return g("combine3", b[0], g("min", saturation, 1.0), light)


def _from_hsl(g: Graph, hsl: Value) -> Value:
    spread = (1.0 - g("absval", hsl[2] * 2.0 - 1.0)) * hsl[1]
    full = g("hsvtorgb", g("combine3", hsl[0], 1.0, 1.0))
    return (full - 0.5) * spread + hsl[2]


def _mode(node: Any) -> str:
    """Return what a node's three numbers are; those of Blender 4 have no mode."""
    if node.type in ("COMBINE_COLOR", "SEPARATE_COLOR"):
        return str(node.mode)
    return "HSV" if node.type.endswith("HSV") else "RGB"


def _separate(tree: Any, at: Site) -> Value:
    g, mode = tree.g, _mode(at.node)
    value = tree.input(at, 0)
    if mode in ("HSV", "HSL"):
        value = g("rgbtohsv", value) if mode == "HSV" else _hsl(g, value)
    return value[[s.identifier for s in at.node.outputs].index(at.output)]


def _combine(tree: Any, at: Site) -> Value:
    g, mode = tree.g, _mode(at.node)
    value = g("combine3", *(tree.input(at, i) for i in range(3)))
    return {"HSV": lambda v: g("hsvtorgb", v), "HSL": lambda v: _from_hsl(g, v)}.get(
        mode, lambda v: v
    )(value)


def _map_range(tree: Any, at: Site) -> Value:
    node, g = at.node, tree.g
    end = "_FLOAT3" if node.data_type == "FLOAT_VECTOR" else ""
    names = ("From_Min", "From_Max", "To_Min", "To_Max")
    names = tuple(n + end if end else n.replace("_", " ") for n in names)
    value = tree.input(at, "Vector" if end else "Value")
    low, high, to_low, to_high = (tree.input(at, name) for name in names)
    t, kind = (value - low) / (high - low), node.interpolation_type
    if kind == "STEPPED":
        steps = tree.input(at, f"Steps{end}")
        t = g("floor", t * (steps + 1.0)) / steps
    elif kind in ("SMOOTHSTEP", "SMOOTHERSTEP"):
        t = t.clamped()
        six = t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
        t = six if kind == "SMOOTHERSTEP" else t * t * (3.0 - t * 2.0)
    made = to_low + t * (to_high - to_low)
    if node.clamp and kind in ("LINEAR", "STEPPED"):
        made = g("clamp", made, g("min", to_low, to_high), g("max", to_low, to_high))
    return made


def _clamp(tree: Any, at: Site) -> Value:
    g, low, high = tree.g, tree.input(at, "Min"), tree.input(at, "Max")
    if at.node.clamp_type == "RANGE":
        low, high = g("min", low, high), g("max", low, high)
    return g("clamp", tree.input(at, "Value"), low, high)


# ---- vectors


def _mapping(tree: Any, at: Site) -> Value:
    g, kind = tree.g, at.node.vector_type
    v, angles, scale = (tree.input(at, key) for key in ("Vector", "Rotation", "Scale"))
    move = tree.input(at, "Location") if kind in ("POINT", "TEXTURE") else g.value(0.0)
    if kind == "TEXTURE":
        return turned(g, v - move, angles, back=True) / scale
    if kind == "NORMAL":
        return g("normalize", turned(g, v / scale, angles))
    return turned(g, v * scale, angles) + move


def _rotate(tree: Any, at: Site) -> Value:
    g, kind, center = tree.g, at.node.rotation_type, tree.input(at, "Center")
    v = tree.input(at, "Vector") - center
    if kind == "EULER_XYZ":
        return turned(g, v, tree.input(at, "Rotation"), back=at.node.invert) + center
    axis = {"X_AXIS": X, "Y_AXIS": Y, "Z_AXIS": Z}.get(kind) or tree.input(at, "Axis")
    sign = -1.0 if at.node.invert else 1.0
    return g("rotate3d", v, tree.input(at, "Angle") * math.degrees(sign), axis) + center


def _normal(tree: Any, at: Site) -> Value:
    own = tree.g.value(list(at.node.outputs[0].default_value))
    if at.output == "Normal":
        return own
    return tree.g("dotproduct", tree.g("normalize", tree.input(at, 0)), own)


def _coordinates(tree: Any, at: Site) -> Value | None:
    if at.output == "Object" and at.node.object is not None:
        return tree.of_object(at.node.object)
    known = {"UV": "uv", "Generated": "generated", "Object": "object", "Normal": "normal"}
    return tree.attribute(known[at.output]) if at.output in known else None


def _geometry(tree: Any, at: Site) -> Value | None:
    if at.output == "Position":
        return Value(tree.g, "position", 3)
    if at.output in ("Normal", "True Normal"):
        return tree.attribute("world normal")
    return tree.told(at, f"{at.output} of Geometry counts as 0", 0.0)


def _uv_map(tree: Any, at: Site) -> Value:
    return tree.attribute("uv", at.node.uv_map)


def _attribute(tree: Any, at: Site) -> Value | None:
    if at.node.type == "VERTEX_COLOR":
        name = at.node.layer_name
    elif at.node.attribute_type == "GEOMETRY":
        name = at.node.attribute_name
    else:
        return tree.told(at, "attributes of objects count as 0", 0.0)
    if at.output == "Alpha":
        return tree.g.value(1.0)
    value = tree.attribute("attribute", name)
    return (value[0] + value[1] + value[2]) / 3.0 if at.output == "Fac" else value


# ---- patterns


def _offset(seed: float, count: int) -> list[float]:
    """Return where the further channels of a noise begin."""
    keys = [(seed,)] if count == 1 else [(seed, float(i)) for i in range(count)]
    return [100.0 + 100.0 * hashed(*key) for key in keys]


def _place(tree: Any, at: Site, dimensions: str) -> Value:
    """Return what a pattern is made of: a number, a vector, or both."""
    g = tree.g
    if dimensions == "1D":
        return tree.input(at, "W")
    v = tree.vector(at, "generated")
    if dimensions == "2D":
        return g("convert", v, channels=2)
    return g("combine4", v[0], v[1], v[2], tree.input(at, "W")) if dimensions == "4D" else v


def _noise(tree: Any, at: Site) -> Value:
    node, g, count = at.node, tree.g, int(at.node.noise_dimensions[0])
    p = _place(tree, at, node.noise_dimensions) * tree.input(at, "Scale")
    perlin, parts = PERLIN[node.noise_dimensions], []
    bend = tree.input(at, "Distortion")
    if bend.constant() != [0.0]:
        seeds = [_offset(float(i), count) for i in range(count)]
        parts = [g(perlin, p + seed) * bend for seed in seeds]
        p = p + (parts[0] if count == 1 else g(f"combine{count}", *parts))
    seed = float(count)
    places = [p, p + _offset(seed, count), p + _offset(seed + 1.0, count)]
    kind = node.noise_type
    if at.output != "Color":
        return _octaves(tree, at, perlin, kind, p)
    return g("combine3", *(_octaves(tree, at, perlin, kind, place) for place in places))


def _octaves(tree: Any, at: Site, perlin: str, kind: str, p: Value) -> Value:
    """Return octaves of noise (Musgrave 1994; Texturing and Modeling, chapter 16)."""
    g, detail = tree.g, min(max(tree.constant(at, "Detail", 2.0), 0.0), 15.0)
    rough = g("max", tree.input(at, "Roughness"), 0.0)
    lacunarity, whole, rest = tree.input(at, "Lacunarity"), int(detail), detail - int(detail)
    if kind == "FBM":
        return _fbm(g, perlin, p, (detail, rough, lacunarity), normalized=at.node.normalize)
    offset, gain = (tree.input(at, key) for key in ("Offset", "Gain"))
    count = whole + (1 if rest else 0) if kind != "RIDGED_MULTIFRACTAL" else whole
    power, weight = g.value(1.0), g.value(1.0)
    value = g.value(1.0 if kind == "MULTIFRACTAL" else 0.0)
    for i in range(count + 1):
        share, n = (rest if i > whole else 1.0), g(perlin, p)
        if kind == "MULTIFRACTAL":
            value = value * (n * power * share + 1.0)
        elif kind == "HETERO_TERRAIN":
            step = n + offset if i == 0 else (n + offset) * power * value
            value = value + step * share
        elif kind == "HYBRID_MULTIFRACTAL":
            weight = g("ifgreater", weight, 1e-3, g("min", weight, 1.0), 0.0)  # 0: it ends there
            signal = (n + offset) * power
            value = value + weight * signal * share
            weight = weight * gain * signal
        else:
            signal = offset - g("absval", n)
            signal = signal * signal * (weight if i else 1.0)
            value = value + signal * (power if i else 1.0)
            weight = (signal * gain).clamped()
        power, p = power * rough, p * lacunarity
    return value


def _fbm(
    g: Graph, perlin: str, p: Value, settings: tuple[float, Any, Any], *, normalized: bool
) -> Value:
    """Return octaves of noise, each less strong by `rough`; a part of the last one."""
    detail, rough, lacunarity = settings
    whole, rest = int(detail), detail - int(detail)
    rough = g.value(rough)

    def octaves(count: int) -> Value:
        if perlin in ("noise2d", "noise3d"):
            place = {"noise2d": "texcoord", "noise3d": "position"}[perlin]
            inputs = {place: p, "lacunarity": lacunarity, "diminish": rough}
            value = g(perlin.replace("noise", "fractal"), octaves=float(count), **inputs)
        else:
            value, power, at = g.value(0.0), g.value(1.0), p
            for _ in range(count):
                value = value + g(perlin, at) * power
                power, at = power * rough, at * lacunarity
        total, power = g.value(0.0), g.value(1.0)
        for _ in range(count):
            total, power = total + power, power * rough
        return value / total * 0.5 + 0.5 if normalized else value

    low = octaves(whole + 1)
    return g("mix", octaves(whole + 2), low, rest) if rest else low


def _voronoi(tree: Any, at: Site) -> Value | None:
    node, g = at.node, tree.g
    if node.voronoi_dimensions in ("1D", "4D"):
        return tree.told(at, "Voronoi Texture of one or four dimensions is grey", 0.5)
    if bpy.app.version < (5, 0):
        tree.tell("Voronoi Texture has the cells of Blender 5, which lie elsewhere")
    feature = ("F1", "F2", "SMOOTH_F1", "DISTANCE_TO_EDGE", "N_SPHERE_RADIUS").index(node.feature)
    smoothness = (tree.input(at, "Smoothness") * 0.5) if feature == 2 else g.value(0.25)
    settings = {
        "randomness": tree.input(at, "Randomness").clamped(), "feature": feature,
        "smoothness": g("clamp", smoothness, 0.0, 0.5), "exponent": tree.input(at, "Exponent"),
        "metric": ("EUCLIDEAN", "MANHATTAN", "CHEBYCHEV", "MINKOWSKI").index(node.distance)
        if feature < 3 else 0, "output": ("Distance", "Color", "Position").index(
            at.output if at.output != "Radius" else "Distance"),
    }  # fmt: skip
    flat = node.voronoi_dimensions == "2D"
    scale = tree.input(at, "Scale")
    p = _place(tree, at, node.voronoi_dimensions) * scale

    def octave(factor: Any) -> Value:
        place = {"texcoord" if flat else "position": p * factor}
        found = g("voronoi2d" if flat else "voronoi3d", **place, **settings)
        return found[0] if settings["output"] == 0 else found

    value = _cells(tree, at, octave, settings) if feature < 4 else octave(1.0)
    return value / scale if at.output == "Position" else value


def _cells(tree: Any, at: Site, octave: Callable[[Any], Value], settings: Any) -> Value:
    """Return octaves of Voronoi's cells: sums, and of distances to edges the least."""
    node, g, output = at.node, tree.g, settings["output"]
    detail = min(max(tree.constant(at, "Detail", 0.0), 0.0), 15.0)
    rough, lacunarity = tree.input(at, "Roughness").clamped(), tree.input(at, "Lacunarity")
    edge, single = settings["feature"] == 3, detail == 0.0 or rough.constant() == [0.0]
    reach = settings["randomness"] * 0.5 + 0.5
    most = g.value(0.0)
    value, amplitude, scale = g.value(8.0 if edge else 0.0), g.value(1.0), g.value(1.0)
    for i in range(1 if single else math.ceil(detail) + 1):
        share = 1.0 if i <= detail else detail - int(detail)
        found = octave(scale)
        if single:
            value, most = found, reach if edge else g.value(1.0)
        elif edge:
            value = g(
                "mix", g("mix", g("min", value, found / scale), value, amplitude), value, share
            )
            most = g("mix", g("mix", reach / scale, most, amplitude), most, share)
        elif output == 2:
            value = g("mix", found / scale, value, amplitude * share)
        else:
            value, most = value + found * amplitude * share, most + amplitude * share
        amplitude, scale = amplitude * rough, scale * lacunarity
    if not node.normalize or output == 2:
        return value
    if output == 1 or edge:
        return value / most
    metric, corner = node.distance, reach * (2.0 if settings["feature"] == 1 else 1.0)
    count = 2.0 if node.voronoi_dimensions == "2D" else 3.0
    far = {"EUCLIDEAN": count**0.5, "MANHATTAN": count, "CHEBYCHEV": 1.0}.get(metric)
    far = g("power", count, 1.0 / settings["exponent"]) if far is None else far
    return value / (most * corner * far)


def _waves(tree: Any, at: Site) -> Value:
    node, g = at.node, tree.g
    p = (tree.vector(at, "generated") * tree.input(at, "Scale") + 1e-6) * 0.999999
    bands = node.wave_type == "BANDS"
    way = node.bands_direction if bands else node.rings_direction
    if bands:
        n = (p[0] + p[1] + p[2]) * 10.0 if way == "DIAGONAL" else p["XYZ".index(way)] * 20.0
    else:
        n = g("magnitude", p * [float(way != axis) for axis in "XYZ"]) * 20.0
    n = n + tree.input(at, "Phase Offset")
    bend = tree.input(at, "Distortion")
    if bend.constant() != [0.0]:
        detail = min(max(tree.constant(at, "Detail", 2.0), 0.0), 15.0)
        rough = tree.input(at, "Detail Roughness").clamped()
        q = p * tree.input(at, "Detail Scale")
        n = n + bend * (_fbm(g, "noise3d", q, (detail, rough, 2.0), normalized=True) * 2.0 - 1.0)
    if node.wave_profile == "SIN":
        return g("sin", n - 0.5 * math.pi) * 0.5 + 0.5
    n = n / TURN
    return g("fract", n) if node.wave_profile == "SAW" else g("absval", n - g("round", n)) * 2.0


def _checker(tree: Any, at: Site) -> Value:
    g = tree.g
    p = (tree.vector(at, "generated") * tree.input(at, "Scale") + 1e-6) * 0.999999
    cell = g("floor", p)
    odd = g("modulo", cell[0] + cell[1] + cell[2], 2.0)
    return odd if at.output == "Fac" else g("mix", *(tree.input(at, c) for c in (
        "Color1", "Color2")), odd)  # fmt: skip


def _bricks(tree: Any, at: Site) -> Value:
    node, g = at.node, tree.g
    p = tree.vector(at, "generated") * tree.input(at, "Scale")
    pairs = {
        "size": ("Brick Width", "Row Height"), "mortar": ("Mortar Size", "Mortar Smooth"),
    }  # fmt: skip
    inputs = {key: g("combine2", *map(tree.inputs(at), names)) for key, names in pairs.items()}
    off = node.offset_frequency == 0 or node.squash_frequency == 0
    inputs["offset"] = g.value([0.0 if off else node.offset, max(node.offset_frequency, 1)])
    inputs["squash"] = g.value([1.0 if off else node.squash, max(node.squash_frequency, 1)])
    flat = g("convert", p, channels=2)
    found = g("brick", texcoord=flat, bias=tree.input(at, "Bias"), **inputs)
    if at.output == "Fac":
        return found[1]
    first, second, mortar = (tree.input(at, c) for c in ("Color1", "Color2", "Mortar"))
    return g("mix", mortar, g("mix", second, first, found[0]), found[1])


def _gradient(tree: Any, at: Site) -> Value:
    g, p, kind = tree.g, tree.vector(at, "generated"), at.node.gradient_type
    ball = g("max", 0.999999 - g("magnitude", p), 0.0)
    r, eased = g("max", p[0], 0.0), p[0].clamped()
    return {
        "LINEAR": lambda: p[0], "QUADRATIC": lambda: r * r, "DIAGONAL": lambda: (p[0] + p[1]) * 0.5,
        "EASING": lambda: eased * eased * (3.0 - eased * 2.0),
        "RADIAL": lambda: g("atan2", p[1], p[0]) / TURN + 0.5,
        "QUADRATIC_SPHERE": lambda: ball * ball, "SPHERICAL": lambda: ball,
    }[kind]().clamped()  # fmt: skip


MAGIC = (  # which of x, y, z, its function and sign, and the signs within
    ("y", "cos", -1, (1, -1, 1)), ("x", "cos", 1, (1, -1, -1)), ("z", "sin", 1, (-1, -1, -1)),
    ("x", "cos", -1, (-1, 1, -1)), ("y", "sin", -1, (-1, 1, 1)), ("y", "cos", -1, (-1, 1, 1)),
    ("x", "cos", 1, (1, 1, 1)), ("z", "sin", 1, (1, 1, -1)), ("x", "cos", -1, (-1, -1, 1)),
    ("y", "sin", -1, (1, -1, 1)),
)  # fmt: skip


def _magic(tree: Any, at: Site) -> Value:
    g, bend = tree.g, tree.input(at, "Distortion")
    p = tree.vector(at, "generated") * tree.input(at, "Scale")
    p = g("combine3", *(g("modulo", p[i], TURN) for i in range(3)))
    v = {
        "x": g("sin", (p[0] + p[1] + p[2]) * 5.0), "y": g("cos", (p[1] - p[0] - p[2]) * 5.0),
        "z": -g("cos", (p[2] - p[0] - p[1]) * 5.0),
    }  # fmt: skip
    for i, (axis, function, sign, signs) in enumerate(MAGIC[: at.node.turbulence_depth]):
        v = {key: value * bend for key, value in v.items()} if i == 0 else v
        inner = v["x"] * signs[0] + v["y"] * signs[1] + v["z"] * signs[2]
        v[axis] = g(function, inner) * bend * float(sign)
    double = g("ifequal", bend, 0.0, 1.0, bend * 2.0)
    color = g("combine3", *(0.5 - value / double for value in v.values()))
    return (color[0] + color[1] + color[2]) / 3.0 if at.output == "Fac" else color


def _white(tree: Any, at: Site) -> Value:
    kind = at.node.noise_dimensions
    p = _place(tree, at, kind)
    found = tree.g("whitenoise", p, dimensions=int(kind[0]))
    return found[0] if at.output == "Value" else found


# ---- images and what is known of a surface


def _image(tree: Any, at: Site) -> Value:
    node, alpha = at.node, at.output == "Alpha"
    bitmap = None if node.image is None else tree.image(node)
    if bitmap is None:
        return tree.g.value(1.0) if alpha else tree.g.value([1.0, 0.0, 1.0])
    wraps = {"REPEAT": "repeat", "EXTEND": "clamp", "CLIP": "zero", "MIRROR": "mirror"}
    nearest = {"filter": "nearest"} if node.interpolation == "Closest" else {}
    bitmap |= {"wrap": wraps[node.extension], **({"channel": "a"} if alpha else {}), **nearest}
    width, matrix = 1 if alpha else 3, _affine(at)
    if node.projection != "FLAT":
        tree.tell(f"{node.projection.title()} projection of an image is read as flat")
    if matrix is None:
        return tree.g.look(bitmap, width, tree.vector(at, "uv"))
    placed = {} if np.array_equal(matrix, np.eye(3)) else {"to_uv": matrix.tolist()}
    return tree.g.look({**bitmap, **placed}, width)


def _environment(tree: Any, at: Site) -> Value:
    g, node = tree.g, at.node
    bitmap = None if node.image is None else tree.image(node)
    if bitmap is None:
        return g.value([1.0, 0.0, 1.0])
    v = tree.vector(at, "generated")
    if node.projection != "EQUIRECTANGULAR":
        tree.tell("Mirror Ball of an image is read as equirectangular")
    flat = g("magnitude", g("combine2", v[0], v[1]))
    along, up = 0.5 - g("atan2", v[1], v[0]) / TURN, g("atan2", v[2], flat) / math.pi + 0.5
    return g.look({**bitmap, "wrap": "repeat"}, 3, g("combine2", along, up))


def _affine(at: Site) -> np.ndarray | None:
    """Return how Mapping nodes of numbers place the first uv; None for other coordinates."""
    matrix, groups, socket = np.eye(3), at.groups, at.node.inputs["Vector"]
    while socket.is_linked:
        site, _ = origin(groups, socket)
        if site is None:
            return None
        node, groups = site.node, site.groups
        if node.type == "TEX_COORD" and site.output == "UV":
            return matrix
        plain = node.type == "MAPPING" and node.vector_type == "POINT"
        if not plain or any(s.is_linked for s in node.inputs if s.name != "Vector"):
            return None
        move, angles, scale = (
            list(node.inputs[key].default_value) for key in ("Location", "Rotation", "Scale")
        )
        if angles[0] or angles[1]:
            return None
        cosine, sine = math.cos(angles[2]), math.sin(angles[2])
        step = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        step = step @ np.diag([scale[0], scale[1], 1.0])
        step[:2, 2] = move[:2]
        matrix, socket = matrix @ step, node.inputs["Vector"]
    return matrix


def _constant(tree: Any, at: Site) -> Value:
    value = at.node.outputs[0].default_value
    return tree.g.value(value if isinstance(value, float) else list(value)[:3])


def _light_path(tree: Any, at: Site) -> Value:
    of_camera = tree.tree.surface and at.output in ("Is Camera Ray", "Is Singular Ray")
    kind = "a ray from the camera" if tree.tree.surface else "light, also for the camera"
    return tree.told(at, f"Light Path is that of {kind}", float(of_camera))


def _fresnel(tree: Any, at: Site) -> Value:
    """The mean over directions: a graph does not know where it is seen from."""
    layer, cosine = at.node.type == "LAYER_WEIGHT", (np.arange(256) + 0.5) / 256
    blend = tree.constant(at, "Blend" if layer else "IOR", 0.5 if layer else 1.5)
    if layer and at.output == "Facing":
        b = min(max(blend, 0.0), 1.0 - 1e-5)
        share = cosine ** (2.0 * b if b < 0.5 else 0.5 / (1.0 - b))
        mean = 1.0 - (2.0 * cosine * share).mean()
    else:
        eta = 1.0 / max(1.0 - blend, 1e-5) if layer else max(blend, 1.0 + 1e-5)
        g = np.sqrt(eta * eta - 1.0 + cosine**2)
        a, b = (g - cosine) / (g + cosine), (cosine * (g + cosine) - 1.0)
        parts = 0.5 * a * a * (1.0 + (b / (cosine * (g - cosine) + 1.0)) ** 2)
        mean = (2.0 * cosine * parts).mean()
    return tree.told(at, f"{at.node.bl_label} is its mean over directions", float(mean))


def _object_info(tree: Any, at: Site) -> Value:
    source, tree.tree.personal = tree.object, True
    if source is None:
        return tree.g.value(0.0)
    return tree.g.value({
        "Location": lambda: list(source.matrix_world.translation),
        "Color": lambda: list(source.color)[:3], "Alpha": lambda: source.color[3],
        "Object Index": lambda: source.pass_index, "Random": lambda: tree.random,
        "Material Index": lambda: 0.0,
    }[at.output]())  # fmt: skip


def _hair(tree: Any, at: Site) -> Value:
    known = {"Is Strand": 1.0, "Length": 1.0, "Thickness": 0.001}
    if at.output == "Intercept":
        return tree.g("extract", Value(tree.g, "texcoord", 2), index=1)
    return tree.told(at, f"{at.output} of Curves Info is one number", known.get(at.output, 0.5))


def _planck(kelvin: float) -> list[float]:
    """Return the linear Rec. 709 of a black body, of luminance 1."""
    nm = np.arange(380.0, 781.0, 5.0)
    return _rgb(nm, 1.0 / (nm**5 * np.expm1(1.4387769e7 / (nm * max(kelvin, 200.0)))))


def observer(nm: np.ndarray) -> np.ndarray:
    """Return how the eye sees wavelengths (3, n): Wyman, Sloan and Shirley 2013."""

    def lobe(size: float, peak: float, low: float, high: float) -> np.ndarray:
        return size * np.exp(-0.5 * ((nm - peak) / np.where(nm < peak, low, high)) ** 2)

    x = lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7)
    x += lobe(-0.065, 501.1, 20.4, 26.2)
    y = lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1)
    z = lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8)
    return np.array([x, y, z])


def _rgb(nm: np.ndarray, power: np.ndarray) -> list[float]:
    """Return the linear Rec. 709 of a spectrum, of luminance 1."""
    xyz = observer(nm) @ power
    to_rgb = [[3.2404542, -1.5371385, -0.4985314], [-0.969266, 1.8760108, 0.041556],
              [0.0556434, -0.2040259, 1.0572252]]  # fmt: skip
    return (np.array(to_rgb) @ (xyz / xyz[1])).tolist()


def _blackbody(tree: Any, at: Site) -> Value:
    kelvin = tree.input(at, "Temperature")
    if kelvin.constant() is not None:
        return tree.g.value(np.maximum(_planck(kelvin.ref[0]), 0.0).tolist())
    rows = [[k, *np.maximum(_planck(k), 0.0).tolist()] for k in np.geomspace(800.0, 12000.0, 64)]
    return tree.g("convert", tree.stops(kelvin, rows, 0), channels=3)


def _wavelength(tree: Any, at: Site) -> Value:
    def color(nm: float) -> list[float]:
        one = np.array([nm])
        bright = 1.0 / 2.52 * np.exp(-0.5 * ((nm - 560.0) / 45.0) ** 2)
        return np.maximum(np.array(_rgb(one, np.ones(1))) * bright, 0.0).tolist()

    rows = [[nm, *color(nm)] for nm in np.arange(390.0, 731.0, 4.0).tolist()]
    return tree.g("convert", tree.stops(tree.input(at, 0), rows, 0), channels=3)


def _table(tree: Any, at: Site) -> Value:
    """The intensities of an IES file by direction: a lamp gets them, as a factor."""
    node, tables = at.node, tree.tree.tables
    if tables is None:
        return tree.told(at, "IES Texture counts as 1", 1.0)
    if node.inputs["Vector"].is_linked:
        tree.tell("Vector of an IES Texture is left out")
    text = node.ies.as_string() if node.mode == "INTERNAL" and node.ies is not None else ""
    path = bpy.path.abspath(node.filepath)
    if not text and not os.path.isfile(path):
        return tree.told(at, f"the IES file {path!r} is missing: it counts as 1", 1.0)
    tables.append(text or path)
    return tree.input(at, "Strength")


def _passed(key: int, text: str) -> Read:
    """Return a function that hands on an input, and tells why."""

    def read(tree: Any, at: Site) -> Value:
        tree.tell(text)
        return tree.input(at, key)

    return read


def _zero(text: str, value: float = 0.0) -> Read:
    return lambda tree, at: tree.told(at, text, value)


TEXTURES: dict[str, Read] = {
    "ATTRIBUTE": _attribute, "BLACKBODY": _blackbody, "BRIGHTCONTRAST": _contrast, "CLAMP": _clamp,
    "COMBINE_COLOR": _combine, "COMBXYZ": _combine, "COMBRGB": _combine,
    "COMBHSV": _combine, "CURVE_FLOAT": _curves, "CURVE_RGB": _curves,
    "CURVE_VEC": _curves, "GAMMA": _gamma, "HAIR_INFO": _hair, "HUE_SAT": _hue_saturation,
    "INVERT": _invert, "MAPPING": _mapping, "MAP_RANGE": _map_range, "MATH": _math, "MIX": _mix,
    "MIX_RGB": _mix, "NEW_GEOMETRY": _geometry, "NORMAL": _normal, "OBJECT_INFO": _object_info,
    "RGB": _constant, "RGBTOBW": lambda tree, at: tree.g.gray(tree.input(at, 0)),
    "SEPARATE_COLOR": _separate, "SEPXYZ": _separate, "SEPRGB": _separate, "SEPHSV": _separate,
    "TEX_BRICK": _bricks,
    "TEX_CHECKER": _checker, "TEX_COORD": _coordinates, "TEX_ENVIRONMENT": _environment,
    "TEX_GRADIENT": _gradient,
    "TEX_IMAGE": _image, "TEX_MAGIC": _magic, "TEX_NOISE": _noise, "TEX_VORONOI": _voronoi,
    "TEX_WAVE": _waves, "TEX_WHITE_NOISE": _white, "UVMAP": _uv_map, "VALTORGB": _ramp,
    "VALUE": _constant, "VECTOR_ROTATE": _rotate, "VECT_MATH": _vector_math,
    "VERTEX_COLOR": _attribute, "WAVELENGTH": _wavelength,
    "FRESNEL": _fresnel, "LAYER_WEIGHT": _fresnel, "LIGHT_PATH": _light_path,
    "AMBIENT_OCCLUSION": _passed(0, "Ambient Occlusion is read as open everywhere"),
    "VECT_TRANSFORM": _passed(0, "Vector Transform is left out"),
    "BEVEL": _zero("Bevel is left out"), "CAMERA": _zero("Camera Data counts as 0"),
    "PARTICLE_INFO": _zero("Particle Info counts as 0"),
    "POINT_INFO": _zero("Point Info counts as 0"), "TANGENT": _zero("Tangent is left out"),
    "VOLUME_INFO": _zero("Volume Info counts as 1", 1.0),
    "WIREFRAME": _zero("Wireframe counts as 0"),
    "UVALONGSTROKE": _zero("UV Along Stroke is of Freestyle alone"),
    "LIGHT_FALLOFF": _passed(0, "Light Falloff is quadratic"),
    "SHADERTORGB": _zero("Shader to RGB is of EEVEE alone", 0.5),
    "SCRIPT": _zero("Open Shading Language is not read", 0.5),
    "TEX_IES": _table,
    "TEX_SKY": _zero("Sky Texture beside others is grey", 0.3),
    "TEX_POINTDENSITY": _zero("Point Density counts as 0"),
    "TEX_GABOR": _zero("Gabor Texture is grey", 0.5),
}  # fmt: skip
