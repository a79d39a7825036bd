"""Lights that are not on shapes: their rows in `light_params`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import fits_single
from clpt.errors import SceneError
from clpt.render.analysis.lights import light_power
from clpt.render.analysis.lights.sources import emissions_of
from clpt.render.contract import light_records
from clpt.render.contract.light_records import RECORDS
from clpt.render.lowering.encoder import Encoder
from clpt.render.lowering.lights import projected, sky
from clpt.render.lowering.lights.image_lights import lower_image
from clpt.scene import lights
from clpt.scene.lights import Light
from clpt.scene.params import params


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
    for name, param in params(type(lamp)).items():
        value, where = getattr(lamp, name), f"{lamp.kind}.{name}"
        if param.form in light_records.OF_HOST:
            continue
        if param.form == "matrix4":
            members |= light_power.placement(value, where)
        elif param.role == "host":
            turned = light_power.unit if param.form == "direction" else light_power.three
            members[name] = turned(value, where)
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
    placement = light_power.placement(lamp.to_world, "spot.to_world")
    return {
        "position": placement["position"],
        "axis": placement["z"],
        "cutoff": np.radians(lamp.cutoff),
        "beam_width": np.radians(min(lamp.beam_width, lamp.cutoff)),
        "smooth": lights.SPOT_EDGES.index(lamp.edge),
    }
