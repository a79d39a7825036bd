"""Lights that are not on shapes: their rows in `light_params`, and their power."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.errors import SceneError
from clpt.render.contract import light_records
from clpt.render.contract.light_records import RECORDS
from clpt.render.lowering.encoder import Encoder
from clpt.render.lowering.lights import image_lights, projected, sky
from clpt.scene import lights
from clpt.scene.lights import Light
from clpt.scene.params import params
from clpt.scene.pixels import pixels
from clpt.scene.textures import Bitmap, Checkerboard, Dots, MeshAttribute, Mix, Product, Solid


def blank_row() -> NDArray[np.uint32]:
    """Return what stands at word 0 of `light_params`: valid as a dark light of any kind.

    It is what idle lanes read; an image light's smallest size keeps them inside its tables.
    """
    words = np.zeros(1, RECORDS["spectral_envmap"].dtype)
    words["width"], words["height"] = 1, 2
    words["block_rows"] = words["block_columns"] = 1
    longest = max(record.words for record in RECORDS.values())
    return np.pad(words.view(np.uint32), (0, longest - RECORDS["spectral_envmap"].words))


class Lowered(NamedTuple):
    """A light in the tables: its record's name, its row and its emission in `light_params`.

    power, importance: as the functions of these names have them.
    """

    kind: str
    row: int
    radiance: int
    power: float
    importance: float


def lower_lamp(lamp: Light, encoder: Encoder, scene_radius: float) -> Lowered:
    """Put a light into the tables.

    scene_radius: of a sphere around the scene [m]. Raises SceneError for a light that has no
    position or no direction.
    """
    if lamp.kind not in RECORDS:
        raise SceneError(f"a light of kind {lamp.kind!r} is a shape's `emission`", where="lights")
    kind, radiance = projected.kind_of(lamp), 0
    if isinstance(lamp, (lights.Envmap, lights.CubeMap)):
        members, strength = image_lights.lower_image(lamp, encoder)
        kind = "spectral_envmap" if "bands" in members else kind
    elif isinstance(lamp, lights.Sky):
        kind, members, strength = sky.lower_sky(lamp, encoder)
    else:
        emissions = _emissions(lamp)
        rows = {
            name: encoder.store.append("light_params", encoder.emission_words(value))
            for name, value in emissions.items()
        }
        radiance = next(iter(rows.values()))
        if kind in light_records.DECLARED:
            members = {**_declared_members(lamp), **rows}
        else:
            members = {**_computed_members(kind, lamp, encoder), "radiance": radiance}
        strength = float(np.mean([brightness(value) for value in emissions.values()]))
    words = np.zeros(1, RECORDS[kind].dtype)
    for name, value in members.items():
        words[name] = value
    at = encoder.store.append("light_params", words.view(np.uint32))
    sent = power(lamp, strength, scene_radius)
    return Lowered(kind, at, radiance, sent, importance(lamp, strength, sent))


def _emissions(lamp: Light) -> dict[str, Any]:
    """The values of a light's emission parameters."""
    declared = params(type(lamp)).items()
    return {name: getattr(lamp, name) for name, param in declared if param.role == "emission"}


def _declared_members(lamp: Light) -> dict[str, ArrayLike]:
    """The members of a declared light's record but for its emissions, see `declared_record`."""
    members: dict[str, ArrayLike] = {}
    for name, param in params(type(lamp)).items():
        value, where = getattr(lamp, name), f"{lamp.kind}.{name}"
        if param.form in ("text", "keys"):
            continue
        if param.form == "matrix4":
            members |= _placement(value, where)
        elif param.role == "host":
            members[name] = (_unit if param.form == "direction" else _three)(value, where)
        elif param.role == "choice":
            members[name] = param.choices.index(value)
        elif param.role != "emission":
            members[name] = np.radians(value) if param.unit == "degrees" else value
    return members


def _computed_members(kind: str, lamp: Light, encoder: Encoder) -> dict[str, ArrayLike]:
    """The members of another light's record but for its radiance."""
    if kind in light_records.PROJECTED_RECORDS:
        return projected.members(lamp, encoder)
    assert isinstance(lamp, lights.Spot)
    placement = _placement(lamp.to_world, "spot.to_world")
    return {
        "position": placement["position"],
        "axis": placement["z"],
        "cutoff": np.radians(lamp.cutoff),
        "beam_width": np.radians(min(lamp.beam_width, lamp.cutoff)),
        "smooth": lights.SPOT_EDGES.index(lamp.edge),
    }


def _placement(to_world: ArrayLike, where: str) -> dict[str, ArrayLike]:
    """A light's position and unit axes. Raises SceneError for a matrix without an inverse."""
    matrix = projected.invertible(to_world, where)
    axes = {axis: _unit(matrix[:3, i], where) for i, axis in enumerate("xyz")}
    return {"position": matrix[:3, 3], **axes}


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

    strength: the mean of its intensity, irradiance or radiance. A light of which nothing more is
    known shines to all sides, or on the whole disk of the scene.
    """
    if isinstance(lamp, lights.Goniometric):
        return 4.0 * np.pi * strength * brightness(lamp.image)
    if isinstance(lamp, lights.Projector):
        return projected.image_area(lamp) * strength * brightness(lamp.image)
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
    if lamp.reach == "placed" and getattr(lamp, "falloff", True):
        return power
    return np.pi * strength * (np.pi if lamp.reach == "infinite" else 1.0)


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
