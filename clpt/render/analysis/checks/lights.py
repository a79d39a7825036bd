"""Rules of lights that are no shapes."""

from __future__ import annotations

from numpy.typing import ArrayLike

from clpt.errors import SceneError
from clpt.render.analysis.checks.textures import check_image, check_textures
from clpt.render.analysis.lights import image_lights, light_power
from clpt.render.contract.light_records import RECORDS
from clpt.scene.lights import CubeMap, Envmap, Goniometric, Light, Projector, Sky, Spot
from clpt.scene.params import Texture, params


def check_light(lamp: Light) -> None:
    """Raise SceneError for a light that only shapes have, or one without a place or direction."""
    if lamp.kind not in RECORDS:
        raise SceneError(f"a light of kind {lamp.kind!r} is a shape's `emission`", where="lights")
    check_textures(lamp)
    if isinstance(lamp, (Envmap, CubeMap)) and lamp.image is None:
        message = "an image is needed: a path, or an array (h, w, 3)"
        raise SceneError(message, where=f"{lamp.kind}.image")
    if isinstance(lamp, Envmap):
        check_image(lamp.image, "envmap.image", emissive=True)
    for name, param in params(type(lamp)).items():
        value, where = getattr(lamp, name), f"{lamp.kind}.{name}"
        if param.form == "matrix4":
            _check_matrix(lamp, value, where)
        elif param.role == "host" and param.form == "direction":
            light_power.unit(value, where)
        elif param.role == "host" and param.form == "vector":
            light_power.three(value, where)


def _check_matrix(lamp: Light, value: ArrayLike, where: str) -> None:
    throws = isinstance(lamp, Spot) and isinstance(lamp.image, Texture)
    if isinstance(lamp, (Envmap, CubeMap, Sky)):
        image_lights.axes_of(lamp)
    elif throws or isinstance(lamp, (Projector, Goniometric)):
        light_power.unsheared(value, where)
    else:
        light_power.placement(value, where)
