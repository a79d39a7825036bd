"""Graphs of nodes as MaterialX on a stage: nodes of the same names, typed by their channels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from pxr import Gf, Sdf, UsdShade

from clpt.arrays import Floats
from clpt.images.colour import LUMINANCE
from clpt.scene.textures import Graph
from clpt.scene.textures.graph import TEXTURE, Operand, Step
from clpt.scene.values import Texture

TYPES = Sdf.ValueTypeNames
OF_USD = {
    "float": TYPES.Float, "color3": TYPES.Color3f, "color4": TYPES.Color4f, "vector2": TYPES.Float2,
    "vector3": TYPES.Vector3f, "vector4": TYPES.Float4, "integer": TYPES.Int,
    "surfaceshader": TYPES.Token,
}  # fmt: skip
VECTORS = ("", "float", "vector2", "vector3", "vector4")  # types by their channels
COLORS = ("", "float", "", "color3", "color4")
LETTERS = {"f": "float", "i": "integer", "2": "vector2", "3": "vector3", "c": "color3",
           "k": "color4"}  # fmt: skip
# Types of inputs and of the result: of LETTERS, T and C: a vector and a color as wide as the
# result, W: a vector as wide as the widest input. Nodes that are not here have T for all.
SIGNATURES = {
    **dict.fromkeys(("plus", "minus", "difference", "screen", "dodge", "burn"), "CCfC"),
    **dict.fromkeys(("ifgreater", "ifgreatereq", "ifequal"), "ffTTT"),
    **dict.fromkeys(("inside", "outside"), "CfC"),
    **dict.fromkeys(("ramplr", "ramptb"), "TT2T"),
    **dict.fromkeys(("splitlr", "splittb"), "TTf2T"),
    **dict.fromkeys(("over", "disjointover", "matte", "in", "out", "mask"), "kkfk"),
    **dict.fromkeys(("premult", "unpremult"), "kk"),
    "mix": "TTfT", "dotproduct": "WWf", "magnitude": "Wf", "normalize": "WT",
    "distance": "WWf", "crossproduct": "333", "luminance": "ccc", "rgbtohsv": "cc",
    "hsvtorgb": "cc", "hsvadjust": "c3c", "rotate2d": "2f2", "rotate3d": "3f33",
    "place2d": "222f22", "ramp4": "TTTT2T", "noise2d": "2TfT", "noise3d": "3TfT",
    "fractal2d": "2TiffT", "fractal3d": "3TiffT", "cellnoise2d": "2f", "cellnoise3d": "3f",
    "worleynoise2d": "2fT", "worleynoise3d": "3fT",
}  # fmt: skip
ABSENT = frozenset(("brick", "noise1d", "noise4d", "voronoi2d", "voronoi3d", "whitenoise"))
"""Kinds of nodes that MaterialX does not have."""
INSTEAD = {"and": "multiply", "or": "max", "not": "invert"}  # of numbers, not of booleans


class Lost(Exception):
    """A node that MaterialX does not have; the message names it."""


class Shaders(Protocol):
    """The network that a graph is written to."""

    def shader(self, name: str, kind: str, output: str) -> UsdShade.Shader: ...
    def coordinates(self, mapping: str) -> UsdShade.Shader: ...
    def look_up(
        self, texture: Texture, form: str, uv: UsdShade.Shader | None
    ) -> UsdShade.Shader: ...


@dataclass(frozen=True)
class Value:
    """An output of a type, or numbers (n,)."""

    form: str
    shader: UsdShade.Shader | None = None
    numbers: Floats = field(default_factory=lambda: np.zeros(0))


class GraphWriter:
    """Writes a graph's nodes below a material."""

    def __init__(self, network: Shaders, graph: Graph):
        self.network, self.graph = network, graph
        self.values: list[Value] = []

    def written(self, form: str) -> UsdShade.Shader:
        """Return the last node of the graph, of a type. Raises Lost."""
        for step in self.graph.steps:
            self.values.append(self._step(step))
        value = self._operand(self.graph.result)
        if form == "float" and self.graph.channel in "rgba":
            value = self._channel(value, "rgba".index(self.graph.channel))
        elif form == "float" and self.graph.width > 2:
            weights = _numbers(LUMINANCE.astype(float))
            value = self._node("dotproduct", "vector3", "float", in1=value, in2=weights)
        found = self._as(value, form)
        if found.shader is not None:
            return found.shader
        return self._node("constant", form, form, value=found).shader

    def _step(self, step: Step) -> Value:
        inputs = {name: self._operand(operand) for name, operand in step.operands.items()}
        if step.kind == TEXTURE:
            return self._texture(step, inputs)
        if step.kind in ABSENT:
            raise Lost(step.kind)
        special = SPECIAL.get(step.kind)
        if special is not None:
            return special(self, step, inputs)
        kind, wide = INSTEAD.get(step.kind, step.kind), VECTORS[step.width]
        letters = SIGNATURES.get(kind, "T" * (len(inputs) + 1))
        if kind == "mix" and _channels(inputs["mix"]) > 1:
            letters, kind = "TTTT", f"mix_{wide}"
        widest = VECTORS[max(map(_channels, inputs.values()))]
        forms = {**LETTERS, "T": wide, "C": COLORS[step.width], "W": widest}
        types = [forms[letter] for letter in letters]
        factors = [v for v, letter in zip(inputs.values(), letters, strict=False) if letter == "f"]
        if (
            not all(types)
            or step.width != _count(types[-1])
            or any(_channels(v) > 1 for v in factors)
        ):
            raise Lost(step.kind)
        given = {
            name: self._as(value, form)
            for (name, value), form in zip(inputs.items(), types, strict=False)
        }
        settings = {k: v for k, v in step.settings.items() if k != "channels"}
        suffix = widest if "W" in letters else types[-1]
        return self._node(kind, suffix, types[-1], **settings, **given)

    def _texture(self, step: Step, inputs: dict[str, Value]) -> Value:
        uv = inputs.get("texcoord")
        texture = self.graph.textures[step.settings["texture"]]
        at = None if uv is None else self._as(uv, "vector2").shader
        form = "float" if step.width == 1 else "color3"
        color = Value(form, self.network.look_up(texture, form, at))
        if step.width < 4:
            return color
        alpha = Value("float", self.network.look_up(texture.with_channel("a"), "float", at))
        return self._node("combine2", "color4CF", "color4", in1=color, in2=alpha)

    def _operand(self, operand: Operand) -> Value:
        if isinstance(operand, int):
            return self.values[operand]
        if not isinstance(operand, str):
            return _numbers(operand)
        if operand == "position":
            return self._node("position", "vector3", "vector3")
        mapping = "uv1" if operand == "texcoord1" else "uv"
        return Value("vector2", self.network.coordinates(mapping))

    def _node(self, kind: str, suffix: str, form: str, **inputs: Value | int) -> Value:
        """Add a node. suffix: of its definition; form: the type of the result."""
        node = self.network.shader(kind, f"{kind}_{suffix}", form)
        for name, value in inputs.items():
            if isinstance(value, int):
                node.CreateInput(name, TYPES.Int).Set(value)
            else:
                _set(node, name.rstrip("_"), value)
        return Value(form, node)

    def _as(self, value: Value, form: str) -> Value:
        """Return a value as another type: a number stands in all channels. Raises Lost."""
        if value.form == form:
            return value
        if value.shader is None:
            count = _count(form)
            numbers = np.resize(value.numbers, count) if len(value.numbers) == 1 else value.numbers
            return Value(form, None, np.resize(np.append(numbers, np.zeros(count)), count))
        if form == "integer":
            raise Lost("octaves that vary")
        if form == "float":
            return self._channel(value, 0)
        return self._node("convert", f"{value.form}_{form}", form, in_=value)

    def _channel(self, value: Value, index: int) -> Value:
        index = min(index, _channels(value) - 1)
        if value.shader is None:
            return _numbers(value.numbers[index : index + 1])
        if value.form == "float":
            return value
        return self._node("extract", value.form, "float", index=index, in_=value)


def _combined(writer: GraphWriter, step: Step, inputs: dict[str, Value]) -> Value:
    parts = [
        writer._channel(value, i) for value in inputs.values() for i in range(_channels(value))
    ]
    form = VECTORS[len(parts)]
    named = {f"in{i + 1}": part for i, part in enumerate(parts)}
    return writer._node(f"combine{len(parts)}", form, form, **named)


def _extracted(writer: GraphWriter, step: Step, inputs: dict[str, Value]) -> Value:
    return writer._channel(inputs["in"], step.settings["index"])


def _converted(writer: GraphWriter, step: Step, inputs: dict[str, Value]) -> Value:
    return writer._as(inputs["in"], VECTORS[step.width])


def _ramp(writer: GraphWriter, step: Step, inputs: dict[str, Value]) -> Value:
    """A mixture for each stop: where a stop is reached, it is as if the stops before were not."""
    assert step.stops is not None
    at, smooth = writer._as(inputs["in"], "float"), step.settings["interpolation"] == 2
    value = _numbers(step.stops[0, 1:])
    for (low, *_), (high, *color) in zip(step.stops, step.stops[1:], strict=False):
        end = _numbers(np.array(color))
        if step.settings["interpolation"] == 1 or low == high:
            inputs = {"value1": at, "value2": _number(high), "in1": end, "in2": value}
            value = writer._node("ifgreatereq", "vector4", "vector4", **inputs)
            continue
        ends = {"low": _number(low), "high": _number(high)}
        if smooth:
            share = writer._node("smoothstep", "float", "float", in_=at, **ends)
        else:
            ends = {"inlow": ends["low"], "inhigh": ends["high"]}
            share = writer._node("remap", "float", "float", in_=at, **ends)
            share = writer._node("clamp", "float", "float", in_=share)
        value = writer._node("mix", "vector4", "vector4", fg=end, bg=value, mix=share)
    return value


SPECIAL: dict[str, Callable[[GraphWriter, Step, dict[str, Value]], Value]] = {
    **dict.fromkeys(("combine2", "combine3", "combine4"), _combined),
    "extract": _extracted,
    "convert": _converted,
    "ramp": _ramp,
}


def _numbers(numbers: Floats) -> Value:
    return Value(VECTORS[len(numbers)], None, numbers)


def _number(number: float) -> Value:
    return _numbers(np.array([number]))


def _count(form: str) -> int:
    """Return the channels of a type."""
    return int(form[-1]) if form[-1].isdigit() else 1


def _channels(value: Value) -> int:
    return _count(value.form)


def _set(node: UsdShade.Shader, name: str, value: Value) -> None:
    """Set an input to numbers, or connect it."""
    made = node.CreateInput(name, OF_USD[value.form])
    if value.shader is not None:
        made.ConnectToSource(value.shader.GetOutput("out"))
        return
    numbers: list[Any] = value.numbers.tolist()
    if value.form == "integer":
        made.Set(int(np.ceil(numbers[0])))
    else:
        made.Set(numbers[0] if len(numbers) == 1 else VECTORS_OF_USD[len(numbers)](*numbers))


VECTORS_OF_USD = {2: Gf.Vec2f, 3: Gf.Vec3f, 4: Gf.Vec4f}
