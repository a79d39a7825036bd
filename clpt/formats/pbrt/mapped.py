"""Functions of what a parameter has been given, whatever it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from clpt import images
from clpt.scene.textures import Bitmap, Checkerboard, Mix, Product, Texture
from clpt.spectra import RGB, Constant, RGBUnbounded, Spectrum, Tabulated, cie


def mapped(value: Any, function: Callable[[Any], Any]) -> Any:
    """A function of what a parameter has been given: of a number, a colour, a spectrum, a texture.

    Of a mixture and of a pattern of numbers it is taken at both ends, of a product of both factors,
    which is right for powers.
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
        return replace(value, image=function(_pixels(value)).astype(np.float32), raw=True)
    if isinstance(value, Texture) and type(value) not in ENDS:  # patterns between 0 and 1
        return Mix(first=float(function(0.0)), second=float(function(1.0)), amount=value)
    if isinstance(value, Texture):
        ends = {name: mapped(getattr(value, name), function) for name in ENDS[type(value)]}
        return replace(value, **ends)
    return float(function(value))


ENDS: dict[type[Texture], tuple[str, ...]] = {
    Checkerboard: ("color0", "color1"),
    Mix: ("first", "second"),
    Product: ("first", "second"),
}


def _pixels(bitmap: Bitmap) -> Any:
    image = bitmap.image
    if isinstance(image, (str, Path)):
        image = images.read(image, linear=not bitmap.raw)
    return np.asarray(image, np.float32)
