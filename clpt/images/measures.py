"""Figures of pictures: exposure that suits a screen, white and black shares, differences of two."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, Floats32
from clpt.choices import Exposure
from clpt.images.colour import LUMINANCE, View, to_codes

GREY = 0.18  # reflectance of the middle grey that photographers expose for
DIM = 1e-4  # of the mean: a pixel below counts as if it were as bright
WHITE, BLACK = 250, 2  # codes of 255: detail above and below is not visible
LOOKED_AT = 1 << 20  # pixels that are enough to judge a picture
EPSILON = 0.01  # beside the square of the reference, where that is dark


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


@dataclass(frozen=True)
class Differences:
    """Figures of a - b over all values of two images; b is the reference.

    means: of a and of b; bias: mean of a - b; absolute: mean of |a - b|; mean_square;
    relative_square: mean of (a - b)^2 / (b^2 + EPSILON), as renderers are compared by; largest:
    |a - b|; where: x, y and channel of that; lost: number of values that are not finite in a
    or b, which are left out.
    """

    means: tuple[float, float]
    bias: float
    absolute: float
    mean_square: float
    relative_square: float
    largest: float
    where: tuple[int, int, int]
    lost: int

    @property
    def root_mean_square(self) -> float:
        """The root of the mean square."""
        return math.sqrt(self.mean_square)


def differences(a: NDArray[np.float32], b: NDArray[np.float32]) -> Differences:
    """Compare two images (h, w, n) of equal shape."""
    first, second = a.astype(np.float64), b.astype(np.float64)
    known = np.isfinite(first) & np.isfinite(second)
    first, second = np.where(known, first, 0.0), np.where(known, second, 0.0)
    count, apart = max(int(known.sum()), 1), first - second
    y, x, channel = np.unravel_index(int(np.abs(apart).argmax()), apart.shape)
    return Differences(
        means=(float(first.sum() / count), float(second.sum() / count)),
        bias=float(apart.sum() / count),
        absolute=float(np.abs(apart).sum() / count),
        mean_square=float((apart**2).sum() / count),
        relative_square=float((apart**2 / (second**2 + EPSILON)).sum() / count),
        largest=float(np.abs(apart).max()),
        where=(int(x), int(y), int(channel)),
        lost=known.size - int(known.sum()),
    )


def size_of(a: NDArray[np.float32], b: NDArray[np.float32]) -> Floats:
    """Return the root of the mean square of a - b over the channels of each pixel, (h, w)."""
    apart = np.nan_to_num(a.astype(np.float64) - b, nan=0.0, posinf=0.0, neginf=0.0)
    return np.asarray(np.sqrt((apart**2).mean(axis=2)))
