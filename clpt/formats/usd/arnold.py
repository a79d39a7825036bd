"""Shaders of Arnold that are nodes of MaterialX under other names.

Names and meanings are those of Arnold's user guide; how many squares a checkerboard has is seen in
a picture of its testsuite (0025).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from pxr import Sdf, UsdShade

from clpt.formats.usd.document import Document
from clpt.formats.usd.textures import Node

PREFIX = "arnold:"
LIGHT = (".exr", ".hdr", ".tx")  # files whose numbers are light as they stand
WRAPS = {"black": "constant", "clamp": "clamp", "mirror": "mirror"}
CHANNELS = "rgba"


@dataclass(frozen=True)
class Same:
    """A shader as a node of MaterialX.

    inputs: the shader's inputs by those of the node; values: of inputs of the node that the shader
    says in another way, by functions of the shader.
    """

    kind: str
    inputs: Mapping[str, str] = field(default_factory=dict)
    values: Mapping[str, Callable[[Node], Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class Shader(Node):
    """A shader of Arnold as a node of MaterialX; other shaders stay as they are."""

    @property
    def same(self) -> Same:
        name = str(self.shader.GetIdAttr().Get() or "")
        return SAME.get(name, Same(name))

    @property
    def kind(self) -> str:
        return self.same.kind

    def source(self, name: str) -> tuple[Node, str] | None:
        found = super().source(self._own(name))
        if found is None:
            uv_set = str(self.value("uvset", "")) if name == "texcoord" else ""
            return (_Coordinates(self.document, self.shader), "out") if uv_set else None
        node, output = Shader(self.document, found[0].shader), found[1]
        if len(output) == 1 and output in CHANNELS and node.kind.endswith(("color3", "color4")):
            return _Channel(self.document, node.shader, output), "out"
        return node, output

    def value(self, name: str, default: object = None) -> Any:
        if name in self.same.values:
            return self.same.values[name](self)
        value = super().value(self._own(name), default)
        if name == "file" and isinstance(value, str):
            return Sdf.AssetPath(value, self.layer(self._own(name)).ComputeAbsolutePath(value))
        return value

    def color_space(self, name: str) -> str:
        return _space(self) if name == "file" else super().color_space(self._own(name))

    def _own(self, name: str) -> str:
        return self.same.inputs.get(name, name)


@dataclass(frozen=True)
class _Coordinates(Node):
    """The set of texture coordinates that an image names."""

    kind = "ND_geompropvalue_vector2"

    def source(self, name: str) -> None:
        return None

    def value(self, name: str, default: object = None) -> Any:
        return super().value("uvset") if name == "geomprop" else default


@dataclass(frozen=True)
class _Channel(Node):
    """A channel of a color that a shader returns."""

    channel: str = "r"
    kind = "ND_extract_color4"

    @property
    def path(self) -> str:
        return f"{super().path}.{self.channel}"

    def source(self, name: str) -> tuple[Node, str] | None:
        return (Shader(self.document, self.shader), "out") if name == "in" else None

    def value(self, name: str, default: object = None) -> Any:
        return CHANNELS.index(self.channel) if name == "index" else default


def surface_of(document: Document, shader: UsdShade.Shader) -> Node:
    """Return a surface shader as a node, of MaterialX if Arnold's is one."""
    node = Node(document, shader)
    return Shader(document, shader) if node.kind.startswith(PREFIX) else node


def _space(shader: Node) -> str:
    """Return the color space of an image's file, as MaterialX calls it."""
    told = str(shader.value("color_space") or "auto").lower()
    if told == "auto":
        file = shader.value("file")
        name = file.path if isinstance(file, Sdf.AssetPath) else ""
        return "raw" if name.lower().endswith(LIGHT) else "srgb_texture"
    return "srgb_texture" if "srgb" in told else "raw"


def _wrap(name: str) -> Callable[[Node], str]:
    return lambda shader: WRAPS.get(str(shader.value(name)), "periodic")


def _squares(shader: Node) -> tuple[float, float]:
    """A frequency counts pairs of squares."""
    u, v = (float(shader.value(f"{axis}_frequency", 1.0)) for axis in "uv")
    return 2.0 * u, 2.0 * v


def _zero(shader: Node) -> float:
    return 0.0


PAIR = {"in1": "input1", "in2": "input2"}
PROPERTY = {"geomprop": "attribute"}
RANGE = {
    "in": "input", "inlow": "input_min", "inhigh": "input_max", "outlow": "output_min",
    "outhigh": "output_max",
}  # fmt: skip
SAME = {
    "arnold:standard_surface": Same("ND_standard_surface_surfaceshader"),
    "arnold:openpbr_surface": Same("ND_open_pbr_surface_surfaceshader"),
    "arnold:lambert": Same(
        "ND_standard_surface_surfaceshader",
        {"base": "Kd", "base_color": "Kd_color"},
        {"specular": _zero},
    ),
    "arnold:flat": Same("ND_surface_unlit", {"emission_color": "color"}),
    "arnold:image": Same(
        "ND_image_color4",
        {"file": "filename", "default": "missing_texture_color", "texcoord": "uvcoords"},
        {"uaddressmode": _wrap("swrap"), "vaddressmode": _wrap("twrap")},
    ),
    "arnold:checkerboard": Same(
        "ND_checkerboard_color3", {"texcoord": "uvcoords"}, {"uvtiling": _squares}
    ),
    "arnold:user_data_rgb": Same("ND_geompropvalue_color3", PROPERTY),
    "arnold:user_data_float": Same("ND_geompropvalue_float", PROPERTY),
    "arnold:float_to_rgb": Same("ND_combine3_color3", {"in1": "r", "in2": "g", "in3": "b"}),
    "arnold:range": Same("ND_range_color3", RANGE),
    "arnold:add": Same("ND_add_color3", PAIR),
    "arnold:multiply": Same("ND_multiply_color3", PAIR),
}
