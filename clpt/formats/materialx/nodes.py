"""Readers of MaterialX's nodes: most are nodes of our graphs, by their names.

READERS has an entry for each category that is read; the library has graphs for others.
"""

from __future__ import annotations

import numpy as np

from clpt.formats.materialx.graph import (
    Graph,
    LeftOut,
    Node,
    Read,
    Value,
    bitmap_of,
    numbers,
    numbers_value,
    width,
)
from clpt.scene.textures import Bitmap
from clpt.scene.textures.nodes import NODES

WRAPS = {"periodic": "repeat", "clamp": "clamp", "mirror": "mirror", "constant": "zero"}


def _by_name(kind: str) -> Read:
    """Return the reader of a node that our graphs have."""
    declared = NODES[kind]

    def read(graph: Graph, node: Node, output: str) -> Value:
        inputs = {
            name: graph.value(node, name, default) for name, default in declared.inputs.items()
        }
        settings = {key: _whole(node, key, limits[0]) for key, limits in declared.settings.items()}
        wide = width(node.kind)
        if "channels" in settings:
            settings["channels"] = max(wide, 1)
        value = graph.built.add(kind, inputs, **settings)
        if wide == 4 and value.width == 3:  # of the color; alpha stays
            alpha = graph.built.add("extract", {"in": inputs["in"]}, index=3)
            return graph.built.add("combine2", {"in1": value, "in2": alpha})
        return value

    return read


def _whole(node: Node, name: str, default: int) -> int:
    return int(numbers(node.value(name, default))[0])


def _constant(graph: Graph, node: Node, output: str) -> Value:
    return graph.value(node, "value", 0.0)


def _dot(graph: Graph, node: Node, output: str) -> Value:
    return graph.value(node, "in", 0.0)


def _combined(graph: Graph, node: Node, output: str) -> Value:
    kind = "combine" + node.kind.split("combine")[1][0]
    inputs = {name: graph.value(node, name, 0.0) for name in NODES[kind].inputs}
    return graph.built.add(kind, inputs)


def _extracted(graph: Graph, node: Node, output: str) -> Value:
    value = graph.value(node, "in", 0.0)
    return graph.built.add("extract", {"in": value}, index=_whole(node, "index", 0))


def _separated(graph: Graph, node: Node, output: str) -> Value:
    value = graph.value(node, "in", (0.0,) * 4)
    at = max("xyzw".find(output[-1]), "rgba".find(output[-1]))
    return graph.built.add("extract", {"in": value}, index=at)


def _converted(graph: Graph, node: Node, output: str) -> Value:
    value = graph.value(node, "in", 0.0)
    return graph.built.add("convert", {"in": value}, channels=width(node.kind) or value.width)


def _texcoord(graph: Graph, node: Node, output: str) -> Value:
    """A set of texture coordinates, by number or by the name of a property."""
    name = node.value("geomprop", None)
    if name is None:
        number = _whole(node, "index", 0) if node.value("index") is not None else 0
        name = ("", "uv1")[min(number, 1)]
    return Value(2, "texcoord1" if graph.host.uv_mapping(str(name)) == "uv1" else "texcoord")


def _property(graph: Graph, node: Node, output: str) -> Value:
    count = width(node.kind)
    if count == 2:
        return _texcoord(graph, node, output)
    if count not in (1, 3):
        raise LeftOut(f"{node.kind} is not read")
    return graph.built.look_up(graph.host.attribute(str(node.value("geomprop", "")), count), count)


def _position(graph: Graph, node: Node, output: str) -> Value:
    return Value(3, "position")


def _image(graph: Graph, node: Node, output: str) -> Value:
    stored = graph.stored(node)
    count = width(node.kind) or 3
    if stored is None:
        default = node.value("default", None)
        return numbers_value((0.0,) * count if default is None else default)
    uv = graph.value(node, "texcoord", "texcoord")
    place = graph.built.place(uv)
    names = [str(node.value(f"{axis}addressmode", "periodic")) for axis in "uv"]
    wrap, wrap_v = (WRAPS.get(name, "repeat") for name in names)
    to_uv, source = place or (np.eye(3), "texcoord")
    bitmap = Bitmap(
        **bitmap_of(stored, node.color_space("file") if "_color" in node.kind else "raw"),
        to_uv=to_uv,
        mapping="uv1" if source == "texcoord1" else "uv",
        filter="nearest" if node.value("filtertype", "linear") == "closest" else "bilinear",
        wrap=wrap,
        wrap_v=None if wrap_v == wrap else wrap_v,
        channel="r",
    )
    value = graph.built.look_up(bitmap, max(count, 3) if count > 1 else 1, None if place else uv)
    return graph.built.add("convert", {"in": value}, channels=count)


def _refused(graph: Graph, node: Node, output: str) -> Value:
    raise LeftOut(f"{node.kind} is not read")


SPECIAL = ("ramp", "convert", "extract", "combine2", "combine3", "combine4")  # not by our inputs
READERS: dict[str, Read] = {
    **{kind: _by_name(kind) for kind in NODES if kind not in SPECIAL},
    "constant": _constant,
    "dot": _dot,
    "combine2": _combined, "combine3": _combined, "combine4": _combined,
    "extract": _extracted,
    "separate2": _separated, "separate3": _separated, "separate4": _separated,
    "convert": _converted,
    "image": _image,
    "position": _position,
    "texcoord": _texcoord,
    "geompropvalue": _property,
    **dict.fromkeys(
        ("normal", "tangent", "bitangent", "viewdirection", "geomcolor", "time", "frame"), _refused
    ),
}  # fmt: skip
