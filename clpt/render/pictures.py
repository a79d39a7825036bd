"""The picture that a renderer has so far, as arrays of the device and of the host."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import pyopencl as cl
from numpy.typing import DTypeLike, NDArray
from pyopencl.array import Array

from clpt import device as dev
from clpt import images
from clpt.colour.view import View
from clpt.errors import SceneError
from clpt.render.contents import FilmOwner
from clpt.render.film.layers import layers_of
from clpt.render.film.resolve import Resolve
from clpt.render.film.saved_film import PictureForm
from clpt.render.locking import synchronized
from clpt.render.wavefront.wavefront import Wavefront
from clpt.scene import Scene
from clpt.spectral_exr import SpectralImage

Image = NDArray[np.float32]


class Pictures(FilmOwner):
    """Base of renderers: their picture as an array, on the device or the host.

    wavefronts: its one; make_widget: given by who shows pictures in notebooks, see `clpt/__init__`.
    """

    make_widget: ClassVar[Callable[..., Any]]

    scene: Scene
    device: dev.Device
    wavefronts: list[Wavefront]
    _resolve: Resolve | None = None  # built when a picture is first resolved

    @property
    def form(self) -> PictureForm:
        """How the film's words become a picture."""
        raise NotImplementedError

    @property
    @synchronized
    def film(self) -> dev.DeviceArray:
        """The picture so far on the device, (h, w, 4) float32, valid when its `events` have ended.

        Red, green and blue, linear in the film's output space; last, how many samples the pixel
        has. Always the same memory, on the renderer's queue; steps wait for those of its `events`
        that readers add, as its `get_async` does.
        """
        return self.wavefronts[0].film.picture

    @synchronized
    def resolve(
        self,
        into: Array | cl.MemoryObject | None = None,
        *,
        dtype: DTypeLike | None = None,
        exposure: float = 0.0,
        tone: str = "none",
        srgb: bool | None = None,
        flip: bool = False,
        view: View | None = None,
        wait_for: dev.Events = None,
    ) -> Any:
        """Enqueue a picture (h, w, 4) for a screen, opaque, from the film as it then is.

        into: the caller's Array or Buffer, or 2D Image of 8-bit or float RGBA, as OpenGL shares
        them; None makes an Array. dtype: uint8 (the default, the bytes of a .png) or float32.
        exposure [stops]; tone: none, reinhard, aces, agx or neutral, see clpt.colour.tones; srgb:
        whether the sRGB transfer is applied, by default to uint8 only; colours become Rec. 709.
        view: of OpenColorIO, in the place of tone and transfer: a table of it, right to 1/512 for
        98 of 100 colours. flip: the first row is the lowest.

        Returns the Array, whose `events` hold the event of the picture; for an Image the event.
        Raises DeviceError if the picture does not fit, UnknownKindError for names.
        """
        if self._resolve is None:
            self._resolve = Resolve(self.device, self.wavefronts[0].stream)
        return self._resolve(
            self.film, into, dtype=dtype, exposure=exposure,
            tone=tone, srgb=srgb, flip=flip, view=view, wait_for=wait_for,
            space=self.scene.film.output_space,
        )  # fmt: skip

    def widget(self, **options: Any) -> Any:
        """Return a widget for notebooks: the scene, rendered while it is watched and steered.

        It is rendered by another renderer, with these options, in a thread of its own; see
        clpt.view.widget.Widget. Raises ClptError where clpt[notebook] is not installed.
        """
        return type(self).make_widget(self.scene, self.device, **options)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """`image()`, for numpy.asarray(renderer): a copy, which waits."""
        if copy is False:
            raise ValueError("a picture on a device becomes an array of numpy only by a copy")
        image = self.image()
        return image if dtype is None else image.astype(dtype, copy=False)

    def _repr_png_(self) -> bytes:
        """What a notebook shows of a renderer: its picture so far; waits."""
        return images.png(self.resolve().get()[..., :3])

    @synchronized
    def image(self) -> Image:
        """The picture so far: (h, w, 3) float32, linear in the film's output space.

        Of a film with alpha (h, w, 4), colours as they arrive and how much of the pixel is covered:
        to lie over another picture, which adds the rest of its own. Of a film with bands (h, w,
        bands), the mean radiance in each.
        """
        film = self.scene.film
        if film.bands:
            return self.wavefronts[0].bands() * np.float32(film.exposure)
        if film.alpha:
            return np.dstack([self.colours(), self.wavefronts[0].alpha()])
        return self.colours()

    @synchronized
    def colours(self) -> Image:
        """The picture so far in three colours, (h, w, 3) float32, also of a film with bands."""
        return self.wavefronts[0].image()

    def spectral_image(self) -> SpectralImage:
        """The picture so far of a film with bands, at their centres. Raises SceneError without."""
        if not self.scene.film.bands:
            raise SceneError("this picture has no bands; set the film's", where="film.bands")
        return SpectralImage(self.image(), self.scene.film.band_centres, emissive=True)

    @synchronized
    def samples_per_pixel(self) -> Image:
        """How many samples each pixel has, (h, w) float32."""
        return np.ascontiguousarray(self.wavefronts[0].film.picture.get()[..., 3])

    @synchronized
    def light_paths_per_pixel(self) -> float:
        """How many paths have begun at lights for each pixel."""
        return self.wavefronts[0].light_paths_per_pixel

    @synchronized
    def halves(self) -> tuple[Image, Image]:
        """Return two independent pictures, of the even and of the odd samples; wait for them.

        (h, w, 3) float32 each, in the film's output space, of a Renderer with `halves=True`. Their
        mean, weighted as samples are, is the whole picture. Raises SceneError without.
        """
        first = self.wavefronts[0]
        if first.film.halves != 2:
            raise SceneError("even and odd samples are not kept apart; give Renderer halves=True")
        return first.half(0), first.half(1)

    @synchronized
    def layers(self) -> dict[str, Image]:
        """The layers of the film by name, (h, w, 1 to 12) float32: what `film.layers` names.

        Colours are in the film's output space, white paper is (1, 1, 1); lengths are in metres.
        Where nothing is seen values are 0, ids -1. `light_groups` is a layer light_NAME for each
        group, `light_rest` of lights that name none; of mattes (h, w, 12), pairs of a name's hash
        and its coverage; see docs/layers.md.
        """
        return layers_of(self.form, self.wavefronts[0].film.layer_words(), self)
