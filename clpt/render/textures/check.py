"""Rules of textures: an image of spectra holds light or reflectance, as its parameter does."""

from __future__ import annotations

import numpy as np

from clpt.errors import SceneError
from clpt.images import spectral_exr
from clpt.images.spectral_exr import SpectralImage
from clpt.scene.params import Kind, fields_of, params
from clpt.scene.roles import EMISSION, FACTOR, REFLECTANCE
from clpt.scene.textures import Bitmap, Placed, Product, Solid, Texture


def check_textures(kind: Kind) -> None:
    """Raise SceneError for an image of light as a reflectance, and for the reverse.

    Images in files are not read for this.
    """
    values = fields_of(kind)
    for name, param in params(type(kind)).items():
        if isinstance(values[name], (Texture, tuple)):
            _check(values[name], param.role is EMISSION)


def check_image(image: object, where: str, *, emissive: bool) -> None:
    """Raise SceneError for an image in memory of the other kind of spectra."""
    if isinstance(image, SpectralImage):
        spectral_exr.find(image, emissive=emissive, where=where)


def _check(value: object, light: bool) -> None:
    """Raise SceneError for a texture of the wrong kind of spectra.

    light: whether its parameter emits.
    """
    if isinstance(value, tuple):
        for entry in value:
            if isinstance(entry, Kind):
                check_textures(entry)
    elif isinstance(value, Texture):
        _check_place(value)
        if isinstance(value, Bitmap):
            check_image(value.image, "bitmap.image", emissive=light)
        values = fields_of(value)
        for name, param in params(type(value)).items():
            emits = light and param.role in (FACTOR, REFLECTANCE) and name != _factor(value)
            _check(values[name], emits)


def _check_place(texture: Texture) -> None:
    """Raise SceneError for a matrix in use that is a projection."""
    if isinstance(texture, Placed):
        last = texture.to_uv[2]
        if not np.allclose(last[:2], 0.0) or np.isclose(last[2], 0.0):
            raise SceneError("its last row must be 0 0 1", where=f"{texture.kind}.to_uv")
        if texture.mapping in ("uv", "uv1"):
            return
    elif not isinstance(texture, Solid):
        return
    if not np.allclose(np.asarray(texture.to_texture)[3], [0.0, 0.0, 0.0, 1.0]):
        raise SceneError("its last row must be 0 0 0 1", where=f"{texture.kind}.to_texture")


def _factor(texture: Texture) -> str:
    """Return the parameter of a product that stays a factor in an emission, "" for others.

    An emission is light times a factor, never light times light.
    """
    if not isinstance(texture, Product):
        return ""
    first, second = (isinstance(part, Texture) for part in (texture.first, texture.second))
    return "first" if second and not first else "second"
