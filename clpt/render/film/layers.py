"""Layers beside the picture, from the words of a film: see kernels/film/layers.cl."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Image, Words
from clpt.render.film.colour import output_matrix, sensor
from clpt.render.film.cryptomatte import pairs_of
from clpt.render.film.picture_form import PictureForm
from clpt.render.film.pictures import Pictures
from clpt.render.film.state import numbers
from clpt.render.records.film import layer_places
from clpt.scene.integrators import Film
from clpt.scene.layers import LAYERS
from clpt.spectra import cie

UNITS = 2.0**22  # kernels/film/layers.cl
LONG_UNITS = (2.0**18, 2.0**-6, 2.0**-30, 2.0**-54)
GROUP = "light_"  # begins the name of a group's picture


def layers_of(
    arrays: Mapping[str, Words], picture: Pictures, variance: Callable[[], Image]
) -> dict[str, Image]:
    """Return the layers of a film by name, (h, w, 1 to 12) float32.

    arrays: its words, as `FilmState` has them; picture: its other pictures; variance: makes
    the layer of that name. Where nothing was seen, as in the sky, a layer is 0, an id -1.
    `light_groups` becomes a layer light_NAME for each group.
    """
    made: dict[str, Image] = {}
    form = picture._form
    sampled = _sampled(form, arrays["layers"])
    light = _light(form, arrays["light_layers"], picture)
    mattes = iter(arrays["mattes"])
    for name in form.layers:
        kept = LAYERS[name].form
        if kept == "light":
            made |= light[name]
        elif kept == "matte":
            made[name] = pairs_of(next(mattes), arrays["layers"][0], matte_names(form, name))
        elif name == "samples":
            made[name] = picture.samples_per_pixel()[..., None]
        elif name == "variance":
            made[name] = variance()
        else:
            made[name] = sampled[name]
    return made


def matte_names(form: PictureForm, layer: str) -> tuple[str, ...]:
    """The names that a layer of mattes knows, by number."""
    return form.names.materials if layer == "crypto_material" else form.names.objects


def _sampled(form: PictureForm, words: Words) -> dict[str, Image]:
    """The layers of the first samples."""
    made, places = {}, layer_places(form.layers)
    for name, place in places.items():
        layer = LAYERS[name]
        own = words[place : place + layer.words]
        if layer.form == "id":
            made[name] = (own[0].astype(np.float32) - np.float32(1.0))[..., None]
            continue
        sums = _near_one(own) if layer.form == "near" else _long(own)
        mean = np.moveaxis(sums, 0, -1) / np.maximum(words[0], 1)[..., None]
        if layer.is_colour:
            mean = mean @ np.asarray(form.paper).T
        made[name] = mean.astype(np.float32)
    return made


def _light(form: PictureForm, words: Words, picture: Pictures) -> dict[str, dict[str, Image]]:
    """The pictures of each layer of light."""
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
    found: dict[str, dict[str, Image]] = {}
    for i, name in enumerate(names):  # of which groups come last
        pictures = colours[i:]
        groups = form.names.light_groups
        found[name] = (
            {f"{GROUP}{group}": one for group, one in zip(groups, pictures, strict=True)}
            if name == "light_groups"
            else {name: pictures[0]}
        )
    return found


def white_paper(film: Film, mode: str) -> NDArray[np.float64]:
    """Return the matrix (3, 3) from reflectances that the sensor sees to the film's output space.

    A thing that reflects all light is (1, 1, 1) there; a channel that sees no light at the film's
    wavelengths stays as it is.
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
