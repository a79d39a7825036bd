"""The noise in each cell of a film (clpt.render.wavefront.path_buffers), and that after denoising.

To measure the latter both halves of the samples are denoised. The noise of a half is independent of
the other half, so the distance of a denoised half from the other half measures its error, blur
included: with halves a and b, and d of them denoised, the square of (d(a) + d(b)) / 2 - truth is on
average

    ((d(a) - b)^2 + (d(b) - a)^2) / 2 - (a - b)^2 / 2 - (d(a) - d(b))^2 / 4

The two colours of the chessboard (clpt.render.wavefront.adaptive) are denoised apart, each in a
picture of half the width. So the error of a colour's pixels does not depend on the samples of the
other colour, whose numbers it decides.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import device
from clpt.arrays import Floats, Image
from clpt.denoise import needs
from clpt.denoise.oidn import Oidn
from clpt.denoise.statistical import Statistical
from clpt.images.colour import LUMINANCE
from clpt.render.film.pictures import Pictures
from clpt.render.flow import programs
from clpt.render.wavefront.path_buffers import SIDE
from clpt.render.wavefront.wavefront import Wavefront

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


SURE = {"oidn": 0.02, "statistical": 0.1}  # least share of the noise that remains
BESIDE = 2  # squares around the wanted squares, which are denoised with them
AROUND = np.array([1.0, 2.0, 1.0])  # weights of neighbouring squares in a row


class DenoisedNoise:
    """A meter of the error of a denoised picture.

    picture: returns the present picture, with halves; on: the device that denoises; method: a name
    of clpt.choices.DENOISERS.
    """

    def __init__(self, picture: Callable[[], Pictures], on: device.Device, method: str):
        self._picture, self._device, self._method = picture, on, method
        self._oidn: dict[int, tuple[list[Image | None], Oidn]] = {}  # of each colour

    def measure(self, cells: NDArray[np.bool_]) -> Floats:
        """Return the mean square of the relative error of luminance left in cells, (cells,).

        cells: the cells to measure; others may be 0. An error is relative to the denoised light,
        but at least to a hundredth of the picture's mean. A single square is too noisy, so
        neighbouring squares count too. The error is at most the noise before denoising. Raises
        DeviceError where the denoiser fails.
        """
        picture = self._picture()
        halves, layers = picture.halves(), picture.layers()
        height, width = halves[0].shape[:2]
        down, across = -(-height // SIDE), -(-width // SIDE)
        dark = DARK * max(float(np.mean(halves[0] + halves[1]) / 2.0), 0.0)
        left_over = np.zeros((down, across, 2))
        rows, columns = (
            _part(cells.reshape(left_over.shape).any(axis=(2, axis))) for axis in (1, 0)
        )
        part = tuple(slice(each.start * SIDE, each.stop * SIDE) for each in (rows, columns))
        surfaces = [layers[name][part] if name in layers else None for name in needs.LAYERS]
        even, odd = (np.nan_to_num(half[part]) for half in halves)
        for colour in range(2):
            y, x, inside = _pixels(even.shape[0], even.shape[1], colour)
            beside = [None if image is None else image[y, x] for image in surfaces]
            squares = (y // SIDE * (columns.stop - columns.start) + x // SIDE)[inside]
            errors = self._errors(colour, (even[y, x], odd[y, x]), beside, dark)
            shape = left_over[rows, columns, 0].shape
            count, left, before = (
                _around(np.bincount(squares, each[inside], shape[0] * shape[1]).reshape(shape))
                for each in (np.ones(x.shape), *errors)
            )
            before = divide(before, count)
            left_over[rows, columns, colour] = np.clip(
                divide(left, count), SURE[self._method] * before, before
            )
        return left_over.ravel()

    def _errors(
        self,
        colour: int,
        halves: tuple[Image, Image],
        surfaces: list[Image | None],
        dark: float,
    ) -> tuple[Floats, Floats]:
        """Squares of the relative error after denoising and before, (h, w) float64 each."""
        denoised = self._denoised(colour, halves, surfaces)
        a, b, da, db = ((image @ LUMINANCE).astype(float) for image in (*halves, *denoised))
        weight = divide(1.0, (np.maximum(0.5 * (da + db), 0.0) + dark) ** 2)
        noise = 0.5 * (a - b) ** 2
        left = 0.5 * ((da - b) ** 2 + (db - a) ** 2) - noise - 0.25 * (da - db) ** 2
        return weight * left, weight * 0.5 * noise

    def _denoised(
        self, colour: int, halves: tuple[Image, Image], surfaces: list[Image | None]
    ) -> tuple[Image, Image]:
        if self._method == "statistical":
            return Statistical(self._device, halves, *surfaces).halves()
        former, oidn = self._oidn.get(colour, ([], None))
        same = len(former) > 0 and all(
            np.array_equal(a, b)
            for a, b in zip(former, surfaces, strict=True)
            if a is not None and b is not None
        )
        if oidn is None or not same:  # layers are of the first samples, and then stay
            oidn = Oidn(*surfaces)
            self._oidn[colour] = surfaces, oidn
        return oidn.colours(halves[0]), oidn.colours(halves[1])


def _part(wanted: NDArray[np.bool_]) -> slice:
    """Return the range of wanted rows or columns of squares, with their surroundings."""
    squares = np.flatnonzero(wanted)
    first, last = int(squares[0]), int(squares[-1])
    return slice(max(first - BESIDE, 0), min(last + 1 + BESIDE, len(wanted)))


def _pixels(height: int, width: int, colour: int) -> tuple[Any, Any, NDArray[np.bool_]]:
    """Return y and x of a colour's pixels, and whether they exist, (h, half the width) each.

    A row with a pixel less has its last pixel twice.
    """
    y = np.broadcast_to(np.arange(height)[:, None], (height, -(-width // 2)))
    x = 2 * np.arange(-(-width // 2)) + (y + colour) % 2
    inside = x < width
    return y, np.where(inside, x, np.maximum(x - 2, 0)), inside


def _around(sums: NDArray[Any]) -> Floats:
    """Sums over each square (rows, columns) and its neighbours, weighted by AROUND."""
    padded = np.pad(sums, 1)
    rows = sum(AROUND[i] * padded[i : i + sums.shape[0]] for i in range(3))
    return np.asarray(sum(AROUND[i] * rows[:, i : i + sums.shape[1]] for i in range(3)))
