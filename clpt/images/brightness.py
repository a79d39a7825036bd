"""Brightness of pictures on a screen: what is white or black, and the exposure that suits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats32
from clpt.choices import Exposure
from clpt.images.colour.tones import LUMINANCE
from clpt.images.colour.view import View
from clpt.images.transfer import to_codes

GREY = 0.18  # reflectance of the middle grey that photographers expose for
DIM = 1e-4  # of the mean: a pixel below counts as if it were as bright
WHITE, BLACK = 250, 2  # codes of 255: a colour from which or to which nothing can be told apart
LOOKED_AT = 1 << 20  # pixels that are enough to judge a picture


@dataclass(frozen=True)
class Levels:
    """Shares of a picture on a screen.

    lit: whether any light came; white: the share of the lit pixels that are white; black: that of
    all pixels which are black.
    """

    lit: bool
    white: float
    black: float


def auto_exposure(image: Floats32) -> float:
    """Return the stops that bring the mean of linear Rec. 709 (h, w, c) to a middle grey.

    The mean is that of the logarithm of the luminance of lit pixels (Reinhard et al. 2002,
    "Photographic Tone Reproduction", eq. 1). 0 for a picture without light.
    """
    luminance = _luminance(_few(image))
    lit = luminance[luminance > 0.0]
    if lit.size == 0:
        return 0.0
    mean = float(lit.mean(dtype=np.float64))
    key = float(np.exp(np.log(np.maximum(lit, DIM * mean), dtype=np.float64).mean()))
    return math.log2(GREY / key)


def raised(exposure: Exposure, display: float) -> Exposure:
    """Return an exposure over that of a film's display [stops]; "auto" needs none."""
    return exposure if exposure == "auto" else exposure + display


def stops(exposure: Exposure, image: Floats32) -> float:
    """Return an exposure in stops; "auto" is that of the image, see `auto_exposure`."""
    return auto_exposure(image) if exposure == "auto" else exposure


def levels(
    image: Floats32, exposure: float = 0.0, tone: str = "none", view: View | None = None
) -> Levels:
    """Return how linear Rec. 709 (h, w, c) comes out; the rest: see `clpt.images.to_codes`.

    Of a picture of more than LOOKED_AT pixels every second row and column is looked at, or fewer.
    """
    image = _few(image)
    codes = to_codes(image, exposure, tone, view)[..., :3]
    lit = _luminance(image) > 0.0
    white = float((codes[lit].min(axis=-1) >= WHITE).mean()) if lit.any() else 0.0
    return Levels(bool(lit.any()), white, float((codes.max(axis=-1) <= BLACK).mean()))


def _few(image: Floats32) -> Floats32:
    """Every n-th row and column of an image, such that there are LOOKED_AT pixels at most."""
    step = math.ceil(math.sqrt(max(image.shape[0] * image.shape[1] / LOOKED_AT, 1.0)))
    return np.ascontiguousarray(image[::step, ::step])


def _luminance(image: Floats32) -> NDArray[np.float32]:
    """The luminance of each pixel (h, w); 0 where it is not finite."""
    colour = image[..., :3] if image.shape[2] >= 3 else np.repeat(image[..., :1], 3, axis=2)
    return np.nan_to_num(colour @ LUMINANCE, nan=0.0, posinf=0.0, neginf=0.0)
