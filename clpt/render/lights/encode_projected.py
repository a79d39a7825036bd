"""Points that throw an image on their way to the device: projector, goniometric, spot with one."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.render.lights.power import aspect, unsheared
from clpt.render.materials.encoder import Encoder
from clpt.scene.lights import SPOT_EDGES, Goniometric, Light, Projector, Spot
from clpt.scene.params import fields_of
from clpt.scene.pixels import pixels, spectral_image
from clpt.scene.roles import REFLECTANCE
from clpt.scene.textures import Bitmap, Texture


def kind_of(lamp: Light) -> str:
    """Return the record of a light: a spot with an image has one of its own."""
    plain = isinstance(lamp, Spot) and isinstance(lamp.image, Texture)
    return "image_spot" if plain else lamp.kind


def members(lamp: Light, encoder: Encoder) -> dict[str, ArrayLike]:
    """Return the members of a light's record but for `radiance`.

    Raises SceneError for a transform that shears, or an image that cannot be used.
    """
    if isinstance(lamp, Projector):
        half = float(np.tan(np.radians(lamp.fov) / 2.0))
        axes = _place(lamp.to_world, "projector.to_world", half, half / aspect(lamp))
        return {**axes, **_image(lamp.image, encoder)}
    if isinstance(lamp, Goniometric):
        place = _place(lamp.to_world, "goniometric.to_world")
        return {**place, **_image(with_poles(lamp.image), encoder)}
    assert isinstance(lamp, Spot)
    half = float(np.tan(np.radians(lamp.cutoff)))
    return {
        **_place(lamp.to_world, "spot.to_world", half, half),
        "cutoff": np.radians(lamp.cutoff),
        "beam_width": np.radians(min(lamp.beam_width, lamp.cutoff)),
        "smooth": SPOT_EDGES.index(lamp.edge),
        "factor": encoder.store.append("light_params", encoder.factor_words(lamp.image)),
    }


def with_poles(image: object) -> object:
    """Return an image around a point, and all that it is made of, so that it ends at the poles.

    Bitmaps whose `wrap_v` is not set go on at their other end, where the opposite pole is. One that
    `to_uv` moves along v or repeats stays as it is.
    """
    if isinstance(image, Bitmap):
        corners = np.asarray(image.to_uv)[1] @ np.array([[0, 0, 1, 1], [0, 1, 0, 1], [1, 1, 1, 1]])
        inside = bool((np.abs(corners - 0.5) <= 0.5 + 1e-6).all())
        return dataclasses.replace(image, wrap_v="clamp") if inside and not image.wrap_v else image
    if not isinstance(image, Texture):
        return image
    parts = {name: value for name, value in fields_of(image).items() if isinstance(value, Texture)}
    return dataclasses.replace(image, **{name: with_poles(one) for name, one in parts.items()})


def _image(image: object, encoder: Encoder) -> dict[str, ArrayLike]:
    """The members of an image whose values are brought below 1, as those of a reflectance are."""
    scale = 1.0
    if isinstance(image, Bitmap) and spectral_image(image, REFLECTANCE) is None:
        values = pixels(image, REFLECTANCE)
        scale = max(float(values.max()), 0.0) or 1.0
        image = dataclasses.replace(image, image=values / np.float32(scale), raw=True)
    return {
        "scale": scale,
        "factor": encoder.store.append("light_params", encoder.factor_words(image)),
    }


def _place(
    to_world: ArrayLike, where: str, half_x: float = 1.0, half_y: float = 1.0
) -> dict[str, NDArray[np.float64]]:
    """Position and axes; x and y over half the image's size, along rows (1, 1) of unit length."""
    position, axes = unsheared(to_world, where)
    x, y, z = axes.T
    return {"position": position, "x": x / half_x, "y": y / half_y, "z": z}
