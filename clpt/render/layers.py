"""Layers beside the picture, from the words of a film: see kernels/film/layers.cl."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.render.contract.features import layer_places
from clpt.render.lowering.camera.colour import output_matrix, sensor
from clpt.scene.integrators import LAYERS, Film
from clpt.spectra import cie

Words = NDArray[np.uint32]
Image = NDArray[np.float32]

UNITS = 2.0**22  # kernels/film/layers.cl
LONG_UNITS = (2.0**8, 2.0**-16, 2.0**-40)


def layers_of(names: Iterable[str], paper: ArrayLike, words: Words) -> dict[str, Image]:
    """Return the mean of each layer by name, (h, w, 1 to 3) float32.

    names: in the order of their words; paper: the matrix of `white_paper`; words: (n, h, w) uint32.
    Where nothing was seen, as in the sky, a layer is 0.
    """
    made, places = {}, layer_places(names)
    for name, place in places.items():
        layer = LAYERS[name]
        own = words[place : place + layer.words]
        sums = _near_one(own) if layer.near_one else _long(own)
        mean = np.moveaxis(sums, 0, -1) / np.maximum(words[0], 1)[..., None]
        if layer.is_colour:
            mean = mean @ np.asarray(paper).T
        made[name] = mean.astype(np.float32)
    return made


def channels_of(layers: Mapping[str, Image]) -> dict[str, Image]:
    """Return the channels of layers as an .exr has them, (h, w) by names such as depth.Z."""
    return {
        f"{name}.{letter}": image[..., i]
        for name, image in layers.items()
        for i, letter in enumerate(LAYERS[name].channels)
    }


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
    parts = words.view(np.int32).reshape(-1, len(LONG_UNITS), *words.shape[1:])
    return np.tensordot(np.array(LONG_UNITS), parts.astype(np.float64), (0, 1))
