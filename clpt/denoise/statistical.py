"""A denoiser without anything learned: averages over pixels that see the same light, by statistics.

It runs on any OpenCL device. Two halves of a picture's samples tell the noise of each pixel; which
pixels are alike, and how that decides, is in kernels/stage/denoise.cl. It averages twice: the
averages of the first time, which have less noise, decide the second time. The halves then tell the
error of both averages, and the picture is chosen among the averages and the noisy picture by the
least error: so it is not worse than the noisy picture where errors can be estimated.

All weights follow from colours, and are the same for bands: so spectra keep their shape.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import device
from clpt.arrays import Image

# bench/notes/denoising.md has the alternatives.
SCALE = 0.2  # of the mean light: above it, statistics are of logarithms
NOISE_RADIUS = 3  # of the window around a pixel that tells its variance
ERROR_RADIUS = 4  # likewise of errors
LEAST_VARIANCES = (1e-4, 3e-4)  # of transformed light: what the eye does not see
LIMITS, SHARPNESS = (1.3, 2.5), (3, 2)  # of both averages, see `likeness`
ALBEDO, NORMAL = 0.05, 0.2  # differences of surfaces that count, beside three times their noise
DARK = 0.1  # of the mean light: what is darker counts as if it were so bright
BORDER = 11  # pixels of planes beside the picture, kernels/stage/denoise.cl
ADVICE = "denoise a smaller picture"
VECTORS = 4  # MOST_VALUES, kernels/stage/denoise.cl


class Statistical:
    """Denoises pictures that see the same surfaces.

    on: the device; halves: (h, w, 3) float32 each, of even and of odd samples; albedo, normal:
    likewise, or None. colours: (h, w, 3) float32, their picture without most of its noise.

    Raises KernelBuildError, MemoryBudgetError.
    """

    def __init__(
        self,
        on: device.Device,
        halves: tuple[Image, Image],
        albedo: Image | None = None,
        normal: Image | None = None,
    ):
        self._height, self._width = halves[0].shape[:2]
        self._lanes, self._rows = on.lanes, 2 if on.lanes == 1 else 8
        self._stream, self._buffers = device.Stream(on.queue), device.Buffers(on)
        self._program = device.build(
            on, device.assemble("stage/denoise.cl", defines={"LANES": on.lanes})
        )
        mean = float(np.mean(halves, dtype=float))
        self._light = max(mean, 1e-12)
        empty = np.zeros_like(halves[0])
        pair = (np.clip(empty if albedo is None else albedo, 0.0, 1.0), normal)
        surfaces = [empty if image is None else image for image in pair]
        self._surfaces = [self._planes(self._upload(_padded(image)), 1) for image in surfaces]
        widths = (
            least + 3.0 * noise_of(image)
            for least, image in zip((ALBEDO, NORMAL), surfaces, strict=True)
        )
        self._features = tuple(0.5 / width**2 for width in widths)
        both = np.stack([_padded(half) for half in halves], axis=2)
        uploaded = self._upload(both)
        self._guides = [self._guide(both, 0)]
        once = self._average(0, uploaded, 2)
        self._guides.append(self._guide(self._download(once, both.shape), 1))
        twice = self._average(1, uploaded, 2)
        self._shares = self._decide(uploaded, once, twice)
        pairs = self._download(once, both.shape), self._download(twice, both.shape), both
        first, second, noisy = (pair.mean(axis=2)[..., :3] for pair in pairs)
        self.colours = self._mixed(first, second, noisy)
        self._both = both

    def halves(self) -> tuple[Image, Image]:
        """Return both halves without most of their noise, (h, w, 3) float32 each.

        The values of a half alone decide which of its pixels are alike. Both halves tell only how
        much noise there is. So the noise of a denoised half is independent of the other.
        """
        even, odd = (self._half(self._both[:, :, i]) for i in range(2))
        return even, odd

    def _half(self, noisy: Image) -> Image:
        twice_over, averages = np.stack([noisy, noisy], axis=2), []
        values = self._upload(np.ascontiguousarray(noisy))
        for which in (0, 1):
            guide, _ = self._guide(twice_over, which)
            variance = self._download(self._guides[which][1], noisy.shape)
            average = self._average(which, values, 1, (guide, self._upload(2.0 * variance)))
            averages.append(self._download(average, noisy.shape))
            twice_over = np.stack([averages[0], averages[0]], axis=2)
        return self._mixed(*(image[..., :3] for image in (*averages, noisy)))

    def error(self) -> Image:
        """Return what is left in the picture, relative to its light, (h, w) float32: the root of
        the mean square over the pixels around.

        With independent halves a and b, and d of them denoised apart, the square of
        (d(a) + d(b)) / 2 - truth is on average

            ((d(a) - b)^2 + (d(b) - a)^2) / 2 - (a - b)^2 / 2 - (d(a) - d(b))^2 / 4

        Even and odd samples of a Sobol sequence keep off each other: their (a - b)^2 is up to twice
        their noise, and this is too low. So it is no less than the noise of both that is left,
        (d(a) - d(b))^2 / 4, where it is that for the same reason which is too large. What was
        measured is in bench/notes/denoising.md. It takes twice the time of the picture.
        """
        a, b = (self._both[:, :, i, :3].astype(float) for i in range(2))
        of_a, of_b = (half.astype(float) for half in self.halves())

        def square(image: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.asarray(np.mean(image**2, axis=2))

        light = self.colours.mean(axis=2, dtype=float) ** 2 + (DARK * self._light) ** 2
        noise = 0.25 * square(of_a - of_b)
        left = 0.5 * (square(of_a - b) + square(of_b - a) - square(a - b)) - noise
        both = np.zeros((*left.shape, 4), np.float32)
        both[..., 0], both[..., 1] = left / light, noise / light
        blurred = self._blurred(self._upload(both), ERROR_RADIUS, 0.0)
        around = self._download(blurred, both.shape)
        return np.sqrt(np.maximum(around[..., 0], around[..., 1]))

    def bands(self, image: Image) -> Image:
        """Return a picture (h, w, n) float32 of the same samples without most of its noise."""
        count = image.shape[2]
        parts = [image[..., i : i + 4 * VECTORS] for i in range(0, count, 4 * VECTORS)]
        return np.concatenate([self._some_bands(part) for part in parts], axis=2)

    def _some_bands(self, image: Image) -> Image:
        vectors = -(-image.shape[2] // 4)
        padded = np.zeros((self._height, self._width, 4 * vectors), np.float32)
        padded[..., : image.shape[2]] = image
        values = self._upload(padded)
        once, twice = (
            self._download(self._average(which, values, vectors), padded.shape) for which in (0, 1)
        )
        return self._mixed(once, twice, padded)[..., : image.shape[2]]

    def _mixed(self, once: Image, twice: Image, noisy: Image) -> Image:
        """Both averages and the noisy picture, by their shares."""
        first, second, kept = np.moveaxis(self._shares[..., :3, None], 2, 0)
        return np.asarray(first * once + second * twice + kept * noisy, np.float32)

    def _guide(self, both: Image, which: int) -> tuple[Any, Any]:
        """Transformed means of two halves (h, w, 2, 4), and their variances."""
        halves = [self._upload(np.ascontiguousarray(both[:, :, i])) for i in range(2)]
        guide, variance = self._allocate(1), self._allocate(1)
        self._run(
            "denoise_guide", flat=True, first=halves[0], second=halves[1], guide=guide,
            variance=variance, scale=SCALE * self._light,
        )  # fmt: skip
        return guide, self._blurred(variance, NOISE_RADIUS, LEAST_VARIANCES[which])

    def _average(
        self, which: int, values: object, count: int, by: tuple[Any, Any] | None = None
    ) -> Any:
        """Averages of `count` vectors a pixel; which: the first time or the second.

        by: a guide and its variance, in place of the guides of both halves.
        """
        guide, variance = (self._planes(image, 1) for image in by or self._guides[which])
        (albedo, normal), averaged = self._surfaces, self._allocate(count)
        bound = self._program.kernel("denoise_average").bind(
            guide=guide, variance=variance, albedo=albedo, normal=normal,
            values=self._planes(values, count), averaged=averaged, size=self._size,
            extent=self._extent, count=count, features=self._features, limit=LIMITS[which],
            sharpness=SHARPNESS[which],
        )  # fmt: skip
        columns, rows = -(-self._width // self._lanes), -(-self._height // self._rows)
        # drivers of CPUs keep the private arrays of a whole work-group on the same stack
        self._stream.run(bound, (columns, rows), None if self._lanes == 1 else (1, 1))
        return averaged

    def _planes(self, image: object, count: int) -> Any:
        """Planes of a picture of `count` vectors a pixel, see denoise_planes."""
        width, height = self._extent
        nbytes = 16 * count * width * height
        planes = self._buffers.allocate("a picture to denoise", nbytes, ADVICE)
        bound = self._program.kernel("denoise_planes").bind(
            **{"from": image}, planes=planes, size=self._size, extent=self._extent, count=count
        )
        self._stream.run(bound, (width, height, 4 * count))
        return planes

    def _decide(self, halves: object, once: object, twice: object) -> Image:
        """Return the share of each picture in the result, (h, w, 4); the last is 0."""
        errors, shares = self._allocate(1), self._allocate(1)
        self._run(
            "denoise_errors", flat=True, halves=halves, once=once, twice=twice, errors=errors,
            dark=(DARK * self._light) ** 2,
        )  # fmt: skip
        around = self._blurred(errors, ERROR_RADIUS, 0.0)
        self._run("denoise_shares", flat=True, errors=around, shares=shares)
        return self._download(shares, (self._height, self._width, 4))

    def _blurred(self, image: Any, radius: int, least: float) -> Any:
        """The mean over a square; least: is added."""
        across, mean = self._allocate(1), self._allocate(1)
        rows, columns = (image, across, (1, 0), 0.0), (across, mean, (0, 1), least)
        for source, into, step, more in (rows, columns):
            self._run(
                "denoise_blur", **{"from": source}, into=into, size=self._size, step=step,
                radius=radius, least=more,
            )  # fmt: skip
        return mean

    @property
    def _extent(self) -> tuple[int, int]:
        """The size of a plane: borders, and whole blocks of the rows and columns of a work-item."""
        width = -(-self._width // self._lanes) * self._lanes
        height = -(-self._height // self._rows) * self._rows
        return width + 2 * BORDER, height + 2 * BORDER

    @property
    def _size(self) -> tuple[int, int]:
        return self._width, self._height

    def _run(self, kernel: str, *, flat: bool = False, **named: Any) -> None:
        bound = self._program.kernel(kernel).bind(**named)
        self._stream.run(bound, (self._width * self._height,) if flat else self._size)

    def _allocate(self, vectors: int) -> Any:
        nbytes = 16 * vectors * self._width * self._height
        return self._buffers.allocate("a denoised picture", nbytes, ADVICE)

    def _upload(self, image: Image) -> Any:
        return self._buffers.upload("a picture to denoise", image)

    def _download(self, buffer: object, shape: tuple[int, ...]) -> Image:
        return self._stream.read(buffer, np.empty(shape, np.float32))


def noise_of(image: Image) -> float:
    """Return the standard deviation of a picture's noise, where that is more than its edges.

    It is that of second differences along rows, by their median: edges are few.
    """
    if image.shape[1] < 3:
        return 0.0
    second = np.diff(image, n=2, axis=1)
    return float(np.median(np.sqrt(np.mean(second**2, axis=2)))) / 6.0**0.5


def _padded(image: Image) -> Image:
    """A picture (h, w, 3) with a fourth channel of 0."""
    padded = np.zeros((*image.shape[:2], 4), np.float32)
    padded[..., :3] = image
    return padded
