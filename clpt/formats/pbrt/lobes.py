"""Sums of lobes of reflection as blends: a scene has no sums of materials."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from clpt.formats.pbrt.textures import map_values
from clpt.scene import materials
from clpt.scene.materials import Material
from clpt.scene.textures import Bitmap, Mix, Product, Texture

LARGEST = 1.0  # what a texture of unknown values may reach
TINY = 1e-6
Values = Any  # a number, a colour, a spectrum or a texture
Lobe = tuple[Any, Callable[[Any], Material]]  # a factor, and what makes the material of a factor


def summed(lobes: Sequence[Lobe], warn: Callable[[str], None]) -> Material:
    """Return the sum of lobes as a blend, each part the stronger the smaller its share.

    That is the same light while the largest albedos add up to at most 1. Else the sum is darker,
    and `warn` is called with a message.
    """
    shining = [(value, make) for value, make in lobes if not is_dark(value)]
    if not shining:
        return materials.Diffuse(reflectance=0.0)
    peaks = [max(_largest(value), TINY) for value, _ in shining]
    total = sum(peaks)
    if total > 1.0 + TINY and len(shining) > 1:
        warn(f"its lobes may reflect {total:.3g} in all: each is divided by that")
    excess = max(total, 1.0)
    blend, share = shining[0][1](_over(shining[0][0], peaks[0] / total * excess)), peaks[0]
    for (value, make), peak in list(zip(shining, peaks, strict=True))[1:]:
        share += peak
        lobe = make(_over(value, peak / total * excess))
        blend = materials.Blend(first=blend, second=lobe, weight=peak / share)
    return blend


def _over(value: Values, divisor: float) -> Values:
    if isinstance(value, Texture):
        return Product(first=value, second=1.0 / divisor)
    return map_values(value, lambda v: np.minimum(v / divisor, 1.0))


def rgb(value: Values) -> Values:
    """Return a constant factor as a number or linear Rec. 709 (3,), float64."""
    if isinstance(value, (float, int, tuple)):
        return np.asarray(value, np.float64)
    return np.asarray(value.to_rgb("unbounded"), np.float64)


def _largest(value: Values) -> float:
    """Return the largest number of a factor; of an image its largest texel."""
    if isinstance(value, Bitmap):
        return min(float(map_values(value, lambda v: v).image.max()), LARGEST)
    if isinstance(value, Product):
        return min(_largest(value.first) * _largest(value.second), LARGEST)
    if isinstance(value, Mix):
        return max(_largest(value.first), _largest(value.second))
    return LARGEST if isinstance(value, Texture) else float(np.max(rgb(value)))


def is_dark(value: Values) -> bool:
    """Return whether a factor is 0."""
    return not isinstance(value, Texture) and not np.any(rgb(value))
