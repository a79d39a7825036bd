"""The media around lights, where light paths begin.

The boundaries of media tell the media around a lamp. A shape emits into its `exterior` if it names
its sides, else into the media at some points just before it: these must agree.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.geometry import analytic, shapes, winding
from clpt.render.geometry import surroundings
from clpt.render.geometry.find import Emitter, Geometry
from clpt.render.lights.find import Sources, row_order
from clpt.render.media.bodies import BodyWords, matter_of
from clpt.render.media.encode import MediumWords
from clpt.render.records.tables import LoweringCache
from clpt.render.scene_index import SceneIndex
from clpt.scene.media import Medium
from clpt.scene.motion import Deformation, Keys

POINTS = 6  # before a shape that emits
OFFSET = 1e-4  # of these points from the shape, over its size
INFINITY = 1e4  # radii of the scene: the distance of a point that stands for infinity
CROSSES = "{} comes into another medium while the shutter is open"
STRADDLES = "{} lies in more than one medium, or does not know its bounds"

Around = tuple[Any, ...]  # both of `surroundings.for_rays`, or the matter of bodies


class LightMedia(NamedTuple):
    """The media around the lights of a scene.

    around: for each lamp and each emitting shape the media around it and its number of rows;
    refusal: why no path can start at some light, "" if paths can; extinction (n,): for each row the
    extinction of the scattering medium around the light [1/m], 0 without a medium, nan where its
    density is on a grid.
    """

    around: tuple[tuple[Around, int], ...]
    refusal: str
    extinction: NDArray[np.float64]


NOWHERE = LightMedia((), "", np.zeros(0))


def light_media(
    index: SceneIndex,
    geometry: Geometry,
    sources: Sources,
    sphere: tuple[NDArray[np.float64], float],
    cache: LoweringCache,
) -> LightMedia:
    """Return the media around all lights of a scene with media; the parameters are `around`'s."""
    try:
        surrounding = around(index, geometry, sphere, cache)
    except Unknown as reason:
        return NOWHERE._replace(refusal=str(reason))
    ends = (*sources.first, len(sources.power))[1:]
    counts = [1] * len(sources.order)
    counts += [end - first for first, end in zip(sources.first, ends, strict=True)]
    rows = tuple(zip(surrounding, counts, strict=True))
    extinction = np.repeat(np.array([_extinction(media) for media in surrounding]), counts)
    return LightMedia(rows, "", extinction)


def light_media_words(
    surrounding: LightMedia, media: MediumWords, bodies: BodyWords | None, rows: int
) -> NDArray[np.uint32]:
    """Return the words of `around_words` for each of the rows of `lights`, (3 rows,) uint32.

    Zeros where the media are unknown.
    """
    if not surrounding.around:
        return np.zeros(3 * rows, np.uint32)
    words: list[tuple[int, int, int]] = []
    for at_light, count in surrounding.around:
        words += [around_words(at_light, media, bodies)] * count
    return np.array(words, np.uint32).ravel()


def around_words(
    surrounding: Around, media: MediumWords, bodies: BodyWords | None
) -> tuple[int, int, int]:
    """Return the words of the bodies around a point, and of both of `surroundings.for_rays`."""
    if bodies is not None:
        return (*bodies.around(surrounding, media), 0)
    medium, beyond = surrounding
    return 0, media.word(medium), media.word(beyond)


class Unknown(Exception):
    """The reason why no path can start at some light; where: that light, "" if it is no light's."""

    def __init__(self, reason: str, where: str = ""):
        super().__init__(reason)
        self.where = where


def around(
    index: SceneIndex,
    geometry: Geometry,
    sphere: tuple[NDArray[np.float64], float],
    cache: LoweringCache,
) -> list[Around]:
    """Return the media around each lamp, in the order of rows, and around each emitting shape.

    geometry: it has the emitting shapes; sphere: centre and radius [m] of the scene. Moving lights
    and boundaries are tested at several times while the shutter is open. Raises Unknown for a light
    in no known or no single medium, and for media that emit.
    """
    if index.emitting:
        name = index.emitting[0].name or index.emitting[0].kind
        raise Unknown(f"no path starts in the medium {name!r}, which gives out light")
    boundaries = _Boundaries(index, cache)
    hole = None if index.nested else boundaries.open_medium()
    unknown = (
        ""
        if hole is None
        else (
            f"the boundary of the medium {hole.name or hole.kind!r} is not closed, so that nobody "
            "knows whether {} is in it"
        )
    )
    far = sphere[0] + INFINITY * sphere[1] * np.ones(3)
    order = row_order(index.lights)
    lamps = [_around_lamp(i, index, boundaries, far, unknown) for i in order]
    return lamps + [
        _around_emitter(emitter, boundaries, geometry, unknown) for emitter in geometry.emitters
    ]


def _around_lamp(
    i: int, index: SceneIndex, boundaries: _Boundaries, far: NDArray[np.float64], unknown: str
) -> Around:
    """Return the media around a lamp. Raises Unknown.

    far (3,): a point that stands for infinity; unknown: the message, with room for the light's
    name, where a boundary is open, else "".
    """
    name, lamp = f"lights[{i}]", index.lights[i]
    if unknown:
        raise Unknown(unknown.format(name))
    if lamp.reach == "placed":
        bounds, keys = lamp.bounds(), index.motions.lamps.get(i)
        if bounds is None:
            raise Unknown(STRADDLES.format(name), name)
        corners = itertools.product(*zip(bounds.low, bounds.high, strict=True))
        first, *others = (boundaries.around(np.array(p), keys) for p in dict.fromkeys(corners))
        if first is None or None in others:
            raise Unknown(CROSSES.format(name), name)
        if any(other != first for other in others):
            raise Unknown(STRADDLES.format(name), name)
        return first
    surrounding = boundaries.around(far, None)
    if surrounding is None or any(surrounding):
        reason = f"the light of {name} comes from infinity, where a medium has no end"
        raise Unknown(reason, name)
    return surrounding


def _around_emitter(
    emitter: Emitter, boundaries: _Boundaries, geometry: Geometry, unknown: str
) -> Around:
    """Return the media into which a shape emits; unknown: as for `_around_lamp`. Raises Unknown."""
    name = shapes.where(emitter.shape)
    if unknown and not surroundings.bounds_media(emitter.shape):
        raise Unknown(unknown.format(name))
    number = int(geometry.rows[emitter.shape_row]["number"])
    surrounding = _around_shape(emitter, boundaries, number)
    if surrounding is None:
        moving = " while the shutter is open" if boundaries.motions.moving else ""
        raise Unknown(f"{name} shines into more than one medium{moving}", name)
    return surrounding


def _extinction(surrounding: Around) -> float:
    """Return the mean extinction of the medium that counts [1/m].

    0 for a medium that does not scatter, nan for a density on a grid.
    """
    media = (entry[-1] if isinstance(entry, tuple) else entry for entry in surrounding[:1])
    medium = next((medium for medium in media if medium is not None and medium.scatters), None)
    if medium is None or medium.lattice is not None:
        return 0.0 if medium is None else float("nan")
    both = [value.to_rgb("unbounded") for value in medium.coefficients(spectral=False)]
    return float(np.mean(np.add(*both)))


class _Boundaries:
    """The boundaries of a scene, which tell the media or the bodies at a point."""

    def __init__(self, index: SceneIndex, cache: LoweringCache):
        self.nested, self.cache, self.motions = index.nested, cache, index.motions
        self.shapes = surroundings.boundaries(index.listed, matter_of if self.nested else None)
        self.times = self.motions.looks()
        self.still = surroundings.stands_still(self.shapes)
        self.elsewhere = () if self.nested else self._around_camera(index)

    def _around_camera(self, index: SceneIndex) -> tuple[Medium, ...]:
        """Return the camera's medium if no boundary encloses the camera with it.

        That medium then fills all space without another medium.
        """
        camera = index.camera
        if camera.medium is None:
            return ()
        time = surroundings.moment(camera)
        origin = surroundings.camera_origin(camera, index.film, time)
        media = surroundings.media_at(self.shapes, origin, time, self.cache)
        return () if camera.medium in media else (camera.medium,)

    def open_medium(self) -> Medium | None:
        """Return a medium whose boundary has a hole at some time, None if all are closed."""
        times = self.times[:1] if self.still else self.times
        media = (surroundings.open_medium(self.shapes, time, self.cache) for time in times)
        return next((medium for medium in media if medium is not None), None)

    def around(
        self, p: NDArray[np.float64], keys: Keys | None, times: Sequence[float] = ()
    ) -> Around | None:
        """Return the media or the bodies at a point (3,) [m] that moves by keys.

        times: by default all times of the test of motion. None if the media change with the time.
        """
        first: Around | None = None
        times = times or self.times
        for time in times[:1] if self.still and keys is None else times:
            at = p if keys is None else transforms.transform_points(keys.at(time), p)
            surrounding = self._at(np.asarray(at, np.float64), time)
            if first is not None and surrounding != first:
                return None
            first = surrounding
        return first

    def _at(self, p: NDArray[np.float64], time: float) -> Around:
        if self.nested:
            return surroundings.bodies_at(self.shapes, matter_of, p, time, self.cache)
        fillings = surroundings.media_at(self.shapes, p, time, self.cache)
        return surroundings.for_rays(fillings, self.elsewhere)


def _around_shape(emitter: Emitter, boundaries: _Boundaries, number: int) -> Around | None:
    """Return the media into which a shape emits, None if they differ between points or times.

    number: of the shape in the scene's motions.
    """
    shape, motions = emitter.shape, boundaries.motions
    two_sided = shape.emission is not None and shape.emission.two_sided
    if boundaries.nested and matter_of(shape) is not None:
        return None
    if not boundaries.nested and surroundings.bounds_media(shape):
        if two_sided and shape.interior is not shape.exterior:
            return None
        return shape.exterior, None
    offsets = (OFFSET, -OFFSET) if two_sided else (OFFSET,)
    keys = motions.shapes.get(number)
    if emitter.keys == 1:
        media = [boundaries.around(p, keys) for o in offsets for p in _points_before(emitter, o)]
    else:
        media = [
            boundaries.around(p, keys, (time,))
            for deformed, time in _deformed(emitter, motions.deforming[number], boundaries.times)
            for offset in offsets
            for p in _points_before(deformed, offset)
        ]
    return media[0] if all(surrounding == media[0] for surrounding in media) else None


def _deformed(
    emitter: Emitter, key_times: Sequence[float], times: Sequence[float]
) -> Iterator[tuple[Emitter, float]]:
    """Yield a deforming shape at each time; key_times: of its rows of vertices."""
    assert emitter.vertices is not None and emitter.faces is not None
    rows = emitter.vertices.reshape(-1, emitter.keys, 3)
    deformation = Deformation(key_times, np.moveaxis(rows, 1, 0))
    faces = emitter.faces // np.uint32(emitter.keys)
    for time in times:
        yield replace(emitter, vertices=deformation.at(time)[0], faces=faces, keys=1), time


def _points_before(emitter: Emitter, offset: float) -> NDArray[np.float64]:
    """Return some points before an emitting shape, behind it for a negative offset (n, 3) [m]."""
    shape, vertices, faces = emitter.shape, emitter.vertices, emitter.faces
    six = np.concatenate([np.eye(3), -np.eye(3)])
    if shape.kind == "sphere" and vertices is None:
        low, high = analytic.bounds(shape)
        offset *= -1.0 if shape.flip_normals else 1.0
        return (low + high) / 2.0 + (0.5 + offset) * (high - low) * six
    if vertices is not None and faces is None:
        balls = np.asarray(vertices, np.float64)[:: max(1, len(vertices) // POINTS)]
        return (balls[:, None, :3] + (1.0 + offset) * balls[:, None, 3:] * six).reshape(-1, 3)
    if vertices is None or faces is None:
        vertices, faces = winding.triangles_of(shape)
    chosen = np.asarray(faces)[:: max(1, len(faces) // POINTS)]
    a, b, c = np.moveaxis(np.asarray(vertices, np.float64)[chosen], 1, 0)
    n = np.cross(b - a, c - a)
    size = np.sqrt(np.linalg.norm(n, axis=1, keepdims=True))
    return (a + b + c) / 3.0 + offset * n / np.maximum(size, 1e-30)
