"""Lights on their way to the device: their rows, how often each is chosen, and the dispatch text.

What is chosen is a row of `lights`: a lamp, a shape that is sampled as a whole, or one triangle of
an emissive mesh or cube. Infinite lights come first, for the rays that leave the scene.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.arrays import Faces, Points
from clpt.errors import SceneError
from clpt.geometry import analytic, shape_records, shapes, spheres, triangles
from clpt.records import LIGHT
from clpt.render.geometry.find import Emitter
from clpt.render.lights import bounds as light_bounds
from clpt.render.lights import tree as light_tree
from clpt.render.lights.encode_bodies import BodyLight
from clpt.render.lights.encode_bricks import BrickLights
from clpt.render.lights.encode_placed import blank_row, lower_lamp
from clpt.render.lights.find import Source, Sources, is_whole
from clpt.render.materials.encoder import Encoder
from clpt.render.records.light_rows import ALONG, BOTH, FRONT, KINDS
from clpt.render.records.lowering_cache import content
from clpt.scene.lights import Area, DirectionalArea, Light

PLACED_LIGHT_WEIGHT = (
    6  # triangles that a light at a place of its own counts as, where a tree is thought of
)
INFINITE_SHARE = 0.5  # of the choices, where there are other lights too


@dataclass(frozen=True)
class LightRows:
    """The table `lights` and what follows from it.

    rows: structured (n,) of LIGHT.dtype; power: (n,) float64, what each sends into the scene, in a
    unit of all of them; radiance: the largest mean one of a shape [W m^-2 sr^-1 nm^-1]; infinite:
    how many of the rows, the first ones, are infinite; kinds: those that occur, for
    `dispatch_text`; first: per emitter, its first row; whole: per emitter, whether that one row
    stands for all of it; visible: whether one is no delta light; two_sided: whether one shines from
    the back of its shape too; bounds: of the rows of each lamp and emitter; tree: the words of the
    tree that stand behind the rows, None where the alias table chooses.
    """

    rows: np.ndarray
    power: NDArray[np.float64]
    radiance: float
    infinite: int
    kinds: tuple[str, ...]
    first: tuple[int, ...]
    whole: tuple[bool, ...]
    visible: bool
    two_sided: bool
    bounds: tuple[light_bounds.Bounds, ...]
    tree: NDArray[np.uint32] | None


def light_rows(
    lamps: Sequence[Light],
    emitters: Sequence[Emitter],
    encoder: Encoder,
    sources: Sources,
    tree_from: int | None = None,
    volumes: Sequence[BrickLights | BodyLight] = (),
) -> LightRows:
    """Put the parameters of all lights into the tables, and make the rows of `lights`.

    sources: what they send; tree_from: the number of rows from which a tree chooses among them, or
    1 / PLACED_LIGHT_WEIGHT of it of lights at places; volumes: parts of media, whose rows follow
    those of the lamps. Raises SceneError for a light that has no place.
    """
    if encoder.store.append("light_params", blank_row()) != 0:
        raise ValueError("`light_params` must be empty before the lights are put in")
    blocks = [_lamp_rows(lamps[i], encoder) for i in sources.order]
    blocks += [_volume_rows(part, encoder) for part in volumes]
    blocks += [_emitter_rows(emitter, encoder) for emitter in emitters]
    every, infinite, power = sources.every, sources.infinite, sources.power
    rows = np.concatenate([np.zeros(0, LIGHT.dtype), *blocks])
    tree = None
    if len(rows):
        weights = _shared(power, infinite)
        same = content(weights)
        rows["pmf"], rows["keep"], rows["alias"] = encoder.cache(alias_table, weights, by=(same,))
        if tree_from is not None and has_tree(every, tree_from):
            tree = _tree(every, encoder)
    shine = (rows["shape"] >= 0) & (rows["emission_mode"] != ALONG)
    return LightRows(
        rows=rows,
        power=power,
        radiance=max((one.radiance for one in every), default=0.0),
        infinite=infinite,
        kinds=tuple(KINDS[i] for i in sorted({*rows["kind"].tolist()})),
        first=sources.first,
        whole=tuple(is_whole(emitter.shape) for emitter in emitters),
        visible=infinite > 0 or bool(shine.any()),
        two_sided=bool((rows["emission_mode"] == BOTH).any()),
        bounds=tuple(one.bounds for one in every),
        tree=tree,
    )


def has_tree(every: Sequence[Source], tree_from: int) -> bool:
    """Whether there are so many lights; each at a place of its own counts for several."""
    apart = sum(bool(one.bounds.placed.any()) for one in every)
    return max(sum(len(one.power) for one in every), PLACED_LIGHT_WEIGHT * apart) >= tree_from


def _tree(every: Sequence[Source], encoder: Encoder) -> NDArray[np.uint32]:
    """The words of the tree over all lights."""
    bounds = light_bounds.concatenated([one.bounds for one in every])
    importance = np.concatenate([one.importance for one in every])
    by = content(importance, *bounds.arrays)
    made: NDArray[np.uint32] = encoder.cache(_tree_words, bounds, importance, by=(by,))
    return made


def _tree_words(bounds: light_bounds.Bounds, importance: np.ndarray) -> NDArray[np.uint32]:
    return light_tree.build(bounds, importance).words(LIGHT.words * len(bounds))


def _block(count: int, kind: str, params: ArrayLike, radiance: int, shape_row: int) -> np.ndarray:
    rows = np.zeros(count, LIGHT.dtype)
    rows["kind"], rows["params"] = KINDS.index(kind), params
    rows["radiance"], rows["shape"] = radiance, shape_row
    return rows


def _lamp_rows(lamp: Light, encoder: Encoder) -> np.ndarray:
    """The row of a light that is not on a shape."""
    made = lower_lamp(lamp, encoder)
    return _block(1, made.kind, made.row, made.radiance, -1)


def _volume_rows(part: BrickLights | BodyLight, encoder: Encoder) -> np.ndarray:
    """The rows of a medium that emits."""
    at = part.rows(encoder)
    return _block(len(at), part.kind, at, 0, -1)


def _emitter_rows(emitter: Emitter, encoder: Encoder) -> np.ndarray:
    """The rows of a shape that emits."""
    shape = emitter.shape
    emission = shape.emission
    assert isinstance(emission, (Area, DirectionalArea))
    along = isinstance(emission, DirectionalArea)
    value = emission.radiance if isinstance(emission, Area) else emission.irradiance
    radiance = encoder.store.append("light_params", encoder.emission_words(value))
    kind = "triangle"
    if is_whole(shape):
        kind, geometry = shape.kind, analytic.row(shape)[None]
    elif shape.kind in shape_records.ONE_OF and emitter.vertices is not None:
        kind, geometry = "sphere", spheres.rows(shape, emitter.vertices)
    elif emitter.vertices is None or emitter.faces is None:
        raise SceneError("its triangles are missing", where=shapes.where(shape))
    else:
        corners = emitter.vertices, emitter.faces, emitter.keys
        geometry = encoder.cache(_triangle_rows, *corners)
    count, words = geometry.shape
    at = encoder.store.append("geometry", geometry) + words * np.arange(count)
    rows = _block(count, kind, at, radiance, emitter.shape_row)
    rows["emission_mode"] = ALONG if along else BOTH if emission.two_sided else FRONT
    return rows


def _triangle_rows(vertices: Points, faces: Faces, keys: int) -> NDArray[np.uint32]:
    """Rows of `Triangle` (m, 10 k) uint32 of faces: one for each of k keys, side by side."""
    rows = [triangles.triangle_rows(vertices, faces + np.uint32(i)) for i in range(keys)]
    return np.ascontiguousarray(np.hstack(rows))


def _shared(weights: np.ndarray, infinite: int) -> np.ndarray:
    """Weights with the infinite lights' share fixed where there are others; even if all are 0."""
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

    Row i of n, chosen evenly, is kept with probability keep[i], else alias[i] is taken.
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
