"""Lights on their way to the device: their rows, how often each is chosen, and the dispatch text.

What is chosen is a row of `lights`: a lamp, a shape that is sampled as a whole, or one triangle of
an emissive mesh or cube. Infinite lights come first, for the rays that leave the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt.errors import SceneError
from clpt.geometry import analytic, shape_records, shapes, spheres, triangles
from clpt.records import LIGHT
from clpt.render.contract.light_records import ALONG, BOTH, FRONT, INFINITE, KINDS, VOLUME
from clpt.render.lowering.encoder import Encoder
from clpt.render.lowering.geometry import Emitter
from clpt.render.lowering.lights import light_bounds, light_tree
from clpt.render.lowering.lights.brick_lights import BrickLights
from clpt.render.lowering.lights.non_shape_lights import blank_row, brightness, lower_lamp
from clpt.render.lowering.lights.triangle_means import triangle_means
from clpt.render.lowering.lowering_cache import content
from clpt.render.lowering.textures.textures import per_face
from clpt.scene.lights import DirectionalArea, Light
from clpt.scene.shapes import Shape
from clpt.scene.textures import MeshAttribute, textures_in

PLACED_LIGHT_WEIGHT = (
    6  # triangles that a light at a place of its own counts as, where a tree is thought of
)
INFINITE_SHARE = 0.5  # of the choices, where there are other lights too


Around: TypeAlias = Callable[[int | Emitter, light_bounds.Bounds], light_bounds.Bounds] | None


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


class Block(NamedTuple):
    """The rows of one lamp or emitter, their power [W/nm], and where they shine.

    importance: how much they count in a tree, see `non_shape_lights`; their power by default.
    radiance: of a shape, the largest mean one of its rows.
    """

    rows: np.ndarray
    power: np.ndarray
    bounds: light_bounds.Bounds
    importance: np.ndarray | None = None
    radiance: float = 0.0


def row_order(lamps: Sequence[Light]) -> list[int]:
    """Return the index of each light that is no shape, in the order of their rows: infinite first.

    Each of them has one row; those of emitters follow.
    """
    return sorted(range(len(lamps)), key=lambda i: lamps[i].kind not in INFINITE)


def light_rows(
    lamps: Sequence[Light],
    emitters: Sequence[Emitter],
    encoder: Encoder,
    scene_radius: float,
    tree_from: int | None = None,
    volumes: Sequence[BrickLights] = (),
    around: Around = None,
) -> LightRows:
    """Put the parameters of all lights into the tables, and make the rows of `lights`.

    scene_radius: of a sphere around the scene [m]; tree_from: the number of rows from which a tree
    chooses among them, or 1 / PLACED_LIGHT_WEIGHT of it of lights at places; volumes: bricks of
    media, whose rows follow those of the lamps; around: makes bounds of a lamp (by its index) or
    emitter hold while it moves. Raises SceneError for a light that has no place.
    """
    if encoder.store.append("light_params", blank_row()) != 0:
        raise ValueError("`light_params` must be empty before the lights are put in")
    ordered = [lamps[i] for i in row_order(lamps)]
    infinite = sum(lamp.kind in INFINITE for lamp in ordered)
    blocks = [_lamp_block(lamp, encoder, scene_radius) for lamp in ordered]
    blocks += [_brick_block(bricks, encoder) for bricks in volumes]
    before = len(blocks)
    blocks += [_emitter_block(emitter, encoder) for emitter in emitters]
    if around is not None:
        own: list[int | Emitter] = [*row_order(lamps), *emitters]
        moved = [*blocks[: len(ordered)], *blocks[before:]]
        moved = [
            block._replace(bounds=around(light, block.bounds))
            for light, block in zip(own, moved, strict=True)
        ]
        blocks[: len(ordered)], blocks[before:] = moved[: len(ordered)], moved[len(ordered) :]
    first = np.cumsum([0, *(len(block.rows) for block in blocks)])[before:-1]
    rows = np.concatenate([np.zeros(0, LIGHT.dtype), *(block.rows for block in blocks)])
    power = np.concatenate([np.zeros(0), *(block.power for block in blocks)])
    tree = None
    if len(rows):
        weights = _shared(power, infinite)
        same = content(weights)
        rows["pmf"], rows["keep"], rows["alias"] = encoder.cache(alias_table, weights, by=(same,))
        apart = sum(bool(block.bounds.placed.any()) for block in blocks)
        if tree_from is not None and max(len(rows), PLACED_LIGHT_WEIGHT * apart) >= tree_from:
            bounds = light_bounds.concatenated([block.bounds for block in blocks])
            counts = (b.power if b.importance is None else b.importance for b in blocks)
            importance = np.concatenate([*counts])
            by = content(importance, *vars(bounds).values())
            tree = encoder.cache(_tree_words, bounds, importance, by=(by,))
    kinds = tuple(KINDS[i] for i in np.unique(rows["kind"]))
    return LightRows(
        rows=rows,
        power=power,
        radiance=max((block.radiance for block in blocks), default=0.0),
        infinite=infinite,
        kinds=kinds,
        first=tuple(int(i) for i in first),
        whole=tuple(_whole(emitter.shape) for emitter in emitters),
        visible=infinite > 0
        or bool(((rows["shape"] >= 0) & (rows["emission_mode"] != ALONG)).any()),
        two_sided=bool((rows["emission_mode"] == BOTH).any()),
        bounds=tuple(block.bounds for block in blocks),
        tree=tree,
    )


def _tree_words(bounds: light_bounds.Bounds, importance: np.ndarray) -> NDArray[np.uint32]:
    return light_tree.build(bounds, importance).words(LIGHT.words * len(bounds))


def _whole(shape: Shape) -> bool:
    """Whether the shape is sampled as one light; a mesh and a cube are many."""
    return shape.kind in shape_records.RECORDS


def _block(count: int, kind: str, params: ArrayLike, radiance: int, shape_row: int) -> np.ndarray:
    rows = np.zeros(count, LIGHT.dtype)
    rows["kind"], rows["params"] = KINDS.index(kind), params
    rows["radiance"], rows["shape"] = radiance, shape_row
    return rows


def _lamp_block(lamp: Light, encoder: Encoder, scene_radius: float) -> Block:
    """The row of a light that is not on a shape."""
    made = lower_lamp(lamp, encoder, scene_radius)
    row = _block(1, made.kind, made.row, made.radiance, -1)
    bounds = light_bounds.of_lamp(lamp)
    return Block(row, np.array([made.power]), bounds, np.array([made.importance]))


def _brick_block(bricks: BrickLights, encoder: Encoder) -> Block:
    """The rows of a medium that emits."""
    at = bricks.rows(encoder)
    return Block(_block(len(at), VOLUME, at, 0, -1), bricks.glow.power, bricks.bounds())


def _emitter_block(emitter: Emitter, encoder: Encoder) -> Block:
    """The rows of a shape that emits."""
    shape = emitter.shape
    emission: Any = shape.emission  # an area light, of either kind
    along = isinstance(emission, DirectionalArea)
    emission_mode = ALONG if along else BOTH if emission.two_sided else FRONT
    value = emission.irradiance if along else emission.radiance
    radiance = encoder.store.append("light_params", encoder.emission_words(value))
    strength = {FRONT: np.pi, ALONG: 1.0, BOTH: 2.0 * np.pi}[emission_mode]
    if _whole(shape):
        at = encoder.store.append("geometry", analytic.row(shape))
        rows = _block(1, shape.kind, at, radiance, emitter.shape_row)
        rows["emission_mode"] = emission_mode
        bounds = light_bounds.of_shape(shape, emission_mode == BOTH)
        bright = brightness(value)
        sent = np.array([strength * analytic.area(shape) * bright])
        return Block(rows, sent, bounds, radiance=bright)
    if shape.kind in shape_records.ONE_OF:
        bright = brightness(value)
        block = _balls_block(emitter, encoder, emission_mode, radiance, strength * bright)
        return block._replace(radiance=bright)
    if emitter.vertices is None or emitter.faces is None:
        raise SceneError("its triangles are missing", where=shapes.where(shape))
    cache, corners = encoder.cache, (emitter.vertices, emitter.faces, emitter.keys)
    geometry = cache(_triangle_rows, *corners)
    count, words = geometry.shape
    at = encoder.store.append("geometry", geometry) + words * np.arange(count)
    rows = _block(count, "triangle", at, radiance, emitter.shape_row)
    rows["emission_mode"] = emission_mode
    bounds = cache(_triangle_bounds, *corners, emission_mode == BOTH)
    by_face = _face_attributes(shape, value)
    if by_face:
        means = triangle_means(value, emitter.uvs, emitter.faces, by_face)
    else:
        means = cache(triangle_means, value, emitter.uvs, emitter.faces)
    areas = cache(_triangle_areas, *corners)
    return Block(rows, strength * areas * means, bounds, radiance=float(means.max(initial=0.0)))


def _face_attributes(shape: Shape, value: Any) -> dict[str, NDArray[np.float32]]:
    """What an emission reads of each triangle."""
    names = {one.name for one in textures_in(value) if isinstance(one, MeshAttribute)}
    return {name: triangles.attribute(shape, name) for name in names if per_face(name)}


def _triangle_rows(vertices: shapes.Points, faces: shapes.Faces, keys: int) -> NDArray[np.uint32]:
    """Rows of `Triangle` (m, 10 k) uint32 of faces: one for each of k keys, side by side."""
    rows = [triangles.triangle_rows(vertices, faces + np.uint32(i)) for i in range(keys)]
    return np.ascontiguousarray(np.hstack(rows))


def _triangle_areas(vertices: shapes.Points, faces: shapes.Faces, keys: int) -> NDArray[np.float64]:
    """The mean area over all keys (m,) [m^2]: by it triangles are chosen, at any time alike."""
    areas = (triangles.triangle_areas(vertices, faces + np.uint32(i)) for i in range(keys))
    return np.asarray(sum(areas) / keys)


def _triangle_bounds(
    vertices: shapes.Points, faces: shapes.Faces, keys: int, two_sided: bool
) -> light_bounds.Bounds:
    """Bounds (m) that hold at all times: between two keys a triangle is in the box around both."""
    first, *others = (
        light_bounds.of_triangles(vertices, faces + np.uint32(i), two_sided) for i in range(keys)
    )
    if not others:
        return first
    return replace(
        first,
        low=np.minimum.reduce([first.low, *(one.low for one in others)]),
        high=np.maximum.reduce([first.high, *(one.high for one in others)]),
        theta_o=np.full(len(faces), np.pi),
    )


def _balls_block(
    emitter: Emitter, encoder: Encoder, emission_mode: int, radiance: int, strength: float
) -> Block:
    """A row for each of many spheres; strength: what a square metre of them emits."""
    placed: Any = emitter.vertices
    geometry = spheres.rows(emitter.shape, placed)
    count, words = geometry.shape
    at = encoder.store.append("geometry", geometry) + words * np.arange(count)
    rows = _block(count, "sphere", at, radiance, emitter.shape_row)
    rows["emission_mode"] = emission_mode
    areas = 4.0 * np.pi * placed[:, 3].astype(np.float64) ** 2
    return Block(rows, strength * areas, light_bounds.of_balls(placed))


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
