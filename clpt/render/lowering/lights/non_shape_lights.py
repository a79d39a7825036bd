"""Lights off all shapes on their way to the device: their rows in `light_params`, and their power."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.errors import SceneError
from clpt.render.contract import light_records
from clpt.render.contract.light_records import RECORDS
from clpt.render.lowering.encoder import Encoder
from clpt.render.lowering.lights import image_lights, projected
from clpt.render.lowering.textures.texels import pixels
from clpt.scene import lights
from clpt.scene.lights import Light
from clpt.scene.textures import Bitmap, Checkerboard, Dots, MeshAttribute, Mix, Product, Solid


def blank_row() -> NDArray[np.uint32]:
    """Return what stands at word 0 of `light_params`: valid as a dark light of any kind.

    It is what idle lanes read; an image light's smallest size keeps them inside its tables.
    """
    words = np.zeros(1, RECORDS["spectral_envmap"].dtype)  # the longest
    words["width"], words["height"] = 1, 2
    return words.view(np.uint32)


def lower_lamp(lamp: Light, encoder: Encoder, scene_radius: float) -> tuple[str, int, int, float]:
    """Put a light into the tables; its record, its row and emission in `light_params`, its power [W/nm].

    The power is an estimate, the mean of channels; scene_radius: of a sphere around the scene [m].
    Raises SceneError for a light that has no place or no direction.
    """
    if lamp.kind not in RECORDS:
        raise SceneError(f"a light of kind {lamp.kind!r} is a shape's `emission`", where="lights")
    kind = projected.kind_of(lamp)
    if isinstance(lamp, (lights.Envmap, lights.CubeMap)):
        members, strength = image_lights.lower_image(lamp, encoder)
        kind = "spectral_envmap" if "bands" in members else kind
        radiance = 0
    else:
        radiance = encoder.store.append("light_params", encoder.emission_words(_emitted(lamp)))
        own = (
            projected.members(lamp, encoder)
            if kind in light_records.PROJECTED_RECORDS
            else _members(lamp)
        )
        members = {**own, "radiance": radiance}
        strength = brightness(_emitted(lamp))
    words = np.zeros(1, RECORDS[kind].dtype)
    for name, value in members.items():
        words[name] = value
    at = encoder.store.append("light_params", words.view(np.uint32))
    return kind, at, radiance, power(lamp, strength, scene_radius)


def _emitted(lamp: Light) -> Any:
    """The value of a light's one emission parameter, whatever its name."""
    names = {
        "point": "intensity", "spot": "intensity", "goniometric": "intensity",
        "directional": "irradiance", "projector": "irradiance",
    }  # fmt: skip
    return getattr(lamp, names.get(lamp.kind, "radiance"))


def _members(lamp: Light) -> dict[str, ArrayLike]:
    """The members of a light's record but for its radiance."""
    if isinstance(lamp, lights.Point):
        return {"position": _three(lamp.position, "point.position"), "falloff": lamp.falloff}
    if isinstance(lamp, lights.Directional):
        return {"direction": _unit(lamp.direction, "directional.direction")}
    if isinstance(lamp, lights.Spot):
        matrix = _matrix(lamp)
        return {
            "position": matrix[:3, 3],
            "axis": _unit(matrix[:3, 2], "spot.to_world"),
            "cutoff": np.radians(lamp.cutoff),
            "beam_width": np.radians(min(lamp.beam_width, lamp.cutoff)),
            "smooth": lights.SPOT_EDGES.index(lamp.edge),
        }
    return {}


def _matrix(lamp: lights.Spot) -> NDArray[np.float64]:
    """A light's transform. Raises SceneError where it cannot be inverted."""
    matrix = np.asarray(lamp.to_world, np.float64)
    if matrix.shape != (4, 4) or transforms.is_singular(matrix):
        raise SceneError("must be an invertible (4, 4) matrix", where="spot.to_world")
    return matrix


def _three(value: ArrayLike, where: str) -> NDArray[np.float64]:
    values = np.asarray(value, np.float64)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise SceneError(f"must be three finite numbers, found {value!r}", where=where)
    return values


def _unit(value: ArrayLike, where: str) -> NDArray[np.float64]:
    vector = _three(value, where)
    length = float(np.linalg.norm(vector))
    if not length > 0.0:
        raise SceneError("has no length", where=where)
    return vector / length


def power(lamp: Light, strength: float, scene_radius: float) -> float:
    """Estimate what a light off all shapes sends into the scene, mean of channels [W/nm].

    strength: the mean of its intensity, irradiance or radiance.
    """
    disk = np.pi * scene_radius**2
    if isinstance(lamp, lights.Point):
        return 4.0 * np.pi * strength
    if isinstance(lamp, lights.Goniometric):
        return 4.0 * np.pi * strength * brightness(lamp.image)
    if isinstance(lamp, lights.Projector):
        return projected.image_area(lamp) * strength * brightness(lamp.image)
    if isinstance(lamp, lights.Spot):
        edge = np.radians([min(lamp.beam_width, lamp.cutoff), lamp.cutoff])
        return 2.0 * np.pi * (1.0 - float(np.cos(edge).mean())) * strength
    if isinstance(lamp, lights.Directional):
        return disk * strength
    return 4.0 * np.pi * disk * strength


def brightness(value: Any) -> float:
    """Return the mean over channels, and over a texture, of an emission."""
    if isinstance(value, Bitmap):
        return float(np.maximum(pixels(value, "emission"), 0.0).mean(dtype=np.float64))
    if isinstance(value, Checkerboard):
        return 0.5 * (brightness(value.color0) + brightness(value.color1))
    if isinstance(value, (MeshAttribute, Solid, Dots)):
        return 0.5  # whatever it is: this only shares out samples
    if isinstance(value, Product):
        return brightness(value.first) * brightness(value.second)
    if isinstance(value, Mix):
        share = value.amount if isinstance(value.amount, float) else brightness(value.amount)
        return (1.0 - share) * brightness(value.first) + share * brightness(value.second)
    return float(np.mean(value.to_rgb("emission")))
