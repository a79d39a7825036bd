"""UsdUVTexture, UsdPrimvarReader and UsdTransform2d as textures (UsdPreviewSurface 2.6).

A `Node` is a shader; its inputs are values, or connections to outputs of other shaders.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Usd, UsdShade

from clpt import images
from clpt.errors import SceneError
from clpt.files import budget
from clpt.formats.usd.document import Document, read_image
from clpt.scene import gltf_material
from clpt.scene.textures import Bitmap, MeshAttribute
from clpt.scene.values import Texture


@dataclass(frozen=True)
class Node:
    """A shader of a stage."""

    document: Document
    shader: UsdShade.Shader

    @property
    def kind(self) -> str:
        """Its identifier, such as UsdUVTexture; "" for none."""
        return str(self.shader.GetIdAttr().Get() or "")

    @property
    def path(self) -> str:
        return str(self.shader.GetPath())

    def source(self, name: str) -> tuple[Node, str] | None:
        """Return the shader and the name of the output that an input is connected to."""
        attribute = self._attribute(name)
        if attribute is None or not UsdShade.Output.IsOutput(attribute):
            return None
        shader = UsdShade.Shader(attribute.GetPrim())
        return Node(self.document, shader), UsdShade.Output(attribute).GetBaseName()

    def value(self, name: str, default: object = None) -> Any:
        """Return an input's value, which an interface of the material may have; else `default`."""
        attribute = self._attribute(name)
        if attribute is None or UsdShade.Output.IsOutput(attribute):
            return default
        value = attribute.Get(self.document.time)
        return default if value is None else value

    def color_space(self, name: str) -> str:
        """Return the color space that an input's value says it has; "" for none."""
        attribute = self._attribute(name)
        return "" if attribute is None else str(attribute.GetColorSpace())

    def number(self, name: str, default: float) -> float:
        """Return an input that is a finite number; `default`, with a warning, for another."""
        value = self.value(name, default)
        if isinstance(value, (int, float)) and np.isfinite(value):
            return float(value)
        self.document.warn(f"{name} is no finite number; {default:g} stands for it", self.path)
        return default

    def numbers(self, name: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return an input of several finite numbers; `default`, with a warning, for others."""
        value = self.value(name, default)
        try:
            numbers = tuple(float(number) for number in value)
        except (TypeError, ValueError):
            numbers = ()
        if len(numbers) == len(default) and np.isfinite(numbers).all():
            return numbers
        self.document.warn(
            f"{name} is not {len(default)} finite numbers; {default} stands for it", self.path
        )
        return default

    def layer(self, name: str) -> Sdf.Layer:
        """Return the layer that an input's value stands in; paths are relative to it."""
        stack = self.shader.GetInput(name).GetAttr().GetPropertyStack(self.document.time)
        return stack[0].layer

    def _attribute(self, name: str) -> Usd.Attribute | None:
        port = self.shader.GetInput(name)
        sources = port.GetValueProducingAttributes() if port else ()
        return sources[0] if sources else None


WRAPS = {
    "black": "zero", "clamp": "clamp", "repeat": "repeat", "mirror": "mirror",
    "useMetadata": "zero",
}  # fmt: skip
SPACES = ("auto", "sRGB", "raw")
READER, TRANSFORM, IMAGE = "UsdPrimvarReader_", "UsdTransform2d", "UsdUVTexture"
UDIM, FIRST_TILE, LAST_TILE = "<UDIM>", 1001, 1100
DEEPEST = 32  # of transforms, one after the other


@dataclass
class Uses:
    """The primvars that a material reads: sets of texture coordinates, and others.

    It is the host of a material's network of MaterialX. fallbacks: by name, the values of vertices
    of a mesh without the primvar.
    """

    document: Document
    uv_sets: list[str] = field(default_factory=list)
    fallbacks: dict[str, tuple[float, ...]] = field(default_factory=dict)

    def warn(self, message: str, path: str) -> None:
        self.document.warn(message, path)

    def image(self, asset: object, path: str) -> images.Stored | None:
        return read(self.document, asset, path)

    def attribute(self, name: str, default: tuple[float, ...]) -> MeshAttribute:
        self.fallbacks.setdefault(name, default)
        return MeshAttribute(name=f"vertex_{name}")

    def uv_mapping(self, name: str) -> str:
        """Return how a bitmap finds a set of texture coordinates; there may be two."""
        name = name or "st"
        if name not in self.uv_sets:
            self.uv_sets.append(name)
        return "uv1" if self.uv_sets.index(name) == 1 else "uv"


def colour(node: Node, name: str, default: tuple[float, ...], uses: Uses) -> Any:
    """Return a color input: three numbers, or a texture."""
    source = node.source(name)
    if source is None:
        return tuple(max(value, 0.0) for value in node.numbers(name, default))
    return _texture(*source, uses, default)


def number(node: Node, name: str, default: float, uses: Uses) -> Any:
    """Return a number's input: the number, or a texture."""
    source = node.source(name)
    if source is None:
        return node.number(name, default)
    return _texture(*source, uses, (default,))


def _texture(node: Node, output: str, uses: Uses, default: tuple[float, ...]) -> Any:
    """Return what a shader's output is, as one or three numbers or a texture."""
    wide = len(default) == 3
    if node.kind == IMAGE:
        return image(node, output, uses, wide=wide)
    if node.kind.startswith(READER):
        return _primvar(node, uses, default)
    kind = node.kind or "a shader without info:id"
    node.document.warn(f"{kind} is not read; its input's fallback stands for it", node.path)
    return default if wide else default[0]


def _primvar(node: Node, uses: Uses, default: tuple[float, ...]) -> Texture:
    name = str(node.value("varname", ""))
    if node.kind.endswith(("2", "3", "4")):
        row = node.numbers("fallback", (0.0,) * int(node.kind[-1]))
    else:
        row = (node.number("fallback", default[0]),)
    uses.fallbacks[name] = (row + default)[: len(default)]
    return MeshAttribute(name=f"vertex_{name}")


def image(node: Node, output: str, uses: Uses, *, wide: bool) -> Any:
    """Return an output of a UsdUVTexture: three numbers or one, or a texture.

    wide: whether three are wanted.
    """
    scale = node.numbers("scale", (1.0,) * 4)
    bias = node.numbers("bias", (0.0,) * 4)
    channel = output if output in "rgba" and len(output) == 1 else "r"
    at = slice(0, 3) if wide else slice("rgba".index(channel), "rgba".index(channel) + 1)
    bitmap = bitmap_of(node, uses, channel=None if wide else channel)
    if bitmap is None:
        fallback = np.array(node.numbers("fallback", (0.0, 0.0, 0.0, 1.0)))
        values = tuple((fallback[at] * scale[at] + bias[at]).tolist())
        return values if wide else values[0]
    if any(bias[at]) or min(scale[at]) < 0.0:
        return _baked(bitmap, scale, bias)
    if wide:
        return gltf_material.tinted(bitmap, scale[:3])
    return gltf_material.times(bitmap, scale[at][0])


def _baked(bitmap: Bitmap, scale: Sequence[float], bias: Sequence[float]) -> Bitmap:
    """Return a bitmap whose values are scaled and moved, and those below zero cut off."""
    values = pixels(bitmap)
    rgba = np.ones((*values.shape[:2], 4), np.float32)
    rgba[..., : values.shape[2]] = values
    if values.shape[2] < 3:
        rgba[..., :3], rgba[..., 3] = (
            values[..., :1],
            values[..., -1] if values.shape[2] == 2 else 1.0,
        )
    moved = rgba * np.array(scale, np.float32) + np.array(bias, np.float32)
    return dataclasses.replace(bitmap, image=np.maximum(moved, 0.0), raw=True)


def pixels(bitmap: Bitmap) -> NDArray[np.float32]:
    """Return a bitmap's values as its texture has them, (h, w, c) float32."""
    array = np.asarray(bitmap.image)
    stored = images.Stored(array, encoded=not bitmap.raw and array.dtype == np.uint8)
    return stored.decoded()


def bitmap_of(node: Node, uses: Uses, *, channel: str | None) -> Bitmap | None:
    """Return the bitmap of a UsdUVTexture; None, with a warning, where its file is not there.

    channel: of r, g, b, a that a number is taken from.
    """
    space = str(node.value("sourceColorSpace", "auto"))
    if space not in SPACES:
        node.document.warn(f"sourceColorSpace {space!r} is read as auto", node.path)
        space = "auto"
    values: dict[str, Any] = {**_wraps(node), **_coordinates(node, uses)}
    asset = node.value("file")
    if isinstance(asset, Sdf.AssetPath) and UDIM in asset.path:
        stored, tiles = _tiled(node, asset)
        shrink = np.diag([1.0 / tiles[0], 1.0 / tiles[1], 1.0])
        values |= {"to_uv": shrink @ values.get("to_uv", np.eye(3)), "wrap": "zero"}
        values.pop("wrap_v", None)
    else:
        stored = read(node.document, asset, node.path)
    if stored is None:
        return None
    if channel is not None:
        values["channel"] = channel
    return Bitmap(**_decoded(stored, space), **values)


def _decoded(stored: images.Stored, space: str) -> dict[str, Any]:
    """Return `image` and `raw` of a bitmap. space: of SPACES.

    `auto` reads three or four channels of 8 bits as sRGB, and others as they are; colors of other
    primaries that the file tells become linear Rec. 709.
    """
    is_bytes = stored.values.dtype == np.uint8
    if space == "auto":
        if (is_bytes and stored.values.shape[2] < 3) or (stored.matrix is None and not is_bytes):
            space = "raw"
        stored = stored.meant(space == "raw")
    elif space == "sRGB":
        stored = images.Stored(stored.values, encoded=True)
    if space == "raw" or (is_bytes and stored.values.dtype == np.uint8):
        return {"image": stored.values, "raw": space == "raw"}
    return {"image": stored.decoded(), "raw": True}


def read(document: Document, asset: object, path: str) -> images.Stored | None:
    """Return the image that an asset names; None, with a warning, where it cannot be read."""
    if not isinstance(asset, Sdf.AssetPath) or not asset.path:
        document.warn("names no image; its fallback stands for it", path)
        return None
    key = asset.resolvedPath or asset.path

    def stored() -> images.Stored | None:
        try:
            return read_image(document, asset)
        except SceneError as error:
            document.warn(
                f"image {asset.path!r}: {error.message}; its fallback stands for it", path
            )
            return None

    return document.once(("image", key), stored)


def _tiled(node: Node, asset: Sdf.AssetPath) -> tuple[images.Stored | None, tuple[int, int]]:
    """Return the tiles of a UDIM texture as one image, and how many there are along u and v.

    Each is as large as the largest; there is black where a tile is not there.
    """
    document, parts = node.document, {}
    layer = node.layer("file")
    for path, tile in UsdShade.UdimUtils.ResolveUdimTilePaths(asset.path, layer):
        number = int(tile) - FIRST_TILE
        stored = read(document, Sdf.AssetPath(path, path), node.path)
        if stored is not None and 0 <= number < LAST_TILE - FIRST_TILE + 1:
            parts[number % 10, number // 10] = stored
    if not parts:
        document.warn(f"image {asset.path!r} has no tile; its fallback stands for it", node.path)
        return None, (1, 1)
    first = next(iter(parts.values()))
    sizes = [part.values.shape for part in parts.values()]
    height, width, depth = (max(sizes_) for sizes_ in zip(*sizes, strict=True))
    across, up = (max(at[axis] for at in parts) + 1 for axis in (0, 1))
    kind = first.values.dtype
    budget.take(kind.itemsize * height * width * depth * across * up, "tiles", document.file)
    whole = np.zeros((up * height, across * width, depth), kind)
    for (u, v), part in parts.items():
        if part.values.dtype != kind or part.encoded != first.encoded:
            document.warn("a tile of another kind than the first is left out", node.path)
            continue
        y, x = (np.arange(n) * part.values.shape[i] // n for i, n in enumerate((height, width)))
        top = (up - 1 - v) * height
        tile_values = part.values[y[:, None], x]
        whole[top : top + height, u * width : (u + 1) * width, : tile_values.shape[2]] = tile_values
    return dataclasses.replace(first, values=whole), (across, up)


def _wraps(node: Node) -> dict[str, str]:
    wraps = []
    for name in ("wrapS", "wrapT"):
        wrap = str(node.value(name, "useMetadata"))
        if wrap not in WRAPS:
            node.document.warn(f"{name} {wrap!r} is read as black", node.path)
        wraps.append(WRAPS.get(wrap, "zero"))
    return {"wrap": wraps[0]} | ({"wrap_v": wraps[1]} if wraps[1] != wraps[0] else {})


def _coordinates(node: Node, uses: Uses) -> dict[str, Any]:
    """Return `mapping` and `to_uv` of what a texture's st is connected to."""
    matrix, source = np.eye(3), node.source("st")
    for _ in range(DEEPEST):
        if source is None or source[0].kind != TRANSFORM:
            break
        matrix = matrix @ _transform(source[0])
        source = source[0].source("in")
    name = "st"
    if source is not None and source[0].kind.startswith(READER):
        name = str(source[0].value("varname", "st"))
    elif source is not None:
        node.document.warn(f"{source[0].kind} is not read; st stands for it", source[0].path)
    values: dict[str, Any] = {"mapping": uses.uv_mapping(name)}
    if not np.array_equal(matrix, np.eye(3)):
        values["to_uv"] = matrix
    return values


def _transform(node: Node) -> NDArray[np.float64]:
    """Return a UsdTransform2d as a matrix (3, 3): scale, then rotation, then translation."""
    angle = math.radians(node.number("rotation", 0.0))
    c, s = math.cos(angle), math.sin(angle)
    scale, move = node.numbers("scale", (1.0, 1.0)), node.numbers("translation", (0.0, 0.0))
    turn = np.array([[c, -s, move[0]], [s, c, move[1]], [0.0, 0.0, 1.0]])
    return turn @ np.diag([*scale, 1.0])
