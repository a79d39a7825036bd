"""Textures: images and patterns that stand for a parameter and vary over a surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from clpt.errors import SceneError
from clpt.scene.params import Kind, choice, host, reflectance


@dataclass(frozen=True, kw_only=True, eq=False)
class Texture(Kind):
    """Base of all textures; `to_uv` maps a surface's uv to the texture's, 3x3, homogeneous."""

    is_texture = True

    to_uv: np.ndarray = host(np.eye(3), "uv transform, (3, 3) float64")

    def check(self) -> None:
        matrix = np.asarray(self.to_uv, dtype=np.float64)
        if matrix.shape != (3, 3) or not np.isfinite(matrix).all():
            raise SceneError("must be a finite 3x3 matrix", where=f"{self.kind}.to_uv")
        object.__setattr__(self, "to_uv", matrix)


@dataclass(frozen=True, kw_only=True, eq=False)
class Bitmap(Texture):
    """An image; v = 0 is its bottom row. A `real` parameter takes its luminance."""

    image: Any = host(
        None,
        "path of an image, or an array (h, w) or (h, w, 1|3|4) float32; an .exr may hold spectra, "
        "as clpt.SpectralImage does",
    )
    raw: bool = host(False, "True: values as they are, without the sRGB decoding of 8-bit files")
    filter: str = choice("bilinear", "between texels", ("bilinear", "nearest"))
    wrap: str = choice("repeat", "outside [0, 1]", ("repeat", "clamp", "mirror"))


@dataclass(frozen=True, kw_only=True, eq=False)
class Checkerboard(Texture):
    """Two colours in a 2x2 pattern per unit of uv."""

    color0: Any = reflectance(0.4, "colour where both or neither coordinate is below a half")
    color1: Any = reflectance(0.2, "colour elsewhere")


KINDS = (Bitmap, Checkerboard)
