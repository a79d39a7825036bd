"""The pictures of a film: how its words become them, and how they are denoised."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from clpt import device
from clpt.arrays import Floats32, Image
from clpt.choices import DENOISERS
from clpt.denoise import needs
from clpt.denoise.oidn import Oidn
from clpt.denoise.statistical import Statistical
from clpt.errors import SceneError
from clpt.images.spectral_exr import SpectralImage
from clpt.render.records.film import LayerNames
from clpt.scene import Film

if TYPE_CHECKING:
    from typing_extensions import Self


log = logging.getLogger(__name__)

OUTSIDE = 1e-3  # share of light outside of the bins of time that is warned of
LIGHT_LAYERS = ("layers", "light_layers", "mattes")  # words of layers, as `FilmState` has them


@dataclass(frozen=True)
class PictureForm:
    """The conversion of a film's words to a picture.

    to_output: (3, 3), rows of the matrix from the sums to the output space; light_paths: all paths
    start at lights; weighed: light paths are weighted against paths from the camera; weights:
    samples serve several pixels; paper: the matrix (3, 3) from sums of albedo layers to the output
    space, see `clpt.render.film.layers.white_paper`; names: of objects, materials and groups of
    lights; adaptive: whether pixels may differ in their numbers of samples; octaves:
    `Sampler.octaves` where even and odd octaves of samples have separate sums, else 0; place: of a
    crop its first column and row, and the size of the whole film, (x, y, width, height). Other
    members are as in `clpt.scene.Film`.
    """

    to_output: tuple[tuple[float, ...], ...]
    light_paths: bool = False
    weighed: bool = False
    weights: bool = False
    alpha: bool = False
    bands: int = 0
    lambda_min: float = 360.0
    lambda_max: float = 830.0
    time_bins: int = 0
    time_min: float = 0.0
    time_max: float = 100.0
    output_space: str = "rec709"
    exposure: float = 1.0
    display_exposure: float = 0.0
    layers: tuple[str, ...] = ()
    paper: tuple[tuple[float, ...], ...] = ()
    names: LayerNames = LayerNames()
    adaptive: bool = False
    octaves: float = 0.0
    place: tuple[int, int, int, int] | None = None

    @property
    def band_centres(self) -> NDArray[np.float64]:
        """The wavelengths at the centres of the bands, (bands,) [nm]."""
        film = Film(bands=self.bands, lambda_min=self.lambda_min, lambda_max=self.lambda_max)
        return film.band_centres

    def outside(self, times: Floats32) -> str:
        """Return a sentence on light outside of the bins of `Pictures.times`, "" if it is little.

        The share is of the absolute values of all channels.
        """
        light = np.abs(times).sum(axis=(0, 1, 3), dtype=np.float64)
        share = light[-1] / max(light.sum(), 1e-300)
        span = f"{self.time_min:g} to {self.time_max:g} ns"
        reason = "it comes at other times, or from infinitely far"
        return f"{share:.1%} of the light is not in {span}: {reason}" if share > OUTSIDE else ""


class Pictures(ABC):
    """Base of renderers and saved films: the pictures of a film.

    All pictures are made on the host, from whole numbers, by `clpt.render.film.developed`: equal
    films have equal pictures, whichever device, process or machine took the samples.

    form: how the film's words become a picture; denoise: name of the denoiser for it, or None.
    """

    form: PictureForm
    denoise: str | None = None

    @abstractmethod
    def developed(self, *words: str) -> Pictures:
        """Wait for the film; return its present pictures, which later samples do not change.

        words: names of the arrays of `clpt.FilmState` that are needed, by default all.
        """

    @property
    def extra_pictures(self) -> Mapping[str, Image]:
        """Further pictures for files that show this picture, by name."""
        return {}

    def image(self) -> Image:
        """The picture so far: (h, w, 3) float32, linear in the film's output space.

        A film with alpha gives (h, w, 4): colours, premultiplied, and the covered share of each
        pixel. A film with bands gives (h, w, bands): the mean radiance in each band.
        """
        return self.developed("words", "bands").image()

    def colours(self) -> Image:
        """The picture so far in three colours, (h, w, 3) float32, also of a film with bands."""
        return self.developed("words").colours()

    def picture(self) -> Image:
        """The picture so far in three colours, (h, w, 3) float32; (h, w, 4) of a film with alpha.

        Also of a film with bands.
        """
        return self.developed("words").picture()

    def spectral_image(self) -> SpectralImage:
        """The picture so far of a film with bands, at their centres. Raises SceneError without."""
        if not self.form.bands:
            raise SceneError("this picture has no bands; set the film's", where="film.bands")
        form = self.form
        stops = form.display_exposure
        return SpectralImage(self.image(), form.band_centres, emissive=True, exposure=stops)

    def times(self) -> Floats32:
        """Light by its time from the lamp to the film, (h, w, time_bins + 1, 3) float32.

        In the film's output space, by the bins of `film.time_edges`. The last bin has the light of
        all other times, and of lamps that are infinitely far away. The sum over all bins is the
        picture. A warning tells how much light the last bin has. Raises SceneError for a film
        without `time_bins`.
        """
        times = self.developed("words", "light_layers").times()
        if warning := self.form.outside(times):
            log.warning("%s", warning)
        return times

    def samples_per_pixel(self) -> Image:
        """Return how many samples each pixel has, (h, w) float32."""
        return self.developed("words").samples_per_pixel()

    def light_paths_per_pixel(self) -> float:
        """Return how many paths have begun at lights for each pixel."""
        return self.developed("words").light_paths_per_pixel()

    def halves(self) -> tuple[Image, Image]:
        """Return two independent pictures: of the even samples, and of the odd samples.

        (h, w, 3) float32 each, in the film's output space. Their mean, weighted by samples, is the
        whole picture. Raises SceneError for a Renderer without `halves=True`.
        """
        return self.developed("words").halves()

    def layers(self) -> dict[str, Image]:
        """The layers by the names in `film.layers`, (h, w, 1 to 12) float32.

        Colours are in the film's output space, white paper is (1, 1, 1); lengths are in metres.
        Where nothing is seen values are 0, ids -1. `light_groups` becomes a layer light_NAME for
        each group, and `light_rest` for lights without a group. Mattes are (h, w, 12): pairs of a
        name's hash and its coverage; see docs/layers.md.
        """
        return self.developed("words", *LIGHT_LAYERS).layers()


class Still(Pictures):
    """Base of pictures of a film that does not change."""

    def developed(self, *words: str) -> Self:
        """Return itself."""
        return self


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

    def times(self) -> Floats32:
        """Light by time, not denoised."""
        return self._source.times()

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
