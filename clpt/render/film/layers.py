"""Layers beside the picture, from the words of a film (kernels/film/layers.cl), and as colours."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Image, Words
from clpt.render.film.colour import output_matrix, sensor
from clpt.render.film.cryptomatte import pairs_of
from clpt.render.film.pictures import PictureForm, Pictures
from clpt.render.film.state import numbers
from clpt.render.records.film import layer_places
from clpt.scene.integrators import Film
from clpt.scene.layers import LAYERS
from clpt.spectra import cie

UNITS = 2.0**22  # kernels/film/layers.cl
LONG_UNITS = (2.0**18, 2.0**-6, 2.0**-30, 2.0**-54)
GROUP = "light_"  # begins the name of a group's picture


def layers_of(
    arrays: Mapping[str, Words], picture: Pictures, variance: Image | None
) -> dict[str, Image]:
    """Return the layers of a film by name, (h, w, 1 to 12) float32.

    arrays: words by name, see `FilmState`; picture: the film's other pictures; variance: its layer
    of that name, None if the film has none. Where nothing was seen, as in the sky, a layer is 0, an
    id -1. `light_groups` becomes a layer light_NAME for each group.
    """
    layers: dict[str, Image] = {}
    form = picture.form
    first_samples = _first_samples(form, arrays["layers"])
    light = _light(form, arrays["light_layers"], picture)
    mattes = iter(arrays["mattes"])
    for name in form.layers:
        if LAYERS[name].form == "light":
            layers |= light[name]
        elif LAYERS[name].form == "matte":
            layers[name] = pairs_of(next(mattes), arrays["layers"][0], matte_names(form, name))
        elif name == "samples":
            layers[name] = picture.samples_per_pixel()[..., None]
        elif name == "variance" and variance is not None:
            layers[name] = variance
        else:
            layers[name] = first_samples[name]
    return layers


def matte_names(form: PictureForm, layer: str) -> tuple[str, ...]:
    """Return the names of objects or materials, by the number that a matte holds."""
    return form.names.materials if layer == "crypto_material" else form.names.objects


def _first_samples(form: PictureForm, words: Words) -> dict[str, Image]:
    """Return the layers that only the first samples of a pixel fill."""
    layers = {}
    for name, first in layer_places(form.layers).items():
        layer = LAYERS[name]
        layer_words = words[first : first + layer.words]
        if layer.form == "id":
            layers[name] = (layer_words[0].astype(np.float32) - np.float32(1.0))[..., None]
            continue
        sums = _near_one(layer_words) if layer.form == "near" else _long(layer_words)
        mean = np.moveaxis(sums, 0, -1) / np.maximum(words[0], 1)[..., None]
        if layer.is_colour:
            mean = mean @ np.asarray(form.paper).T
        layers[name] = mean.astype(np.float32)
    return layers


def _light(form: PictureForm, words: Words, picture: Pictures) -> dict[str, dict[str, Image]]:
    """Return the pictures of each layer of light, by the layer and by the picture's name."""
    names = [name for name in form.layers if LAYERS[name].form == "light"]
    if not names:
        return {}
    sums = numbers(np.moveaxis(words, 1, 0)).reshape(-1, 3, *words.shape[2:])
    samples = picture.samples_per_pixel()
    means = sums[: len(sums) // (1 + form.weighed)] / np.maximum(samples, 1.0)
    if form.weighed:
        paths = max(picture.light_paths_per_pixel(), 1e-30)
        means = means + sums[len(means) :] * ((samples > 0) / np.float32(paths))
    colours = np.einsum("ij,njhw->nhwi", np.asarray(form.to_output), means).astype(np.float32)
    light: dict[str, dict[str, Image]] = {}
    for i, name in enumerate(names):  # light_groups comes last: it takes all remaining pictures
        if name == "light_groups":
            groups = (f"{GROUP}{group}" for group in form.names.light_groups)
            light[name] = dict(zip(groups, colours[i:], strict=True))
        else:
            light[name] = {name: colours[i]}
    return light


def white_paper(film: Film, mode: str) -> NDArray[np.float64]:
    """Return the matrix (3, 3) from the sensor's sums of a reflectance to the output space.

    A surface that reflects all light becomes (1, 1, 1); a channel without a response in the film's
    range is not scaled.
    """
    matrix = output_matrix(film, mode)
    seen = np.ones(3)
    if mode == "spectral":
        lambdas = np.arange(film.lambda_min, film.lambda_max + 1e-6)
        seen = sensor(film).sample(lambdas).sum(axis=0) / cie.CIE_Y_INTEGRAL
    white = matrix @ seen
    return matrix / np.where(white == 0.0, 1.0, white)[:, None]


def _near_one(words: Words) -> NDArray[np.float64]:
    return words.view(np.int32) / UNITS


def _long(words: Words) -> NDArray[np.float64]:
    parts = words.view(np.int32).reshape(-1, len(LONG_UNITS), *words.shape[1:])
    return np.tensordot(np.array(LONG_UNITS), parts.astype(np.float64), (0, 1))


def viewable(name: str, layer: Image) -> Image:
    """Return the values (h, w, 1 to 4) of a layer as colours in [0, 1], (h, w, 3) float32."""
    if name.endswith("albedo"):
        return layer
    if name.endswith("_normal"):
        return layer * np.float32(0.5) + np.float32(0.5)
    if name in ("depth", "z"):  # the nearest point is white; twice as far, half as bright
        near = np.min(layer, where=layer > 0, initial=np.inf)
        return np.repeat(np.divide(near, layer, where=layer > 0, out=np.zeros_like(layer)), 3, 2)
    if name.endswith("_id"):  # consecutive numbers differ in hue; black where nothing is seen
        hue = layer * np.float32(0.618034) + np.arange(3, dtype=np.float32) / np.float32(3.0)
        shown = 0.5 + 0.5 * np.cos(2 * np.pi * hue)
        return np.where(layer < 0, 0.0, shown).astype(np.float32)
    if name == "motion":  # hue: direction; brightness: length over the greatest length
        motion = layer[..., 2:] - layer[..., :2]
        turn = np.arctan2(motion[..., 1:], motion[..., :1])
        far = np.linalg.norm(motion, axis=2, keepdims=True)
        wheel = 0.5 + 0.5 * np.cos(turn - 2 * np.pi / 3 * np.arange(3))
        return (wheel * (far / max(float(far.max()), 1e-6))).astype(np.float32)
    cells = np.mod(layer, np.float32(1.0))  # positions and uv: colours repeat in every unit
    return np.pad(cells, ((0, 0), (0, 0), (0, 3 - cells.shape[2])))
