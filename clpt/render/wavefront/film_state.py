"""What a film holds, on the host: sums of samples that add to the bit, and their numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.render.contract.features import GROUP_WORDS, SUM_WORDS

SAMPLES_WORD = 3 * SUM_WORDS  # after three sums, kernels/film/film.cl
FILM_WORDS = GROUP_WORDS  # of a pixel; one of weights and one of alpha may follow
LEAST_WITH_LIGHT_PATHS = 2 * FILM_WORDS  # from which a pixel's last words are those of light paths
STRIP = 16384  # pixels whose words are added at a time

Words = NDArray[np.uint32]
Ranges = tuple[tuple[int, int], ...]


NO_LAYERS = np.zeros((0, 1, 1), np.uint32)
NO_LAYERS.setflags(write=False)


@dataclass(frozen=True, eq=False)
class FilmState:
    """The film of a renderer as whole numbers, from `Renderer.film_state`.

    A sum is 96 bits in two's complement, three words with the lowest first, in units of 2^-48. So
    two states of different samples merge to the state of one run, to the bit, in any order.

    words: (films, halves, 10 to 26, h, w) uint32, one film, or one for each channel of `aov`; of
    each pixel three sums, and the number of its samples; then, where samples serve all pixels whose
    filters hold them, a sum of the filter's values, and with alpha a sum of what is covered; then,
    where light paths are weighed, three sums of theirs, and how many began at the pixel's number.
    halves: 2 where even and odd samples are kept apart, else 1. bands: (halves, sums, 3, h, w)
    uint32, a sum for each band, then, where light paths are weighed, one of theirs for each; sums
    may be 0. taken: first and end of each range of sample
    numbers that were taken, ascending and apart. scale: of a value of 1, a power of two that
    follows from the film's exposure. layers: (words, h, w) uint32, those beside the picture, see
    kernels/film/layers.cl.
    """

    words: Words
    bands: Words
    taken: Ranges
    scale: float = 1.0
    layers: Words = field(default_factory=lambda: NO_LAYERS)

    @property
    def arrays(self) -> dict[str, Words]:
        """All words by name."""
        return {"words": self.words, "bands": self.bands, "layers": self.layers}

    @property
    def samples(self) -> NDArray[np.uint32]:
        """How many samples each pixel has, (h, w) uint32."""
        counts: NDArray[np.uint32] = self.words[0, :, SAMPLES_WORD].sum(axis=0, dtype=np.uint32)
        return counts

    def merged(self, other: FilmState) -> FilmState:
        """Return the film of the samples of both.

        Raises SceneError where films differ in their form, or a sample is in both.
        """
        for name, array in self.arrays.items():
            own, given = array.shape, other.arrays[name].shape
            if own != given:
                raise SceneError(
                    f"films of another form cannot be merged: {name} are {own} and {given}"
                )
        if self.scale != other.scale:
            raise SceneError("films of another exposure cannot be merged", where="film.exposure")
        taken = join_ranges(self.taken, other.taken)
        words, bands = add_films(self.words, other.words), add_sums(self.bands, other.bands)
        return FilmState(words, bands, taken, self.scale, self.layers + other.layers)


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
    """Return which of a pixel's words is the first of light paths; `words` where there are none."""
    return words - FILM_WORDS if words >= LEAST_WITH_LIGHT_PATHS else words


def add_sums(a: Words, b: Words) -> Words:
    """Return the sums of 96-bit numbers, (..., 3, h, w) each."""
    total = np.empty_like(a)
    for rows in _strips(a):
        np.add(a[rows], b[rows], out=total[rows])
        _carry(total[rows], a[rows])
    return total


def _strips(words: Words) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of words (..., h, w) in pieces that fit a cache."""
    height, width = words.shape[-2:]
    step = max(1, STRIP // max(width, 1))
    for i in range(0, height, step):
        yield np.s_[..., i : i + step, :]


def _carry(total: Words, a: Words) -> None:
    """Carry between the words of sums, (..., 3, h, w), whose words were added to those of `a`.

    A sum that wrapped around is less than what it was made of.
    """
    low, middle, high = (total[..., i, :, :] for i in range(SUM_WORDS))
    carry = low < a[..., 0, :, :]
    carry_high = middle < a[..., 1, :, :]
    middle += carry
    carry_high |= carry & (middle == 0)
    high += carry_high


def join_ranges(a: Ranges, b: Ranges) -> Ranges:
    """Return two sets of ranges as one; neighbours become one range.

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
