"""The picture of a film on the host, without a device: what kernels/stage/accumulate.cl makes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.render.contract.features import SUM_WORDS
from clpt.render.film.layers import layers_of
from clpt.render.film.saved_film import SavedFilm
from clpt.render.wavefront.film_state import (
    FILM_WORDS,
    SAMPLES_WORD,
    Words,
    add_films,
    add_sums,
    light_group,
    numbers,
)
from clpt.scene import Film
from clpt.spectral_exr import SpectralImage

Image = NDArray[np.float32]


class HostPicture:
    """The picture of a film, with the methods of `Renderer` that make it; equal but for an ulp.

    saved: the film. form: as of a renderer; is_adaptive: whether pixels differ in their
    numbers of samples. denoise: the denoiser of its files, None for none.
    """

    def __init__(self, saved: SavedFilm, denoise: str | None = None):
        self.denoise = denoise
        self.saved, self.form = saved, saved.form
        self.is_adaptive = bool(saved.adaptive)
        state = saved.film
        words, bands = state.words[0], state.bands[0]
        for half in range(1, len(state.words)):
            words = add_films(words, state.words[half])
            bands = add_sums(bands, state.bands[half])
        self._words, self._bands = words, bands

    def saved_film(self, *, held: bool = False) -> SavedFilm:
        """The film; held: as of a renderer, here without a meaning."""
        return self.saved

    def image(self) -> Image:
        """The picture, as `Renderer.image` returns it."""
        if self.form.bands:
            return self._mean_bands() * np.float32(self.form.exposure)
        if self.form.alpha:
            return np.dstack([self.colours(), self._alpha()])
        return self.colours()

    def colours(self) -> Image:
        """The picture in three colours, (h, w, 3) float32, also of a film with bands."""
        return self._colours(self._words)

    def layers(self) -> dict[str, Image]:
        """The layers by name, (h, w, 1 to 12) float32, as `Renderer.layers` returns them."""
        return layers_of(self.form, self.saved.film.arrays, self)

    def halves(self) -> tuple[Image, Image]:
        """The pictures of the even and of the odd samples, as `Renderer.halves` returns them.

        Raises SceneError where the film does not keep them apart.
        """
        words = self.saved.film.words
        if len(words) != 2:
            raise SceneError(
                "the film does not keep even and odd samples apart; render it with --denoise "
                "statistical, or give Renderer halves=True"
            )
        return self._colours(words[0]), self._colours(words[1])

    def spectral_image(self) -> SpectralImage:
        """The picture of a film with bands, at their centres."""
        form = self.form
        film = Film(bands=form.bands, lambda_min=form.lambda_min, lambda_max=form.lambda_max)
        return SpectralImage(self.image(), film.band_centres, emissive=True)

    def samples_per_pixel(self) -> Image:
        """How many samples each pixel has, (h, w) float32."""
        return self._samples(self._words)

    def light_paths_per_pixel(self) -> float:
        """How many paths have begun at lights for each pixel."""
        return self._light_paths(self._words)

    def _colours(self, words: Words) -> Image:
        total = _means(words, 0) * self._mean(words)
        if self.form.weighed:
            total += _means(words, light_group(len(words))) * self._light_mean(words)
        matrix = np.array(self.form.to_output, np.float32)
        return np.ascontiguousarray(np.moveaxis(np.tensordot(matrix, total, 1), 0, 2))

    def _alpha(self) -> Image:
        words, first = self._words, FILM_WORDS + SUM_WORDS * self.form.weights
        return numbers(words[first : first + SUM_WORDS]) * self._mean(words)

    def _mean_bands(self) -> Image:
        words, count = self._words, self.form.bands
        scale = np.float32(self.saved.film.scale)
        sums = numbers(np.moveaxis(self._bands, 1, 0))
        total = sums[:count] * (self._mean(words) / scale)
        if self.form.weighed:
            total += sums[count:] * (self._light_mean(words) / scale)
        return np.ascontiguousarray(np.moveaxis(total, 0, 2))

    def _samples(self, words: Words) -> Image:
        if not self.form.light_paths:
            return words[SAMPLES_WORD].astype(np.float32)
        return np.full(words.shape[1:], self._light_paths(words), np.float32)

    def _mean(self, words: Words) -> Image:
        """One over what a pixel's sums are divided by, 0 where that is nothing."""
        weighed = self.form.weights
        by = numbers(words[FILM_WORDS:][:SUM_WORDS]) if weighed else self._samples(words)
        return _inverse(by)

    def _light_mean(self, words: Words) -> Image:
        """The same of light paths; 0 where a pixel has no samples of the camera."""
        inverse = _inverse(np.full((), self._light_paths(words), np.float32))
        return np.where(words[SAMPLES_WORD] > 0, inverse, np.float32(0.0))

    def _light_paths(self, words: Words) -> float:
        """How many light paths there were for each pixel."""
        first = light_group(len(words)) if self.form.weighed else 0
        count = words[first + SAMPLES_WORD]
        return float(count.sum(dtype=np.uint64)) / count.size


def _means(words: Words, first: int) -> Image:
    """The three sums of pixels (n, h, w) from a word on, (3, h, w) float32."""
    sums = words[first : first + 3 * SUM_WORDS].reshape(3, SUM_WORDS, *words.shape[1:])
    return numbers(np.moveaxis(sums, 1, 0))


def _inverse(by: Any) -> Image:
    return np.divide(np.float32(1.0), by, out=np.zeros_like(by), where=by > 0)
