"""Points that throw an image on their way to the device: projector, goniometric, spot with one."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.errors import SceneError
from clpt.layout import Record
from clpt.render.texels import pixels, spectral_image
from clpt.scene.lights import SPOT_EDGES, Goniometric, Light, Projector, Spot
from clpt.scene.textures import Bitmap

_PLACE = {
    "position": ("vec3", "[m]"),
    "x": ("vec3", "the light's own axes in the world"),
    "y": ("vec3", ""),
    "z": ("vec3", "unit length"),
}
_RADIANCE = ("integer", "first word of the emission parameter in `lamps`")
_SCALE = ("real", "what the image's values were divided by")
_FACTOR = ("integer", "first word in `lamps` of what it is multiplied by")
RECORDS: dict[str, Record] = {
    "projector": Record(
        "Projector",
        "A pinhole camera in reverse; x and y are over half the size of the image at a metre.",
        **_PLACE,
        scale=_SCALE,
        radiance=_RADIANCE,
        factor=_FACTOR,
    ),
    "image_spot": Record(
        "ImageSpot",
        "A spot light with an image; x and y are over half its size at a metre.",
        **_PLACE,
        cutoff=("real", "half angle beyond which it is dark [rad]"),
        beam_width=("real", "half angle of full intensity [rad]"),
        smooth=("integer", "1: it falls off smoothly in the cosine; 0: linearly in the angle"),
        radiance=_RADIANCE,
        factor=_FACTOR,
    ),
    "goniometric": Record(
        "Goniometric",
        "A point light with an image around it.",
        **_PLACE,
        scale=_SCALE,
        radiance=_RADIANCE,
        factor=_FACTOR,
    ),
}


def kind_of(lamp: Light) -> str:
    """Return the record of a light: a spot with an image has one of its own."""
    plain = isinstance(lamp, Spot) and getattr(lamp.image, "is_texture", False)
    return "image_spot" if plain else lamp.kind


def members(lamp: Light, tables: Any) -> dict[str, ArrayLike]:
    """Return the members of a light's record but for `radiance`.

    Raises SceneError for a transform that shears, or an image that cannot be used.
    """
    if isinstance(lamp, Projector):
        half = float(np.tan(np.radians(lamp.fov) / 2.0))
        axes = _place(lamp.to_world, "projector.to_world", half, half / _aspect(lamp))
        return {**axes, **_image(lamp.image, tables)}
    if isinstance(lamp, Goniometric):
        return {**_place(lamp.to_world, "goniometric.to_world"), **_image(lamp.image, tables)}
    assert isinstance(lamp, Spot)
    half = float(np.tan(np.radians(lamp.cutoff)))
    return {
        **_place(lamp.to_world, "spot.to_world", half, half),
        "cutoff": np.radians(lamp.cutoff),
        "beam_width": np.radians(min(lamp.beam_width, lamp.cutoff)),
        "smooth": SPOT_EDGES.index(lamp.edge),
        "factor": tables.append("lamps", tables.factor_words(lamp.image)),
    }


def image_area(lamp: Projector) -> float:
    """Return the area of a projector's image a metre before it [m^2]."""
    half = float(np.tan(np.radians(lamp.fov) / 2.0))
    return 4.0 * half * half / _aspect(lamp)


def _aspect(lamp: Projector) -> float:
    if lamp.aspect > 0.0 or not isinstance(lamp.image, Bitmap):
        return lamp.aspect or 1.0
    height, width = pixels(lamp.image, "reflectance").shape[:2]
    return width / height


def _image(image: Any, tables: Any) -> dict[str, ArrayLike]:
    """The members of an image whose values are brought below 1, as those of a reflectance are."""
    scale = 1.0
    if isinstance(image, Bitmap) and spectral_image(image, "reflectance") is None:
        values = pixels(image, "reflectance")
        scale = max(float(values.max()), 0.0) or 1.0
        image = dataclasses.replace(image, image=values / np.float32(scale), raw=True)
    return {"scale": scale, "factor": tables.append("lamps", tables.factor_words(image))}


def _place(
    to_world: ArrayLike, where: str, half_x: float = 1.0, half_y: float = 1.0
) -> dict[str, NDArray[np.float64]]:
    """Position and axes; x and y over half the image's size, along rows (1, 1) of unit length."""
    matrix = np.asarray(to_world, np.float64)
    if matrix.shape != (4, 4) or transforms.is_singular(matrix):
        raise SceneError("must be an invertible (4, 4) matrix", where=where)
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    if np.abs(axes.T @ axes - np.eye(3)).max() > 1e-5:
        raise SceneError("must not shear", where=where)
    x, y, z = axes.T
    return {"position": matrix[:3, 3], "x": x / half_x, "y": y / half_y, "z": z}
