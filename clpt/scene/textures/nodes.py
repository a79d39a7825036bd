"""Kinds of nodes of graphs: their inputs, and what they compute on arrays (..., channels) float64.

Names, inputs and defaults are those of MaterialX's standard library, but for the patterns of
`cells`. `kernels/textures/graph.cl`
has a function for each kind.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

import numpy as np

from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.scene.textures import cells, noise

SOURCES = {"texcoord": 2, "texcoord1": 2, "position": 3}  # names without a node; their channels
FILLING = (0.0, 0.0, 0.0, 1.0)  # of channels that a value does not have
LUMINANCE = (0.2722287, 0.6740818, 0.0536895)  # MaterialX's: of ACEScg

Default: TypeAlias = float | tuple[float, ...] | str
Function: TypeAlias = Callable[..., Floats]
Form = Literal["each", "vectors", "padded", "routes"]


@dataclass(frozen=True)
class NodeKind:
    """A kind of node.

    function: of arrays of the inputs, then of the settings. inputs: their defaults by name: a
    number, numbers, or the name of a source. form: "each": kernels compute the channels one by one;
    "vectors": from inputs as wide as their defaults, where a number stands in all channels;
    "padded": the same, with zeros behind the channels of the widest input; "routes": channels go to
    other places, and kernels have no function. width: channels of the result; 0: as many as the
    widest input has; -1: as many as all inputs have. settings: whole numbers by name, which kernels
    have as constants: the default, the least and the most; `channels` is the width of the result.
    """

    function: Function
    inputs: Mapping[str, Default]
    form: Form = "each"
    width: int = 0
    settings: Mapping[str, tuple[int, int, int]] = field(default_factory=dict)

    def width_of(self, widths: Mapping[str, int], settings: Mapping[str, int]) -> int:
        """Return the channels of the result; widths, settings: of the inputs, by name.

        Raises SceneError for inputs that do not fit to each other.
        """
        if "channels" in settings:
            return settings["channels"]
        seen = [widths[name] for name, value in self.inputs.items() if not isinstance(value, str)]
        if self.form == "each" and len({1, *seen}) > 2:
            raise SceneError(f"its inputs have {' and '.join(map(str, sorted({*seen})))} channels")
        if self.width < 0 and sum(seen) > 4:
            raise SceneError(f"it has {sum(seen)} channels, more than four")
        return sum(seen) if self.width < 0 else self.width or max(seen)

    def evaluated(
        self,
        values: Mapping[str, Floats],
        settings: Mapping[str, int],
        width: int,
        stops: Floats | None = None,
    ) -> Floats:
        """Return the result (..., width) of inputs (..., channels) by name; stops: of a ramp."""
        inputs = [*values.values()]
        if self.form in ("vectors", "padded"):
            widest = max(value.shape[-1] for value in inputs)
            inputs = [
                widened(values[name], channels_of(default), widest if self.form == "padded" else 4)
                for name, default in self.inputs.items()
            ]
        inputs += [] if stops is None else [stops]
        with np.errstate(all="ignore"):
            result = np.asarray(self.function(*inputs, *settings.values()), np.float64)
        return result if self.form == "routes" else result[..., :width]


def channels_of(default: Default) -> int:
    """Return the channels of an input's default."""
    if isinstance(default, str):
        return SOURCES[default]
    return len(default) if isinstance(default, tuple) else 1


def widened(value: Floats, channels: int, reach: int = 4) -> Floats:
    """Return a value with so many channels: a number stands in the first `reach`, then zeros."""
    if value.shape[-1] == 1:
        value = np.repeat(value, min(channels, reach), axis=-1)
    missing = max(channels - value.shape[-1], 0)
    return np.pad(value, [(0, 0)] * (value.ndim - 1) + [(0, missing)])[..., :channels]


def safe(a: Floats, b: Floats) -> Floats:
    """Return a / b, 0 where b is 0."""
    return np.where(b == 0.0, 0.0, a / np.where(b == 0.0, 1.0, b))


def _power(a: Floats, b: Floats) -> Floats:
    return np.nan_to_num(np.power(a, b), nan=0.0, posinf=0.0, neginf=0.0)


def _mix(fg: Floats, bg: Floats, amount: Floats) -> Floats:
    return bg + (fg - bg) * amount


def _remap(x: Floats, inlow: Floats, inhigh: Floats, low: Floats, high: Floats) -> Floats:
    return low + safe(x - inlow, inhigh - inlow) * (high - low)


def _smoothstep(x: Floats, low: Floats, high: Floats) -> Floats:
    t = np.clip(safe(x - low, high - low), 0.0, 1.0)
    return np.where(x >= high, 1.0, t * t * (3.0 - 2.0 * t))


def _chosen(compare: Function) -> NodeKind:
    def choose(value1: Floats, value2: Floats, in1: Floats, in2: Floats) -> Floats:
        return np.where(compare(value1, value2), in1, in2)

    return _each(choose, value1=1.0, value2=0.0, in1=0.0, in2=0.0)


def _dot(a: Floats, b: Floats) -> Floats:
    return (a * b).sum(axis=-1, keepdims=True)


def _length(a: Floats) -> Floats:
    return np.linalg.norm(a, axis=-1, keepdims=True)


def _normalized(a: Floats) -> Floats:
    return safe(a, _length(a))


def _luminance(color: Floats, weights: Floats) -> Floats:
    return np.repeat(_dot(color, weights), 3, axis=-1)


def _rgb_to_hsv(color: Floats) -> Floats:
    most, least = color.max(axis=-1), color.min(axis=-1)
    spread = most - least
    r, g, b = (safe(color[..., i] - least, spread) for i in range(3))
    other = np.where(color[..., 1] >= most, 2.0 + b - r, 4.0 + r - g)
    hue = np.where(color[..., 0] >= most, g - b, other)
    hue = np.where(spread > 0.0, (hue / 6.0) % 1.0, 0.0)
    return np.stack([hue, safe(spread, most), most], axis=-1)


def _hsv_to_rgb(hsv: Floats) -> Floats:
    h, s, v = (hsv[..., i : i + 1] for i in range(3))
    k = (np.array([5.0, 3.0, 1.0]) + h * 6.0) % 6.0
    return v - v * s * np.clip(np.minimum(k, 4.0 - k), 0.0, 1.0)


def _hsv_adjusted(color: Floats, amount: Floats) -> Floats:
    hsv = _rgb_to_hsv(color)
    moved = np.stack([hsv[..., 0] + amount[..., 0], hsv[..., 1] * amount[..., 1],
                      hsv[..., 2] * amount[..., 2]], axis=-1)  # fmt: skip
    return _hsv_to_rgb(moved)


def _dodge(fg: Floats, bg: Floats, amount: Floats) -> Floats:
    return _mix(safe(bg, 1.0 - fg), bg, amount)


def _burn(fg: Floats, bg: Floats, amount: Floats) -> Floats:
    return _mix(np.where(fg == 0.0, 0.0, 1.0 - safe(1.0 - bg, fg)), bg, amount)


def _over(fg: Floats, bg: Floats, amount: Floats) -> Floats:
    return _mix(fg + bg * (1.0 - fg[..., 3:]), bg, amount)


def _over_apart(fg: Floats, bg: Floats, amount: Floats) -> Floats:
    """The composite of two layers that do not hide each other as long as there is room."""
    f, b = fg[..., 3:], bg[..., 3:]
    both = fg + bg * np.where(f + b <= 1.0, 1.0, safe(1.0 - f, b))
    return _mix(joined(both[..., :3], np.minimum(f + b, 1.0)), bg, amount)


def _matte(fg: Floats, bg: Floats, amount: Floats) -> Floats:
    f = fg[..., 3:]
    color = fg[..., :3] * f + bg[..., :3] * (1.0 - f)
    return _mix(joined(color, f + bg[..., 3:] * (1.0 - f)), bg, amount)


def _premultiplied(x: Floats) -> Floats:
    return joined(x[..., :3] * x[..., 3:], x[..., 3:])


def _unpremultiplied(x: Floats) -> Floats:
    return joined(np.where(x[..., 3:] == 0.0, x[..., :3], safe(x[..., :3], x[..., 3:])), x[..., 3:])


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


def _placed(
    uv: Floats, pivot: Floats, scale: Floats, rotate: Floats, offset: Floats, order: int
) -> Floats:
    moved = uv - pivot
    if order:  # first the offset, then the turn and the scale
        return safe(_rotated(moved - offset, rotate), scale) + pivot
    return _rotated(safe(moved, scale), rotate) - offset + pivot


def _left_to_right(low: Floats, high: Floats, uv: Floats) -> Floats:
    return _mix(high, low, np.clip(uv[..., :1], 0.0, 1.0))


def _top_to_bottom(top: Floats, bottom: Floats, uv: Floats) -> Floats:
    return _mix(top, bottom, np.clip(uv[..., 1:], 0.0, 1.0))


def _four(tl: Floats, tr: Floats, bl: Floats, br: Floats, uv: Floats) -> Floats:
    return _top_to_bottom(_left_to_right(tl, tr, uv), _left_to_right(bl, br, uv), uv)


def _split_at_u(left: Floats, right: Floats, center: Floats, uv: Floats) -> Floats:
    return np.where(uv[..., :1] < center, left, right)


def _split_at_v(top: Floats, bottom: Floats, center: Floats, uv: Floats) -> Floats:
    return np.where(uv[..., 1:] < center, bottom, top)


def _ramp(x: Floats, stops: Floats, interpolation: int) -> Floats:
    """A color of rows (position, channels...), by their positions.

    interpolation: 0: linear; 1: the stop's own up to the next; 2: smooth.
    """
    at, colors = stops[:, 0], stops[:, 1:]
    upper = np.clip(np.searchsorted(at, x[..., 0], side="right"), 1, len(at) - 1)
    t = np.clip(safe(x[..., 0] - at[upper - 1], at[upper] - at[upper - 1]), 0.0, 1.0)
    t = np.where(x[..., 0] >= at[upper], 1.0, t)[..., None]
    t = (t, np.where(t < 1.0, 0.0, 1.0), t * t * (3.0 - 2.0 * t))[interpolation]
    return _mix(colors[upper], colors[upper - 1], t)


def joined(*parts: Floats) -> Floats:
    """Return the channels of values of several widths side by side."""
    places = np.broadcast_shapes(*(value.shape[:-1] for value in parts))
    wide = [np.broadcast_to(value, (*places, value.shape[-1])) for value in parts]
    return np.concatenate(wide, axis=-1)


def _extracted(x: Floats, index: int) -> Floats:
    return x[..., min(index, x.shape[-1] - 1)][..., None]


def converted(x: Floats, channels: int) -> Floats:
    """Return a value with more or fewer channels: a number in each, and 1 for a fourth."""
    if x.shape[-1] == 1:
        x = np.repeat(x, min(channels, 3), axis=-1)
    missing = max(channels - x.shape[-1], 0)
    filled = FILLING[4 - missing :] if channels == 4 else (0.0,) * missing
    return joined(x, np.array(filled))[..., :channels]


def _noise(at: Floats, amplitude: Floats, pivot: Floats, channels: int) -> Floats:
    return noise.perlin(at, channels) * amplitude[..., :channels] + pivot


def _fractal(
    at: Floats,
    amplitude: Floats,
    octaves: Floats,
    lacunarity: Floats,
    diminish: Floats,
    channels: int,
) -> Floats:
    return amplitude[..., :channels] * noise.fractal(at, octaves, lacunarity, diminish, channels)


def _each(function: Function, **inputs: Default) -> NodeKind:
    return NodeKind(function, inputs)


def _vectors(function: Function, width: int = 0, /, **inputs: Default) -> NodeKind:
    return NodeKind(function, inputs, "vectors", width)


def _padded(function: Function, width: int, *names: str) -> NodeKind:
    return NodeKind(function, dict.fromkeys(names, (0.0,) * 4), "padded", width)


def _blend(function: Function) -> NodeKind:
    """A blend of a foreground and a background, by an amount."""

    def blended(fg: Floats, bg: Floats, amount: Floats) -> Floats:
        return _mix(function(fg, bg), bg, amount)

    return _each(blended, fg=0.0, bg=0.0, mix=1.0)


def _pattern(
    function: Function, place: str, inputs: Mapping[str, Default], most: int = 4
) -> NodeKind:
    settings = {"channels": (1, 1, most)}
    if function is noise.worley:
        settings["style"] = (0, 0, 1)
    return NodeKind(function, {place: place, **inputs}, "vectors", 0, settings)


def _voronoi(place: str) -> NodeKind:
    inputs: dict[str, Default] = {
        place: place, "randomness": 1.0, "smoothness": 0.25, "exponent": 2.0
    }  # fmt: skip
    settings = {"feature": (0, 0, 4), "metric": (0, 0, 3), "output": (0, 0, 2)}
    return NodeKind(cells.voronoi, inputs, "vectors", 3, settings)


ONE, TWO, THREE, FOUR = 0.0, (0.0,) * 2, (0.0,) * 3, (0.0,) * 4  # defaults, by their widths
IN: dict[str, Default] = {"in": ONE}
UNARY: dict[str, Function] = {
    "absval": np.abs, "sign": np.sign, "floor": np.floor, "ceil": np.ceil,
    "round": lambda a: np.floor(a + 0.5),
    "fract": lambda a: a - np.floor(a), "sin": np.sin, "cos": np.cos, "tan": np.tan,
    "asin": lambda a: np.arcsin(np.clip(a, -1.0, 1.0)), "exp": np.exp,
    "acos": lambda a: np.arccos(np.clip(a, -1.0, 1.0)),
    "sqrt": lambda a: np.sqrt(np.maximum(a, 0.0)), "ln": lambda a: np.log(np.maximum(a, 1e-9)),
    "not": lambda a: 1.0 - a,
}  # fmt: skip
OCTAVES: dict[str, Default] = {
    "amplitude": (1.0,) * 4, "octaves": 3.0, "lacunarity": 2.0, "diminish": 0.5
}  # fmt: skip
NOISE: dict[str, Default] = {"amplitude": (1.0,) * 4, "pivot": 0.0}
JITTER: dict[str, Default] = {"jitter": 1.0}
NODES: dict[str, NodeKind] = {
    **{name: _each(function, **IN) for name, function in UNARY.items()},
    "add": _each(np.add, in1=0.0, in2=0.0),
    "subtract": _each(np.subtract, in1=0.0, in2=0.0),
    "multiply": _each(np.multiply, in1=0.0, in2=1.0),
    "divide": _each(safe, in1=0.0, in2=1.0),
    "modulo": _each(lambda a, b: a - b * np.floor(safe(a, b)), in1=0.0, in2=1.0),
    "power": _each(_power, in1=0.0, in2=1.0),
    "min": _each(np.minimum, in1=0.0, in2=0.0),
    "max": _each(np.maximum, in1=0.0, in2=0.0),
    "atan2": _each(np.arctan2, iny=0.0, inx=1.0),
    "invert": _each(lambda x, amount: amount - x, **IN, amount=1.0),
    "clamp": _each(lambda x, a, b: np.minimum(np.maximum(x, a), b), **IN, low=0.0, high=1.0),
    "remap": _each(_remap, **IN, inlow=0.0, inhigh=1.0, outlow=0.0, outhigh=1.0),
    "smoothstep": _each(_smoothstep, **IN, low=0.0, high=1.0),
    "mix": _each(_mix, fg=0.0, bg=0.0, mix=0.0),
    "and": _each(np.multiply, in1=0.0, in2=0.0),
    "or": _each(np.maximum, in1=0.0, in2=0.0),
    "ifgreater": _chosen(np.greater),
    "ifgreatereq": _chosen(np.greater_equal),
    "ifequal": _chosen(np.equal),
    "plus": _blend(np.add),
    "minus": _blend(lambda fg, bg: bg - fg),
    "difference": _blend(lambda fg, bg: np.abs(bg - fg)),
    "screen": _blend(lambda fg, bg: 1.0 - (1.0 - fg) * (1.0 - bg)),
    "dodge": _each(_dodge, fg=0.0, bg=0.0, mix=1.0),
    "burn": _each(_burn, fg=0.0, bg=0.0, mix=1.0),
    "inside": _each(np.multiply, **IN, mask=1.0),
    "outside": _each(lambda x, mask: x * (1.0 - mask), **IN, mask=0.0),
    **{
        name: _vectors(function, 4, fg=FOUR, bg=FOUR, mix=1.0)
        for name, function in {
            "over": _over, "disjointover": _over_apart, "matte": _matte,
            "in": lambda fg, bg, amount: _mix(fg * bg[..., 3:], bg, amount),
            "out": lambda fg, bg, amount: _mix(fg * (1.0 - bg[..., 3:]), bg, amount),
            "mask": lambda fg, bg, amount: _mix(bg * fg[..., 3:], bg, amount),
        }.items()
    },
    "premult": _vectors(_premultiplied, 4, **{"in": FOUR}),
    "unpremult": _vectors(_unpremultiplied, 4, **{"in": FOUR}),
    "dotproduct": _padded(_dot, 1, "in1", "in2"),
    "magnitude": _padded(_length, 1, "in"),
    "normalize": _padded(_normalized, 0, "in"),
    "distance": _padded(lambda a, b: _length(a - b), 1, "in1", "in2"),
    "crossproduct": _vectors(np.cross, 3, in1=THREE, in2=THREE),
    "luminance": _vectors(_luminance, 3, **{"in": THREE}, lumacoeffs=LUMINANCE),
    "rgbtohsv": _vectors(_rgb_to_hsv, 3, **{"in": THREE}),
    "hsvtorgb": _vectors(_hsv_to_rgb, 3, **{"in": THREE}),
    "hsvadjust": _vectors(_hsv_adjusted, 3, **{"in": THREE}, amount=(0.0, 1.0, 1.0)),
    "rotate2d": _vectors(_rotated, 2, **{"in": TWO}, amount=ONE),
    "rotate3d": _vectors(_rotated3, 3, **{"in": THREE}, amount=ONE, axis=(0.0, 1.0, 0.0)),
    "place2d": NodeKind(
        _placed,
        {"texcoord": "texcoord", "pivot": TWO, "scale": (1.0, 1.0), "rotate": ONE, "offset": TWO},
        "vectors", 2, {"operationorder": (0, 0, 1)},
    ),
    "ramplr": _vectors(_left_to_right, valuel=FOUR, valuer=FOUR, texcoord="texcoord"),
    "ramptb": _vectors(_top_to_bottom, valuet=FOUR, valueb=FOUR, texcoord="texcoord"),
    "ramp4": _vectors(
        _four, valuetl=FOUR, valuetr=FOUR, valuebl=FOUR, valuebr=FOUR, texcoord="texcoord"
    ),
    "splitlr": _vectors(_split_at_u, valuel=FOUR, valuer=FOUR, center=0.5, texcoord="texcoord"),
    "splittb": _vectors(_split_at_v, valuet=FOUR, valueb=FOUR, center=0.5, texcoord="texcoord"),
    "ramp": NodeKind(_ramp, IN, "vectors", 4, {"interpolation": (0, 0, 2)}),
    "noise2d": _pattern(_noise, "texcoord", NOISE),
    "noise3d": _pattern(_noise, "position", NOISE),
    "fractal2d": _pattern(_fractal, "texcoord", OCTAVES),
    "fractal3d": _pattern(_fractal, "position", OCTAVES),
    "cellnoise2d": _pattern(noise.cells, "texcoord", {}),
    "cellnoise3d": _pattern(noise.cells, "position", {}),
    "worleynoise2d": _pattern(noise.worley, "texcoord", JITTER, 3),
    "worleynoise3d": _pattern(noise.worley, "position", JITTER, 3),
    "voronoi2d": _voronoi("texcoord"),
    "voronoi3d": _voronoi("position"),
    "noise1d": _each(lambda x: cells.perlin(x[..., None])[..., 0], **IN),
    "noise4d": _vectors(cells.perlin, 1, **{"in": FOUR}),
    "whitenoise": NodeKind(cells.white, {"in": FOUR}, "vectors", 3, {"dimensions": (3, 1, 4)}),
    "brick": _vectors(
        cells.brick, 2, texcoord="texcoord", size=(0.5, 0.25), mortar=(0.02, 0.1), bias=0.0,
        offset=(0.5, 2.0), squash=(1.0, 2.0),
    ),
    "combine2": NodeKind(joined, {"in1": ONE, "in2": ONE}, "routes", -1),
    "combine3": NodeKind(joined, {"in1": ONE, "in2": ONE, "in3": ONE}, "routes", -1),
    "combine4": NodeKind(joined, {"in1": ONE, "in2": ONE, "in3": ONE, "in4": ONE}, "routes", -1),
    "extract": NodeKind(_extracted, IN, "routes", 1, {"index": (0, 0, 3)}),
    "convert": NodeKind(converted, IN, "routes", 0, {"channels": (3, 1, 4)}),
}  # fmt: skip
