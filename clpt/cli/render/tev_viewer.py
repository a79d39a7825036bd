"""`--tev`: the picture so far for tev or HDRView, after each pass of a render."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from ...render.film.layer_channels import channels_of
from ..files.outputs import Film


@contextmanager
def showing(
    address: tuple[str, int] | None, name: str, source: Film, note: Callable[[str], None]
) -> Iterator[Callable[[], None]]:
    """Yield what sends the picture so far, in a thread; it does nothing without an address.

    A viewer that goes away stops nothing. Raises tev.TevError where none is at first.
    """
    if address is None:
        yield lambda: None
        return
    from clpt.images import tev  # here: most renders show nothing

    viewer = tev.Viewer(name, *address, tell=note)
    try:
        yield lambda: viewer.show(shown(source))
    finally:
        viewer.close()


def shown(source: Film) -> dict[str, NDArray[np.float32]]:
    """Return all channels of the picture so far, (h, w) by name: colours, layers, bands."""
    picture = source.picture()
    made = {letter: picture[..., i] for i, letter in enumerate("RGBA"[: picture.shape[2]])}
    made |= channels_of(source.layers())
    if source.form.adaptive:
        made["samples.X"] = source.samples_per_pixel()
    if source.form.bands:
        spectral = source.spectral_image()
        for nm, band in zip(spectral.lambdas, np.moveaxis(spectral.values, 2, 0), strict=True):
            made[f"bands.{nm:g}nm"] = band
    return made
