"""A meter of the noise in each cell of a film; see clpt.render.wavefront.work_list."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Floats
from clpt.render.flow import programs
from clpt.render.wavefront.wavefront import Wavefront
from clpt.render.wavefront.work_list import SIDE

DARK = 0.01  # of the picture's mean luminance: a darker tile counts as if it were as bright


class NoiseMeter:
    """Tells the variance of a wavefront's film since it was measured last, cell by cell.

    pixels: (cells,) how many each has; cell: (padded_pixels,) of each pixel.
    """

    def __init__(self, wavefront: Wavefront):
        self.wavefront = wavefront
        grid = wavefront.paths.cells
        self.across, self.cell, self.pixels = grid.across, grid.cell, grid.pixels
        self._dark: Floats | None = None  # luminance, for each of the two colours
        self._allocate(len(self.cell), len(self.pixels))

    def _allocate(self, padded_pixels: int, count: int) -> None:
        """Make the buffers and the kernel that measures noise."""
        wavefront, allocate = self.wavefront, self.wavefront.buffers.allocate
        features = wavefront.features
        texts = programs.noise_sources(features, wavefront.scene.strategy.layout)
        self._tiles = padded_pixels // 16
        self._active_cells = allocate("the cells of the film", 4 * count)
        self._noise_sums = allocate("the film's noise", 24 * self._tiles)
        streams = 2 * features.film_groups
        self._previous_mean = allocate("the film's former luminance", 4 * streams * padded_pixels)
        wavefront.stream.fill(self._previous_mean, 0, 0, self._previous_mean.size)
        self._kernel = wavefront.auxiliary_kernel(
            texts, "noise", active_cells=self._active_cells, noise_sums=self._noise_sums,
            previous_mean=self._previous_mean, side=SIDE, light_paths=0.0,
        )  # fmt: skip

    @property
    def knows_brightness(self) -> bool:
        """Whether the camera's paths have been measured, and so how bright the picture is."""
        return self._dark is not None

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Return the measurements so far, for `restore`; wait for the device."""
        mean = np.empty(self._previous_mean.size // 4, np.float32)
        mean = self.wavefront.stream.read(self._previous_mean, mean)
        return {"previous_mean": mean, "dark": np.zeros(0) if self._dark is None else self._dark}

    def restore(self, arrays: Mapping[str, NDArray[Any]]) -> None:
        """Continue with measurements of `arrays`."""
        mean, dark = arrays["previous_mean"], arrays["dark"]
        if mean.nbytes != self._previous_mean.size:
            raise ValueError("the noise was measured of another film")
        self.wavefront.stream.write(self._previous_mean, mean)
        self._dark = dark if len(dark) else None

    def measure(self, cells: NDArray[np.bool_]) -> Floats:
        """Return the relative variance of camera paths, (cells,) float64.

        It is the variance of the pixels' means, on average over each cell.
        """
        sums = self._sums_of_tiles(cells, 0.0)
        if self._dark is None:  # of each colour by itself
            _, luminance, pixels = sums
            self._dark = DARK * luminance.sum(axis=0) / np.maximum(pixels.sum(axis=0), 1)
        return self._of_cells(sums)

    def measure_lights(self, cells: NDArray[np.bool_], light_paths: float) -> Floats:
        """Return the variance of light paths likewise; light_paths: of each pixel in the film."""
        return self._of_cells(self._sums_of_tiles(cells, light_paths))

    def _of_cells(self, sums: Floats) -> Floats:
        """The mean over each cell's pixels of their relative variance."""
        variance, luminance, pixels = sums
        dark = np.zeros(2) if self._dark is None else self._dark
        cell = self.cell[::16, None] // 2 * 2 + np.arange(2)  # of a tile's two colours
        count = np.maximum(self.pixels, 1)
        mean_of_cell = np.bincount(cell.ravel(), luminance.ravel(), len(count)) / count
        mean = luminance / np.maximum(pixels, 1)
        # A tile that a few paths have lit is as bright as its cell, for all that is known.
        uncertain = np.minimum(divide(variance, luminance**2), 1.0)
        bright = mean + uncertain * (mean_of_cell[cell] - mean) + dark
        relative = divide(variance, bright**2)
        return np.bincount(cell.ravel(), relative.ravel(), len(count)) / count

    def _sums_of_tiles(self, cells: NDArray[np.bool_], light_paths: float) -> Floats:
        """Variance, luminance and number of pixels (3, tiles, 2) of each tile's two colours."""
        stream = self.wavefront.stream
        stream.write(self._active_cells, cells.astype(np.uint32))
        if self.wavefront.features.transport.weighed:
            self._kernel.set_args(light_paths=light_paths)
        stream.run(self._kernel, (self._tiles,))
        sums = stream.read(self._noise_sums, np.empty((self._tiles, 2, 3), np.float32))
        return np.moveaxis(sums.astype(float), 2, 0)


def divide(a: ArrayLike, b: ArrayLike) -> Floats:
    """Return a / b, and 0 where b is 0."""
    over, under = np.broadcast_arrays(np.asarray(a), np.asarray(b))
    return np.divide(over, under, out=np.zeros(over.shape), where=under > 0.0)
