"""A film on a device: sums of samples by pixel, and the picture of them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import device
from clpt.arrays import Words
from clpt.device.buffers import Buffers
from clpt.render.film.state import NO_LAYERS, NO_LIGHT_LAYERS, NO_MATTES, SAMPLES_WORD
from clpt.render.records import GROUP_WORDS, SUM_WORDS, Features
from clpt.render.wavefront import path_buffers
from clpt.scene.layers import MATTE_SLOTS

NONE = {"layers": NO_LAYERS, "light_layers": NO_LIGHT_LAYERS, "mattes": NO_MATTES}
READ = 1 << 24  # bytes that are read at once: memory is dear
SIDE_BY_SIDE = ("layers", "mattes")  # whose pixels have their words together


class Film:
    """The film of a wavefront.

    settings: of the paths, which say the film's size and parts; features: which sums of a pixel it
    has. size: width and height [pixels]; sums: the buffers that samples are added to, by the names
    of the kernels' arguments; picture: (h, w, 4) float32, always the same memory.

    Raises MemoryBudgetError.
    """

    def __init__(
        self,
        stream: device.Stream,
        buffers: Buffers,
        settings: NDArray[np.void],
        features: Features,
    ):
        self.stream, self._words = stream, features.film_words
        self._allocate = buffers.allocate
        self.size = int(settings["width"]), int(settings["height"])
        self.band_count = int(settings["bands"]) if features.film.bands else 0
        self._band_sums = self.band_count * features.film_groups  # of a pixel
        self.halves = int(settings["halves"])
        self._parts = self.halves * int(settings["octaves"])
        self._settings, self._padded_pixels = settings, int(settings["padded_pixels"])
        x, y = path_buffers.pixels(settings)
        self._inside = path_buffers.inside(settings)
        self._at = (y * self.size[0] + x)[self._inside]  # in a picture, of each of these
        advice = "lower the image's size" + " or time_bins" * (features.film.layers.time_bins > 0)
        sums = {"film": self._words * self._word_bytes}
        if features.film.bands:
            advice += " or the number of bands"
            sums["bands"] = SUM_WORDS * self._band_sums * self._word_bytes
        layers = features.film.layers
        self._layer_words, self._mattes = layers.words, layers.matte_count
        self._light_sums = 3 * layers.light_pictures * features.film_groups
        for name, count in (
            ("layers", self._layer_words),
            ("light_layers", SUM_WORDS * self._light_sums),
            ("mattes", MATTE_SLOTS * self._mattes),
        ):
            if count:
                sums[name] = 4 * count * self._padded_pixels
        self.sums = {n: buffers.allocate(f"the {n}", size, advice) for n, size in sums.items()}
        self._sum_bytes = sums
        self._held: dict[str, cl.Buffer] = {}
        self._image = buffers.allocate("the image", 16 * math.prod(self.size), advice)
        shape = (*self.size[::-1], 4)
        self.picture = device.DeviceArray(stream.queue, shape, np.float32, data=self._image)
        self._written: cl.Event | None = None  # of the last command that wrote `picture`

    def show_in(self, picture: device.DeviceArray) -> None:
        """Let `picture` be another film's, of the same size."""
        self.picture, self._image = picture, picture.base_data

    @property
    def arguments(self) -> dict[str, Any]:
        """The kernels' arguments by name."""
        return {**self.sums, "image": self._image}

    def clear(self) -> None:
        """Enqueue that the film is empty and its picture black."""
        for name, size in self._sum_bytes.items():
            self.stream.fill(self.sums[name], 0, 0, size)
        self.stream.after(self.picture.events)
        device.supersede(self.picture, self.stream.fill(self._image, 0, 0, self._image.size))

    @property
    def group_bytes(self) -> int:
        """The size of a group of words of all pixels, in all parts."""
        return GROUP_WORDS * self._word_bytes

    @property
    def _word_bytes(self) -> int:
        return 4 * self._padded_pixels * self._parts

    def copy_group(self, first: int, into: cl.Buffer) -> None:
        """Enqueue that a buffer of `group_bytes` gets a group, a pixel's words from `first` on."""
        size = self.group_bytes // self._parts
        for part in range(self._parts):
            at = self._word_at(part, first)
            offsets = {"src_offset": at, "dst_offset": part * size, "byte_count": size}
            self.stream.copy(into, self.sums["film"], **offsets)

    def set_group(self, first: int, words: cl.Buffer | None) -> None:
        """Enqueue that a group has the words that `copy_group` copied, or 0 without a copy."""
        size = self.group_bytes // self._parts
        for part in range(self._parts):
            at = self._word_at(part, first)
            if words is None:
                self.stream.fill(self.sums["film"], 0, at, size)
            else:
                offsets = {"src_offset": part * size, "dst_offset": at, "byte_count": size}
                self.stream.copy(self.sums["film"], words, **offsets)

    def accumulate(self, kernel: device.BoundKernel) -> cl.Event:
        """Enqueue that `picture` becomes the mean of the samples, once its readers have ended."""
        self.stream.after([e for e in self.picture.events if e is not self._written])
        self._written = self.stream.run(kernel, *device.tiles(*self.size))
        device.supersede(self.picture, self._written)
        return self._written

    def hold(self) -> None:
        """Enqueue a copy of the film, for `words`. Raises MemoryBudgetError."""
        if not self._held:
            self._held = {
                name: self._allocate(f"a copy of the {name}", sums.size, "save no films")
                for name, sums in self.sums.items()
            }
        for name, copy in self._held.items():
            self.stream.copy(copy, self.sums[name])

    def words(self, *names: str, held: bool = False) -> dict[str, Words]:
        """Return what the film holds, arrays of `FilmState` by these names; wait for it.

        held: what it held at `hold`.
        """
        return {name: self._array(name, held) for name in names}

    def _array(self, name: str, held: bool) -> Words:
        """An array of `FilmState`, perhaps of no words."""
        width, height = self.size
        if name == "words":
            film = self._planes("film", self._parts * self._words, held)
            return film.reshape(self._parts, -1, height, width)
        if name == "bands":
            bands = self._planes("bands", self._parts * SUM_WORDS * self._band_sums, held)
            return bands.reshape(self._parts, self._band_sums, SUM_WORDS, height, width)
        if name not in self.sums:
            return NONE[name]
        if name == "layers":
            return self._pixels(name, self._layer_words, held)
        if name == "light_layers":
            sums = self._planes(name, SUM_WORDS * self._light_sums, held)
            return sums.reshape(-1, SUM_WORDS, *sums.shape[1:])
        slots = self._pixels(name, MATTE_SLOTS * self._mattes, held)
        return slots.reshape(self._mattes, MATTE_SLOTS, *slots.shape[1:])

    def _pixels(self, name: str, count: int, held: bool) -> Words:
        """Return a buffer whose pixels have their words side by side as pictures, (count, h, w)."""
        stored = np.empty((self._padded_pixels, count), np.uint32)
        self.stream.read((self._held if held else self.sums)[name], stored)
        return np.ascontiguousarray(path_buffers.picture(self._settings, stored.T))

    def _planes(self, name: str, count: int, held: bool) -> Words:
        """Return the first streams of a buffer as pictures, (count, h, w) uint32."""
        width, height = self.size
        sums = self._held if held else self.sums
        pixels = np.empty((count, height, width), np.uint32)
        size = 4 * self._padded_pixels
        at_once = max(READ // size, 1)
        for i in range(0, count, at_once):
            stored = np.empty((min(at_once, count - i), self._padded_pixels), np.uint32)
            self.stream.read(sums[name], stored, i * size)
            pixels[i : i + len(stored)] = path_buffers.picture(self._settings, stored)
        return pixels

    def set_words(self, arrays: Mapping[str, Words]) -> None:
        """Enqueue that the film holds these words, of the form that `words` returns."""
        for array, values in arrays.items():
            name = "film" if array == "words" else array
            if values.size:
                pixels = values.reshape(-1, math.prod(self.size))
                streams = np.zeros((len(pixels), self._padded_pixels), np.uint32)
                streams[:, self._inside] = pixels[:, self._at]
                stored = np.ascontiguousarray(streams.T) if name in SIDE_BY_SIDE else streams
                self.stream.write(self.sums[name], stored)

    def count_samples(self, group: int) -> int:
        """Return how many samples the film has in a group of words; wait for it."""
        count, words = 0, np.empty(self._padded_pixels, np.uint32)
        for part in range(self._parts):
            at = self._word_at(part, group + SAMPLES_WORD)
            count += int(self.stream.read(self.sums["film"], words, at).sum(dtype=np.uint64))
        return count

    def _word_at(self, part: int, word: int) -> int:
        """Return the place where a word of the pixels begins [bytes]."""
        return 4 * (part * self._words + word) * self._padded_pixels
