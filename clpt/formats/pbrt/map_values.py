"""A function applied to the value of a parameter, whatever stands for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from clpt import images
from clpt.scene.params import fields_of
from clpt.scene.textures import Bitmap, Checkerboard, Mix, Product, Texture
from clpt.spectra import RGB, Constant, RGBUnbounded, Spectrum, Tabulated, cie


def map_values(value: object, function: Callable[[Any], Any], *, bytes_stay: bool = False) -> Any:
    """Apply a function to a number, a colour, a spectrum or a texture.

    It is applied to both ends of a mixture and of a pattern of numbers, and to both factors of a
    product, which is right for powers. bytes_stay: keep sRGB images of 8 bits as such, a quarter as
    large as floats; the function must not leave [0, 1].
    """
    if isinstance(value, tuple):
        return tuple(float(function(v)) for v in value)
    if isinstance(value, (RGB, RGBUnbounded)):
        return type(value)(*(float(function(v)) for v in (value.r, value.g, value.b)))
    if isinstance(value, Constant):
        return Constant(float(function(value.value)))
    if isinstance(value, Spectrum):
        return Tabulated(cie.GRID, function(value.sample(cie.GRID)), "hold")
    if isinstance(value, Bitmap):
        return _bitmap(value, function, bytes_stay)
    if isinstance(value, Texture) and type(value) not in ENDS:  # patterns between 0 and 1
        return Mix(first=float(function(0.0)), second=float(function(1.0)), amount=value)
    if isinstance(value, Texture):
        names = ENDS[type(value)]
        values = fields_of(value)
        ends = [map_values(values[name], function, bytes_stay=bytes_stay) for name in names]
        return replace(value, **dict(zip(names, ends, strict=True)))
    return float(function(value))


ENDS: dict[type[Texture], tuple[str, ...]] = {
    Checkerboard: ("color0", "color1"),
    Mix: ("first", "second"),
    Product: ("first", "second"),
}


def _bitmap(bitmap: Bitmap, function: Callable[[Any], Any], bytes_stay: bool) -> Bitmap:
    image = bitmap.image
    if isinstance(image, (str, Path)):
        stored = images.read_stored(image)
        images.log_notes(image, stored, raw=bitmap.raw)
    else:
        values = np.asarray(image)
        stored = images.Stored(values, encoded=values.dtype == np.uint8)
    stored = stored.meant(raw=bitmap.raw)
    values = stored.values
    if bytes_stay and values.dtype == np.uint8 and stored.encoded and not bitmap.raw:
        levels = images.srgb_to_linear(np.arange(256, dtype=np.float32) / np.float32(255.0))
        codes = images.linear_to_srgb(function(levels).astype(np.float32))
        return replace(bitmap, image=np.round(255.0 * codes).astype(np.uint8)[values[..., :3]])
    result = function(stored.decoded(linear=not bitmap.raw))
    return replace(bitmap, image=result.astype(np.float32), raw=True)
