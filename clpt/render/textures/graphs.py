"""The kernel text of graphs of nodes, a function for each structure.

Graphs that differ by numbers and textures alone have the same structure, and so the same function:
their rows hold the numbers.
"""

from __future__ import annotations

from clpt.render.records.dispatch import Case, Function, active, function
from clpt.render.records.textures import GraphNode, Operand, Structure
from clpt.scene.textures.graph import TEXTURE
from clpt.scene.textures.nodes import FILLING, NODES, SOURCES, channels_of

TYPES = ("", "real", "vec2", "vec3", "vec4")  # of values, by their channels
XYZW = ("x", "y", "z", "w")
SECOND = "texcoord1"


def graph_text(structures: tuple[Structure, ...]) -> list[str]:
    """Return a function for each structure, and `graph_value`, which calls that of a row."""
    cases = [
        Case(f"running & (t.structure == {i})", f"graph_{i}(scene, {active('t.first')}, m, point)")
        for i in range(len(structures))
    ]
    signature = "vec4 graph_value(Graph t, Scene scene, mask running, TexturePoint point)"
    value = Function(signature, "v4(0.0f, 0.0f, 0.0f, 0.0f)", cases)
    return [*(_function(i, s) for i, s in enumerate(structures)), value.text()]


def _function(number: int, structure: Structure) -> str:
    channels: list[list[str]] = []  # of each node, as expressions
    lines = []
    for i, node in enumerate(structure.nodes):
        operands = [_channels(operand, channels) for operand in node.operands]
        if node.kind == TEXTURE:
            lines += _look_up(i, node, operands)
            channels.append([f"n{i}{c}" for c in XYZW[: node.width]])
            continue
        form = NODES[node.kind].form
        if form == "routes":
            channels.append(_routed(node, operands))
            continue
        value = _each(node, operands) if form == "each" else _vectors(node, operands)
        type_ = TYPES[node.width if form == "each" else _returned(node)]
        lines.append(f"{type_} n{i} = {value};")
        wide = type_ != "real"
        channels.append([f"n{i}.{c}" if wide else f"n{i}" for c in XYZW[: node.width]])
    result = _channels(structure.result, channels)
    whole = _as(result, 4, 4)
    signature = f"vec4 graph_{number}(Scene scene, integer at, mask running, TexturePoint point)"
    return function(signature, *lines, f"return {whole};", how="called")


def _channels(operand: Operand, channels: list[list[str]]) -> list[str]:
    """Return the channels of an operand as expressions."""
    kind, *numbers = operand
    if kind == "step":
        return channels[int(numbers[0])]
    if kind in ("words", "rows"):
        first, count = map(int, numbers)
        read = "graph_number(scene, " if kind == "words" else "graph_index(scene, running, "
        return [f"{read}at + {first + i})" for i in range(count)]
    if kind == SECOND:
        value = f"graph_second_uv(scene, graph_index(scene, running, at + {numbers[0]}), point)"
        return [f"{value}.{c}" for c in "xy"]
    member = "uv" if kind == "texcoord" else "p"
    return [f"point.{member}.{c}" for c in XYZW[: SOURCES[str(kind)]]]


def _as(channels: list[str], width: int, reach: int) -> str:
    """Return a value of a width: a number stands in the first `reach` channels, then zeros."""
    if len(channels) == 1:
        channels = channels * min(width, reach)
    channels = [*channels, *["(real)(0.0f)"] * 4][:width]
    if width == 1:
        return channels[0]
    joined = ", ".join(channels)
    return f"(vec2){{{joined}}}" if width == 2 else f"v{width}({joined})"


def _each(node: GraphNode, operands: list[list[str]]) -> str:
    """Return a function of reals for each channel."""
    calls = []
    for i in range(node.width):
        inputs = [channels[min(i, len(channels) - 1)] for channels in operands]
        calls.append(f"graph_{node.kind}({', '.join(inputs)})")
    return _as(calls, node.width, node.width)


def _returned(node: GraphNode) -> int:
    """Return the channels that a function of vectors returns."""
    kind = NODES[node.kind]
    return 4 if kind.width == 0 else kind.width


def _vectors(node: GraphNode, operands: list[list[str]]) -> str:
    kind = NODES[node.kind]
    reach = max(map(len, operands)) if kind.form == "padded" else 4
    widths = [channels_of(default) for default in kind.inputs.values()]
    inputs = [_as(o, width, reach) for o, width in zip(operands, widths, strict=False)]
    inputs += ["scene", *operands[-1]] if node.kind == "ramp" else []  # and its stops
    inputs += [str(setting) for setting in node.settings]
    return f"graph_{node.kind}({', '.join(inputs)})"


def _routed(node: GraphNode, operands: list[list[str]]) -> list[str]:
    """Return the channels of a node that only moves channels."""
    if node.kind.startswith("combine"):
        return [channel for channels in operands for channel in channels]
    (channels,) = operands
    if node.kind == "extract":
        return [channels[min(node.settings[0], len(channels) - 1)]]
    channels = channels * min(node.width, 3) if len(channels) == 1 else channels
    filled = [f"(real)({value}f)" for value in FILLING]
    return [*channels, *filled[len(channels) :]][: node.width]


def _look_up(i: int, node: GraphNode, operands: list[list[str]]) -> list[str]:
    """Return statements that look up the channels of a texture."""
    rows, *moved = operands
    lines = [f"TexturePoint p{i} = point;"]
    if moved:
        lines.append(f"p{i}.uv = {_as(moved[0], 2, 2)};")
    for c, row in zip(XYZW, rows, strict=False):
        lines.append(f"real n{i}{c} = graph_texture(scene, {row}, p{i});")
    return lines
