"""The cost of an integrator for a scene, measured on small pictures: variance times counted rays.

Clocks play no part. The variance is that of the mean of some samples, since samples are spread
evenly over their domain, and integrators differ in how much they gain from that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats

FEWEST, PIXELS = 512, 2048  # of the small film, about
ROUNDS = 8  # pictures of each integrator, with different seeds
SAMPLES = 16  # of a pixel of each picture
BLOCK = 8  # side of a block of pixels
TRIM = 0.001  # share of the pixels that is left out: the noisiest
ODD = 0.01  # the same for the noise of ordinary pixels
SURE = 3.0  # standard deviations
LIGHT_RAY, GUIDED_RAY = 1.15, 1.3  # time of a ray, relative to `path`: bench/notes/guiding.md
PHOTON_RAY = 1.5  # the same of `vcm`
# For these sizes of films, and larger sizes, a trial costs less than it can save.
GUIDE_RAYS = 1 << 27  # rays, some 20 s of a core: longer than the compilation of a guide
PLAIN_RAYS = 1 << 30  # the same for the compilation of kernels without light paths
SHARE = 1 << 7  # samples of a film for each sample of an integrator in a trial


@dataclass(frozen=True)
class Trial:
    """Pictures of a few samples each.

    pictures: (rounds, height, width, 3); rays: the number of rays of all pictures; ray: the time of
    a ray, relative to the integrator `path`.
    """

    pictures: Floats
    rays: int
    ray: float = 1.0


def pixels_for(samples: int) -> int:
    """Return the number of pixels, about, of a small film; samples: of the whole film."""
    wanted = samples // (SHARE * ROUNDS * SAMPLES)
    return min(max(wanted, FEWEST), PIXELS)


def settings(of: NDArray[np.void], pixels: int = PIXELS) -> NDArray[np.void]:
    """Return the settings of a small film of the whole picture; of: settings of the picture.

    A small film has fewer photons, so the disks that gather them are larger.
    """
    small = of.copy()
    width, height = int(of["film_width"]), int(of["film_height"])
    scale = math.sqrt(pixels / (width * height))
    width, height = (max(round(size * scale), BLOCK) for size in (width, height))
    margin = int(of["margin"])
    small["width"], small["height"] = small["film_width"], small["film_height"] = width, height
    small["crop_x"] = small["crop_y"] = 0
    small["tiles_x"] = -(-(width + 2 * margin) // 4)
    small["padded_pixels"] = 16 * small["tiles_x"] * -(-(height + 2 * margin) // 4)
    small["photon_pixels"] = min(int(of["photon_pixels"]), int(small["padded_pixels"]))
    small["radius"] = of["radius"] / scale
    return small


def variances(trials: Sequence[Trial], trim: float = TRIM) -> list[float]:
    """Return the variance of a picture of each trial; all have the same scene and rounds.

    It is relative to the mean of a block of pixels, as the mean of a pixel is too noisy; trim: the
    share of the worst pixels, which are left out. The variance of a trial misses light that it has
    hardly ever found. So where another trial has surely found more light in a block, the variance
    is at least the variance of finding that light once in all samples.
    """
    spread = [_in_blocks(trial.pictures.var(axis=0, ddof=1)) for trial in trials]
    means = [_in_blocks(trial.pictures.mean(axis=0)) for trial in trials]
    around = np.mean([_of_blocks(mean) for mean in means], axis=0)
    scale = np.maximum(around**2 + 1e-2 * around.mean() ** 2, 1e-300)
    count = BLOCK**2 * len(trials[0].pictures)
    variances_ = []
    for spread_here, mean in zip(spread, means, strict=True):
        least = np.zeros_like(around)
        for other, more in zip(spread, means, strict=True):
            missed = np.maximum(_of_blocks(more - mean), 0.0) ** 2
            least = np.maximum(least, count * missed - SURE**2 * _of_blocks(spread_here + other))
        error = np.sort((np.maximum(spread_here, least) / scale).mean(axis=-1), axis=None)
        variances_.append(float(error[: math.ceil(error.size * (1.0 - trim))].mean()))
    return variances_


def _in_blocks(picture: Floats) -> Floats:
    """Return whole blocks of a picture, (rows, BLOCK, columns, BLOCK, 3)."""
    height, width = (size - size % BLOCK for size in picture.shape[:2])
    return picture[:height, :width].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3)


def _of_blocks(values: Floats) -> Floats:
    """Return the means of blocks, (rows, 1, columns, 1, 3)."""
    means: Floats = values.mean(axis=(1, 3), keepdims=True)
    return means


def costs(trials: Sequence[Trial]) -> list[float]:
    """Return the variance times the time of the rays of each trial, over the first trial's.

    All costs are 1 if the first trial has no noise.
    """
    products = [
        variance * trial.rays * trial.ray
        for variance, trial in zip(variances(trials), trials, strict=True)
    ]
    return [cost / products[0] if products[0] > 0.0 else 1.0 for cost in products]
