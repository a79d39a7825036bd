"""All lights of a scene: power, bounds and importance, before they have rows in the tables."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Faces, Floats, Points
from clpt.errors import SceneError
from clpt.geometry import analytic, shapes, triangles
from clpt.geometry.motion import corners, swept
from clpt.render.geometry.find import Emitter, Geometry
from clpt.render.lights import bounds as light_bounds
from clpt.render.lights import images as image_lights
from clpt.render.lights.bodies import BodyLight, BrickLights, volume_lights
from clpt.render.lights.bounds import Bounds
from clpt.render.records.lights import INFINITE
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.find import Look
from clpt.scene import lights
from clpt.scene.lights import Light
from clpt.scene.media import Medium
from clpt.scene.params import fields_of, params
from clpt.scene.roles import EMISSION, REFLECTANCE
from clpt.scene.shapes import Shape
from clpt.scene.textures import attributes_in
from clpt.scene.values import brightness_at, is_texture, mean

Around: TypeAlias = Callable[[int | Emitter, light_bounds.Bounds], light_bounds.Bounds] | None

LOOKS = 1 << 18  # at a texture, all triangles together
FEWEST, MOST = 16, 1024  # of them for a triangle
LEAST = 0.02  # of the texture's mean: a triangle that looks dark may yet hold a bright texel
_GOLDEN = np.array([0.7548776662466927, 0.5698402909980532])  # Roberts' sequence R2 (2018)


@dataclass(frozen=True)
class Source:
    """The light of the rows of a lamp, a medium or a shape.

    power (n,) [W/nm]; bounds (n); importance (n,): weight in a light tree; radiance: the largest
    mean radiance of a shape [W m^-2 sr^-1 nm^-1].
    """

    power: NDArray[np.float64]
    bounds: Bounds
    importance: NDArray[np.float64]
    radiance: float = 0.0


@dataclass(frozen=True)
class Sources:
    """All lights of a scene.

    order: as `row_order`; infinite: number of infinite lamps; lamps: in that order; volumes: the
    lights of each emitting medium; media: their sources; emitters: shapes. Rows stand in this
    order.
    """

    order: tuple[int, ...]
    infinite: int
    lamps: tuple[Source, ...]
    volumes: dict[Medium, BrickLights | BodyLight]
    media: tuple[Source, ...]
    emitters: tuple[Source, ...]

    @property
    def every(self) -> tuple[Source, ...]:
        """All sources, in the order of their rows."""
        return (*self.lamps, *self.media, *self.emitters)

    @cached_property
    def power(self) -> NDArray[np.float64]:
        """The power of each row (n,) [W/nm]."""
        return np.concatenate([np.zeros(0), *(source.power for source in self.every)])

    @cached_property
    def first(self) -> tuple[int, ...]:
        """The first row of each emitter."""
        ends = np.cumsum([0, *(len(source.power) for source in self.every)])
        return tuple(int(i) for i in ends[len(self.lamps) + len(self.media) : -1])


def row_order(lamps: Sequence[Light]) -> list[int]:
    """Return the indices of lights off all shapes in the order of their rows: infinite first.

    Each has a single row; the rows of emitters follow.
    """
    return sorted(range(len(lamps)), key=lambda i: lamps[i].kind not in INFINITE)


def sources_of(index: SceneIndex, geometry: Geometry, scene_radius: float, look: Look) -> Sources:
    """Return the sources of a scene; scene_radius: of a sphere around it [m].

    Raises SceneError for a light without a place, and for an image that cannot be read.
    """
    volumes = volume_lights(index, look)
    around = _around(index, geometry) if index.motions else None
    return measured(index.lights, geometry.emitters, scene_radius, look, volumes, around)


def measured(
    lamps: Sequence[Light],
    emitters: Sequence[Emitter],
    scene_radius: float,
    look: Look,
    volumes: dict[Medium, BrickLights | BodyLight] | None = None,
    around: Around = None,
) -> Sources:
    """Return the sources of lamps, shapes and media.

    volumes: the lights of media; around: widens bounds of a lamp (by its index) or emitter to hold
    while it moves.
    """
    order = row_order(lamps)
    volumes = volumes or {}
    of_lamps = [_of_lamp(lamps[i], scene_radius, look) for i in order]
    media = [_of_volume(part) for part in volumes.values()]
    of_emitters = [_of_emitter(emitter, look) for emitter in emitters]
    if around is not None:
        of_lamps = [
            replace(source, bounds=around(i, source.bounds))
            for i, source in zip(order, of_lamps, strict=True)
        ]
        of_emitters = [
            replace(source, bounds=around(emitter, source.bounds))
            for emitter, source in zip(emitters, of_emitters, strict=True)
        ]
    infinite = sum(lamps[i].kind in INFINITE for i in order)
    return Sources(
        tuple(order), infinite, tuple(of_lamps), volumes, tuple(media), tuple(of_emitters)
    )


def is_whole(shape: Shape) -> bool:
    """Return whether a shape is sampled as a single light; a mesh and a cube have many rows."""
    return shape.kind in shapes.RECORDS


def emissions_of(lamp: Light) -> dict[str, Any]:
    """Return the values of a light's emission parameters."""
    values, declared = fields_of(lamp), params(type(lamp)).items()
    return {name: values[name] for name, param in declared if param.role is EMISSION}


ENVIRONMENTS: dict[type[Light], Any] = {  # functions of a light and a look
    lights.Envmap: image_lights.envmap_content,
    lights.CubeMap: image_lights.cube_content,
    lights.Sky: image_lights.sky_content,
}


def environment_of(
    lamp: Light, look: Look
) -> image_lights.Content | image_lights.SkyContent | None:
    """Return the content of a light that is an image around the scene; None for another light."""
    if type(lamp) not in ENVIRONMENTS:
        return None
    content: image_lights.Content | image_lights.SkyContent = ENVIRONMENTS[type(lamp)](lamp, look)
    return content


def _of_lamp(lamp: Light, scene_radius: float, look: Look) -> Source:
    environment = environment_of(lamp, look)
    if environment is not None:
        strength = environment.strength
    else:
        values = emissions_of(lamp).values()
        strength = float(np.mean([mean(value, look) for value in values]))
    power = light_power(lamp, strength, scene_radius, look)
    counts = importance(lamp, strength, power)
    return Source(np.array([power]), light_bounds.of_lamp(lamp), np.array([counts]))


def _of_volume(part: BrickLights | BodyLight) -> Source:
    power = np.atleast_1d(part.power)
    return Source(power, part.bounds, power)


def _of_emitter(emitter: Emitter, look: Look) -> Source:
    shape, cache = emitter.shape, look.cache
    emission = shape.emission
    assert emission is not None
    both = emission.two_sided
    value = fields_of(emission)[emission.emission_name]
    strength = emission.extent(1.0)  # power of a square metre whose emission is 1
    if is_whole(shape):
        bright = mean(value, look)
        power = np.array([strength * analytic.area(shape) * bright])
        return Source(power, light_bounds.of_shape(shape, both), power, bright)
    if shape.kind in shapes.ONE_OF and emitter.vertices is not None:
        bright = mean(value, look)
        areas = 4.0 * np.pi * emitter.vertices[:, 3].astype(np.float64) ** 2
        power = strength * bright * areas
        return Source(power, light_bounds.of_balls(emitter.vertices), power, bright)
    if emitter.vertices is None or emitter.faces is None:
        raise SceneError("its triangles are missing", where=shapes.where(shape))
    mesh = emitter.vertices, emitter.faces, emitter.keys
    by_face = _face_attributes(shape, value)
    if by_face:
        means = triangle_means(value, look, emitter.uvs, emitter.faces, by_face)
    else:
        textured = value, emitter.uvs, emitter.faces
        seen = look.spectral, look.lo, look.hi, look.unseen
        means = cache(triangle_means, value, look, *textured[1:], by=(*textured, *seen))
    power = strength * cache(_triangle_areas, *mesh) * means
    bounds = cache(_triangle_bounds, *mesh, both)
    return Source(power, bounds, power, float(means.max(initial=0.0)))


def light_power(lamp: Light, strength: float, scene_radius: float, look: Look) -> float:
    """Estimate the power of a light off all shapes in the scene, mean of channels [W/nm].

    strength: the mean of its intensity, irradiance or radiance.
    """
    declared = params(type(lamp)).get("image")
    passes = declared is not None and declared.role is REFLECTANCE
    image_mean = mean(fields_of(lamp)["image"], look) if passes else 1.0
    return lamp.sampling_power(strength, scene_radius, image_mean)


def importance(lamp: Light, strength: float, power: float) -> float:
    """Return the weight of a light off all shapes in a light tree.

    A small flat light of power P gives an irradiance of P / pi at a metre, so the irradiance of a
    light without a place counts pi times.
    """
    if lamp.reach == "placed" and lamp.falloff:
        return power
    return np.pi * strength * (np.pi if lamp.reach == "infinite" else 1.0)


def triangle_means(
    value: object,
    look: Look,
    uvs: NDArray[np.float32] | None,
    faces: NDArray[Any],
    attributes: Mapping[str, NDArray[np.float32]] = MappingProxyType({}),
) -> Floats:
    """Return the mean brightness of an emission over triangles (m, 3), as (m,).

    look: of the film; uvs (n, 2): of the vertices; None: uv are barycentrics, as in
    kernels/lights/area.cl; attributes: values (m, k) of the mesh attributes that the emission
    reads by face.
    """
    if not is_texture(value):
        return np.full(len(faces), mean(value, look))
    corners = np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])
    corner_uvs = (
        np.tile(corners, (len(faces), 1, 1)) if uvs is None else np.asarray(uvs, float)[faces]
    )
    count = int(np.clip(LOOKS // max(len(faces), 1), FEWEST, MOST))
    u = np.modf(0.5 + np.arange(count)[:, None] * _GOLDEN)[0]
    root = np.sqrt(u[:, 0])
    weights = np.stack([1.0 - root, root * (1.0 - u[:, 1]), root * u[:, 1]], axis=1)
    places = np.einsum("kc,mcd->mkd", weights, corner_uvs)
    edges = corner_uvs[:, 1:] - corner_uvs[:, :1]
    area = 0.5 * np.abs(edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0])
    means = brightness_at(value, look, places, area / count, attributes).mean(axis=1)
    return np.maximum(means, LEAST * mean(value, look))


def _face_attributes(shape: Shape, value: object) -> dict[str, NDArray[np.float32]]:
    """Return the attributes that an emission reads at a shape's triangles, by their names."""
    names = filter(triangles.per_face, attributes_in(value))
    return {name: triangles.attribute(shape, name) for name in names}


def _triangle_areas(vertices: Points, faces: Faces, keys: int) -> NDArray[np.float64]:
    """Return the mean area over all keys (m,) [m^2]: triangles are chosen alike at any time."""
    areas = (triangles.triangle_areas(vertices, faces + np.uint32(i)) for i in range(keys))
    return np.asarray(sum(areas) / keys)


def _triangle_bounds(vertices: Points, faces: Faces, keys: int, two_sided: bool) -> Bounds:
    """Return bounds (m) for all times: between two keys a triangle is in the box around both."""
    first, *others = (
        light_bounds.of_triangles(vertices, faces + np.uint32(i), two_sided) for i in range(keys)
    )
    if not others:
        return first
    low = np.minimum.reduce([first.low, *(bounds.low for bounds in others)])
    return first.within(low, np.maximum.reduce([first.high, *(bounds.high for bounds in others)]))


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
