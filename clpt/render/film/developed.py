"""The pictures of a film, computed from its words on the host."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats32, Image, Words
from clpt.errors import SceneError
from clpt.render.film.layers import layers_of, times_of
from clpt.render.film.pictures import PictureForm, Still
from clpt.render.film.state import (
    FILM_WORDS,
    SAMPLES_WORD,
    FilmState,
    add_films,
    add_sums,
    light_group,
    numbers,
)
from clpt.render.records import SUM_WORDS


class Developed(Still):
    """The pictures of a film, which every picture of clpt comes from.

    Equal words give equal pictures on every machine: each step is an operation of IEEE 754 in
    float32, in a fixed order. kernels/stage/accumulate.cl computes `Renderer.film` on the device by
    the same steps; a device may divide and contract differently.
    """

    def __init__(self, film: FilmState, form: PictureForm):
        self._film, self.form = film, form

    def image(self) -> Image:
        """The picture: colours, with alpha where the film has it, or the film's bands."""
        if self.form.bands:
            return self._mean_bands() * np.float32(self.form.exposure)
        return self.picture()

    def picture(self) -> Image:
        """The picture in three colours, with alpha where the film has it, also with bands."""
        colours = self.colours()
        return np.dstack([colours, self._alpha()]) if self.form.alpha else colours

    def colours(self) -> Image:
        """The picture in three colours, (h, w, 3) float32, also of a film with bands."""
        return self._colours(self._words)

    def layers(self) -> dict[str, Image]:
        """The layers by name, (h, w, 1 to 12) float32."""
        variance = self._variance() if "variance" in self.form.layers else None
        return layers_of(self._film.arrays, self, variance)

    def times(self) -> Floats32:
        """Light by its time, (h, w, time_bins + 1, 3) float32."""
        if not self.form.time_bins:
            raise SceneError("this picture has no times; set the film's", where="film.time_bins")
        return times_of(self.form, self._film.light_layers, self)

    def halves(self) -> tuple[Image, Image]:
        """The pictures of even samples and of odd samples. Raises SceneError without them."""
        words = self._film.words
        if self.form.octaves:
            words = add_films(*np.split(words, 2))
        if len(words) != 2:
            raise SceneError(
                "even and odd samples are not kept apart; give Renderer halves=True, or render "
                "with --denoise statistical"
            )
        return self._colours(words[0]), self._colours(words[1])

    def _variance(self) -> Image:
        """Return an estimate of the variance of each pixel's mean, (h, w, 3) float32.

        Let a pixel's samples have the weight a in the first part of the film and b in the second.
        The squared difference of both means times a b / (a + b)^2 estimates the variance of the
        mean of all samples, without bias if they are independent. For points that are spread
        evenly, even and odd octaves differ more: the estimate is divided by `Sampler.octaves`. If a
        part is empty, the squared value replaces the estimate.
        """
        parts = [self._sum(part) for part in np.split(self._film.words, 2)]
        divisors = [self._divisor(words) for words in parts]
        shares = divisors[0] * divisors[1] * _inverse(sum(divisors, start=np.float32(0.0))) ** 2
        first, second = (self._to_output(self._camera_mean(words)) for words in parts)
        apart = np.where(shares > 0, shares / np.float32(self.form.octaves or 1.0), 1.0)
        variance = apart[..., None] * (first - second) ** 2
        if self.form.weighed:
            counts = [self._light_paths(words) for words in parts]
            share = counts[0] * counts[1] / max(sum(counts), 1e-30) ** 2
            first, second = (self._to_output(self._light_path_mean(words)) for words in parts)
            variance += np.float32(share or 1.0) * (first - second) ** 2
        return variance.astype(np.float32)

    def samples_per_pixel(self) -> Image:
        """Return how many samples each pixel has, (h, w) float32."""
        return self._samples(self._words)

    def light_paths_per_pixel(self) -> float:
        """Return how many paths have begun at lights for each pixel."""
        return self._light_paths(self._words)

    @cached_property
    def _words(self) -> Words:
        """The words of all samples, (10 to 26, h, w)."""
        return self._sum(self._film.words)

    def _sum(self, films: Words) -> Words:
        total, *others = films
        for part in others:
            total = add_films(total, part)
        return np.asarray(total)

    def _colours(self, words: Words) -> Image:
        values = self._camera_mean(words)
        return self._to_output(
            values + self._light_path_mean(words) if self.form.weighed else values
        )

    def _camera_mean(self, words: Words) -> Image:
        """Return the means of the camera's samples in the film's three channels, (3, h, w)."""
        return _sums(words, 0) * _inverse(self._divisor(words))

    def _light_path_mean(self, words: Words) -> Image:
        """Return the light that weighted light paths add to these means, (3, h, w)."""
        return _sums(words, light_group(len(words))) * self._inverse_light_paths(words)

    def _to_output(self, values: Image) -> Image:
        first, second, third = values
        rows = np.array(self.form.to_output, np.float32)
        return np.stack([a * first + b * second + c * third for a, b, c in rows], axis=2)

    def _alpha(self) -> Image:
        words, first = self._words, FILM_WORDS + SUM_WORDS * self.form.weights
        return numbers(words[first : first + SUM_WORDS]) * self._inverse_divisor(words)

    def _mean_bands(self) -> Image:
        sums, *others = self._film.bands
        for half in others:
            sums = add_sums(sums, half)
        values, count = numbers(np.moveaxis(sums, 1, 0)), self.form.bands
        words, scale = self._words, np.float32(self._film.scale)
        total = values[:count] * (self._inverse_divisor(words) / scale)
        if self.form.weighed:
            total += values[count:] * (self._inverse_light_paths(words) / scale)
        return np.ascontiguousarray(np.moveaxis(total, 0, 2))

    def _samples(self, words: Words) -> Image:
        if not self.form.light_paths:
            return words[SAMPLES_WORD].astype(np.float32)
        return np.full(words.shape[1:], self._light_paths(words), np.float32)

    def _inverse_divisor(self, words: Words) -> Image:
        return _inverse(self._divisor(words))

    def _divisor(self, words: Words) -> Image:
        """Return the number of samples of each pixel, or the sum of their filter weights."""
        if self.form.weights:
            return numbers(words[FILM_WORDS:][:SUM_WORDS])
        return self._samples(words)

    def _inverse_light_paths(self, words: Words) -> Image:
        """Return 1 over the light paths per pixel; 0 in pixels without samples of the camera."""
        inverse = _inverse(np.full((), self._light_paths(words), np.float32))
        return np.where(words[SAMPLES_WORD] > 0, inverse, np.float32(0.0))

    def _light_paths(self, words: Words) -> float:
        first = light_group(len(words)) if self.form.weighed else 0
        count = words[first + SAMPLES_WORD]
        return float(count.sum(dtype=np.uint64)) / count.size


def _sums(words: Words, first: int) -> Image:
    """Three sums of pixels (n, h, w) from a word on, (3, h, w) float32."""
    sums = words[first : first + 3 * SUM_WORDS].reshape(3, SUM_WORDS, *words.shape[1:])
    return numbers(np.moveaxis(sums, 1, 0))


def _inverse(divisor: NDArray[Any]) -> Image:
    zeros = np.zeros_like(divisor)
    return np.divide(np.float32(1.0), divisor, out=zeros, where=divisor > 0)
