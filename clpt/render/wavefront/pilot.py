"""A pilot: whether a guide pays in a scene, told by a small film with it and without it.

It decides by the variance of pictures times their rays, so that no clock has a word in it.
Its seed is another than the picture's, whose mean would else depend on what its samples bring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats

PIXELS = 2048  # of the small film, about
BLOCK = 8  # side of a block of pixels
ROUNDS = 4  # pictures with the guide, each of another seed, and without
SAMPLES = 16  # of a pixel of each: where they are spread evenly, a guide spoils some of that
SEED = 0x2545F491
TRIM = 0.01  # share of the pixels that is left out, the worst
RAY = 1.4  # time of a ray with the guide, over one without: the most that was measured
PAYS = 1.0  # the guide pays where the cost is below this


def settings(of: NDArray[np.void]) -> NDArray[np.void]:
    """Return the settings of a small film of the whole picture; of: those of the picture."""
    small = of.copy()
    width, height = int(of["film_width"]), int(of["film_height"])
    scale = math.sqrt(PIXELS / (width * height))
    width, height = (max(round(size * scale), BLOCK) for size in (width, height))
    margin = int(of["margin"])
    small["width"], small["height"] = small["film_width"], small["film_height"] = width, height
    small["crop_x"] = small["crop_y"] = 0
    small["tiles_x"] = -(-(width + 2 * margin) // 4)
    small["padded_pixels"] = 16 * small["tiles_x"] * -(-(height + 2 * margin) // 4)
    small["seed"] = int(of["seed"]) ^ SEED
    return small


@dataclass(frozen=True)
class Trial:
    """Pictures of a few samples, (rounds, height, width, 3), and the rays of all."""

    pictures: Floats
    rays: int


def cost(plain: Trial, guided: Trial) -> float:
    """Return variance times rays with the guide over that without, by a trial of each.

    The variance is relative to the mean of a block of pixels, as that of a pixel is too noisy, and
    that of the worst pixels is left out. 1 where nothing is noisy.
    """
    means = np.concatenate([plain.pictures, guided.pictures]).mean(axis=0)
    height, width = (size - size % BLOCK for size in means.shape[:2])
    shape = height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3
    around = means[:height, :width].reshape(shape).mean(axis=(1, 3), keepdims=True)
    scale = np.maximum(around**2 + 1e-2 * means.mean() ** 2, 1e-300)
    found = []
    for trial in (plain, guided):
        variance = trial.pictures.var(axis=0)[:height, :width].reshape(shape)
        error = np.sort((variance / scale).mean(axis=-1), axis=None)
        kept = math.ceil(error.size * (1.0 - TRIM))
        found.append(float(error[:kept].mean()) * trial.rays)
    return RAY * found[1] / found[0] if found[0] > 0.0 else 1.0
