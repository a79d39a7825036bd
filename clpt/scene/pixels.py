"""The numbers of a bitmap's image."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import images, spectra
from clpt.arrays import Floats32, on_host
from clpt.images import spectral_exr
from clpt.images.spectral_exr import SpectralImage
from clpt.scene.roles import EMISSION, REAL, Role
from clpt.scene.textures import Bitmap


def spectral_image(texture: object, role: Role) -> SpectralImage | None:
    """Return a texture's image if it is a bitmap of spectra, in the role of a parameter."""
    if not isinstance(texture, Bitmap):
        return None
    return spectral_exr.find(texture.image, emissive=role is EMISSION, where="bitmap.image")


def pixels(texture: Bitmap, role: Role, side: int | None = None) -> Floats32:
    """Return a bitmap's image, (h, w, 1 or 3) float32, top row first; for REAL (h, w, 1).

    role: it chooses the colour of spectra; side: about how many texels along each side are
    enough; the others are left out. Raises SceneError if it cannot be read
    or is no image.
    """
    spectral = spectral_image(texture, role)
    image = texture.image if spectral is None else spectral.to_rgb()
    if isinstance(image, (str, Path)):
        stored = images.read_stored(image)
        some = dataclasses.replace(stored, values=_thinned(stored.values, side))
        image = some.decoded(not texture.raw)
    stored = images.from_array(_thinned(np.asarray(on_host(image)), side), "bitmap.image")
    plain = stored.decoded(not texture.raw)
    return np.nan_to_num(channel(plain, texture.channel) if role is REAL else plain[..., :3])


def _thinned(image: NDArray[Any], side: int | None) -> NDArray[Any]:
    """Return every so many texels of an image (h, w, ...), about `side` along each side."""
    if side is None or image.ndim < 2:
        return image
    down, across = (max(1, size // side) for size in image.shape[:2])
    return image[::down, ::across]


def channel(image: NDArray[Any], name: str) -> NDArray[Any]:
    """The channel (h, w, 1) that stands for a number, of (h, w, 1, 3 or 4); a is 1 if missing."""
    count = image.shape[2]
    if name == "a":
        return image[..., 3:] if count == 4 else np.ones_like(image[..., :1])
    if count == 1:
        return image
    if name == "luminance":
        return spectra.luminance(image[..., :3])[..., None]
    return image[..., "rgb".index(name), None]
