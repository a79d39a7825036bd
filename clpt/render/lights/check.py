"""Rules of lights off all shapes, and their positions and axes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.arrays import fits_single
from clpt.errors import SceneError
from clpt.render.records.lights import IMAGE_RECORDS, INFINITE, PROJECTED_RECORDS, RECORDS
from clpt.scene import roles
from clpt.scene.lights import Light, with_emission
from clpt.scene.params import fields_of, params
from clpt.scene.pixels import check_image
from clpt.scene.roles import Role
from clpt.scene.textures import check_textures

SHEAR = 1e-5  # largest cosine between axes that are at right angles


def check_light(lamp: Light) -> None:
    """Raise SceneError for a light of shapes, or a light without a place, direction or power."""
    if lamp.kind not in RECORDS:
        raise SceneError(f"a light of kind {lamp.kind!r} is a shape's `emission`", where="lights")
    check_textures(lamp)
    values = fields_of(lamp)
    with_emission(lamp)  # refuses a light that is 0 whatever its power
    if lamp.kind in IMAGE_RECORDS and values["image"] is None:
        message = "an image is needed: a path, or an array (h, w, 3)"
        raise SceneError(message, where=f"{lamp.kind}.image")
    if lamp.kind == "envmap":
        check_image(values["image"], "envmap.image", emissive=True)
    for name, param in params(type(lamp)).items():
        if param.role in PLACES:
            PLACES[param.role](lamp, values[name], f"{lamp.kind}.{name}")


def _check_matrix(lamp: Light, value: ArrayLike, where: str) -> None:
    if lamp.kind in INFINITE:
        rotation(lamp)
    elif lamp.record in PROJECTED_RECORDS:
        unsheared(value, where)
    else:
        placement(value, where)


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


def rotation(lamp: Light) -> NDArray[np.float64]:
    """Return the axes of an infinite light in the world, the columns of (3, 3).

    Raises SceneError for a matrix that is no rotation, but for its scale.
    """
    return unsheared(fields_of(lamp)["to_world"], f"{lamp.kind}.to_world")[1]


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
    """Return a vector of length 1. Raises SceneError for a vector of length 0."""
    vector = three(value, where)
    length = transforms.length(vector)
    if not length > 0.0:
        raise SceneError("has no length", where=where)
    return vector / length


def three(value: ArrayLike, where: str) -> NDArray[np.float64]:
    """Return a vector (3,). Raises SceneError unless it has three finite numbers."""
    values = np.asarray(value, np.float64)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise SceneError(f"must be three finite numbers, found {value!r}", where=where)
    return values


# rules of a light's place and direction, by the role of the parameter
PLACES: dict[Role, Callable[[Light, Any, str], object]] = {
    roles.host("matrix4"): _check_matrix,
    roles.host("direction"): lambda _, value, where: unit(value, where),
    roles.host("vector"): lambda _, value, where: three(value, where),
}
