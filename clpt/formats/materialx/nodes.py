"""Readers of MaterialX's nodes: most are nodes of our graphs, by their names.

READERS has an entry for each category that is read; the library has graphs for others.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from clpt.arrays import Floats
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
from clpt.spectra import Blackbody

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
    default = np.broadcast_to(graph.constant(node, "default", (0.0,) * count), count)
    name = str(node.value("geomprop", ""))
    return graph.built.look_up(graph.host.attribute(name, tuple(default.tolist())), count)


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


def _logical(kind: str, **inputs: str) -> Read:
    """Return the reader of a node of booleans, which are 0 and 1."""

    def read(graph: Graph, node: Node, output: str) -> Value:
        given = {name: graph.value(node, of, 0.0) for name, of in inputs.items()}
        return graph.built.add(kind, given)

    return read


def _transformed(graph: Graph, node: Node, output: str) -> Value:
    """A vector times a matrix (3, 3) that varies with nothing: a product with each column."""
    matrix, vector = graph.value(node, "mat", IDENTITY), graph.value(node, "in", (0.0,) * 3)
    if matrix.numbers is None or matrix.width != 9 or vector.width != 3:
        raise LeftOut(f"{node.kind} is not read")
    parts = [
        graph.built.add("dotproduct", {"in1": vector, "in2": numbers_value(column)})
        for column in matrix.numbers.reshape(3, 3).T
    ]
    return graph.built.add("combine3", dict(zip(("in1", "in2", "in3"), parts, strict=True)))


def _of_numbers(function: Callable[..., object], **inputs: object) -> Read:
    """Return the reader of a node whose inputs cannot vary.

    function: of numbers (n,), with the output's name last.
    """

    def read(graph: Graph, node: Node, output: str) -> Value:
        values = [graph.value(node, name, default) for name, default in inputs.items()]
        if any(value.numbers is None for value in values):
            raise LeftOut(f"{node.kind} of what varies is not read")
        return numbers_value(function(*(value.numbers for value in values), output))

    return read


def _alphas(roughness: Floats, anisotropy: Floats, output: str) -> Floats:
    """Two alphas, whose ratio an anisotropy gives."""
    square = np.clip(roughness**2, 1e-8, 1.0)
    ratio = np.sqrt(1.0 - np.clip(anisotropy, 0.0, 0.98))
    return np.concatenate([np.minimum(square / ratio, 1.0), square * ratio])


def _two_alphas(roughness: Floats, output: str) -> Floats:
    """Two alphas; a second roughness of 0 is the first."""
    second = roughness[1:] if roughness[1] > 0.0 else roughness[:1]
    return np.clip(np.concatenate([roughness[:1], second]) ** 2, 1e-8, 1.0)


def _artistic(reflectivity: Floats, edge: Floats, output: str) -> Floats:
    """A metal's index and extinction by its colors (Gulbrandsen 2014)."""
    r = np.clip(reflectivity, 0.0, 0.99)
    least, most = (1.0 - r) / (1.0 + r), (1.0 + np.sqrt(r)) / (1.0 - np.sqrt(r))
    index = most + (least - most) * edge
    square = (r * (index + 1.0) ** 2 - (index - 1.0) ** 2) / (1.0 - r)
    return index if output != "extinction" else np.sqrt(np.maximum(square, 0.0))


def _black_body(temperature: Floats, output: str) -> object:
    kelvin = min(max(float(temperature[0]), 800.0), 25_000.0)
    return np.maximum(Blackbody(kelvin, normalised=True).to_rgb("emission"), 0.0)


IDENTITY = tuple(np.eye(3).ravel().tolist())


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
    "logical_and": _logical("and", in1="in1", in2="in2"),
    "logical_or": _logical("or", in1="in1", in2="in2"),
    "logical_not": _logical("not", **{"in": "in"}),
    "transformmatrix": _transformed,
    "roughness_anisotropy": _of_numbers(_alphas, roughness=0.0, anisotropy=0.0),
    "roughness_dual": _of_numbers(_two_alphas, roughness=(0.0, 0.0)),
    "artistic_ior": _of_numbers(
        _artistic, reflectivity=(0.944, 0.776, 0.373), edge_color=(0.998, 0.981, 0.751)
    ),
    "blackbody": _of_numbers(_black_body, temperature=5000.0),
    "image": _image,
    "position": _position,
    "texcoord": _texcoord,
    "geompropvalue": _property,
    **dict.fromkeys(
        ("normal", "tangent", "bitangent", "viewdirection", "geomcolor", "time", "frame"), _refused
    ),
}  # fmt: skip
