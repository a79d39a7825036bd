"""Rules of lights that are no shapes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numpy.typing import ArrayLike

from clpt.errors import SceneError
from clpt.render.lights import images as image_lights
from clpt.render.lights import power as light_power
from clpt.render.records.light_rows import RECORDS
from clpt.render.textures.check import check_image, check_textures
from clpt.scene import roles
from clpt.scene.lights import (
    CubeMap,
    Envmap,
    Goniometric,
    Light,
    Projector,
    Sky,
    Spot,
    with_emission,
)
from clpt.scene.params import Texture, fields_of, params
from clpt.scene.roles import Role


def check_light(lamp: Light) -> None:
    """Raise SceneError for a light of shapes, or one without a place, direction or power."""
    if lamp.kind not in RECORDS:
        raise SceneError(f"a light of kind {lamp.kind!r} is a shape's `emission`", where="lights")
    check_textures(lamp)
    with_emission(lamp)  # it refuses a light that is 0 whatever its power
    if isinstance(lamp, (Envmap, CubeMap)) and lamp.image is None:
        message = "an image is needed: a path, or an array (h, w, 3)"
        raise SceneError(message, where=f"{lamp.kind}.image")
    if isinstance(lamp, Envmap):
        check_image(lamp.image, "envmap.image", emissive=True)
    given = fields_of(lamp)
    for name, param in params(type(lamp)).items():
        if param.role in PLACES:
            PLACES[param.role](lamp, given[name], f"{lamp.kind}.{name}")


def _check_matrix(lamp: Light, value: ArrayLike, where: str) -> None:
    throws = isinstance(lamp, Spot) and isinstance(lamp.image, Texture)
    if isinstance(lamp, (Envmap, CubeMap, Sky)):
        image_lights.axes_of(lamp)
    elif throws or isinstance(lamp, (Projector, Goniometric)):
        light_power.unsheared(value, where)
    else:
        light_power.placement(value, where)


# the rules of where a light is and shines to, by the role of the parameter
PLACES: dict[Role, Callable[[Light, Any, str], object]] = {
    roles.host("matrix4"): _check_matrix,
    roles.host("direction"): lambda _, value, where: light_power.unit(value, where),
    roles.host("vector"): lambda _, value, where: light_power.three(value, where),
}
