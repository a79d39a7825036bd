# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of Cycles that compute numbers, colors and vectors, as nodes of clpt's graphs.

A function takes the tree that is read (a `nodes.Expression`, whose `graph` is called g) and a site,
and returns the value of the site's output.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from .graphs import Graph, Site, Value, turned

SAMPLES = 256  # of curves and of ramps that are not linear, as Cycles has
X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


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


def _burn(g: Graph, a: Value, b: Value, t: Value) -> Value:
    """As Blender has it: of 1 - t + t b."""
    s = 1.0 - t + t * b
    return g("ifgreater", s, 0.0, (1.0 - (1.0 - a) / s).clamped(), 0.0)


def _dodge(g: Graph, a: Value, b: Value, t: Value) -> Value:
    s = 1.0 - t * b
    return g("ifequal", a, 0.0, 0.0, g("ifgreater", s, 0.0, g("min", a / s, 1.0), 1.0))


def _overlay(g: Graph, a: Value, b: Value, t: Value) -> Value:
    low, high = 1.0 - t + t * b * 2.0, 1.0 - t + t * (1.0 - b) * 2.0
    return g("ifgreater", 0.5, a, a * low, 1.0 - high * (1.0 - a))


BLEND: dict[str, Operation] = {  # of what lies below and above, before they are mixed
    "MIX": lambda g, a, b: b, "DARKEN": lambda g, a, b: g("min", a, b),
    "MULTIPLY": lambda g, a, b: a * b, "LIGHTEN": lambda g, a, b: g("max", a, b),
    "SCREEN": lambda g, a, b: 1.0 - (1.0 - a) * (1.0 - b), "ADD": lambda g, a, b: a + b,
    "DIFFERENCE": lambda g, a, b: g("absval", a - b), "SUBTRACT": lambda g, a, b: a - b,
    "SOFT_LIGHT": lambda g, a, b: (1.0 - a) * a * b + a * (1.0 - (1.0 - a) * (1.0 - b)),
    "EXCLUSION": lambda g, a, b: a + b - a * b * 2.0,
    "DIVIDE": lambda g, a, b: g("ifequal", b, 0.0, a, a / b),
    "HUE": lambda g, a, b: _hsv_of(g, a, b, "baa"),
    "SATURATION": lambda g, a, b: _hsv_of(g, a, b, "aba"),
    "COLOR": lambda g, a, b: _hsv_of(g, a, b, "bba"),
    "VALUE": lambda g, a, b: _hsv_of(g, a, b, "aab"),
}  # fmt: skip
MIXED: dict[str, Operation] = {  # and of the share of what lies above
    "BURN": _burn, "DODGE": _dodge, "OVERLAY": _overlay,
    "LINEAR_LIGHT": lambda g, a, b, t: a + t * (b * 2.0 - 1.0),
}  # fmt: skip


def _hsv_of(g: Graph, a: Value, b: Value, whose: str) -> Value:
    """Return a color with the hue, saturation and value of either; a where hues do not exist."""
    colors = {"a": g("rgbtohsv", a), "b": g("rgbtohsv", b)}
    made = g("hsvtorgb", g("combine3", *(colors[w][i] for i, w in enumerate(whose))))
    asked = {"baa": "b", "bba": "b", "aba": "a"}.get(whose)
    return made if asked is None else g("ifgreater", colors[asked][1], 0.0, made, a)


def _blended(g: Graph, kind: str, a: Value, b: Value, t: Value) -> Value:
    if kind in MIXED:
        return MIXED[kind](g, a, b, t)
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
        axis = np.linspace(0.0, 1.0, SAMPLES).tolist()
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
    axis = np.linspace(low, high, SAMPLES).tolist()
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


# of colors, to three numbers and back; nodes of Blender 4 have no mode, and its name in their type
SPACES: dict[str, tuple[Operation, Operation]] = {
    "HSV": (lambda g, color: g("rgbtohsv", color), lambda g, hsv: g("hsvtorgb", hsv)),
    "HSL": (_hsl, _from_hsl),
    **dict.fromkeys(("RGB", "XYZ"), (lambda g, color: color, lambda g, color: color)),
}  # fmt: skip


def _space(node: Any) -> tuple[Operation, Operation]:
    return SPACES[str(node.mode) if node.type.endswith("COLOR") else node.type[-3:]]


def _separate(tree: Any, at: Site) -> Value:
    value = _space(at.node)[0](tree.g, tree.input(at, 0))
    return value[[s.identifier for s in at.node.outputs].index(at.output)]


def _combine(tree: Any, at: Site) -> Value:
    parts = tree.g("combine3", *(tree.input(at, i) for i in range(3)))
    return _space(at.node)[1](tree.g, parts)


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


def _of(keys: str, compute: Operation) -> Callable[[Any, Site], Value]:
    """Return a function that computes a node of its inputs, whose names are in `keys`."""
    names = keys.split(" ")
    return lambda tree, at: compute(tree.g, *(tree.input(at, name) for name in names))


def _adjusted(
    g: Graph, color: Value, hue: Value, saturation: Value, value: Value, t: Value
) -> Value:
    hsv = g("rgbtohsv", color)
    parts = g("fract", hsv[0] + hue + 0.5), (hsv[1] * saturation).clamped(), hsv[2] * value
    return g("max", g("mix", g("hsvtorgb", g("combine3", *parts)), color, t), 0.0)


def _clamp(tree: Any, at: Site) -> Value:
    g, low, high = tree.g, tree.input(at, "Min"), tree.input(at, "Max")
    if at.node.clamp_type == "RANGE":
        low, high = g("min", low, high), g("max", low, high)
    return g("clamp", tree.input(at, "Value"), low, high)


READ: dict[str, Callable[[Any, Site], Value | None]] = {
    "MATH": _math, "VECT_MATH": _vector_math, "MIX": _mix, "MIX_RGB": _mix, "VALTORGB": _ramp,
    "CURVE_FLOAT": _curves, "CURVE_RGB": _curves, "CURVE_VEC": _curves, "MAP_RANGE": _map_range,
    "CLAMP": _clamp, "MAPPING": _mapping, "VECTOR_ROTATE": _rotate, "NORMAL": _normal,
    **{f"SEP{name}": _separate for name in ("ARATE_COLOR", "XYZ", "RGB", "HSV")},
    **{f"COMB{name}": _combine for name in ("INE_COLOR", "XYZ", "RGB", "HSV")},
    "RGBTOBW": lambda tree, at: tree.g.gray(tree.input(at, 0)),
    "HUE_SAT": _of("Color Hue Saturation Value Fac", _adjusted),
    "INVERT": _of("Color Fac", lambda g, color, t: g("mix", 1.0 - color, color, t)),
    "GAMMA": _of("Color Gamma", lambda g, color, gamma: g(
        "ifgreater", color, 0.0, g("power", color, gamma), color)),
    "BRIGHTCONTRAST": _of("Color Bright Contrast", lambda g, color, bright, contrast: g(
        "max", color * (contrast + 1.0) + bright - contrast * 0.5, 0.0)),
}  # fmt: skip
