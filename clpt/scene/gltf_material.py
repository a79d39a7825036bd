"""Parts of glTF's materials from plain values: factors times textures, alpha, normals, sides.

All readers of such materials use these functions.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from clpt.scene.lights import Area
from clpt.scene.materials import Mask, Material, NormalMap, Null, TwoSided, parts
from clpt.scene.textures import Bitmap, Graph, Product
from clpt.scene.values import Texture, Textured, TexturedNumber
from clpt.spectra import RGBUnbounded

RGB = tuple[float, ...]
WHITE = (1.0, 1.0, 1.0)
CUTOFF = 0.5  # default of alpha
MODES = ("OPAQUE", "MASK", "BLEND")
ONE_SIDE = Null()  # the back of a surface that only its front shows


def tinted(image: Bitmap | None, rgb: RGB) -> Textured:
    """Return a colour, multiplied by an image if any."""
    if image is None:
        return rgb
    if rgb == WHITE:
        return image
    factor = RGBUnbounded(*rgb) if max(rgb) > 1.0 else rgb
    return Product(first=image, second=factor, rgb=max(rgb) > min(rgb))


def times(image: Bitmap | None, value: float) -> TexturedNumber:
    """Return a number, multiplied by an image's channel if any."""
    if image is None:
        return value
    return image if value == 1.0 else Product(first=image, second=value)


def opacity(
    mode: str, factor: float, image: Bitmap | None, cutoff: float = CUTOFF
) -> float | Texture | None:
    """Return the share of light that meets a surface; None for all light.

    mode: of MODES; factor: alpha of the base colour; image: its texture, whose alpha counts.
    """
    alpha = None if image is None else _alpha(image)
    if mode == "OPAQUE":
        return None
    if mode == "MASK":
        if alpha is None:
            return None if factor >= cutoff else 0.0
        return _cut(alpha, cutoff / factor if factor > 0.0 else np.inf)
    return None if alpha is None and factor == 1.0 else times(alpha, factor)


def with_normals(inner: Material, image: Bitmap | Graph | None, scale: float = 1.0) -> Material:
    """Return a material with a normal map, if any."""
    if image is None:
        return inner
    return NormalMap(material=inner, map=image, scale=scale, along_v=True)


def finished(
    inner: Material, share: float | Texture | None, emission: Area | None, *, both: bool
) -> tuple[Material, Area | None]:
    """Return a material with its opacity and its sides, and what it emits.

    share: of light that meets it, see `opacity`; both: its back is shown too.
    """
    passes = any(part.transmits for part in parts(inner))
    if share is not None:
        inner = Mask(material=inner, opacity=share)
        if emission is not None:  # absent parts of a surface emit nothing
            radiance = Product(first=emission.radiance, second=share)
            emission = dataclasses.replace(emission, radiance=radiance)
    if passes:
        return inner, emission
    return TwoSided(front=inner, back=None if both else ONE_SIDE), emission


def _alpha(image: Bitmap) -> Bitmap | None:
    """Return the alpha of an image as an image; None without alpha."""
    pixels = np.asarray(image.image)
    if pixels.ndim < 3 or pixels.shape[2] < 4:
        return None
    return dataclasses.replace(image, image=np.ascontiguousarray(pixels[..., 3]), raw=True)


def _cut(alpha: Bitmap, cutoff: float) -> Bitmap:
    """Return an image that is 1 where the alpha of a texel reaches the cutoff, else 0."""
    pixels = np.asarray(alpha.image)
    shares = pixels / 255.0 if pixels.dtype == np.uint8 else pixels
    return dataclasses.replace(alpha, image=(shares >= cutoff - 1e-6).astype(np.float32))
