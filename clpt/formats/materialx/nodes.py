"""The functions of nodes of MaterialX's standard library, on arrays (..., channels) float64."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from clpt.arrays import Floats
from clpt.formats.materialx import noise
from clpt.formats.materialx.graph import (
    WRAPS,
    Domain,
    Evaluate,
    Graph,
    Leaf,
    LeftOut,
    Node,
    numbers,
    pixels_of,
    sampled,
    width,
)

LUMINANCE = (0.2722287, 0.6740818, 0.0536895)  # the specification's: of ACEScg


def _of(function: Callable[..., Floats], **inputs: object) -> Evaluate:
    """Return a node that computes a function of its inputs, which have these defaults."""

    def evaluate(graph: Graph, node: Node, output: str, domain: Domain) -> Floats:
        values = (graph.evaluated(node, name, default, domain) for name, default in inputs.items())
        return function(*values)

    return evaluate


def _safe(a: Floats, b: Floats) -> Floats:
    return np.where(b == 0.0, 0.0, a / np.where(b == 0.0, 1.0, b))


def _power(a: Floats, b: Floats) -> Floats:
    with np.errstate(all="ignore"):
        return np.nan_to_num(np.power(a, b), nan=0.0, posinf=0.0, neginf=0.0)


def _mix(fg: Floats, bg: Floats, amount: Floats) -> Floats:
    return bg + (fg - bg) * amount


def _remap(x: Floats, inlow: Floats, inhigh: Floats, low: Floats, high: Floats) -> Floats:
    return low + _safe(x - inlow, inhigh - inlow) * (high - low)


def _smoothstep(x: Floats, low: Floats, high: Floats) -> Floats:
    t = np.clip(_safe(x - low, high - low), 0.0, 1.0)
    return np.where(x >= high, 1.0, t * t * (3.0 - 2.0 * t))


def _chosen(compare: Callable[[Floats, Floats], Any]) -> Evaluate:
    def choose(value1: Floats, value2: Floats, in1: Floats, in2: Floats) -> Floats:
        return np.where(compare(value1, value2), in1, in2)

    return _of(choose, value1=1.0, value2=0.0, in1=0.0, in2=0.0)


def _dot(a: Floats, b: Floats) -> Floats:
    return (a * b).sum(axis=-1, keepdims=True)


def _normalized(a: Floats) -> Floats:
    return _safe(a, np.linalg.norm(a, axis=-1, keepdims=True))


def _luminance(color: Floats, weights: Floats) -> Floats:
    grey = _dot(color[..., :3], weights)
    return np.concatenate([np.repeat(grey, 3, axis=-1), color[..., 3:]], axis=-1)


def _rgb_to_hsv(color: Floats) -> Floats:
    most, least = color[..., :3].max(axis=-1), color[..., :3].min(axis=-1)
    spread = most - least
    r, g, b = (_safe(color[..., i] - least, spread) for i in range(3))
    other = np.where(color[..., 1] >= most, 2.0 + b - r, 4.0 + r - g)
    hue = np.where(color[..., 0] >= most, g - b, other)
    hue = np.where(spread > 0.0, (hue / 6.0) % 1.0, 0.0)
    hsv = np.stack([hue, _safe(spread, most), most], axis=-1)
    return np.concatenate([hsv, color[..., 3:]], axis=-1)


def _hsv_to_rgb(hsv: Floats) -> Floats:
    h, s, v = (hsv[..., i : i + 1] for i in range(3))
    k = (np.array([5.0, 3.0, 1.0]) + h * 6.0) % 6.0
    rgb = v - v * s * np.clip(np.minimum(k, 4.0 - k), 0.0, 1.0)
    return np.concatenate([rgb, hsv[..., 3:]], axis=-1)


def _dodge(fg: Floats, bg: Floats, amount: Floats) -> Floats:
    return _mix(_safe(bg, 1.0 - fg), bg, amount)


def _burn(fg: Floats, bg: Floats, amount: Floats) -> Floats:
    return _mix(np.where(fg == 0.0, 0.0, 1.0 - _safe(1.0 - bg, fg)), bg, amount)


def _blend(function: Callable[[Floats, Floats], Floats]) -> Evaluate:
    """Return a blend of a foreground and a background, by an amount."""

    def blended(fg: Floats, bg: Floats, amount: Floats) -> Floats:
        return _mix(function(fg, bg), bg, amount)

    return _of(blended, fg=0.0, bg=0.0, mix=1.0)


def _over(fg: Floats, bg: Floats, amount: Floats) -> Floats:
    return _mix(fg + bg * (1.0 - fg[..., 3:]), bg, amount)


def _rotated(x: Floats, amount: Floats) -> Floats:
    turn = np.radians(amount[..., 0])
    s, c = np.sin(turn), np.cos(turn)
    return np.stack([c * x[..., 0] + s * x[..., 1], c * x[..., 1] - s * x[..., 0]], axis=-1)


def _rotated3(x: Floats, amount: Floats, axis: Floats) -> Floats:
    """Rodrigues' formula."""
    turn, axis = np.radians(amount), _normalized(axis)
    x, axis = np.broadcast_arrays(x, axis)
    s, c = np.sin(turn), np.cos(turn)
    return x * c + np.cross(axis, x) * s + axis * _dot(axis, x) * (1.0 - c)


def _combined(graph: Graph, node: Node, output: str, domain: Domain) -> Floats:
    names = ("in1", "in2", "in3", "in4")[: int(node.kind.split("combine")[1][0])]
    given = [graph.evaluated(node, name, 0.0, domain) for name in names]
    return _joined(given)


def _joined(given: list[Floats]) -> Floats:
    """Return values of several widths side by side."""
    places = np.broadcast_shapes(*(value.shape[:-1] for value in given))
    wide = [np.broadcast_to(value, (*places, value.shape[-1])) for value in given]
    return np.concatenate(wide, axis=-1)


def _extracted(graph: Graph, node: Node, output: str, domain: Domain) -> Floats:
    value = graph.evaluated(node, "in", 0.0, domain)
    at = int(numbers(node.value("index", 0))[0])
    return value[..., at : at + 1]


def _separated(graph: Graph, node: Node, output: str, domain: Domain) -> Floats:
    value = graph.evaluated(node, "in", (0.0,) * 4, domain)
    at = max("xyzw".find(output[-1]), "rgba".find(output[-1]))
    return value[..., at : at + 1]


def _converted(graph: Graph, node: Node, output: str, domain: Domain) -> Floats:
    value = graph.evaluated(node, "in", 0.0, domain)
    wanted = width(node.kind) or value.shape[-1]
    if value.shape[-1] == 1 and wanted > 1:
        grey = np.repeat(value, min(wanted, 3), axis=-1)
        return _joined([grey, np.ones(1)]) if wanted == 4 else grey
    if wanted == 4 and value.shape[-1] == 3:
        return _joined([value, np.ones(1)])
    return value[..., :wanted]


def _texcoord(graph: Graph, node: Node, output: str, domain: Domain) -> Floats:
    """A set of texture coordinates, by number or by the name of a property."""
    name = node.value("geomprop", None)
    number = 0 if node.value("index") is None else int(numbers(node.value("index"))[0])
    if name is not None and not node.kind.endswith("vector2"):
        raise LeftOut(f"the property {name!r} within a graph is not read")
    domain.sets.append(str(name) if name is not None else ("", "uv1")[min(number, 1)])
    domain.patterns = True
    return domain.uv


def _image(graph: Graph, node: Node, output: str, domain: Domain) -> Floats:
    stored = graph.stored(node)
    default = node.value("default", None)
    count = width(node.kind) or 3
    if stored is None:
        return numbers((0.0,) * count if default is None else default)
    patterns = domain.patterns
    uv = np.asarray(domain.uv)
    if node.source("texcoord") is not None:
        uv = graph.evaluated(node, "texcoord", None, domain)
    else:
        domain.sets.append("")
    domain.patterns = patterns
    space = node.color_space("file") if "_color" in node.kind else "raw"
    pixels = pixels_of(stored, space)
    names = [str(node.value(f"{axis}addressmode", "periodic")) for axis in "uv"]
    wraps = (WRAPS.get(names[0], "repeat"), WRAPS.get(names[1], "repeat"))
    filter_ = "nearest" if node.value("filtertype", "linear") == "closest" else "bilinear"
    leaf = Leaf(node, uv, wraps, filter_, pixels)
    domain.leaves.append(leaf)
    value = np.asarray(pixels, np.float64) if domain.own else sampled(leaf)
    if value.shape[-1] < min(count, 3):
        value = np.repeat(value[..., :1], count, axis=-1)
    if value.shape[-1] < count:
        value = _joined([value, np.ones(1)])
    return value[..., :count]


def _ramp(graph: Graph, node: Node, output: str, domain: Domain) -> Floats:
    """Left to right or top to bottom; a split is a ramp without width."""
    kind = node.kind.split("ramp" if "ramp" in node.kind else "split")[1][:2]
    names = ("valuel", "valuer") if kind == "lr" else ("valueb", "valuet")
    low, high = (graph.evaluated(node, name, 0.0, domain) for name in names)
    uv = _coordinates(graph, node, domain)
    at = uv[..., :1] if kind == "lr" else uv[..., 1:]
    if "split" in node.kind:
        return np.where(at < graph.evaluated(node, "center", 0.5, domain), low, high)
    return _mix(high, low, np.clip(at, 0.0, 1.0))


def _coordinates(graph: Graph, node: Node, domain: Domain) -> Floats:
    if node.source("texcoord") is not None:
        return graph.evaluated(node, "texcoord", None, domain)
    domain.sets.append("")
    domain.patterns = True
    return domain.uv


PATTERN_INPUTS = {"amplitude": 1.0, "pivot": 0.0, "lacunarity": 2.0, "diminish": 0.5}


def _pattern(graph: Graph, node: Node, output: str, domain: Domain) -> Floats:
    """Noise over texture coordinates, or over places that are told by a node."""
    name = node.kind[3:].split("_")[0]
    if name.endswith("2d"):
        at = _coordinates(graph, node, domain)
    elif node.source("position") is not None:
        at = graph.evaluated(node, "position", None, domain)
    else:
        at = _position(graph, node, output, domain)
    count = max(width(node.kind.replace("FA", "")), 1)
    given = {
        key: graph.evaluated(node, key, default, domain) for key, default in PATTERN_INPUTS.items()
    }
    octaves, style = (
        int(numbers(node.value(key, n))[0]) for key, n in (("octaves", 3), ("style", 0))
    )
    jitter = float(numbers(node.value("jitter", 1.0))[0])
    if name.startswith("noise"):
        return noise.perlin(at, count) * given["amplitude"] + given["pivot"]
    if name.startswith("fractal"):
        return given["amplitude"] * noise.fractal(
            at, count, octaves, given["lacunarity"], given["diminish"]
        )
    if name.startswith("cell"):
        return noise.cells(at, count)
    return noise.worley(at, count, jitter, style)


def _position(graph: Graph, node: Node, output: str, domain: Domain) -> Floats:
    if domain.places is None:
        raise LeftOut("a graph over places in space and images is not read")
    domain.solid = True
    return domain.places


def _refused(graph: Graph, node: Node, output: str, domain: Domain) -> Floats:
    raise LeftOut(f"{node.kind} is not read")


UNARY: dict[str, Callable[..., Floats]] = {
    "absval": np.abs, "sign": np.sign, "floor": np.floor, "ceil": np.ceil, "round": np.round,
    "fract": lambda a: a - np.floor(a), "sin": np.sin, "cos": np.cos, "tan": np.tan,
    "asin": lambda a: np.arcsin(np.clip(a, -1.0, 1.0)), "exp": np.exp,
    "acos": lambda a: np.arccos(np.clip(a, -1.0, 1.0)),
    "sqrt": lambda a: np.sqrt(np.maximum(a, 0.0)), "ln": lambda a: np.log(np.maximum(a, 1e-9)),
}  # fmt: skip
FUNCTIONS: dict[str, Evaluate] = {
    "constant": _of(np.asarray, value=0.0),
    "dot": _of(np.asarray, **{"in": 0.0}),
    "add": _of(np.add, in1=0.0, in2=0.0),
    "subtract": _of(np.subtract, in1=0.0, in2=0.0),
    "multiply": _of(np.multiply, in1=0.0, in2=1.0),
    "divide": _of(_safe, in1=0.0, in2=1.0),
    "modulo": _of(lambda a, b: a - b * np.floor(_safe(a, b)), in1=0.0, in2=1.0),
    "power": _of(_power, in1=0.0, in2=1.0),
    "min": _of(np.minimum, in1=0.0, in2=0.0),
    "max": _of(np.maximum, in1=0.0, in2=0.0),
    "invert": _of(lambda x, amount: amount - x, **{"in": 0.0}, amount=1.0),
    "clamp": _of(np.clip, **{"in": 0.0}, low=0.0, high=1.0),
    "remap": _of(_remap, **{"in": 0.0}, inlow=0.0, inhigh=1.0, outlow=0.0, outhigh=1.0),
    "smoothstep": _of(_smoothstep, **{"in": 0.0}, low=0.0, high=1.0),
    "mix": _of(_mix, fg=0.0, bg=0.0, mix=0.0),
    "atan2": _of(np.arctan2, iny=0.0, inx=1.0),
    "dotproduct": _of(_dot, in1=0.0, in2=0.0),
    "crossproduct": _of(np.cross, in1=(0.0,) * 3, in2=(0.0,) * 3),
    "magnitude": _of(lambda a: np.linalg.norm(a, axis=-1, keepdims=True), **{"in": 0.0}),
    "normalize": _of(_normalized, **{"in": 0.0}),
    "luminance": _of(_luminance, **{"in": (0.0,) * 3}, lumacoeffs=LUMINANCE),
    "rgbtohsv": _of(_rgb_to_hsv, **{"in": (0.0,) * 3}),
    "hsvtorgb": _of(_hsv_to_rgb, **{"in": (0.0,) * 3}),
    "rotate2d": _of(_rotated, **{"in": (0.0, 0.0)}, amount=0.0),
    "rotate3d": _of(_rotated3, **{"in": (0.0,) * 3}, amount=0.0, axis=(0.0, 1.0, 0.0)),
    "and": _of(np.multiply, in1=0.0, in2=0.0),
    "or": _of(np.maximum, in1=0.0, in2=0.0),
    "not": _of(lambda a: 1.0 - a, **{"in": 0.0}),
    "ifgreater": _chosen(np.greater),
    "ifgreatereq": _chosen(np.greater_equal),
    "ifequal": _chosen(np.equal),
    "plus": _blend(np.add),
    "minus": _blend(lambda fg, bg: bg - fg),
    "difference": _blend(lambda fg, bg: np.abs(bg - fg)),
    "screen": _blend(lambda fg, bg: 1.0 - (1.0 - fg) * (1.0 - bg)),
    "dodge": _of(_dodge, fg=0.0, bg=0.0, mix=1.0),
    "burn": _of(_burn, fg=0.0, bg=0.0, mix=1.0),
    "over": _of(_over, fg=(0.0,) * 4, bg=(0.0,) * 4, mix=1.0),
    "inside": _of(np.multiply, **{"in": 0.0}, mask=1.0),
    "outside": _of(lambda x, mask: x * (1.0 - mask), **{"in": 0.0}, mask=0.0),
    "combine2": _combined, "combine3": _combined, "combine4": _combined,
    "extract": _extracted,
    "separate2": _separated, "separate3": _separated, "separate4": _separated,
    "convert": _converted,
    "image": _image,
    "position": _position,
    "texcoord": _texcoord, "geompropvalue": _texcoord,
    "ramplr": _ramp, "ramptb": _ramp, "splitlr": _ramp, "splittb": _ramp,
    **dict.fromkeys(
        ("noise2d", "noise3d", "fractal2d", "fractal3d", "cellnoise2d", "cellnoise3d",
         "worleynoise2d", "worleynoise3d"), _pattern),
    **dict.fromkeys(
        ("normal", "tangent", "bitangent", "viewdirection", "geomcolor", "time",
         "frame"), _refused),
    **{name: _of(function, **{"in": 0.0}) for name, function in UNARY.items()},
}  # fmt: skip
