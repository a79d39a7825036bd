"""Arrays that are pictures: the one check for all that takes one, a texture, a sky or a writer."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import on_host, single
from clpt.errors import SceneError
from clpt.images.stored import Stored

CHANNELS = (1, 3, 4)


def from_array(image: object, where: str | None = None) -> Stored:
    """Return an array (h, w), or (h, w, 1, 3 or 4), in host or device memory as an image.

    Floats are linear. Bytes (uint8) are as in a .png: colours in sRGB, not multiplied by alpha.
    Raises SceneError for other numbers, as these do not say what is white, for other shapes, and
    for None.
    """
    if image is None:
        raise SceneError("an image must be a path or an array, not None", where=where)
    try:
        values = np.asarray(on_host(image))
    except ValueError as error:
        raise SceneError(f"is no array: {error}", where=where) from error
    if values.dtype != np.uint8 and values.dtype.kind != "f":
        advice = ", such as image / 65535" if values.dtype.kind in "iu" else ""
        message = f"must be an array of floats, which are linear{advice}, or of bytes in sRGB"
        raise SceneError(f"{message}, not of {values.dtype}", where=where)
    values = checked(values[..., None] if values.ndim == 2 else values, where)
    if values.dtype == np.uint8:
        return Stored(values, encoded=True)
    return Stored(single(values), encoded=False)


def checked(values: NDArray[Any], where: str | None = None) -> NDArray[Any]:
    """Return texels (h, w, 1, 3 or 4). Raises SceneError for other shapes."""
    if values.ndim != 3 or values.shape[2] not in CHANNELS or values.size == 0:
        wanted = "must be (h, w) or (h, w, 1, 3 or 4) and not empty"
        raise SceneError(f"{wanted}, not {values.shape}", where=where)
    return values
