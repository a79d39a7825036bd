"""Lights that are not on shapes: their rows in `light_params`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import fits_single
from clpt.errors import SceneError
from clpt.render.lights import encode_projected as projected
from clpt.render.lights import encode_sky as sky
from clpt.render.lights import power as light_power
from clpt.render.lights.encode_images import lower_image
from clpt.render.lights.find import emissions_of
from clpt.render.materials.encoder import Encoder
from clpt.render.records import light_rows as light_records
from clpt.render.records.light_rows import RECORDS
from clpt.scene import lights, roles
from clpt.scene.lights import Light
from clpt.scene.params import fields_of, params
from clpt.scene.roles import Param, Role


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
    """A light in the tables: its record's name, its row and its emission in `light_params`."""

    kind: str
    row: int
    radiance: int


def lower_lamp(lamp: Light, encoder: Encoder) -> Lowered:
    """Put a light into the tables. Raises SceneError for a light without position or direction."""
    kind, radiance = projected.kind_of(lamp), 0
    if isinstance(lamp, (lights.Envmap, lights.CubeMap)):
        members = lower_image(lamp, encoder)
        kind = "spectral_envmap" if "bands" in members else kind
    elif isinstance(lamp, lights.Sky):
        kind, members = sky.lower_sky(lamp, encoder)
    else:
        emissions = emissions_of(lamp)
        rows = {
            name: encoder.store.append("light_params", encoder.emission_words(value))
            for name, value in emissions.items()
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
    """The members of a declared light's record but for its emissions, see `declared_record`."""
    members: dict[str, ArrayLike] = {}
    given = fields_of(lamp)
    for name, param in params(type(lamp)).items():
        value, where = given[name], f"{lamp.kind}.{name}"
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
    roles.host("vector"): lambda name, value, _, where: {name: light_power.three(value, where)},
    roles.host("direction"): lambda name, value, _, where: {name: light_power.unit(value, where)},
    roles.host("matrix4"): lambda _, value, __, where: light_power.placement(value, where),
    **{roles.host(form): lambda *_: {} for form in light_records.OF_HOST},
}


def _computed_members(kind: str, lamp: Light, encoder: Encoder) -> dict[str, ArrayLike]:
    """The members of another light's record but for its radiance."""
    if kind in light_records.PROJECTED_RECORDS:
        return projected.members(lamp, encoder)
    assert isinstance(lamp, lights.Spot)
    placement = light_power.placement(lamp.to_world, "spot.to_world")
    return {
        "position": placement["position"],
        "axis": placement["z"],
        "cutoff": np.radians(lamp.cutoff),
        "beam_width": np.radians(min(lamp.beam_width, lamp.cutoff)),
        "smooth": lights.SPOT_EDGES.index(lamp.edge),
    }
