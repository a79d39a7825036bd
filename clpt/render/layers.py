"""Layers beside the picture, from the words of a film: see kernels/film/layers.cl."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt.render.contract.features import SUM_WORDS, Features
from clpt.render.lowering.camera.colour import output_matrix, sensor
from clpt.scene.integrators import LAYERS, Film
from clpt.spectra import cie

Words = NDArray[np.uint32]
Image = NDArray[np.float32]

UNITS = 2.0**22  # kernels/film/layers.cl
SUM_UNITS = 2.0**48


def layers(film: Film, features: Features, words: Words) -> dict[str, Image]:
    """Return the mean of each layer by name, (h, w, 1 to 3) float32.

    words: (layer_words, h, w) uint32. Where nothing was seen, as in the sky, a layer is 0.
    """
    count = np.maximum(words[0], 1)[..., None]
    made = {}
    for name, place in features.layer_places.items():
        layer = LAYERS[name]
        own = words[place : place + layer.words]
        sums = _near_one(own) if layer.near_one else _long(own)
        mean = np.moveaxis(sums, 0, -1) / count
        if layer.is_colour:
            mean = mean @ white_paper(film, features.mode).T
        made[name] = mean.astype(np.float32)
    return made


def white_paper(film: Film, mode: str) -> NDArray[np.float64]:
    """The matrix (3, 3) from what the sensor sees of a reflectance to colours of the film's output
    space, in which what reflects all light is (1, 1, 1)."""
    matrix = output_matrix(film, mode)
    seen = np.ones(3)
    if mode == "spectral":
        lambdas = np.arange(film.lambda_min, film.lambda_max + 1e-6)
        seen = sensor(film).sample(lambdas).sum(axis=0) / cie.CIE_Y_INTEGRAL
    return matrix / (matrix @ seen)[:, None]


def _near_one(words: Words) -> NDArray[np.float64]:
    return words.view(np.int32) / UNITS


def _long(words: Words) -> NDArray[np.float64]:
    low, middle, high = (words[i::SUM_WORDS] for i in range(SUM_WORDS))
    top = high.view(np.int32).astype(np.float64)
    return (top * 2.0**64 + middle * 2.0**32 + low) / SUM_UNITS
