# SPDX-License-Identifier: GPL-3.0-or-later
"""Graphs of clpt's nodes, written as expressions, and where Blender's links come from."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any, NamedTuple

import bpy
import numpy as np

Json = dict[str, Any]
TURN = 2.0 * math.pi
LUMINANCE = (0.2126729, 0.7151522, 0.0721750)  # of linear Rec. 709, as Cycles has it
COMPARED = ("value1", "value2", "in1", "in2")
INPUTS: dict[str, tuple[str, ...]] = {  # of nodes that are called without names
    "mix": ("fg", "bg", "mix"), "clamp": ("in", "low", "high"), "atan2": ("iny", "inx"),
    "smoothstep": ("in", "low", "high"), "ifgreater": COMPARED, "ifgreatereq": COMPARED,
    "ifequal": COMPARED, "rotate3d": ("in", "amount", "axis"), "noise2d": ("texcoord",),
    "noise3d": ("position",), "combine2": COMPARED[2:], "combine3": ("in1", "in2", "in3"),
    "combine4": ("in1", "in2", "in3", "in4"),
}  # fmt: skip
WIDTHS = {
    "dotproduct": 1, "magnitude": 1, "distance": 1, "extract": 1, "noise1d": 1, "noise4d": 1,
    "noise2d": 1, "noise3d": 1, "fractal2d": 1, "fractal3d": 1, "brick": 2, "ramp": 4,
    "combine2": 2, "combine4": 4, "crossproduct": 3, "rgbtohsv": 3, "hsvtorgb": 3, "combine3": 3,
    "voronoi2d": 3, "voronoi3d": 3, "whitenoise": 3, "rotate3d": 3,
}  # fmt: skip
FOLDED: dict[str, Callable[..., Any]] = {
    "add": operator.add, "subtract": operator.sub, "multiply": operator.mul, "min": np.minimum,
    "divide": lambda a, b: np.where(b == 0.0, 0.0, a / np.where(b == 0.0, 1.0, b)),
    "max": np.maximum, "mix": lambda fg, bg, t: bg + (fg - bg) * t, "absval": np.abs,
    "clamp": lambda x, a, b: np.minimum(np.maximum(x, a), b), "floor": np.floor,
    "sqrt": lambda x: np.sqrt(np.maximum(x, 0.0)),
    "power": lambda a, b: np.nan_to_num(np.power(a, b)), "dotproduct": lambda a, b: (a * b).sum(),
    "combine3": lambda *parts: np.concatenate(parts),
}  # fmt: skip


class Site(NamedTuple):
    """A node where it stands, within groups, and the output of it that is asked for."""

    node: bpy.types.Node
    groups: tuple[bpy.types.Node, ...]
    output: str  # an identifier


def socket_of(node: bpy.types.Node, key: str | int) -> Any:
    """Return an input by its number, identifier or name; None if there is none."""
    if isinstance(key, int):
        return node.inputs[key]
    return next((s for s in node.inputs if s.identifier == key), node.inputs.get(key))


def origin(groups: tuple[bpy.types.Node, ...], socket: Any) -> tuple[Site | None, Any]:
    """Return where a socket's value comes from: past reroutes, groups, muted nodes and links.

    Without a node it is the socket that is returned, whose own value counts; None: nothing does.
    """
    while socket is not None and socket.is_linked:
        link = socket.links[0]
        if link.is_muted or not link.is_valid:
            break
        node, output = link.from_node, link.from_socket
        if node.mute:
            passed = (p.from_socket for p in node.internal_links if p.to_socket == output)
            socket = next(passed, None)
        elif node.type == "REROUTE":
            socket = node.inputs[0]
        elif node.type == "GROUP" and node.node_tree is not None:
            ends = [n for n in node.node_tree.nodes if n.type == "GROUP_OUTPUT"]
            end = next((n for n in ends if n.is_active_output), None)
            groups = (*groups, node)
            socket = None if end is None else socket_of(end, output.identifier)
        elif node.type == "GROUP_INPUT" and groups:
            socket, groups = socket_of(groups[-1], output.identifier), groups[:-1]
        else:
            return Site(node, groups, output.identifier), output
    return None, socket


def fixed_mapping(node: bpy.types.Node) -> tuple[list[float], list[float], list[float]] | None:
    """Return where a Mapping node moves points, and how it turns and scales them.

    None where that varies, and for nodes of another kind.
    """
    varies = any(s.is_linked for s in node.inputs if s.name != "Vector")
    if node.type != "MAPPING" or node.vector_type != "POINT" or varies:
        return None
    move, angles, scale = (
        list(node.inputs[key].default_value) for key in ("Location", "Rotation", "Scale")
    )
    return move, angles, scale


class Value:
    """A value of a graph: numbers, or the name of a node or of a source; with its channels."""

    def __init__(self, graph: Graph, ref: Any, width: int):
        self.graph, self.ref, self.width = graph, ref, width

    def constant(self) -> list[float] | None:
        return None if isinstance(self.ref, str) else self.ref

    def __add__(self, other: Any) -> Value:
        return self.graph("add", self, other)

    def __sub__(self, other: Any) -> Value:
        return self.graph("subtract", self, other)

    def __rsub__(self, other: Any) -> Value:
        return self.graph("subtract", other, self)

    def __mul__(self, other: Any) -> Value:
        return self.graph("multiply", self, other)

    def __truediv__(self, other: Any) -> Value:
        return self.graph("divide", self, other)

    def __rtruediv__(self, other: Any) -> Value:
        return self.graph("divide", other, self)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self) -> Value:
        return self * -1.0

    def __getitem__(self, index: int) -> Value:
        if isinstance(self.ref, list):
            return Value(self.graph, [self.ref[min(index, self.width - 1)]], 1)
        return self if self.width == 1 else self.graph("extract", self, index=index)

    def clamped(self) -> Value:
        return self.graph("clamp", self, 0.0, 1.0)


class Graph:
    """Builds a graph; calling it adds a node. textures: that its nodes look up."""

    def __init__(self) -> None:
        self.nodes: dict[str, Json] = {}
        self.textures: list[Json] = []

    def value(self, x: Any) -> Value:
        """Return numbers as a value."""
        if isinstance(x, Value):
            return x
        numbers = [float(x)] if isinstance(x, (int, float)) else [float(v) for v in x]
        return Value(self, numbers, len(numbers))

    def __call__(self, kind: str, *inputs: Any, **named: Any) -> Value:
        names = INPUTS.get(kind, ("in",) if len(inputs) == 1 else ("in1", "in2"))
        values = {key: self.value(x) for key, x in zip(names, inputs, strict=False)}
        plain = (int, list)  # settings, and the stops of a ramp
        values |= {key: self.value(x) for key, x in named.items() if not isinstance(x, plain)}
        constants = [value.constant() for value in values.values()]
        if kind in FOLDED and None not in constants:
            found = FOLDED[kind](*(np.array(c) for c in constants))
            return self.value(np.atleast_1d(found).tolist())
        node = {"type": kind, **named, **{key: value.ref for key, value in values.items()}}
        for key, made in self.nodes.items():
            if made == node:
                return Value(self, key, self._width(kind, named, values))
        name = f"n{len(self.nodes)}"
        self.nodes[name] = node
        return Value(self, name, self._width(kind, named, values))

    def _width(self, kind: str, named: Json, values: dict[str, Value]) -> int:
        widest = max((value.width for value in values.values()), default=1)
        return named.get("channels") or WIDTHS.get(kind, widest)

    def gray(self, color: Value) -> Value:
        """Return the luminance of a color."""
        return color if color.width == 1 else self("dotproduct", color, LUMINANCE)

    def look(self, texture: Json, width: int, at: Value | None = None) -> Value:
        """Return a lookup of a texture, where it lies by itself or `at` other coordinates."""
        if texture not in self.textures:
            self.textures.append(texture)
        moved = {} if at is None else {"texcoord": self("convert", at, channels=2)}
        number = self.textures.index(texture)
        return self("texture", texture=number, channels=width, **moved)

    def finished(self, value: Value, *, wide: bool) -> Any:
        """Return numbers, or a texture; wide: a color of three channels, else a number."""
        if not isinstance(value.ref, str):
            return [*value.ref, *value.ref, *value.ref][:3] if wide else float(value.ref[0])
        node = self.nodes.get(value.ref, {})
        if node.get("type") == "texture" and "texcoord" not in node and wide == (value.width > 1):
            return self.textures[node["texture"]]
        used, waiting = set(), [value.ref]
        while waiting:
            name = waiting.pop()
            if name in self.nodes and name not in used:
                used.add(name)
                waiting += [ref for ref in self.nodes[name].values() if isinstance(ref, str)]
        nodes = {name: node for name, node in self.nodes.items() if name in used}
        shown = {"textures": self.textures} if self.textures else {}
        return {
            "type": "graph", "nodes": nodes or {"n": {"type": "add", "in1": 0.0}}, **shown,
            "output": value.ref, **({} if wide else {"channel": "r"}),
        }  # fmt: skip


def jenkins(*words: int) -> float:
    """Return a number in [0, 1] of up to three words: Jenkins' hash lookup3."""

    def rotated(x: int, bits: int) -> int:
        return ((x << bits) | (x >> (32 - bits))) & 0xFFFFFFFF

    s = [0xDEADBEEF + (len(words) << 2) + 13] * 3
    s = [(a + b) & 0xFFFFFFFF for a, b in zip(s, [*words, 0, 0][:3], strict=True)]
    for i, bits in enumerate((14, 11, 25, 16, 4, 14, 24)):
        c, b = (2, 0, 1)[i % 3], (1, 2, 0)[i % 3]
        s[c] = ((s[c] ^ s[b]) - rotated(s[b], bits)) & 0xFFFFFFFF
    return s[2] / 0xFFFFFFFF


def hashed(*numbers: float) -> float:
    """Return a number in [0, 1] of up to three, by the bits of float32."""
    return jenkins(*(int(np.float32(x).view(np.uint32)) for x in numbers))


def turned(g: Graph, v: Value, angles: Value, *, back: bool = False) -> Value:
    """Return a vector turned by angles [radians] about x, y and z in this order, or undo it."""
    axes = ((0, (1.0, 0.0, 0.0)), (1, (0.0, 1.0, 0.0)), (2, (0.0, 0.0, 1.0)))
    for i, axis in reversed(axes) if back else axes:
        amount = angles[i] * math.degrees(-1.0 if back else 1.0)
        if amount.constant() != [0.0]:
            v = g("rotate3d", v, amount, axis)
    return v
