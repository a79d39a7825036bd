"""Adaptive sampling: a pixel gets samples until the noise around it is as low as was asked.

The film is cut into squares, and their pixels into the two colours of a chessboard: two cells. How
many samples a cell gets is decided by its partner's pixels alone, never by its own. Samples of
different pixels are independent of each other, so a pixel's number of samples is independent of
what they say, and its mean has no bias: exactly, not in the limit. (To stop by a cell's own samples
makes a picture too dark: where they missed the light there seems to be no noise.)

For that a partner's decision must not depend on how long the cell itself was sampled either. Where
a cell has finished and its partner has not, it goes on for the partner's sake, and what it then
gathers does not go into the picture.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.errors import SceneError
from clpt.render.codegen import programs
from clpt.render.contract.features import Features
from clpt.render.wavefront import work_list
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import check_noise
from clpt.scene.integrators import PIXELWISE

SIDE = 16  # pixels of a square, a multiple of four
LEAST = 8  # samples of a pixel before the film is looked at; it takes twice as many to tell noise
AHEAD = 4  # times the samples of a look that it may tell how many are needed
STEPS = 4  # in which samples are given from one look to the next, at twice as many
DARK = 0.01  # of the picture's luminance: what is darker counts as if it were so bright
OPEN = work_list.FOREVER  # of a cell whose number of samples is not decided

Cells = NDArray[np.int64]
Tell = Callable[[Any], bool]


def checked(noise: float, features: Features) -> float:
    """The noise that was asked for, if it makes sense there. Raises SceneError."""
    check_noise(noise)
    if features.channel:
        message = "the values of the integrator aov are no light; leave it out"
        raise SceneError(message, where="noise")
    if features.light_paths:
        message = "the integrator particle_tracer cannot choose which pixels its paths reach"
        raise SceneError(f"{message}; leave it out, or choose path", where="noise")
    if features.sampler not in [cls.kind for cls in PIXELWISE]:
        message = f"neighbouring pixels share the points of the sampler {features.sampler}"
        raise SceneError(f"{message}; leave it out, or choose sobol", where="noise")
    return float(noise)


class Adaptive:
    """What is known of the noise in a wavefront's film, and how many samples each cell gets.

    Cells are (2 * squares,): a square's two colours after each other, so that a cell's partner is
    its number with the last bit changed.
    """

    def __init__(self, front: Wavefront):
        self.front = front
        settings = front.lowered.settings
        x, y = work_list.pixels(settings)
        self._inside = work_list.inside(settings)
        across, down = (-(-int(settings[name]) // SIDE) for name in ("width", "height"))
        self._cell = 2 * (y // SIDE * across + x // SIDE) + (x + y) % 2  # of every place
        count = 2 * across * down
        self._partner = np.arange(count) ^ 1
        self._pixels = np.bincount(self._cell[self._inside], minlength=count)
        self.noise = 0.0
        self.next = np.zeros(count, np.int64)  # the first sample that a cell's pixels do not have
        self.stop = np.full(count, OPEN)  # how many they will have
        self._level = 0  # samples at the last look
        self._measured_at = np.zeros(
            count, np.int64
        )  # samples at the last look at each cell; 0: none
        self._variance = np.full(count, np.inf)  # of a sample, relative
        self._dark: NDArray[np.float64] | None = None
        self._prepare(int(settings["padded_pixels"]), count)

    def _prepare(self, padded_pixels: int, count: int) -> None:
        front, give = self.front, self.front.buffers
        texts = programs.noise_sources(front.lowered.features, front.tree.layout)
        self._tiles = padded_pixels // 16
        self._active_cells = give.allocate("the cells of the film", 4 * count)
        self._noise_sums = give.allocate("the film's noise", 24 * self._tiles)
        self._previous_mean = give.allocate("the film's former luminance", 8 * padded_pixels)
        front.stream.fill(self._previous_mean, 0, 0, self._previous_mean.size)
        given = {
            "active_cells": self._active_cells,
            "noise_sums": self._noise_sums,
            "previous_mean": self._previous_mean,
            "side": SIDE,
        }
        self._look = front.auxiliary_kernel(texts, "noise", **given)
        self._film_copies: dict[str, Any] = {}

    @property
    def active(self) -> float:
        """The share of the picture's pixels that go on."""
        return float(self._pixels[self.next < self.stop].sum() / self._pixels.sum())

    def skip(self, samples: int) -> None:
        """Note that every pixel has got its samples before this one, whatever its noise."""
        self.next[:] = samples
        self._level = max(self._level, samples)
        self.stop[self.stop < samples] = samples

    def run(self, end: int, noise: float, tell: Tell) -> bool:
        """Add samples till the noise is as low, or all pixels have `end`; whether it came to that.

        noise: of a square's pixels the root of the mean square of the standard error of their
        luminance, relative to the mean luminance of the 4x4 pixels around.
        """
        if noise != self.noise:
            self.noise = noise
            self.stop[:] = OPEN
            self._decide()
        try:
            while (self.next < np.minimum(self.stop, end)).any():
                if not self._round(end, tell):
                    return False
        finally:
            self.front.work_list(self._inside)
        return True

    def _round(self, end: int, tell: Tell) -> bool:
        """Go on to the next look, or the end."""
        look = self._next_look()
        goal = min(look, end)
        ends = np.minimum(self.stop, goal)
        if not self._expose(ends, tell):
            return False
        self.next = np.maximum(self.next, ends)
        guide_cells = self.stop[self._partner] == OPEN
        if goal < look:
            return True
        self._level = look
        overrun = guide_cells & (self.next < look)
        if not overrun.any():
            self._measure(guide_cells)
        else:
            self._copy_film()
            finished = self._expose(np.where(overrun, look, 0), tell)
            if finished:
                self._measure(guide_cells)
            self._restore_film()
            if not finished:
                return False
        self._decide()
        return True

    def _next_look(self) -> int:
        """A power of two: so many points of a Sobol sequence are spread best."""
        return 1 << math.ceil(math.log2(max(LEAST, 1.5 * self._level)))

    def _expose(self, ends: Cells, tell: Tell) -> bool:
        """Bring every cell to its end, if it is not beyond."""
        behind = self.next < ends
        for first in np.unique(self.next[behind]):
            cells = behind & (self.next == first)
            padded_pixels = self._inside[cells[self._cell[self._inside]]]
            own = ends[self._cell[padded_pixels]]
            self.front.work_list(padded_pixels, own)
            if not self.front.render_samples(int(first), int(own.max()), tell):
                return False
        return True

    def _measure(self, active_cells: NDArray[np.bool_]) -> None:
        """Estimate the relative variance of a sample in these cells."""
        stream = self.front.stream
        stream.write(self._active_cells, active_cells.astype(np.uint32))
        stream.run(self._look, (self._tiles,))
        noise_sums = stream.read(
            self._noise_sums, np.empty((self._tiles, 2, 3), np.float32)
        ).astype(float)
        variance, luminance, pixels = np.moveaxis(noise_sums, 2, 0)
        if self._dark is None:  # of each colour by itself
            self._dark = DARK * luminance.sum(axis=0) / np.maximum(pixels.sum(axis=0), 1)
        cell = self._cell[::16, None] // 2 * 2 + np.arange(2)
        count = np.maximum(self._pixels, 1)
        whole = np.bincount(cell.ravel(), luminance.ravel(), len(self.stop)) / count
        mean = luminance / np.maximum(pixels, 1)
        # A tile that a few paths have lit is as bright as its cell, for all that is known.
        uncertain = np.minimum(_over(variance, luminance**2), 1.0)
        relative = _over(variance, (mean + uncertain * (whole[cell] - mean) + self._dark) ** 2)
        sums = np.bincount(cell.ravel(), relative.ravel(), len(self.stop))
        known = active_cells & (self._measured_at > 0)
        self._variance[known] = self._level * (sums / count)[known]
        self._measured_at[active_cells] = self._level

    def _decide(self) -> None:
        """Tell how many samples cells get, where their partners know it closely enough."""
        measured_at = self._measured_at[self._partner]
        needed = self._variance[self._partner] / self.noise**2
        sure = (self.stop == OPEN) & (needed <= AHEAD * measured_at)
        step = np.maximum(measured_at // STEPS, 1)
        wanted = np.ceil(np.where(sure, needed, 0.0) / step) * step
        self.stop[sure] = np.maximum(wanted, measured_at)[sure]

    def _copy_film(self) -> None:
        """Keep a copy of the film."""
        front = self.front
        for name in ("film", "bands"):
            if name in front.named and name not in self._film_copies:
                size = front.named[name].size
                self._film_copies[name] = front.buffers.allocate(f"a copy of the {name}", size)
        for name, kept in self._film_copies.items():
            front.stream.copy(kept, front.named[name])

    def _restore_film(self) -> None:
        for name, kept in self._film_copies.items():
            self.front.stream.copy(self.front.named[name], kept)
        self.front.accumulate_film()


def _over(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """a / b, and 0 where b is."""
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0.0)
