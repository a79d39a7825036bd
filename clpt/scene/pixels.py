"""The numbers of images: reading, channels, wrapping and averages."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import spectra
from clpt.arrays import Floats
from clpt.images import spectral_exr
from clpt.images.spectral_exr import SpectralImage


def image_file(image: object) -> str | None:
    """Return the path of an image file, None for an image in memory."""
    return os.fspath(image) if isinstance(image, (str, os.PathLike)) else None


def check_image(image: object, where: str, *, emissive: bool) -> None:
    """Raise SceneError for spectra of light in memory unless `emissive`, and the reverse."""
    if isinstance(image, SpectralImage):
        spectral_exr.find(image, emissive=emissive, where=where)


def thinned(image: NDArray[Any], side: int | None) -> NDArray[Any]:
    """Return evenly spaced texels of an image (h, w, ...), about `side` along each side."""
    if side is None or image.ndim < 2:
        return image
    down, across = (max(1, size // side) for size in image.shape[:2])
    return image[::down, ::across]


def channel(image: NDArray[Any], name: str) -> NDArray[Any]:
    """Return a channel (h, w, 1) of an image (h, w, 1, 3 or 4); a missing alpha is 1."""
    count = image.shape[2]
    if name == "a":
        return image[..., 3:] if count == 4 else np.ones_like(image[..., :1])
    if count == 1:
        return image
    if name == "luminance":
        return spectra.luminance(image[..., :3])[..., None]
    return image[..., "rgb".index(name), None]


def averaged(image: Floats, uv: Floats, area: Floats, wraps: Sequence[str]) -> Floats:
    """Return means of an image (h, w) around uv (m, k, 2), from copies of half the size each.

    area (m,): of a lookup, in uv; wraps: of u and v, see `clpt.scene.textures.WRAPS`.
    """
    texels = area * image.size
    steps = np.ceil(0.5 * np.log2(np.maximum(texels, 1.0))).astype(np.int64)
    values = np.empty(uv.shape[:2])
    for step in range(int(steps.max(initial=0)) + 1):
        at_step = steps == step
        if at_step.any():
            values[at_step] = _nearest(image, uv[at_step], wraps)
        image = _halved(image)
    return values


def _halved(image: Floats) -> Floats:
    """Return an image of half the size; an odd last row or column is taken twice."""
    height, width = image.shape
    even = np.pad(image, ((0, height % 2 * (height > 1)), (0, width % 2 * (width > 1))), "edge")
    if height > 1:
        even = 0.5 * (even[::2] + even[1::2])
    return even if width == 1 else 0.5 * (even[:, ::2] + even[:, 1::2])


def _nearest(image: Floats, uv: Floats, wraps: Sequence[str]) -> Floats:
    """Return texels (m, k) at uv (m, k, 2); v = 0 is the bottom row."""
    inside = np.ones(uv.shape[:2], bool)
    at = []
    for axis, (wrap, size) in enumerate(zip(wraps, image.shape[::-1], strict=True)):
        x = uv[..., axis] if axis == 0 else 1.0 - uv[..., axis]
        if wrap == "zero":
            inside &= (x >= 0.0) & (x <= 1.0)
        elif wrap == "repeat":
            x = x % 1.0
        elif wrap == "mirror":
            x = 1.0 - np.abs(x % 2.0 - 1.0)
        at.append(np.clip(np.floor(x * size), 0, size - 1).astype(np.int64))
    return np.where(inside, image[at[1], at[0]], 0.0)
