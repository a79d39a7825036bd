"""Networks of MaterialX nodes as values and textures, and what readers of networks provide.

What varies with nothing is a value, and an image that nothing is done to is that image. All else
becomes a `clpt.scene.textures.Graph`, whose nodes have MaterialX's names.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.arrays import Floats
from clpt.errors import SceneError
from clpt.images import interop
from clpt.images.interop import Encoding
from clpt.scene.roles import REAL
from clpt.scene.textures import Bitmap
from clpt.scene.textures import Graph as GraphTexture
from clpt.scene.textures import graph as scene_graph
from clpt.scene.textures.nodes import NODES, SOURCES
from clpt.scene.values import Texture

DEEPEST = 200  # nodes, one after the other
PROBES = np.random.default_rng(7).uniform(-1.0, 2.0, (16, 2))  # of texture coordinates
PLACES = np.random.default_rng(8).uniform(-1.0, 1.0, (16, 3))


class Node(Protocol):
    """A node of a network, of a document or of a stage."""

    @property
    def kind(self) -> str:
        """Its definition, such as ND_image_color3, or an identifier such as UsdPreviewSurface."""

    @property
    def path(self) -> str:
        """Its place, for messages."""

    def source(self, name: str) -> tuple[Node, str] | None:
        """Return the node and the output that an input is connected to."""

    def value(self, name: str, default: object = None) -> Any:
        """Return an input's value: a number, numbers, a boolean, a text or an asset."""

    def color_space(self, name: str) -> str:
        """Return the color space of an input's value, such as srgb_texture; "" for none."""


class Host(Protocol):
    """A reader of scenes, as the graph of a material asks it."""

    def warn(self, message: str, path: str) -> None:
        """Tell what is left out."""

    def image(self, asset: object, path: str) -> images.Stored | None:
        """Return the image of an input `file`; None, after a warning, where there is none."""

    def attribute(self, name: str, default: tuple[float, ...]) -> Texture:
        """Return a property of a mesh. default: of meshes without it, as wide as it."""

    def uv_mapping(self, name: str) -> str:
        """Return "uv" or "uv1" for a set of texture coordinates; "" is the usual one."""


class LeftOut(Exception):
    """A node that cannot be said; the message names it."""


@dataclass(frozen=True)
class Value:
    """An output of a node: numbers (n,) that vary with nothing, or a node of `Nodes` by its name.

    width: its channels.
    """

    width: int
    name: str = ""
    numbers: Floats | None = None

    @property
    def said(self) -> Any:
        """The value as an input of a node."""
        return self.name if self.numbers is None else tuple(self.numbers.tolist())

    def is_all(self, number: float) -> bool:
        """Return whether it is this number in all channels."""
        return self.numbers is not None and bool(np.all(self.numbers == number))


def numbers_value(values: object) -> Value:
    """Return numbers as a value. Raises LeftOut for a text."""
    array = numbers(values)
    return Value(len(array), numbers=array)


@dataclass
class Nodes:
    """The nodes and textures that a network has become.

    parts: of nodes that combine values, for each channel the value and its channel.
    """

    nodes: dict[str, dict[str, Any]] = field(default_factory=dict)
    textures: list[Texture] = field(default_factory=list)
    parts: dict[str, list[tuple[Value, int]]] = field(default_factory=dict)

    def add(self, kind: str, inputs: Mapping[str, Value], **settings: int) -> Value:
        """Return the result of a node: numbers if all inputs are numbers; else add the node.

        A node that changes nothing is not added: its input is the result. Raises LeftOut for inputs
        that do not fit to each other.
        """
        declared = NODES[kind]
        try:
            width = declared.width_of({name: v.width for name, v in inputs.items()}, settings)
        except SceneError as error:
            raise LeftOut(f"{kind}: {error.message}") from None
        plain = {name: v.numbers for name, v in inputs.items() if v.numbers is not None}
        if len(plain) == len(inputs):
            return numbers_value(np.nan_to_num(declared.evaluated(plain, settings, width)))
        if kind == "extract" and (parts := self.parts.get(inputs["in"].name)):
            value, index = parts[min(settings["index"], len(parts) - 1)]
            return self.add("extract", {"in": value}, index=index)
        kept = _unchanged(kind, inputs, settings)
        if kept is not None and kept.width == width:
            return kept
        said = {name: value.said for name, value in inputs.items()}
        added = self._named({"type": kind, **said, **settings}, width)
        if kind.startswith("combine"):
            self.parts[added.name] = [(v, i) for v in inputs.values() for i in range(v.width)]
        return added

    def look_up(self, texture: Texture, channels: int, uv: Value | None = None) -> Value:
        """Return a texture; uv: where it lies, None for the surface's own."""
        self.textures.append(texture)
        at = {} if uv is None else {"texcoord": uv.said}
        node = {"type": scene_graph.TEXTURE, "texture": len(self.textures) - 1, **at}
        return self._named({**node, "channels": channels}, channels)

    def texture(self, value: Value, *, wide: bool) -> Texture:
        """Return a value that varies as a texture; wide: of a color."""
        node = self.nodes.get(value.name, {})
        inner = self.nodes.get(str(node.get("in")), node) if node.get("type") == "extract" else node
        if inner.get("type") == scene_graph.TEXTURE and "texcoord" not in inner:
            plain = self.textures[inner["texture"]]
            if inner is not node:
                return plain if wide else plain.with_channel("rgba"[node["index"]])
            if wide == (inner["channels"] > 1):
                return plain
        return self.graph(value)

    def graph(self, value: Value) -> GraphTexture:
        """Return a value as a graph of the nodes that it needs."""
        needed, waiting = set[str](), [value.name]
        while waiting:
            name = waiting.pop()
            if name in self.nodes and name not in needed:
                needed.add(name)
                waiting += [
                    v for k, v in self.nodes[name].items() if k != "type" and v in self.nodes
                ]
        nodes = {name: node for name, node in self.nodes.items() if name in needed}
        used = sorted({n["texture"] for n in nodes.values() if "texture" in n})
        for name in [name for name, node in nodes.items() if "texture" in node]:
            nodes[name] = {**nodes[name], "texture": used.index(nodes[name]["texture"])}
        if value.name in SOURCES:
            nodes = {"value": {"type": "convert", "in": value.name}}
        output = value.name if value.name in nodes else "value"
        return GraphTexture(nodes=nodes, output=output, textures=[self.textures[i] for i in used])

    def place(self, uv: Value) -> tuple[Floats, str] | None:
        """Return the transform of coordinates (3, 3) that a value is, and its source.

        None for a value that is no such transform.
        """
        if uv.name in SOURCES:
            return (np.eye(3), uv.name) if uv.name != "position" else None
        graph = self.graph(uv) if uv.numbers is None else None
        if (
            graph is None
            or len(graph.sources) != 1
            or graph.textures
            or "position" in graph.sources
        ):
            return None
        places = np.concatenate([PROBES, np.ones((len(PROBES), 1))], axis=1)
        moved = graph.evaluated(Probing(graph))[..., :2]
        matrix, *_ = np.linalg.lstsq(places, moved, rcond=None)
        if not np.allclose(places @ matrix, moved, atol=1e-6):
            return None
        return np.vstack([matrix.T, [0.0, 0.0, 1.0]]).round(9), next(iter(graph.sources))

    def _named(self, node: dict[str, Any], width: int) -> Value:
        name = f"{node['type']}{len(self.nodes)}"
        self.nodes[name] = node
        return Value(width, name)


def _unchanged(kind: str, inputs: Mapping[str, Value], settings: Mapping[str, int]) -> Value | None:
    """Return the input that a node returns as it is; None for a node that changes something."""
    values = [*inputs.values()]
    if kind in NEUTRAL:
        a, b = values[:2]
        if b.is_all(NEUTRAL[kind]):
            return a
        if a.is_all(NEUTRAL[kind]) and kind in ("add", "multiply"):
            return b
        return Value(b.width, numbers=a.numbers) if kind == "multiply" and a.is_all(0.0) else None
    if kind == "mix":
        return values[0] if values[2].is_all(1.0) else values[1] if values[2].is_all(0.0) else None
    return values[0] if kind in ("convert", "extract") else None


NEUTRAL = {"add": 0.0, "subtract": 0.0, "multiply": 1.0, "divide": 1.0, "power": 1.0}


@dataclass(frozen=True)
class Probing:
    """A graph is evaluated at these random places; a texture counts as its mean."""

    graph: GraphTexture

    def source(self, name: str) -> Floats:
        return PLACES if name == "position" else PROBES

    def texture(self, number: int, uv: Floats | None, channels: int) -> Floats:
        texture = self.graph.textures[number]
        means = [
            part.pixels(REAL).mean() if isinstance(part, Bitmap) else 0.5
            for part in scene_graph.parts_of(texture, channels)
        ]
        return np.broadcast_to(np.array(means, np.float64), (len(PROBES), channels))


Read = Callable[["Graph", Node, str], Value]
Inner = Callable[[Node, str], "tuple[Node, str] | None"]


class Graph:
    """The network of a material.

    readers: what reads a node of each category, see `nodes`; library: returns the node in a
    definition's graph that an output of a node stands for, None where there is none.
    """

    def __init__(self, host: Host, readers: Mapping[str, Read], library: Inner):
        self.host, self.readers, self.library = host, readers, library
        self.built = Nodes()
        self._outputs: dict[tuple[str, str], Value] = {}
        self._stored: dict[str, images.Stored | None] = {}
        self._deep = 0

    def constant(self, node: Node, name: str, default: object) -> Floats:
        """Return an input (n,) that varies with nothing; of others, with a warning, the mean."""
        value = self._or_default(node, name, default)
        mean = value.numbers
        if mean is None:
            self.host.warn(f"{name} is one value for all of the surface: a mean", node.path)
            graph = self.built.graph(value)
            mean = graph.evaluated(Probing(graph)).mean(axis=0)[: value.width]
        return np.array([float(f"{number:.7g}") for number in mean])

    def texture(self, node: Node, name: str, default: object, *, wide: bool) -> Any:
        """Return an input as a number or three of them, or as a texture."""
        value = self._or_default(node, name, default)
        if value.numbers is not None:
            return said(value.numbers, wide)
        try:
            return self.built.texture(value, wide=wide)
        except SceneError as error:
            message = f"{error.message}; the default of {name} stands for it"
            self.host.warn(message, node.path)
            return said(numbers(default), wide)

    def value(self, node: Node, name: str, default: object) -> Value:
        """Return an input. default: numbers, or the name of a source. Raises LeftOut."""
        source = node.source(name)
        if source is not None:
            return self.output(*source)
        given = node.value(name)
        given = default if given is None else given
        if given is None:
            raise LeftOut(f"{node.kind} without {name}")
        if isinstance(given, str) and given in SOURCES:
            return Value(SOURCES[given], given)
        return numbers_value(from_space(numbers(given), node.color_space(name)))

    def output(self, node: Node, output: str) -> Value:
        """Return an output of a node. Raises LeftOut."""
        key = node.path, output
        if key in self._outputs:
            return self._outputs[key]
        self._deep += 1
        try:
            if self._deep > DEEPEST:
                raise LeftOut("a graph of more than 200 nodes in a row, or in a circle")
            read = self.readers.get(category(node.kind))
            inner = None if read else self.library(node, output)
            if read is not None:
                value = read(self, node, output)
            elif inner is not None:
                value = self.output(*inner)
            else:
                raise LeftOut(f"{node.kind} is not read")
        finally:
            self._deep -= 1
        self._outputs[key] = value
        return value

    def stored(self, node: Node) -> images.Stored | None:
        """Return the image of a node, as its file has it."""
        if node.path not in self._stored:
            source = node.source("file")
            asset = node.value("file") if source is None else source[0].value("value")
            self._stored[node.path] = self.host.image(asset, node.path)
        return self._stored[node.path]

    def _or_default(self, node: Node, name: str, default: object) -> Value:
        try:
            return self.value(node, name, default)
        except LeftOut as left_out:
            self.host.warn(f"{left_out}; the default of {name} stands for it", node.path)
            return numbers_value(default)


TYPES = {
    "float": 1, "integer": 1, "boolean": 1, "vector2": 2, "vector3": 3, "vector4": 4, "color3": 3,
    "color4": 4, "matrix33": 9, "matrix44": 16,
}  # fmt: skip
_TYPE = re.compile(rf"({'|'.join(TYPES)}|surfaceshader|string|filename)(FA|CF|VF|[IBVM]|\d)*")


def category(kind: str) -> str:
    """Return the category of a node by its definition: ND_image_color3 is an image."""
    if not kind.startswith("ND_"):
        return kind
    words = kind[3:].split("_")
    while len(words) > 1 and _TYPE.fullmatch(words[-1]):
        words.pop()
    return "_".join(words)


def width(kind: str) -> int:
    """Return how many numbers a definition's output has; 0 where it does not say so."""
    found = _TYPE.fullmatch(kind.rsplit("_", 1)[-1])
    return TYPES.get(found[1], 0) if found else 0


def numbers(value: object) -> Floats:
    """Return a value (channels,) float64. Raises LeftOut for a text."""
    try:
        array = np.asarray(value, np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise LeftOut(f"{value!r} is no number") from None
    return array


def from_space(value: Floats, space: str) -> Floats:
    """Return colors (..., 3 or 4) of a color space as linear Rec. 709."""
    if value.shape[-1] < 3 or space in LINEAR:
        return value
    encoding = SPACES.get(space) or interop.encoding(space)
    if encoding is None:
        return value
    return np.concatenate([encoding.linear(value[..., :3]), value[..., 3:]], axis=-1)


LINEAR = ("", "raw", "none", "lin_rec709", "lin_rec709_scene", "auto")
# From other primaries to linear Rec. 709 (MaterialX, Appendix of its specification on color spaces)
AP1 = np.array([
    [1.70505, -0.62179, -0.08326], [-0.13026, 1.14080, -0.01055], [-0.02400, -0.12897, 1.15297],
])  # fmt: skip
P3 = np.array([
    [1.22494, -0.22494, 0.0], [-0.04206, 1.04206, 0.0], [-0.01964, -0.07864, 1.09828],
])  # fmt: skip
ADOBE = np.array([
    [1.39836, -0.39836, 0.0], [0.0, 1.0, 0.0], [0.0, -0.04293, 1.04293],
])  # fmt: skip
SRGB = Encoding(True, None, None)
SPACES = {
    **dict.fromkeys(("srgb_texture", "srgb_rec709_scene", "sRGB"), SRGB),
    **dict.fromkeys(("g22_rec709", "g22_rec709_scene"), Encoding(True, 1 / 2.2, None)),
    "g18_rec709": Encoding(True, 1 / 1.8, None), "rec709_display": Encoding(True, 1 / 2.4, None),
    **dict.fromkeys(("acescg", "lin_ap1", "lin_ap1_scene"), Encoding(False, None, AP1)),
    "g22_ap1": Encoding(True, 1 / 2.2, AP1), "lin_displayp3": Encoding(False, None, P3),
    "srgb_displayp3": Encoding(True, None, P3), "lin_adobergb": Encoding(False, None, ADOBE),
    "adobergb": Encoding(True, 256.0 / 563.0, ADOBE),
}  # fmt: skip


def bitmap_of(stored: images.Stored, space: str) -> dict[str, Any]:
    """Return `image` and `raw` of a bitmap whose file is in a color space."""
    if space in LINEAR:
        return {"image": stored.values, "raw": True}
    if SPACES.get(space) is SRGB and stored.values.dtype == np.uint8:
        return {"image": stored.values, "raw": False}
    return {"image": pixels_of(stored, space), "raw": True}


def pixels_of(stored: images.Stored, space: str) -> NDArray[np.float32]:
    """Return an image's pixels (h, w, c) as linear Rec. 709, or as they are where they are data."""
    values = stored.decoded(linear=False)
    return (
        values
        if space in LINEAR
        else from_space(np.asarray(values, np.float64), space).astype(np.float32)
    )


def said(value: Floats, wide: bool) -> Any:
    """Return numbers without what single precision has added to them."""
    said = [float(f"{number:.7g}") for number in value]
    return tuple(np.broadcast_to(said[:3], 3).tolist()) if wide else said[0]
