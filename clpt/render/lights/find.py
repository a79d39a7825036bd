"""Power and place of each light of a scene, before it has a row in the tables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Faces, Points
from clpt.errors import SceneError
from clpt.geometry import analytic, shape_records, shapes, triangles
from clpt.geometry.motion import corners, swept
from clpt.render.geometry.find import Emitter, Geometry
from clpt.render.lights import bounds as light_bounds
from clpt.render.lights import images as image_lights
from clpt.render.lights import power as light_power
from clpt.render.lights import sky as sky_light
from clpt.render.lights.bounds import Bounds
from clpt.render.lights.bricks import Glow
from clpt.render.lights.glow import GlowingBody, glows
from clpt.render.lights.triangle_means import triangle_means
from clpt.render.records.light_rows import INFINITE
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.look import Look
from clpt.scene import lights
from clpt.scene.lights import Area, DirectionalArea, Light
from clpt.scene.media import Medium
from clpt.scene.params import fields_of, params
from clpt.scene.roles import EMISSION
from clpt.scene.shapes import Shape
from clpt.scene.textures import MeshAttribute, textures_in

Around: TypeAlias = Callable[[int | Emitter, light_bounds.Bounds], light_bounds.Bounds] | None


@dataclass(frozen=True)
class Source:
    """The light that the rows of a lamp, of a medium or of a shape send.

    power (n,) [W/nm]; bounds (n): where rows are and shine; importance (n,): how much they count in
    a tree; radiance: of a shape, the largest mean one [W m^-2 sr^-1 nm^-1].
    """

    power: NDArray[np.float64]
    bounds: Bounds
    importance: NDArray[np.float64]
    radiance: float = 0.0


@dataclass(frozen=True)
class Sources:
    """All lights of a scene.

    order: as `row_order`; lamps: in that order; glows: the lights that each medium is that
    emits; media: of these; emitters: shapes. Their rows follow one another.
    """

    order: tuple[int, ...]
    infinite: int
    lamps: tuple[Source, ...]
    glows: dict[Medium, Glow | GlowingBody]
    media: tuple[Source, ...]
    emitters: tuple[Source, ...]

    @property
    def every(self) -> tuple[Source, ...]:
        """All sources, in the order of their rows."""
        return (*self.lamps, *self.media, *self.emitters)

    @cached_property
    def power(self) -> NDArray[np.float64]:
        """The power that each row sends (n,) [W/nm]."""
        return np.concatenate([np.zeros(0), *(one.power for one in self.every)])

    @cached_property
    def first(self) -> tuple[int, ...]:
        """The first row of each emitter."""
        ends = np.cumsum([0, *(len(one.power) for one in self.every)])
        return tuple(int(i) for i in ends[len(self.lamps) + len(self.media) : -1])


def row_order(lamps: Sequence[Light]) -> list[int]:
    """Return the index of each light that is no shape, in the order of their rows: infinite first.

    Each of them has one row; those of emitters follow.
    """
    return sorted(range(len(lamps)), key=lambda i: lamps[i].kind not in INFINITE)


def sources_of(index: SceneIndex, geometry: Geometry, scene_radius: float, look: Look) -> Sources:
    """Return what the lights of a scene send; scene_radius: of a sphere around it [m].

    Raises SceneError for a light that has no place, and for an image that is none.
    """
    found = glows(index, look)
    around = _around(index, geometry) if index.motions else None
    return measured(index.lights, geometry.emitters, scene_radius, look, found, around)


def measured(
    lamps: Sequence[Light],
    emitters: Sequence[Emitter],
    scene_radius: float,
    look: Look,
    glows: dict[Medium, Glow | GlowingBody] | None = None,
    around: Around = None,
) -> Sources:
    """Return what lamps, shapes and media send.

    glows: the lights that media are; around: makes bounds of a lamp (by its index) or emitter hold
    while it moves.
    """
    order = row_order(lamps)
    glows = glows or {}
    made = [_of_lamp(lamps[i], scene_radius, look) for i in order]
    media = [_of_medium(glow) for glow in glows.values()]
    shining = [_of_emitter(emitter, look) for emitter in emitters]
    if around is not None:
        made = [_moved(one, around(i, one.bounds)) for i, one in zip(order, made, strict=True)]
        shining = [
            _moved(one, around(light, one.bounds))
            for light, one in zip(emitters, shining, strict=True)
        ]
    infinite = sum(lamps[i].kind in INFINITE for i in order)
    return Sources(tuple(order), infinite, tuple(made), glows, tuple(media), tuple(shining))


def _moved(one: Source, bounds: Bounds) -> Source:
    return replace(one, bounds=bounds)


def is_whole(shape: Shape) -> bool:
    """Return whether a shape is sampled as one light; a mesh and a cube are many."""
    return shape.kind in shape_records.RECORDS


def emissions_of(lamp: Light) -> dict[str, Any]:
    """Return the values of a light's emission parameters."""
    given, declared = fields_of(lamp), params(type(lamp)).items()
    return {name: given[name] for name, param in declared if param.role is EMISSION}


def _of_lamp(lamp: Light, scene_radius: float, look: Look) -> Source:
    """Return the source of a light that is not on a shape."""
    if isinstance(lamp, (lights.Envmap, lights.CubeMap)):
        strength = image_lights.mean_radiance(lamp, image_lights.content(lamp, look))
    elif isinstance(lamp, lights.Sky):
        strength = sky_light.content(lamp, look).strength
    else:
        values = emissions_of(lamp).values()
        strength = float(np.mean([light_power.brightness(value, look) for value in values]))
    power = light_power.power(lamp, strength, scene_radius, look)
    counts = light_power.importance(lamp, strength, power)
    return Source(np.array([power]), light_bounds.of_lamp(lamp), np.array([counts]))


def _of_medium(glow: Glow | GlowingBody) -> Source:
    """Return the source of the bricks of a medium, or of a whole one."""
    if isinstance(glow, GlowingBody):
        power, middle, reach = np.array([glow.power]), glow.matrix[:, 3], glow.reach
        return Source(power, _all_around((middle - reach)[None], (middle + reach)[None]), power)
    low = glow.corners + np.minimum(glow.edges, 0.0).sum(axis=1)
    high = glow.corners + np.maximum(glow.edges, 0.0).sum(axis=1)
    return Source(glow.power, _all_around(low, high), glow.power)


def _all_around(low: NDArray[np.float64], high: NDArray[np.float64]) -> Bounds:
    """Boxes (n, 3) of what shines in all directions."""
    count = len(low)
    return Bounds(
        low, high, 0.5 * (low + high),
        np.tile([0.0, 0.0, 1.0], (count, 1)),
        np.full(count, np.pi), np.full(count, np.pi / 2.0), np.full(count, False),
        np.full(count, True),
    )  # fmt: skip


def _of_emitter(emitter: Emitter, look: Look) -> Source:
    """Return the source of a shape that emits."""
    shape, cache = emitter.shape, look.cache
    emission = shape.emission
    assert isinstance(emission, (Area, DirectionalArea))
    along = isinstance(emission, DirectionalArea)
    both = not along and emission.two_sided
    value = emission.radiance if isinstance(emission, Area) else emission.irradiance
    strength = 1.0 if along else 2.0 * np.pi if both else np.pi
    if is_whole(shape):
        bright = light_power.brightness(value, look)
        power = np.array([strength * analytic.area(shape) * bright])
        return Source(power, light_bounds.of_shape(shape, both), power, bright)
    if shape.kind in shape_records.ONE_OF and emitter.vertices is not None:
        bright = light_power.brightness(value, look)
        areas = 4.0 * np.pi * emitter.vertices[:, 3].astype(np.float64) ** 2
        power = strength * bright * areas
        return Source(power, light_bounds.of_balls(emitter.vertices), power, bright)
    if emitter.vertices is None or emitter.faces is None:
        raise SceneError("its triangles are missing", where=shapes.where(shape))
    given = emitter.vertices, emitter.faces, emitter.keys
    by_face = _face_attributes(shape, value)
    if by_face:
        means = triangle_means(value, look, emitter.uvs, emitter.faces, by_face)
    else:
        own = value, emitter.uvs, emitter.faces
        seen = look.spectral, look.lo, look.hi, look.unseen
        means = cache(triangle_means, value, look, *own[1:], by=(*own, *seen))
    power = strength * cache(_triangle_areas, *given) * means
    bounds = cache(_triangle_bounds, *given, both)
    return Source(power, bounds, power, float(means.max(initial=0.0)))


def _face_attributes(shape: Shape, value: object) -> dict[str, NDArray[np.float32]]:
    """Return the attributes of a shape's triangles that its emission reads, by their names."""
    names = {one.name for one in textures_in(value) if isinstance(one, MeshAttribute)}
    return {name: triangles.attribute(shape, name) for name in names if triangles.per_face(name)}


def _triangle_areas(vertices: Points, faces: Faces, keys: int) -> NDArray[np.float64]:
    """The mean area over all keys (m,) [m^2]: by it triangles are chosen, at any time alike."""
    areas = (triangles.triangle_areas(vertices, faces + np.uint32(i)) for i in range(keys))
    return np.asarray(sum(areas) / keys)


def _triangle_bounds(vertices: Points, faces: Faces, keys: int, two_sided: bool) -> Bounds:
    """Bounds (m) that hold at all times: between two keys a triangle is in the box around both."""
    first, *others = (
        light_bounds.of_triangles(vertices, faces + np.uint32(i), two_sided) for i in range(keys)
    )
    if not others:
        return first
    low = np.minimum.reduce([first.low, *(one.low for one in others)])
    return first.within(low, np.maximum.reduce([first.high, *(one.high for one in others)]))


def _around(index: SceneIndex, geometry: Geometry) -> Around:
    """Return a function that widens the bounds of a light to hold while it moves."""
    motions = index.motions

    def around(light: int | Emitter, bounds: Bounds) -> Bounds:
        if isinstance(light, Emitter):
            keys = motions.shapes.get(int(geometry.rows[light.shape_row]["number"]))
        else:
            keys = motions.lamps.get(light)
        if keys is None:
            return bounds
        points = corners(np.stack([bounds.low, bounds.high], axis=1))
        low, high = swept(keys, points, motions.shutter).astype(np.float64).transpose(1, 0, 2)
        return bounds.within(low, high)

    return around
