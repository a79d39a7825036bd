"""Lights off all shapes: their records in `light_params`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import fits_single
from clpt.errors import SceneError
from clpt.render.lights.check import placement, three, unit, unsheared
from clpt.render.lights.find import emissions_of, environment_of
from clpt.render.materials.encoder import Encoder
from clpt.render.records import lights as light_records
from clpt.render.records.lights import RECORDS
from clpt.scene import roles
from clpt.scene.lights import Light
from clpt.scene.params import fields_of, params
from clpt.scene.roles import Param, Role


def blank_row() -> NDArray[np.uint32]:
    """Return the words at the start of `light_params`: valid as a dark light of any kind.

    Idle lanes read them; an image light's smallest size keeps these inside its tables.
    """
    words = np.zeros(1, RECORDS["spectral_envmap"].dtype)
    words["width"], words["height"] = 1, 2
    words["block_rows"] = words["block_columns"] = 1
    longest = max(record.words for record in RECORDS.values())
    return np.pad(words.view(np.uint32), (0, longest - RECORDS["spectral_envmap"].words))


class Lowered(NamedTuple):
    """A light in the tables: its record's name, its row and its emission in `light_params`."""

    kind: str
    row: int
    radiance: int


def lower_lamp(lamp: Light, encoder: Encoder) -> Lowered:
    """Put a light into the tables. Raises SceneError for a light without position or direction."""
    kind, radiance = lamp.record, 0
    environment = environment_of(lamp, encoder.look)
    if environment is not None:
        kind, members = environment.record(lamp, encoder)
    else:
        rows = {
            name: encoder.store.append("light_params", encoder.emission_words(value))
            for name, value in emissions_of(lamp).items()
        }
        radiance = next(iter(rows.values()))
        if kind in light_records.DECLARED:
            members = {**_declared_members(lamp), **rows}
        else:
            members = {**_computed_members(kind, lamp, encoder), "radiance": radiance}
    words = np.zeros(1, RECORDS[kind].dtype)
    for name, value in members.items():
        if not fits_single(value):
            raise SceneError("is beyond float32, 3.4e38", where=f"{lamp.kind}.{name}")
        words[name] = value
    at = encoder.store.append("light_params", words.view(np.uint32))
    return Lowered(kind, at, radiance)


def _declared_members(lamp: Light) -> dict[str, ArrayLike]:
    """Return the members of a declared light's record but for emissions, see `declared_record`."""
    members: dict[str, ArrayLike] = {}
    values = fields_of(lamp)
    for name, param in params(type(lamp)).items():
        value, where = values[name], f"{lamp.kind}.{name}"
        members |= MEMBERS[param.role](name, value, param, where)
    return members


def _number(name: str, value: Any, param: Param, where: str) -> dict[str, ArrayLike]:
    return {name: np.radians(value) if param.unit == "degrees" else value}


# the members of a parameter, by its role
MEMBERS: dict[Role, Callable[[str, Any, Param, str], dict[str, ArrayLike]]] = {
    roles.EMISSION: lambda *_: {},
    roles.REAL: _number,
    roles.FLAG: _number,
    roles.CHOICE: lambda name, value, param, _: {name: param.choices.index(value)},
    roles.host("vector"): lambda name, value, _, where: {name: three(value, where)},
    roles.host("direction"): lambda name, value, _, where: {name: unit(value, where)},
    roles.host("matrix4"): lambda _, value, __, where: placement(value, where),
    **{roles.host(form): lambda *_: {} for form in light_records.OF_HOST},
}


def _computed_members(kind: str, lamp: Light, encoder: Encoder) -> dict[str, ArrayLike]:
    """Return the members of another light's record but for its radiance.

    Raises SceneError for a transform that shears below an image, or an unreadable image.
    """
    to_world, where = fields_of(lamp)["to_world"], f"{lamp.kind}.to_world"
    if kind in light_records.PROJECTED_RECORDS:
        placed = _place(to_world, where, *lamp.image_half_size)
        members = lamp.record_members()
        words = encoder.factor_words(members["factor"])
        return {**members, **placed, "factor": encoder.store.append("light_params", words)}
    axes = placement(to_world, where)
    return {**lamp.record_members(), "position": axes["position"], "axis": axes["z"]}


def _place(
    to_world: ArrayLike, where: str, half_x: float, half_y: float
) -> dict[str, NDArray[np.float64]]:
    """Return position and axes; x and y are divided by half the image's size at a distance of 1."""
    position, axes = unsheared(to_world, where)
    x, y, z = axes.T
    return {"position": position, "x": x / half_x, "y": y / half_y, "z": z}
