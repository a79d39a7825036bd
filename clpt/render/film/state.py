"""The state of a film on the host: sums that add to the bit, and numbers of samples."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Words
from clpt.errors import SceneError
from clpt.render.records import GROUP_WORDS, SUM_WORDS

SAMPLES_WORD = 3 * SUM_WORDS  # after three sums, kernels/film/film.cl
FILM_WORDS = GROUP_WORDS  # of a pixel; a sum of weights and a sum of alpha may follow
LEAST_WITH_LIGHT_PATHS = 2 * FILM_WORDS  # words of a pixel that end with a group of light paths
UNIT = 2.0**-48  # of a sum, kernels/core/fixed.cl
STRIP = 16384  # pixels whose words are added at a time

Ranges = tuple[tuple[int, int], ...]


def _no_words(*shape: int) -> Words:
    words = np.zeros((0, *shape), np.uint32)
    words.setflags(write=False)
    return words


NO_BANDS = _no_words(SUM_WORDS, 1, 1)[None]
NO_LAYERS, NO_LIGHT_LAYERS, NO_MATTES = (
    _no_words(1, 1),
    _no_words(SUM_WORDS, 1, 1),
    _no_words(1, 1, 1),
)
DIMENSIONS = {"words": 4, "bands": 5, "layers": 3, "light_layers": 4, "mattes": 4}


@dataclass(frozen=True, eq=False)
class FilmState:
    """The film of a renderer as whole numbers, from `Renderer.film_state`.

    A sum is 96 bits in two's complement, three words with the lowest first, in units of 2^-48. So
    states of different samples merge, to the bit and in any order, to the state of a single run.

    words: (parts, 10 to 26, h, w) uint32. Each pixel has three sums and the number of its samples.
    Where samples serve all pixels whose filters hold them, a sum of the filter's values follows;
    with alpha, a sum of coverage. Where light paths are weighted, their three sums follow, and the
    number of light paths that have the pixel's number.
    parts: 1; times 2 if even and odd samples have separate sums; times 2 if octaves have; see
    `film_part` in kernels/film/film.cl. bands: (parts, sums, 3, h, w) uint32, a sum for each band,
    then, where light paths are weighted, their sum for each band; sums may be 0.
    taken: first and end of each range of sample numbers in the film, ascending and disjoint.
    scale: the number that a value of 1 adds, a power of two that follows from the film's exposure
    and the scene's light. layers: (words, h, w) uint32, of the first samples, see
    kernels/film/layers.cl; light_layers: (sums, 3, h, w) uint32; mattes: (lists, slots, h, w)
    uint32, numbers of names and how often a ray met each.
    """

    words: Words
    bands: Words = field(default_factory=lambda: NO_BANDS)
    taken: Ranges = ()
    scale: float = 1.0
    layers: Words = field(default_factory=lambda: NO_LAYERS)
    light_layers: Words = field(default_factory=lambda: NO_LIGHT_LAYERS)
    mattes: Words = field(default_factory=lambda: NO_MATTES)

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        """Restore a pickle; in old pickles `words` has a first axis of length 1."""
        self.__dict__.update(state)
        if self.words.ndim > DIMENSIONS["words"]:
            self.__dict__["words"] = self.words[0]

    @property
    def arrays(self) -> dict[str, Words]:
        """All words by name."""
        return {name: getattr(self, name) for name in DIMENSIONS}

    @property
    def samples(self) -> NDArray[np.uint32]:
        """The number of samples of each pixel, (h, w) uint32."""
        counts: NDArray[np.uint32] = self.words[:, SAMPLES_WORD].sum(axis=0, dtype=np.uint32)
        return counts

    def merged(self, other: FilmState) -> FilmState:
        """Return the film of the samples of both.

        Raises SceneError where films differ in their form, or a sample is in both.
        """
        for name, array in self.arrays.items():
            shapes = array.shape, other.arrays[name].shape
            if shapes[0] != shapes[1]:
                raise SceneError(
                    f"films of another form cannot be merged: {name} are {shapes[0]} and "
                    f"{shapes[1]}"
                )
        if self.scale != other.scale:
            message = "films cannot be merged whose exposure, or whose light, is of another scale"
            raise SceneError(message, where="film.exposure")
        taken = join_ranges(self.taken, other.taken)
        return replace(self.plus(other), taken=taken)

    def plus(self, other: FilmState) -> FilmState:
        """Return the sums of both films, which have equal shapes; `taken` is that of the first."""
        return replace(
            self,
            words=add_films(self.words, other.words),
            bands=add_sums(self.bands, other.bands),
            layers=self.layers + other.layers,
            light_layers=add_sums(self.light_layers, other.light_layers),
            mattes=add_mattes(self.mattes, other.mattes),
        )


def add_films(a: Words, b: Words) -> Words:
    """Return the sums and numbers of samples, (..., 10 to 26, h, w) each, of two films."""
    total = np.empty_like(a)
    group = light_group(a.shape[-3])
    firsts = [*range(0, SAMPLES_WORD, SUM_WORDS), *range(FILM_WORDS, group, SUM_WORDS)]
    if group < a.shape[-3]:
        firsts += range(group, group + SAMPLES_WORD, SUM_WORDS)
    for rows in _strips(a):
        np.add(a[rows], b[rows], out=total[rows])
        for first in firsts:
            part = np.s_[..., first : first + SUM_WORDS, :, :]
            _carry(total[rows][part], a[rows][part])
    return total


def light_group(words: int) -> int:
    """Return the first of a pixel's words for light paths; `words` where it has none."""
    return words - FILM_WORDS if words >= LEAST_WITH_LIGHT_PATHS else words


def add_sums(a: Words, b: Words) -> Words:
    """Return the sums of 96-bit numbers, (..., 3, h, w) each."""
    total = np.empty_like(a)
    for rows in _strips(a):
        np.add(a[rows], b[rows], out=total[rows])
        _carry(total[rows], a[rows])
    return total


def add_mattes(a: Words, b: Words) -> Words:
    """Return the lists of names, (..., slots, h, w) each, of two films.

    See matte_add in kernels/film/layers.cl.
    """
    total = np.empty_like(a)
    for rows in _strips(a):
        both = np.concatenate([a[rows], b[rows]], axis=-3)
        both -= 1  # so that no name, which is 0, comes last
        both.sort(axis=-3)
        both += 1
        first, second = both[..., :-1, :, :], both[..., 1:, :, :]
        same = (first >> 7 == second >> 7) & (first > 0)
        first += np.where(same, second & 127, 0).astype(np.uint32)
        second[same] = 0
        both -= 1
        both.sort(axis=-3)
        both += 1
        total[rows] = both[..., : a.shape[-3], :, :]
    return total


def numbers(sums: Words) -> NDArray[np.float32]:
    """Return sums as the nearest floats: three words (3, ...), the lowest first."""
    low, middle, high = sums
    top = (high.astype(np.int64) << 32) | middle
    return ((top * 2.0**32 + low) * UNIT).astype(np.float32)


def _strips(words: Words) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of words (..., h, w) in pieces that fit a cache."""
    height, width = words.shape[-2:]
    step = max(1, STRIP // max(width, 1))
    for i in range(0, height, step):
        yield np.s_[..., i : i + step, :]


def _carry(total: Words, a: Words) -> None:
    """Carry between the words of `total`, (..., 3, h, w): `a` plus another array, word by word.

    A word that wrapped around is less than its summand.
    """
    low, middle, high = (total[..., i, :, :] for i in range(SUM_WORDS))
    carry = low < a[..., 0, :, :]
    carry_high = middle < a[..., 1, :, :]
    middle += carry
    carry_high |= carry & (middle == 0)
    high += carry_high


def join_ranges(a: Ranges, b: Ranges) -> Ranges:
    """Return the union of two sets of ranges; adjacent ranges are joined.

    Raises SceneError if a number is in both.
    """
    joined: list[tuple[int, int]] = []
    for first, end in sorted([*a, *b]):
        if joined and first < joined[-1][1]:
            last = min(end, joined[-1][1]) - 1
            raise SceneError(f"samples {first} to {last} would be taken twice", where="samples")
        if joined and first == joined[-1][1]:
            joined[-1] = joined[-1][0], end
        elif end > first:
            joined.append((first, end))
    return tuple(joined)
