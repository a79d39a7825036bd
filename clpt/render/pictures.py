"""The picture that a renderer has so far, on its device and for screens."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import pyopencl as cl
from numpy.typing import DTypeLike, NDArray
from pyopencl.array import Array

from clpt import device as dev
from clpt import images
from clpt.images.colour import View
from clpt.render.film.resolve import Resolve, Screen
from clpt.render.makers.locking import synchronized
from clpt.render.resumable import ResumableRenderer


class DevicePictures(ResumableRenderer):
    """Base of renderers: their picture as an array on the device, beside those of the host.

    _make_widget: given by who shows pictures in notebooks, see `clpt/__init__`.
    """

    _make_widget: ClassVar[Callable[..., Any]]

    _resolve: Resolve | None = None  # built when a picture is first resolved

    @property
    @synchronized
    def film(self) -> dev.DeviceArray:
        """The picture so far on the device, (h, w, 4) float32, valid when its `events` have ended.

        Red, green and blue, linear in the film's output space, as `colours` but for an ulp of what
        they are sums of; last, how many samples the pixel has. Always the same memory, on the
        renderer's queue; steps wait for those of its `events` that readers add, as its `get_async`
        does.
        """
        return self._wavefront.film.picture

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
        exposure [stops] over the film's `display_exposure`; tone: none, reinhard, aces, agx or
        neutral, see clpt.images.colour; srgb: whether the sRGB transfer is applied, by
        default to uint8 only; colours become Rec. 709. view: of OpenColorIO, in the place of tone
        and
        transfer: a table of it, right to 1/512 for 98 of 100 colours. flip: the first row is the
        lowest. wait_for: events of the caller that come first.

        Returns the Array, whose `events` hold the event of the picture; for an Image the event.
        Raises DeviceError if the picture does not fit, UnknownKindError for names.
        """
        wavefront = self._wavefront
        picture = wavefront.film.picture
        if self._resolve is None or self._resolve.stream is not wavefront.stream:
            self._resolve = Resolve(wavefront.device, wavefront.stream)
        film = self.scene.film
        screen = Screen(exposure + film.display_exposure, tone, srgb, view, film.output_space)
        return self._resolve(picture, into, screen, dtype=dtype, flip=flip, wait_for=wait_for)

    def widget(self, **options: Any) -> Any:
        """Return a widget for notebooks: the scene, rendered while it is watched and steered.

        It is rendered by another renderer, with these options, in a thread of its own; see
        clpt.view.widget.Widget. Raises ClptError where clpt[notebook] is not installed.
        """
        return type(self)._make_widget(self.scene, self.device, **options)

    def close(self) -> None:
        """Give the device's memory back; see `FilmRenderer.close`."""
        super().close()
        self._resolve = None

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """`image()`, for numpy.asarray(renderer): a copy, which waits."""
        if copy is not None and not copy:
            raise ValueError("a picture on a device becomes an array of numpy only by a copy")
        image = self.image()
        return image if dtype is None else image.astype(dtype, copy=False)

    def _repr_png_(self) -> bytes:
        """Return the picture so far as PNG, which a notebook shows of a renderer; waits."""
        return images.png(self.resolve().get()[..., :3])
