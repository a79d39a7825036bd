"""Pictures, and the base of all that they are taken of: renderers, and films in files."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

from clpt.arrays import Image
from clpt.errors import SceneError
from clpt.images.spectral_exr import SpectralImage
from clpt.render.film.picture_form import PictureForm

if TYPE_CHECKING:
    from typing_extensions import Self


LIGHT_LAYERS = ("layers", "light_layers", "mattes")  # words of layers, as `FilmState` has them


class Pictures(ABC):
    """Base of what has a film: the pictures of it.

    All of them are made on the host, of whole numbers, by `clpt.render.film.developed`: films that
    are equal have equal pictures, whichever device, process or machine took the samples.

    form: how the film's words become a picture; denoise: the denoiser that it was made for, None
    for none.
    """

    _form: PictureForm
    denoise: str | None = None

    @abstractmethod
    def _developed(self, *words: str) -> Pictures:
        """Return the pictures of the film as it is now, which then stay; wait for the film.

        words: which of those of `clpt.FilmState` are wanted, by default all.
        """

    def image(self) -> Image:
        """The picture so far: (h, w, 3) float32, linear in the film's output space.

        Of a film with alpha (h, w, 4), colours as they arrive and how much of the pixel is covered:
        to lie over another picture, which adds the rest of its own. Of a film with bands (h, w,
        bands), the mean radiance in each.
        """
        return self._developed("words", "bands").image()

    def colours(self) -> Image:
        """The picture so far in three colours, (h, w, 3) float32, also of a film with bands."""
        return self._developed("words").colours()

    def picture(self) -> Image:
        """The picture so far in three colours, (h, w, 3) float32; (h, w, 4) of a film with alpha.

        Also of a film with bands.
        """
        return self._developed("words").picture()

    def spectral_image(self) -> SpectralImage:
        """The picture so far of a film with bands, at their centres. Raises SceneError without."""
        if not self._form.bands:
            raise SceneError("this picture has no bands; set the film's", where="film.bands")
        form = self._form
        stops = form.display_exposure
        return SpectralImage(self.image(), form.band_centres, emissive=True, exposure=stops)

    def samples_per_pixel(self) -> Image:
        """Return how many samples each pixel has, (h, w) float32."""
        return self._developed("words").samples_per_pixel()

    def light_paths_per_pixel(self) -> float:
        """Return how many paths have begun at lights for each pixel."""
        return self._developed("words").light_paths_per_pixel()

    def halves(self) -> tuple[Image, Image]:
        """Return two independent pictures, of the even and of the odd samples.

        (h, w, 3) float32 each, in the film's output space, of a Renderer with `halves=True`. Their
        mean, weighted as samples are, is the whole picture. Raises SceneError without.
        """
        return self._developed("words").halves()

    def layers(self) -> dict[str, Image]:
        """The layers of the film by name, (h, w, 1 to 12) float32: what `film.layers` names.

        Colours are in the film's output space, white paper is (1, 1, 1); lengths are in metres.
        Where nothing is seen values are 0, ids -1. `light_groups` is a layer light_NAME for each
        group, `light_rest` of lights that name none; of mattes (h, w, 12), pairs of a name's hash
        and its coverage; see docs/layers.md.
        """
        return self._developed("words", *LIGHT_LAYERS).layers()


class Still(Pictures):
    """Base of pictures of a film that does not change."""

    def _developed(self, *words: str) -> Self:
        """Return itself."""
        return self
