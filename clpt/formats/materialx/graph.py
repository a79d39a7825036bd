"""Graphs of MaterialX nodes as textures: what readers of networks tell, and how graphs are baked.

A graph that varies with nothing is a value. A graph over one image, whatever is done with its
colors, is an image with that done to its pixels, in the image's own place. All other graphs over
texture coordinates become an image of the unit square, which repeats.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.arrays import Floats
from clpt.images.interop import Encoding
from clpt.scene.textures import Bitmap
from clpt.scene.values import Texture

LEAST, MOST = 256, 2048  # pixels along a side of a baked image
PATTERN = 1024  # of a baked pattern without images
DEEPEST = 200  # nodes, one after the other
WRAPS = {"periodic": "repeat", "clamp": "clamp", "mirror": "mirror", "constant": "zero"}
PLACES = np.random.default_rng(8).uniform(-1.0, 1.0, (4, 4, 3))  # in space, likewise
PASSING = ("dot", "extract", "separate2", "separate3", "separate4")
PROBES = np.random.default_rng(7).uniform(-1.0, 2.0, (4, 4, 2))  # places that tell how uv are moved


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

    def attribute(self, name: str, count: int) -> Texture:
        """Return a property of a mesh, of a count of numbers for each place."""

    def uv_mapping(self, name: str) -> str:
        """Return "uv" or "uv1" for a set of texture coordinates; "" is the usual one."""


class LeftOut(Exception):
    """A node that cannot be said; the message names it."""


@dataclass
class Leaf:
    """An image in a graph: where its texture coordinates are, (h, w, 2), and its pixels."""

    node: Node
    uv: Floats
    wraps: tuple[str, str]
    filter: str
    pixels: NDArray[np.float32]


@dataclass
class Domain:
    """The places where a graph is evaluated: texture coordinates (h, w, 2), v = 0 at the bottom.

    own: whether the pixels of images are taken as they are. leaves, sets: what the graph has read;
    patterns: whether it reads coordinates beside those of images; varies: whether it reads any.
    places: (h, w, 3) in space, None where there are none; solid: whether it reads them. outputs:
    those of nodes that have been evaluated.
    """

    uv: Floats
    own: bool = False
    leaves: list[Leaf] = field(default_factory=list)
    sets: list[str] = field(default_factory=list)
    patterns: bool = False
    places: Floats | None = None
    solid: bool = False
    outputs: dict[tuple[str, str], Floats] = field(default_factory=dict)

    @property
    def varies(self) -> bool:
        return bool(self.leaves or self.sets or self.solid)


def probing() -> Domain:
    """Return a domain of random places."""
    return Domain(PROBES, places=PLACES)


Evaluate = Callable[["Graph", Node, str, Domain], Floats]
Solid = Callable[["Graph", Node, str, bool], Any]
Inner = Callable[[Node, str], "tuple[Node, str] | None"]


class Graph:
    """The network of a material.

    functions: what a node of each category computes, see `nodes`; solid: returns a graph over
    places in space as a texture, see `solids`; library: returns the node in a
    definition's graph that an output of a node stands for, None where there is none.
    """

    def __init__(self, host: Host, functions: dict[str, Evaluate], library: Inner, solid: Solid):
        self.host, self.functions, self.library, self.solid = host, functions, library, solid
        self._stored: dict[str, images.Stored | None] = {}
        self._deep = 0

    def constant(self, node: Node, name: str, default: object) -> Floats:
        """Return an input (n,) that varies with nothing; of others, with a warning, the mean."""
        probe = probing()
        value = self._or_default(node, name, default, probe)
        if probe.varies:
            self.host.warn(f"{name} is one value for all of the surface: a mean", node.path)
        mean = value.reshape(-1, value.shape[-1]).mean(axis=0)
        return np.array([float(f"{number:.7g}") for number in mean])

    def texture(self, node: Node, name: str, default: object, *, wide: bool) -> Any:
        """Return an input as a number or three of them, or as a texture."""
        source = node.source(name)
        plain = None if source is None else self._plain(*source, wide=wide)
        if plain is not None:
            return plain
        probe = probing()
        value = self._or_default(node, name, default, probe)
        if not probe.varies:
            return said(value.reshape(-1), wide)
        if probe.solid and source is not None:
            return self._solid(*source, name, default, wide=wide)
        return self._baked(node, name, default, probe, wide=wide)

    def evaluated(self, node: Node, name: str, default: object, domain: Domain) -> Floats:
        """Return an input (..., channels) at the places of a domain. Raises LeftOut."""
        source = node.source(name)
        if source is None:
            value = node.value(name)
            given = default if value is None else value
            if given is None:
                raise LeftOut(f"{node.kind} without {name}")
            return from_space(numbers(given), node.color_space(name))
        return self.output(*source, domain)

    def output(self, node: Node, output: str, domain: Domain) -> Floats:
        """Return an output of a node (..., channels). Raises LeftOut."""
        key = node.path, output
        if key in domain.outputs:
            return domain.outputs[key]
        self._deep += 1
        try:
            if self._deep > DEEPEST:
                raise LeftOut("a graph of more than 200 nodes in a row, or in a circle")
            function = self.functions.get(category(node.kind))
            inner = None if function else self.library(node, output)
            if function is not None:
                value = function(self, node, output, domain)
            elif inner is not None:
                value = self.output(*inner, domain)
            else:
                raise LeftOut(f"{node.kind} is not read")
        finally:
            self._deep -= 1
        domain.outputs[key] = value
        return value

    def stored(self, node: Node) -> images.Stored | None:
        """Return the image of a node, as its file has it."""
        if node.path not in self._stored:
            source = node.source("file")
            asset = node.value("file") if source is None else source[0].value("value")
            self._stored[node.path] = self.host.image(asset, node.path)
        return self._stored[node.path]

    def _or_default(self, node: Node, name: str, default: object, domain: Domain) -> Floats:
        try:
            return self.evaluated(node, name, default, domain)
        except LeftOut as left_out:
            self.host.warn(f"{left_out}; the default of {name} stands for it", node.path)
            domain.leaves.clear()
            domain.sets.clear()
            domain.solid = False
            return numbers(default)

    def _solid(self, node: Node, output: str, name: str, default: object, *, wide: bool) -> Any:
        try:
            return self.solid(self, node, output, wide)
        except LeftOut as left_out:
            self.host.warn(f"{left_out}; the default of {name} stands for it", node.path)
            return said(numbers(default), wide)

    def _plain(self, node: Node, output: str, *, wide: bool) -> Any:
        """Return an image that nothing is done to, or an attribute of a mesh; else None."""
        channel = None
        while (kind := category(node.kind)) in PASSING:
            if kind == "extract":
                channel = "rgba"[int(numbers(node.value("index", 0))[0])]
            elif kind != "dot":
                channel = {"x": "r", "y": "g", "z": "b", "w": "a"}.get(output[3:], output[3:])
            source = node.source("in")
            if source is None or (channel and wide):
                return None
            node, output = source
        if kind == "geompropvalue" and width(node.kind) == (3 if wide else 1):
            return self.host.attribute(str(node.value("geomprop", "")), width(node.kind))
        if kind != "image" or (wide and width(node.kind) < 3):
            return None
        probe = probing()
        try:
            self.output(node, "out", probe)
        except LeftOut:
            return None
        placed = _placed(probe)
        stored = self.stored(node)
        if placed is None or stored is None:
            return None
        how = bitmap_of(stored, node.color_space("file") if _is_color(node.kind) else "raw")
        mapping = self.host.uv_mapping(probe.sets[0])
        return Bitmap(**how, **placed, mapping=mapping, channel=channel or "r")

    def _baked(
        self, node: Node, name: str, default: object, probe: Domain, *, wide: bool
    ) -> Bitmap:
        if len(set(probe.sets)) > 1:
            message = f"{name} reads several sets of coordinates; one stands for all"
            self.host.warn(message, node.path)
        placed = None if probe.patterns else _placed(probe)
        mapping = self.host.uv_mapping(probe.sets[0] if probe.sets else "")
        if placed is not None:
            leaf = probe.leaves[0]
            domain = Domain(np.zeros((*leaf.pixels.shape[:2], 2)), own=True)
        else:
            placed = {"wrap": "repeat"}
            domain = Domain(_square(_resolution(probe)))
        value = self._or_default(node, name, default, domain)
        pixels = np.broadcast_to(value, (*domain.uv.shape[:2], value.shape[-1]))
        pixels = pixels[..., :3] if wide else pixels[..., :1]
        if wide and pixels.shape[-1] == 1:
            pixels = np.repeat(pixels, 3, axis=-1)
        image = np.nan_to_num(pixels).astype(np.float32)
        return Bitmap(image=np.ascontiguousarray(image), raw=True, mapping=mapping, **placed)


TYPES = {
    "float": 1, "integer": 1, "boolean": 1, "vector2": 2, "vector3": 3, "vector4": 4, "color3": 3,
    "color4": 4, "matrix33": 9, "matrix44": 16,
}  # fmt: skip
_TYPE = re.compile(rf"({'|'.join(TYPES)}|surfaceshader|string|filename)(FA|[IBVM]|\d)*")


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


def _is_color(kind: str) -> bool:
    return "_color" in kind


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
    encoding = SPACES.get(space)
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


def _placed(probe: Domain) -> dict[str, Any] | None:
    """Return where bitmaps lie, by where their coordinates are.

    None without images, for images in several places, and where a place is no matrix.
    """
    if not probe.leaves or not all(_same_place(leaf, probe.leaves[0]) for leaf in probe.leaves):
        return None
    leaf = probe.leaves[0]
    places = np.concatenate([probe.uv.reshape(-1, 2), np.ones((probe.uv[..., 0].size, 1))], axis=1)
    moved = np.broadcast_to(leaf.uv, probe.uv.shape).reshape(-1, 2)
    matrix, *_ = np.linalg.lstsq(places, moved, rcond=None)
    if not np.allclose(places @ matrix, moved, atol=1e-6):
        return None
    to_uv = np.vstack([matrix.T, [0.0, 0.0, 1.0]]).round(9)
    place: dict[str, Any] = {"wrap": leaf.wraps[0], "filter": leaf.filter}
    if leaf.wraps[1] != leaf.wraps[0]:
        place["wrap_v"] = leaf.wraps[1]
    return place if np.array_equal(to_uv, np.eye(3)) else {**place, "to_uv": to_uv}


def _same_place(a: Leaf, b: Leaf) -> bool:
    alike = a.pixels.shape[:2] == b.pixels.shape[:2] and a.wraps == b.wraps
    return alike and np.allclose(np.broadcast_to(a.uv, PROBES.shape), b.uv)


def _resolution(probe: Domain) -> int:
    """Return the pixels along a side that keep the detail of a graph's images."""
    most = PATTERN if probe.patterns else LEAST
    for leaf in probe.leaves:
        spread, whole = (np.ptp(uv.reshape(-1, 2), axis=0).max() for uv in (leaf.uv, probe.uv))
        most = max(most, math.ceil(max(leaf.pixels.shape[:2]) * max(spread / whole, 0.1)))
    return min(most, MOST)


def _square(side: int) -> Floats:
    """Return the texture coordinates of an image's pixels, (side, side, 2)."""
    at = (np.arange(side) + 0.5) / side
    return np.stack(np.meshgrid(at, at[::-1]), axis=-1)


def sampled(leaf: Leaf) -> Floats:
    """Return an image's colors at its texture coordinates, bilinear; outside by its wraps."""
    h, w, count = leaf.pixels.shape
    x, y = leaf.uv[..., 0] * w - 0.5, (1.0 - leaf.uv[..., 1]) * h - 0.5
    if leaf.filter == "nearest":
        x, y = np.round(x), np.round(y)
    left, top = np.floor(x), np.floor(y)
    total = np.zeros((*leaf.uv.shape[:2], count))
    for dx, dy in ((0, 0), (1, 0), (0, 1), (1, 1)):
        weight = np.abs(1 - dx - (x - left)) * np.abs(1 - dy - (y - top))
        column, in_x = _wrapped(left + dx, w, leaf.wraps[0])
        row, in_y = _wrapped(top + dy, h, leaf.wraps[1])
        total += (weight * in_x * in_y)[..., None] * leaf.pixels[row, column]
    return total


def _wrapped(at: Floats, count: int, wrap: str) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    whole, inside = at.astype(np.int64), np.ones(at.shape, bool)
    if wrap == "repeat":
        return whole % count, inside
    if wrap == "mirror":
        turned = whole % (2 * count)
        return np.minimum(turned, 2 * count - 1 - turned), inside
    if wrap == "zero":
        inside = (whole >= 0) & (whole < count)
    return np.clip(whole, 0, count - 1), inside
