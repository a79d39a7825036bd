"""The denoised picture of a renderer, or of a film in a file."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from clpt import device
from clpt.arrays import Image
from clpt.choices import DENOISERS
from clpt.denoise import needs
from clpt.denoise.oidn import Oidn
from clpt.denoise.statistical import Statistical
from clpt.errors import SceneError
from clpt.render.film.pictures import Pictures, Still


class DenoisedPicture(Still):
    """The present picture of a source, denoised.

    method: a name of clpt.choices.DENOISERS, by default the source's. Layers of the film help, see
    clpt.denoise.needs. A film with bands is denoised in each band, and its colours separately. The
    promise of equal bits does not hold for this picture. text: names the method and the layers, for
    headers of files.

    Raises UnknownKindError for a method, SceneError if the denoiser is not installed, DeviceError
    if it fails.
    """

    def __init__(self, source: Pictures, method: str | None = None):
        self.method = needs.check_method(method or source.denoise or DENOISERS[0])
        self._source, self.form = source.developed(), source.form
        self._noisy, self._image = self._source.colours(), self._source.image()
        self._layers = self._source.layers()
        surfaces = [self._layers.get(name) for name in needs.LAYERS]
        with_layers = [name for name in needs.LAYERS if name in self._layers]
        name = self.method
        self._statistical: Statistical | None = None
        if self.method == "oidn":
            with Oidn(*surfaces) as oidn:
                name += f" {oidn.version}"
                self._colours = oidn.colours(self._noisy)
                bands = oidn.bands(self._image) if self.form.bands else None
        else:
            on = getattr(source, "device", None) or device.choose()
            self._statistical = denoiser = Statistical(on, self._halves(), *surfaces)
            self._colours = denoiser.colours
            bands = denoiser.bands(self._image) if self.form.bands else None
        alpha = self._source.picture()[..., 3:]
        self._picture = np.concatenate([self._colours, alpha], axis=2)
        self._denoised = self._picture if bands is None else bands
        self.text = name + (f" with {', '.join(with_layers)}" if with_layers else "")

    def _halves(self) -> tuple[Image, Image]:
        """Return the pictures of even and odd samples. Raises SceneError if either is empty."""
        if self._source.samples_per_pixel().min() < 2:
            raise SceneError("needs two samples of every pixel or more", where="denoise")
        return self._source.halves()

    def layers(self) -> dict[str, Image]:
        """The layers of the film by name, not denoised."""
        return self._layers

    def samples_per_pixel(self) -> Image:
        """Return how many samples each pixel has, (h, w) float32."""
        return self._source.samples_per_pixel()

    def light_paths_per_pixel(self) -> float:
        """Return how many paths have begun at lights for each pixel."""
        return self._source.light_paths_per_pixel()

    def halves(self) -> tuple[Image, Image]:
        """The noisy pictures of even samples and of odd samples."""
        return self._source.halves()

    def colours(self) -> Image:
        """The picture in three colours, (h, w, 3) float32, also of a film with bands."""
        return self._colours

    def picture(self) -> Image:
        """The picture in three colours, with alpha where the film has it, also with bands."""
        return self._picture

    def image(self) -> Image:
        """The picture, as `Renderer.image` returns it; alpha is not denoised."""
        return self._denoised

    def noisy(self) -> Image:
        """The noisy picture in three colours, (h, w, 3) float32."""
        return self._noisy

    @cached_property
    def error(self) -> Image | None:
        """The noise that remains in the colours, relative to their light, (h, w) float32.

        The denoiser `oidn` gives None.
        """
        return None if self._statistical is None else self._statistical.error()

    @property
    def extra_pictures(self) -> dict[str, Image]:
        """The pictures `noisy` and, if known, `denoised_error`."""
        error = {} if self.error is None else {"denoised_error": self.error}
        return {"noisy": self._noisy} | error
