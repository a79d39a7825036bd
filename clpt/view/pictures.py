"""Pictures on their way to a viewer: encoded, and made as seldom as their price asks."""

from __future__ import annotations

import io
import time
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.arrays import Bytes, Image
from clpt.denoise import oidn
from clpt.images.colour import SCALE, View, false_colours
from clpt.render.film.layers import viewable
from clpt.render.film.pictures import DenoisedPicture, Pictures
from clpt.render.renderer import Renderer
from clpt.scene.layers import LAYERS
from clpt.view.messages import OF_VIEW, CommandError

METHOD = "oidn"  # of denoising: the other method takes a second for a small picture
JPEG_QUALITY = 85
SHARE = 0.02  # of the time of a render that pictures may take
ALLOWANCE = 0.15  # [s] of pictures that a new render has at once
PICTURE, SAMPLES, ERROR, DENOISED = "picture", "samples", "error", "denoised"
# layers that are a picture each, of surfaces that paths have met
SURFACES = tuple(n for n, layer in LAYERS.items() if layer.form in ("near", "long", "id"))
MAPS: Final = (PICTURE, DENOISED, SAMPLES, ERROR, *SURFACES)  # each is a choice in the page

LEAST_ERROR, MOST_ERROR = 0.001, 1.0  # relative, the ends of the scale
WINDOW = 9  # pixels of a side: over so many differences the error is a mean, by a tent
DARK = 0.01  # of the picture's mean: what is darker counts as if it were as bright


def jpeg(pixels: NDArray[np.uint8]) -> bytes:
    """Return pixels (h, w, 3 or 4) as a JPEG file, with colours as fine as light."""
    from PIL import Image

    file = io.BytesIO()
    opaque = np.ascontiguousarray(pixels[..., :3])
    Image.fromarray(opaque).save(file, "JPEG", quality=JPEG_QUALITY, subsampling=0)
    return file.getvalue()


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Return pixels (h, w, 3 or 4) as a PNG file, equal to the byte."""
    return images.png(np.ascontiguousarray(pixels[..., :3]))


@dataclass(frozen=True)
class Display:
    """Settings of a page for the picture; the render does not know them.

    exposure [stops] over that of the film; tone: a curve of clpt.images.colour, or that of
    `view`, of OpenColorIO.
    """

    exposure: float = 0.0
    tone: str = "none"
    view: View | None = None

    def __post_init__(self) -> None:
        if self.tone == OF_VIEW and self.view is None:
            raise CommandError("no view of OpenColorIO was given at the start")


def shown(renderer: Renderer, display: Display) -> NDArray[np.uint8]:
    """Return a renderer's picture for a screen, (h, w, 4) uint8; wait for it."""
    if display.tone == OF_VIEW:
        return renderer.resolve(exposure=display.exposure, view=display.view).get()
    return renderer.resolve(exposure=display.exposure, tone=display.tone).get()


def denoised(source: Pictures, display: Display) -> NDArray[np.uint8]:
    """Return a renderer's picture without most of its noise for a screen, (h, w, 3) uint8.

    Raises SceneError where the denoiser is not installed.
    """
    form = source.form
    colours = images.to_rec709(DenoisedPicture(source, METHOD).colours(), form.output_space)
    stops = display.exposure + form.display_exposure
    if display.tone == OF_VIEW:
        return images.to_codes(colours, stops, view=display.view)
    return images.to_codes(colours, stops, display.tone)


class Budget:
    """When a picture is due: all of them take at most SHARE of the time, and ALLOWANCE."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Begin with a new render."""
        self._began, self._spent = time.perf_counter(), 0.0

    def due(self) -> bool:
        """Return whether a picture may be made now."""
        return self._spent <= SHARE * (time.perf_counter() - self._began) + ALLOWANCE

    def spend(self, seconds: float) -> None:
        """Note what a picture took."""
        self._spent += seconds


def offered() -> list[str]:
    """Return the maps that can be made here: without Open Image Denoise, none is denoised by it."""
    return [name for name in MAPS if name != DENOISED or oidn.is_installed()]


@dataclass(frozen=True)
class Legend:
    """The legend of a map: its colours, with words for both ends of the scale."""

    low: str
    high: str
    colours: tuple[str, ...] = SCALE


def layer(name: str, values: NDArray[np.float32]) -> Bytes:
    """Return a layer (h, w, 1 to 4) as people can see it, (h, w, 3) uint8."""
    return images.to_srgb8(viewable(name, values))


def samples(film: Image) -> tuple[Bytes, Legend]:
    """Return a map of the samples of each pixel, (h, w, 3) uint8."""
    count = film[..., 3]
    low, high = float(count.min()), max(float(count.max()), 1.0)
    share = (count - low) / (high - low) if high > low else np.ones_like(count)
    return false_colours(share), Legend(f"{low:.0f}", f"{high:.0f} samples")


class ErrorMap:
    """An estimate of each pixel's error, from the films of a render.

    With n samples the mean is m, with n1 of them it was m1: the variance of m is the mean of
    (m - m1)^2 n1 / (n - n1), where samples are independent; where they are stratified it is less.
    """

    def __init__(self) -> None:
        self._films: list[Image] = []  # two at most, the newer film with twice as many samples

    def wants(self, samples: float) -> bool:
        """Return whether the film of so many samples is to be noted."""
        return not self._films or samples >= 2.0 * float(self._films[-1][..., 3].mean())

    def note(self, film: Image) -> None:
        """Note a film (h, w, 4), to compare later films with."""
        self._films = [*self._films[-1:], film]

    def of(self, film: Image) -> NDArray[np.float64] | None:
        """Return the relative standard error of each pixel (h, w); None before there are films.

        It is a mean over the pixels around it, whose brightness it is relative to.
        """
        count = film[..., 3].astype(float)
        most = count.mean() / 1.5
        former = next((f for f in reversed(self._films) if f[..., 3].mean() <= most), None)
        if former is None:
            return None
        before = former[..., 3].astype(float)
        gained = np.maximum(count - before, 0.0)
        ratio = np.divide(before, gained, where=gained > 0, out=np.zeros_like(gained))
        brightness = film[..., :3].mean(axis=2, dtype=float)
        moved = brightness - former[..., :3].mean(axis=2, dtype=float)
        variance = _around(moved**2 * ratio)
        known = _around((ratio > 0).astype(float))  # elsewhere pixels have got no more samples
        variance = np.divide(variance, known, where=known > 0, out=np.zeros_like(variance))
        level = _around(brightness) + DARK * brightness.mean()
        return np.sqrt(variance) / np.maximum(level, 1e-30)

    def shown(self, film: Image) -> tuple[Bytes, Legend] | None:
        """Return the error as colours on a logarithmic scale, (h, w, 3) uint8."""
        error = self.of(film)
        if error is None:
            return None
        share = np.log(np.maximum(error, LEAST_ERROR) / LEAST_ERROR)
        share /= np.log(MOST_ERROR / LEAST_ERROR)
        return false_colours(share), Legend(
            f"{100 * LEAST_ERROR:g} %", f"{100 * MOST_ERROR:g} % error"
        )


def _around(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean of the pixels around each pixel, by a tent; of fewer at the edges."""
    total, half = values, WINDOW // 4
    for axis in (0, 1, 0, 1):  # two boxes make a tent
        size = total.shape[axis]
        sums = np.concatenate(
            [np.zeros_like(total.take([0], axis)), total.cumsum(axis=axis)], axis=axis
        )
        last = np.minimum(np.arange(size) + half + 1, size)
        first = np.maximum(np.arange(size) - half, 0)
        count = (last - first).reshape((-1, 1) if axis == 0 else (1, -1))
        total = (sums.take(last, axis) - sums.take(first, axis)) / count
    return total
