"""Textures: images and patterns that stand for a parameter and vary over a surface."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from clpt.errors import SceneError
from clpt.scene.params import Kind, choice, factor, host, params, real, reflectance

ATTRIBUTES = ("vertex_", "face_")  # how the names of what meshes have begin
WRAPS = ("repeat", "clamp", "mirror", "zero")


@dataclass(frozen=True, kw_only=True, eq=False)
class Texture(Kind):
    """Base of all textures."""

    is_texture = True


@dataclass(frozen=True, kw_only=True, eq=False)
class Placed(Texture):
    """Base of those that lie on uv; `to_uv` maps a surface's uv to theirs, 3x3, homogeneous."""

    to_uv: np.ndarray = host(np.eye(3), "uv transform, (3, 3) float64")

    def check(self) -> None:
        matrix = np.asarray(self.to_uv, dtype=np.float64)
        if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
            raise SceneError("must be a finite 3x3 matrix", where=f"{self.kind}.to_uv")
        object.__setattr__(self, "to_uv", matrix)


@dataclass(frozen=True, kw_only=True, eq=False)
class Bitmap(Placed):
    """An image; v = 0 is its bottom row. Where a number is asked for it takes `channel`."""

    image: Any = host(
        None,
        "path of an image, or an array (h, w) or (h, w, 1|3|4), float32, or uint8 as 8-bit files "
        "have; an .exr may hold spectra, as clpt.SpectralImage does",
    )
    raw: bool = host(False, "True: values as they are, without the sRGB decoding of 8-bit files")
    filter: str = choice("bilinear", "between texels", ("bilinear", "nearest"))
    wrap: str = choice("repeat", "outside [0, 1]; zero: black, and no alpha", WRAPS)
    wrap_v: str | None = choice(None, "the same for v alone; none: as `wrap`", WRAPS)
    channel: str = choice(
        "luminance", "what a number is taken from; a is never decoded", ("luminance", *"rgba")
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Checkerboard(Placed):
    """Two colours in a 2x2 pattern per unit of uv."""

    color0: Any = reflectance(0.4, "colour where both or neither coordinate is below a half")
    color1: Any = reflectance(0.2, "colour elsewhere")


@dataclass(frozen=True, kw_only=True, eq=False)
class Product(Texture):
    """The product of two values; in an emission the second is a factor, not a light of its own."""

    first: Any = factor(1.0, "one of them")
    second: Any = factor(1.0, "the other")


@dataclass(frozen=True, kw_only=True, eq=False)
class Mix(Texture):
    """Between two values: (1 - amount) first + amount second."""

    first: Any = factor(0.0, "where the amount is 0")
    second: Any = factor(1.0, "where it is 1")
    amount: Any = real(0.5, "share of the second", textured=True)


@dataclass(frozen=True, kw_only=True, eq=False)
class MeshAttribute(Texture):
    """What a mesh says per vertex or face: its `attributes` of that name."""

    name: str = host("vertex_color", "begins with vertex_ or face_")

    def check(self) -> None:
        if not str(self.name).startswith(ATTRIBUTES):
            message = f"must begin with {' or '.join(ATTRIBUTES)}, not {self.name!r}"
            raise SceneError(message, where=f"{self.kind}.name")


KINDS = (Bitmap, Checkerboard, Product, Mix, MeshAttribute)


def textures_in(value: Any) -> Iterator[Texture]:
    """Yield the textures that a kind's parameters hold, and those in what these hold, and so on."""
    if isinstance(value, (list, tuple)):
        for entry in value:
            yield from textures_in(entry)
    elif isinstance(value, Kind):
        if isinstance(value, Texture):
            yield value
        for name in params(type(value)):
            yield from textures_in(getattr(value, name))
