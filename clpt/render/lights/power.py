"""Power and importance of lights that are not on shapes, and checks of their places."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.arrays import fits_single
from clpt.errors import SceneError
from clpt.render.spectra.look import Look
from clpt.scene import lights
from clpt.scene.lights import Light, Projector
from clpt.scene.pixels import pixels
from clpt.scene.roles import REFLECTANCE
from clpt.scene.textures import Bitmap, Checkerboard, Dots, MeshAttribute, Mix, Product, Solid

SHEAR = 1e-5  # largest cosine between axes that are at right angles


def power(lamp: Light, strength: float, scene_radius: float, look: Look) -> float:
    """Estimate what a light off all shapes sends into the scene, mean of channels [W/nm].

    strength: the mean of its intensity, irradiance or radiance. A light of which nothing more is
    known shines to all sides, or on the whole disk of the scene.
    """
    if isinstance(lamp, lights.Goniometric):
        return 4.0 * np.pi * strength * brightness(lamp.image, look)
    if isinstance(lamp, lights.Projector):
        return image_area(lamp) * strength * brightness(lamp.image, look)
    if isinstance(lamp, lights.Spot):
        edge = np.radians([min(lamp.beam_width, lamp.cutoff), lamp.cutoff])
        return 2.0 * np.pi * (1.0 - float(np.cos(edge).mean())) * strength
    if lamp.reach == "placed":
        return 4.0 * np.pi * strength
    disk = np.pi * scene_radius**2
    return disk * strength if lamp.reach == "distant" else 4.0 * np.pi * disk * strength


def importance(lamp: Light, strength: float, power: float) -> float:
    """Return how much a light off all shapes counts in a tree over lights.

    A small flat light of power P gives an irradiance of P / pi at a metre, so that of a light
    without a place counts pi times.
    """
    if lamp.reach == "placed" and lamp.falloff:
        return power
    return np.pi * strength * (np.pi if lamp.reach == "infinite" else 1.0)


def brightness(value: Any, look: Look) -> float:
    """Return how much an emission counts, in the mean over a texture; see `Look.brightness`."""
    if isinstance(value, Bitmap):
        return float(look.levels(value).mean())
    if isinstance(value, Checkerboard):
        return 0.5 * (brightness(value.color0, look) + brightness(value.color1, look))
    if isinstance(value, (MeshAttribute, Solid, Dots)):
        return 0.5  # whatever it is: this only shares out samples
    if isinstance(value, Product):
        return brightness(value.first, look) * brightness(value.second, look)
    if isinstance(value, Mix):
        given = value.amount
        share = given if isinstance(given, float) else brightness(given, look)
        first, second = (brightness(one, look) for one in (value.first, value.second))
        return (1.0 - share) * first + share * second
    return look.brightness(value)


def image_area(lamp: Projector) -> float:
    """Return the area of a projector's image a metre before it [m^2]."""
    half = float(np.tan(np.radians(lamp.fov) / 2.0))
    return 4.0 * half * half / aspect(lamp)


def aspect(lamp: Projector) -> float:
    """Return the width of a projector's image over its height."""
    if lamp.aspect > 0.0 or not isinstance(lamp.image, Bitmap):
        return lamp.aspect or 1.0
    height, width = pixels(lamp.image, REFLECTANCE).shape[:2]
    return width / height


def invertible(to_world: ArrayLike, where: str) -> NDArray[np.float64]:
    """Return a light's transform. Raises SceneError for a matrix without an inverse."""
    matrix = np.asarray(to_world, np.float64)
    if matrix.shape != (4, 4) or transforms.is_singular(matrix) or not fits_single(matrix):
        raise SceneError("must be an invertible (4, 4) matrix", where=where)
    return matrix


def placement(to_world: ArrayLike, where: str) -> dict[str, ArrayLike]:
    """Return a light's position and unit axes. Raises SceneError as `invertible` and `unit` do."""
    matrix = invertible(to_world, where)
    axes = {axis: unit(matrix[:3, i], where) for i, axis in enumerate("xyz")}
    return {"position": matrix[:3, 3], **axes}


def unsheared(to_world: ArrayLike, where: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return a light's position (3,) and unit axes, the columns of (3, 3).

    Raises SceneError for a matrix that shears, or without an inverse.
    """
    matrix = invertible(to_world, where)
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    if np.abs(axes.T @ axes - np.eye(3)).max() > SHEAR:
        raise SceneError("must not shear", where=where)
    return matrix[:3, 3], axes


def unit(value: ArrayLike, where: str) -> NDArray[np.float64]:
    """Return a vector of length 1. Raises SceneError for one without a direction."""
    vector = three(value, where)
    length = transforms.length(vector)
    if not length > 0.0:
        raise SceneError("has no length", where=where)
    return vector / length


def three(value: ArrayLike, where: str) -> NDArray[np.float64]:
    """Return a vector. Raises SceneError for what are no three finite numbers."""
    values = np.asarray(value, np.float64)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise SceneError(f"must be three finite numbers, found {value!r}", where=where)
    return values
