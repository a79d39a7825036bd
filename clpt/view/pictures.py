"""Pictures on their way to a viewer: encoded, and made as seldom as their price asks."""

from __future__ import annotations

import io
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt import images
from clpt.images.colour import View
from clpt.render.film.denoised_picture import DenoisedPicture
from clpt.render.film.pictures import Pictures
from clpt.render.renderer import Renderer
from clpt.view.commands import OF_VIEW, CommandError

METHOD = "oidn"  # of denoising: the other one takes a second for a small picture
JPEG_QUALITY = 85
SHARE = 0.02  # of the time of a render that pictures may take
ALLOWANCE = 0.15  # [s] of pictures that a new render has at once


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
    """Settings by which a page shows the picture; the render does not know of them.

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
