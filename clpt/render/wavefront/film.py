"""A film on a device: sums of samples by pixel and plane, and the picture of them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import NDArray

from clpt import device
from clpt.device.buffers import Buffers
from clpt.errors import MemoryBudgetError

FILM_WORDS = 7  # of a pixel and plane, kernels/film/film.cl


class Film:
    """The film of a wavefront.

    settings: of the paths, which say the film's size and planes; bands: whether it has any.
    size: width and height [pixels]; sums: the buffers that samples are added to, by the names of
    the kernels' arguments; picture: (h, w, 4) float32, always the same memory.

    Raises MemoryBudgetError.
    """

    def __init__(
        self, stream: device.Stream, buffers: Buffers, settings: NDArray[np.void], bands: bool
    ):
        self.stream, self.has_bands = stream, bands
        self.size = int(settings["width"]), int(settings["height"])
        self.band_count = int(settings["bands"])
        samples = int(settings["padded_pixels"]) * int(settings["planes"])
        pixels, advice = math.prod(self.size), "lower the image's size"
        sums, images = {"film": 4 * FILM_WORDS * samples}, {"image": 16 * pixels}
        if bands:
            advice += " or the number of bands"
            sums["bands"] = 8 * self.band_count * samples
            images["band_image"] = 4 * self.band_count * pixels
            if sums["bands"] // 4 >= 1 << 31:  # kernels/film/bands.cl counts words by an int
                raise MemoryBudgetError("the film of bands", sums["bands"], 1 << 33, advice)
        self.sums, self._images = (
            {name: buffers.allocate(f"the {name}", size, advice) for name, size in sizes.items()}
            for sizes in (sums, images)
        )
        self._sum_bytes = sums
        shape = (*self.size[::-1], 4)
        self.picture = device.DeviceArray(
            stream.queue, shape, np.float32, data=self._images["image"]
        )
        self._written: cl.Event | None = None  # of the last command that wrote `picture`

    @property
    def arguments(self) -> dict[str, Any]:
        """The kernels' arguments by name."""
        return {**self.sums, **self._images}

    def clear(self) -> None:
        """Enqueue that the film is empty and its picture black."""
        for name, size in self._sum_bytes.items():
            self.stream.fill(self.sums[name], 0, 0, size)
        self.stream.after(self.picture.events)
        image = self._images["image"]
        device.supersede(self.picture, self.stream.fill(image, 0, 0, image.size))

    def accumulate(self, kernel: device.BoundKernel) -> cl.Event:
        """Enqueue that `picture` becomes the mean of the samples, once its readers have ended."""
        self.stream.after([e for e in self.picture.events if e is not self._written])
        self._written = self.stream.run(kernel, self.size)
        device.supersede(self.picture, self._written)
        return self._written

    def colours(self) -> NDArray[np.float32]:
        """Return the picture, (h, w, 3) float32 in the film's output space; wait for it."""
        whole = np.empty((*self.size[::-1], 4), np.float32)
        whole = self.stream.read(self._images["image"], whole)
        return np.ascontiguousarray(whole[:, :, :3])

    def bands(self, kernel: device.BoundKernel) -> NDArray[np.float32]:
        """Return the mean radiance in each band, (h, w, bands) float32; wait for it."""
        self.stream.run(kernel, self.size)
        values = np.empty((*self.size[::-1], self.band_count), np.float32)
        return self.stream.read(self._images["band_image"], values)
