"""Lights on their way to the device: their records, their rows, the alias table and the light tree.

A row of `lights` is a lamp, a shape that is sampled as a whole, a triangle of an emissive mesh or
cube, or a part of a medium. Infinite lights come first, for the rays that leave the scene. The
record of a lamp stands in `light_params`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Faces, Points, fits_single
from clpt.errors import SceneError
from clpt.geometry import analytic, shapes, triangles
from clpt.records import LIGHT
from clpt.render.geometry.find import Emitter
from clpt.render.lights import bounds as light_bounds
from clpt.render.lights import tree as light_tree
from clpt.render.lights.bodies import BodyLight, BrickLights
from clpt.render.lights.check import placement, three, unit, unsheared
from clpt.render.lights.find import Source, Sources, emissions_of, environment_of, is_whole
from clpt.render.materials.encoder import Encoder
from clpt.render.records import lights as light_records
from clpt.render.records.lights import (
    ALONG,
    BOTH,
    DIRECTED,
    FRONT,
    KINDS,
    RECORDS,
    UNSEEN,
    LightFeatures,
)
from clpt.render.records.tables import content
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.find import Look
from clpt.scene import roles
from clpt.scene.lights import Light
from clpt.scene.params import fields_of, params
from clpt.scene.roles import Param, Role
from clpt.scene.values import mean


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


PLACED_LIGHT_WEIGHT = 6  # rows of a light at a separate place, to decide on a light tree
INFINITE_SHARE = 0.5  # of the choices, beside other lights

FEW_LIGHTS = 256  # up to this number a single random number chooses a light and a point on it


@dataclass(frozen=True)
class LightRows:
    """The table `lights`.

    rows: structured (n,) of LIGHT.dtype, those of `sources` in their order; tree: words of the
    light tree behind the rows, None where the alias table chooses.
    """

    sources: Sources
    rows: np.ndarray
    tree: NDArray[np.uint32] | None

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds that occur, in their order."""
        return tuple(KINDS[i] for i in sorted({*self.rows["kind"].tolist()}))

    def features(self, gloss: int = 0, *, openings: bool = False) -> LightFeatures:
        """Return the features of these rows; gloss, openings: see `LightFeatures`."""
        modes = self.rows["emission_mode"]
        shine = (self.rows["shape"] >= 0) & (modes & (ALONG | UNSEEN) == 0)
        infinite = self.sources.infinite > 0
        return LightFeatures(
            kinds=self.kinds,
            infinite=infinite,
            visible=infinite or bool(shine.any()),
            two_sided=bool((modes & BOTH).any()),
            unseen=bool((modes & UNSEEN).any()),
            directed=bool((modes & DIRECTED).any()),
            tree=self.tree is not None,
            few=len(self.rows) <= FEW_LIGHTS,
            gloss=gloss,
            openings=openings,
        )


def light_rows(
    lamps: Sequence[Light],
    emitters: Sequence[Emitter],
    encoder: Encoder,
    sources: Sources,
    tree_from: int | None = None,
    volumes: Sequence[tuple[int, BrickLights | BodyLight]] = (),
) -> LightRows:
    """Put the parameters of all lights into the tables, and make the rows of `lights`.

    tree_from: the least number of rows, or of separate lights times PLACED_LIGHT_WEIGHT, for a
    light tree; volumes: lights of media with their medium's word; their rows follow the lamps'.
    Raises SceneError for a light without a place.
    """
    if encoder.store.append("light_params", blank_row()) != 0:
        raise ValueError("`light_params` must be empty before the lights are put in")
    blocks = [_lamp_rows(lamps[i], encoder) for i in sources.order]
    blocks += [_volume_rows(word, part, encoder) for word, part in volumes]
    blocks += [_emitter_rows(emitter, encoder) for emitter in emitters]
    rows = np.concatenate([np.zeros(0, LIGHT.dtype), *blocks])
    tree = None
    if len(rows):
        weights = _shared(sources.power, sources.infinite)
        by = content(weights)
        rows["pmf"], rows["keep"], rows["alias"] = encoder.cache(alias_table, weights, by=(by,))
        if tree_from is not None and has_tree(sources.every, tree_from):
            tree = _tree(sources.every, encoder)
    return LightRows(sources, rows, tree)


def has_tree(every: Sequence[Source], tree_from: int) -> bool:
    """Whether a light tree pays: for many rows, or for fewer separate lights with a place."""
    separate = sum(bool(source.bounds.placed.any()) for source in every)
    rows = sum(len(source.power) for source in every)
    return max(rows, PLACED_LIGHT_WEIGHT * separate) >= tree_from


def _tree(every: Sequence[Source], encoder: Encoder) -> NDArray[np.uint32]:
    bounds = light_bounds.concatenated([source.bounds for source in every])
    importance = np.concatenate([source.importance for source in every])
    by = content(importance, *bounds.arrays)
    words: NDArray[np.uint32] = encoder.cache(_tree_words, bounds, importance, by=(by,))
    return words


def _tree_words(bounds: light_bounds.Bounds, importance: np.ndarray) -> NDArray[np.uint32]:
    return light_tree.build(bounds, importance).words(LIGHT.words * len(bounds))


def _block(count: int, kind: str, params: ArrayLike, radiance: int, shape_row: int) -> np.ndarray:
    rows = np.zeros(count, LIGHT.dtype)
    rows["kind"], rows["params"] = KINDS.index(kind), params
    rows["radiance"], rows["shape"] = radiance, shape_row
    return rows


def _lamp_rows(lamp: Light, encoder: Encoder) -> np.ndarray:
    lowered = lower_lamp(lamp, encoder)
    return _block(1, lowered.kind, lowered.row, lowered.radiance, -1)


def _volume_rows(word: int, part: BrickLights | BodyLight, encoder: Encoder) -> np.ndarray:
    at = part.rows(encoder, word)
    return _block(len(at), part.kind, at, 0, -1)


def _emitter_rows(emitter: Emitter, encoder: Encoder) -> np.ndarray:
    shape = emitter.shape
    emission = shape.emission
    assert emission is not None
    value = fields_of(emission)[emission.emission_name]
    radiance = encoder.store.append("light_params", encoder.emission_words(value))
    kind = "triangle"
    if is_whole(shape):
        kind, geometry = shape.kind, analytic.row(shape)[None]
    elif shape.kind in shapes.ONE_OF and emitter.vertices is not None:
        kind, geometry = "sphere", analytic.rows(shape, emitter.vertices)
    elif emitter.vertices is None or emitter.faces is None:
        raise SceneError("its triangles are missing", where=shapes.where(shape))
    else:
        corners = emitter.vertices, emitter.faces, emitter.keys
        geometry = encoder.cache(_triangle_rows, *corners)
    count, words = geometry.shape
    at = encoder.store.append("geometry", geometry) + words * np.arange(count)
    rows = _block(count, kind, at, radiance, emitter.shape_row)
    along = emission.kind == "directional_area"
    mode = ALONG if along else BOTH if emission.two_sided else FRONT
    rows["emission_mode"] = mode | (0 if emission.visible else UNSEEN)
    rows["emission_mode"] |= DIRECTED if emission.directed else 0
    return rows


def _triangle_rows(vertices: Points, faces: Faces, keys: int) -> NDArray[np.uint32]:
    """Return rows of `Triangle` (m, 10 k) uint32 of faces: k keys side by side."""
    rows = [triangles.triangle_rows(vertices, faces + np.uint32(i)) for i in range(keys)]
    return np.ascontiguousarray(np.hstack(rows))


def _shared(weights: np.ndarray, infinite: int) -> np.ndarray:
    """Return weights with INFINITE_SHARE for infinite lights beside others; even if all are 0."""
    ours, others = weights[:infinite].sum(), weights[infinite:].sum()
    if not ours + others > 0.0:
        return np.ones_like(weights)
    if not (ours > 0.0 and others > 0.0):
        return weights
    shared = weights / others * (1.0 - INFINITE_SHARE)
    shared[:infinite] = weights[:infinite] / ours * INFINITE_SHARE
    return shared


def alias_table(
    weights: ArrayLike,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]:
    """Return pmf, keep and alias (n,) to choose a row by its weight (Vose 1991).

    A uniform row i of n is kept with probability keep[i], else alias[i] is taken.
    """
    weights = np.asarray(weights, np.float64)
    pmf = weights / weights.sum()
    left = (pmf * len(pmf)).tolist()
    keep, alias = [1.0] * len(left), list(range(len(left)))
    small = [i for i, p in enumerate(left) if p < 1.0]
    large = [i for i, p in enumerate(left) if p >= 1.0]
    while small and large:
        i, j = small.pop(), large[-1]
        keep[i], alias[i] = left[i], j
        left[j] -= 1.0 - left[i]
        if left[j] < 1.0:
            small.append(large.pop())
    return pmf.astype(np.float32), np.array(keep, np.float32), np.array(alias, np.int32)


def light_level(
    index: SceneIndex, sources: Sources, sphere: tuple[NDArray[np.float64], float]
) -> float:
    """Estimate the largest radiance that the camera may see [W m^-2 sr^-1 nm^-1].

    The largest of the radiance of emitting shapes and media, and of the light of all lights spread
    evenly over the scene. sphere: centre and radius around the scene [m]. 0 where nothing emits,
    or nothing whose values the host knows.
    """
    centre, radius = sphere
    arrives = 0.0
    every = sources.every
    if every:
        bounds = light_bounds.concatenated([source.bounds for source in every])
        away = np.square((bounds.low + bounds.high) / 2.0 - centre).sum(axis=1)
        square = np.where(bounds.placed, np.maximum(away, radius**2), radius**2)
        arrives = float((sources.power / (4.0 * np.pi * square)).sum())
    look = Look.of(index.film)
    media = [medium.light for medium in index.emitting if medium.light is not None]
    glow = [look.brightness(light) * radius for light in media]
    ambient = index.integrator.ambient
    around = 0.0 if ambient is None else mean(ambient, look)
    return max(*(source.radiance for source in every), arrives, around, *glow)
