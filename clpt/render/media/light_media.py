"""The media around lights, where paths that start there begin.

A lamp at a place is in what boundaries put there. A shape shines into what its `exterior` names,
else into what is at some points just before it: these must agree.
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
from clpt.geometry.motion import Motions
from clpt.render.geometry import surroundings
from clpt.render.geometry.find import Emitter, Geometry
from clpt.render.lights.find import Sources, row_order
from clpt.render.media.bodies import matter_of
from clpt.render.records.lowering_cache import LoweringCache
from clpt.render.scene_index import SceneIndex
from clpt.scene.lights import Light
from clpt.scene.media import Lattice, Medium
from clpt.scene.motion import Deformation, Keys
from clpt.scene.shapes import Shape

POINTS = 6  # of a shape that shines
BEFORE = 1e-4  # how far before it they are, over its size
AFAR = 1e4  # radii of the scene: a place that stands for infinity
CROSSES = "{} comes into another medium while the shutter is open"
STRADDLES = "{} lies in more than one medium, or does not know its bounds"

Around = tuple[Any, ...]  # media, or the matter of bodies


class LightMedia(NamedTuple):
    """The media around the lights of a scene.

    around: of each lamp and shape that shines the media around it, and how many rows it has;
    refusal: why no paths can start at some light, "" if they can; extinction (n,): of each row,
    that of the medium that scatters its light, else 0 [1/m]; nan where its density is on a grid.
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
    """Return the media around all lights of a scene that has media; the rest as of `around`."""
    try:
        found = around(index, geometry, sphere, cache)
    except Unknown as reason:
        return NOWHERE._replace(refusal=str(reason))
    ends = (*sources.first, len(sources.power))[1:]
    counts = [1] * len(sources.order)
    counts += [end - first for first, end in zip(sources.first, ends, strict=True)]
    rows = tuple(zip(found, counts, strict=True))
    extinction = np.concatenate(
        [np.zeros(0), *(np.full(count, _extinction(there)) for there, count in rows)]
    )
    return LightMedia(rows, "", extinction)


class Unknown(Exception):
    """Why no paths can start at some light; where: that light, "" where it is none's own."""

    def __init__(self, reason: str, where: str = ""):
        super().__init__(reason)
        self.where = where


def around(
    index: SceneIndex,
    geometry: Geometry,
    sphere: tuple[NDArray[np.float64], float],
    cache: LoweringCache,
) -> list[Around]:
    """Return the media around each lamp, in the order of rows, and each shape that shines.

    geometry: of the shapes that shine; sphere: centre and radius of one around the scene [m].
    What moves is looked at again and again while the shutter is open. Raises Unknown for a light
    that is not in one medium which is known, and for media that give out light.
    """
    if index.emitting:
        name = index.emitting[0].name or index.emitting[0].kind
        raise Unknown(f"no path starts in the medium {name!r}, which gives out light")
    known = _Known(index, cache)
    hole = None if index.nested else known.open_medium()
    unknown = (
        ""
        if hole is None
        else (
            f"the boundary of the medium {hole.name or hole.kind!r} is not closed, so that nobody "
            "knows whether {} is in it"
        )
    )
    afar = sphere[0] + AFAR * sphere[1] * np.ones(3)
    lamps = [
        _around_lamp(i, index.lights[i], known, afar, unknown) for i in row_order(index.lights)
    ]
    return lamps + [
        _around_emitter(one, known, index, geometry, unknown) for one in geometry.emitters
    ]


def _around_lamp(
    i: int, lamp: Light, known: _Known, afar: NDArray[np.float64], unknown: str
) -> Around:
    """The media around a lamp; afar: a point (3,) that stands for infinity; unknown: where a
    boundary is open, what to say of a light. Raises Unknown."""
    name = f"lights[{i}]"
    if unknown:
        raise Unknown(unknown.format(name))
    if lamp.reach == "placed":
        bounds, keys = lamp.bounds(), known.motions.lamps.get(i)
        if bounds is None:
            raise Unknown(STRADDLES.format(name), name)
        corners = itertools.product(*zip(bounds.low, bounds.high, strict=True))
        first, *others = (known.along(np.array(corner), keys) for corner in dict.fromkeys(corners))
        if first is None or None in others:
            raise Unknown(CROSSES.format(name), name)
        if any(other != first for other in others):
            raise Unknown(STRADDLES.format(name), name)
        return first
    found = known.along(afar, None)
    if found or found is None:
        reason = f"the light of {name} comes from infinity, where a medium has no end"
        raise Unknown(reason, name)
    return found


def _around_emitter(
    emitter: Emitter, known: _Known, index: SceneIndex, geometry: Geometry, unknown: str
) -> Around:
    """The media that a shape shines into; unknown: as of `_around_lamp`. Raises Unknown."""
    name = shapes.where(emitter.shape)
    if unknown and not _says(emitter.shape):
        raise Unknown(unknown.format(name))
    number = int(geometry.rows[emitter.shape_row]["number"])
    into = _around_shape(emitter, known, index.motions, number)
    if into is None:
        moving = " while the shutter is open" if index.motions.moving else ""
        raise Unknown(f"{name} shines into more than one medium{moving}", name)
    return into


def _extinction(around: Around) -> float:
    """The extinction of a medium, which is the first, or that in the first bodies [1/m].

    0 of one that scatters no light, nan of one whose density is on a grid.
    """
    media = (one[-1] if isinstance(one, tuple) else one for one in around[:1])
    medium = next((one for one in media if one is not None and one.scatters), None)
    if medium is None or isinstance(medium, Lattice):
        return 0.0 if medium is None else float("nan")
    both = [one.to_rgb("unbounded") for one in medium.coefficients(spectral=False)]
    return float(np.mean(np.add(*both)))


class _Known:
    """Boundaries of a scene, which are asked which media or matter are at its points."""

    def __init__(self, index: SceneIndex, cache: LoweringCache):
        self.nested, self.cache, self.motions = index.nested, cache, index.motions
        matter = matter_of if self.nested else None
        self.bounding = surroundings.boundaries(index.listed, matter)
        self.looks = self.motions.looks()
        self.still = surroundings.stands_still(self.bounding)
        # A camera's medium that no boundary holds is wherever there is no other.
        self.rest: Around = ()
        camera = index.camera
        named = camera.medium
        if named is not None and not self.nested:
            time = surroundings.moment(camera)
            origin = surroundings.camera_origin(camera, index.film, time)
            found = surroundings.media_at(self.bounding, origin, time, cache)
            self.rest = () if named in found else (named,)

    def open_medium(self) -> Medium | None:
        """A medium whose boundary has a hole at some time."""
        times = self.looks[:1] if self.still else self.looks
        found = (surroundings.open_medium(self.bounding, time, self.cache) for time in times)
        return next((one for one in found if one is not None), None)

    def along(
        self, p: NDArray[np.float64], keys: Keys | None, times: Sequence[float] = ()
    ) -> Around | None:
        """The media at a point (3,) [m] that moves by keys, that which counts first; or the bodies.

        times: at which it is looked, by default all of them. None where what is found changes.
        """
        first: Around | None = None
        looks = times or self.looks
        for time in looks[:1] if self.still and keys is None else looks:
            at = p if keys is None else transforms.transform_points(keys.at(time), p)
            found = self._at(np.asarray(at, np.float64), time)
            if first is not None and found != first:
                return None
            first = found
        return first

    def _at(self, p: NDArray[np.float64], time: float) -> Around:
        if self.nested:
            return surroundings.bodies_at(self.bounding, matter_of, p, time, self.cache)
        return surroundings.media_at(self.bounding, p, time, self.cache)[:1] or self.rest


def _around_shape(emitter: Emitter, known: _Known, motions: Motions, number: int) -> Around | None:
    """Return the media that a shape shines into, None if they differ between places or times."""
    shape = emitter.shape
    both = shape.emission is not None and shape.emission.two_sided
    if known.nested and matter_of(shape) is not None:
        return None
    if not known.nested and _says(shape):
        if both and shape.interior is not shape.exterior:
            return None
        return () if shape.exterior is None else (shape.exterior,)
    sides = (BEFORE, -BEFORE) if both else (BEFORE,)
    keys = motions.shapes.get(number)
    if emitter.keys == 1:
        found = [known.along(p, keys) for side in sides for p in _before(emitter, side)]
    else:
        found = [
            known.along(p, keys, (time,))
            for one, time in _deformed(emitter, motions.deforming[number], known.looks)
            for side in sides
            for p in _before(one, side)
        ]
    return found[0] if all(one == found[0] for one in found) else None


def _deformed(
    emitter: Emitter, times: Sequence[float], looks: Sequence[float]
) -> Iterator[tuple[Emitter, float]]:
    """A shape that deforms as it is at each time of looks; times: of its rows of vertices."""
    assert emitter.vertices is not None and emitter.faces is not None
    rows = emitter.vertices.reshape(-1, emitter.keys, 3)
    way = Deformation(times, np.moveaxis(rows, 1, 0))
    faces = emitter.faces // np.uint32(emitter.keys)
    for time in looks:
        yield replace(emitter, vertices=way.at(time)[0], faces=faces, keys=1), time


def _says(shape: Shape) -> bool:
    """Whether a shape says itself in which media it stands."""
    return shape.interior is not None or shape.exterior is not None


def _before(emitter: Emitter, before: float) -> NDArray[np.float64]:
    """Some points before a shape that shines, or behind it (n, 3) [m]."""
    shape, vertices, faces = emitter.shape, emitter.vertices, emitter.faces
    six = np.concatenate([np.eye(3), -np.eye(3)])
    if shape.kind == "sphere" and vertices is None:
        low, high = analytic.bounds(shape)
        before *= -1.0 if shape.flip_normals else 1.0
        return (low + high) / 2.0 + (0.5 + before) * (high - low) * six
    if vertices is not None and faces is None:
        balls = np.asarray(vertices, np.float64)[:: max(1, len(vertices) // POINTS)]
        return (balls[:, None, :3] + (1.0 + before) * balls[:, None, 3:] * six).reshape(-1, 3)
    if vertices is None or faces is None:
        vertices, faces = winding.triangles_of(shape)
    chosen = np.asarray(faces)[:: max(1, len(faces) // POINTS)]
    a, b, c = np.moveaxis(np.asarray(vertices, np.float64)[chosen], 1, 0)
    n = np.cross(b - a, c - a)
    size = np.sqrt(np.linalg.norm(n, axis=1, keepdims=True))
    return (a + b + c) / 3.0 + before * n / np.maximum(size, 1e-30)
