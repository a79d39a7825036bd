"""The medium around the camera, or a light: found by how often boundaries wind around it.

A closed boundary fills the whole sphere of directions around a point inside, 4 pi, and on balance
nothing of it around a point outside. So a medium fills a point where the shapes that have it inside
wind once more around it than those that have it outside; of one that nothing encloses, as its
signed volume tells, they wind as often. A boundary may have several parts, as a
tube and two disks, and no ray can slip between its triangles.

What moves while the shutter is open is met at a time [s]: the point is taken back to where a shape
was lowered. By default that time is when the shutter opens.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.geometry import shapes, winding
from clpt.geometry.motion import AT_ONCE, corners
from clpt.geometry.triangles import at_time
from clpt.geometry.winding import box
from clpt.scene import Film, Scene
from clpt.scene.cameras import Camera
from clpt.scene.media import Medium
from clpt.scene.shapes import Instance, Shape

MOST_COMPARED = 500  # bodies whose boxes are compared
OPEN = 1e-2  # of its area: what a closed boundary may lack


def media_around(
    scene: Scene, cached: Callable[..., Any] | None = None, time: float | None = None
) -> tuple[Medium, ...]:
    """Return the media at the camera, of the smallest extent first; the named one alone.

    cached: `LoweringCache`, which keeps the triangles of boundaries. Raises SceneError for shapes
    and cameras that make no sense.
    """
    camera, time = scene.camera, moment(scene.camera, time)
    if camera.medium is not None:
        return (camera.medium,)
    return media_at(scene.shapes, camera_origin(camera, scene.film, time), time, cached)


def media_at(
    placed: Sequence[Shape],
    p: NDArray[np.float64],
    time: float,
    cached: Callable[..., Any] | None = None,
) -> tuple[Medium, ...]:
    """Return the media that boundaries put at a point (3,) [m], of the smallest extent first."""
    bounding = [shape for shape in every(placed) if bounds_media(shape)]
    turns: dict[Medium, float] = {}
    extents: dict[Medium, float] = {}
    bounds: dict[Medium, list[NDArray[np.float64]]] = {}
    parts: dict[Medium, list[tuple[float, Shape]]] = {}
    for shape in bounding:
        low, high = _swept_box(shape, cached, time)
        for medium, sign in ((shape.interior, 1.0), (shape.exterior, -1.0)):
            if medium is not None:
                parts.setdefault(medium, []).append((sign, shape))
                bounds.setdefault(medium, []).append(np.stack([low, high]))
    for medium, own in parts.items():
        low = np.min([box[0] for box in bounds[medium]], axis=0)
        high = np.max([box[1] for box in bounds[medium]], axis=0)
        outside = any(sign < 0.0 for sign, _ in own)
        endless = outside and sum(sign * winding.volume(shape, cached) for sign, shape in own) < 0.0
        turns[medium] = 1.0 if endless else 0.0
        extents[medium] = np.inf if endless else float(np.linalg.norm(high - low))
        if ((p >= low) & (p <= high)).all():
            turns[medium] += sum(sign * _winding(shape, p, cached, time) for sign, shape in own)
    found = [medium for medium, number in turns.items() if number > 0.5]
    return tuple(sorted(found, key=lambda medium: extents[medium]))


def open_medium(
    placed: Sequence[Shape], time: float, cached: Callable[..., Any] | None = None
) -> Medium | None:
    """Return a medium whose boundary has a hole, None where all are closed.

    The areas of a closed surface, each along its normal, add up to nothing.
    """
    sums: dict[Medium, NDArray[np.float64]] = {}
    for shape in every(placed):
        then = _then(shape, time)
        to_world = None if shape.motion is None else shape.motion.at(time)
        area = winding.areas(then, cached if then is shape else None, to_world)
        for medium, sign in ((shape.interior, 1.0), (shape.exterior, -1.0)):
            if medium is not None:
                signed = area * np.array([sign, sign, sign, 1.0])
                sums[medium] = sums.get(medium, np.zeros(4)) + signed
    for medium, total in sums.items():
        if np.linalg.norm(total[:3]) > OPEN * total[3]:
            return medium
    return None


def bodies_around(
    scene: Scene,
    matter: Callable[[Shape], tuple[Any, ...] | None],
    cached: Callable[..., Any] | None = None,
    time: float | None = None,
) -> tuple[tuple[Any, ...], ...]:
    """Return the matter of the bodies that the camera is in. Raises as `media_around`.

    matter: of a shape's body, None of a shape that is none. What a body has inside of it faces it,
    as the inner side of a glass does.
    """
    time = moment(scene.camera, time)
    origin = camera_origin(scene.camera, scene.film, time)
    return bodies_at(scene.shapes, matter, origin, time, cached)


def bodies_at(
    placed: Sequence[Shape],
    matter: Callable[[Shape], tuple[Any, ...] | None],
    p: NDArray[np.float64],
    time: float,
    cached: Callable[..., Any] | None = None,
) -> tuple[tuple[Any, ...], ...]:
    """Return the matter of the bodies at a point (3,) [m]; matter: as of `bodies_around`."""
    turns: dict[tuple[Any, ...], float] = {}
    for shape in every(placed, lambda one: matter(one) is not None):
        own = matter(shape)
        if own is not None:
            low, high = _swept_box(shape, cached, time)
            within = ((p >= low) & (p <= high)).all()
            turned = _winding(shape, p, cached, time) if within else 0.0
            turns[own] = turns.get(own, 0.0) + turned
    return tuple(own for own, number in turns.items() if number > 0.5)


def warnings_of(found: tuple[Any, ...]) -> list[str]:
    """Return a warning where a camera is in several media, else none."""
    if len(found) < 2:
        return []
    names = " and ".join(repr(medium.name or medium.kind) for medium in found)
    return [
        f"camera: it is in {len(found)} media at once, {names}; the one of the smallest extent is "
        "taken. Name one by camera.medium, or the outer one by the inner shape's exterior"
    ]


def bounds_media(shape: Shape) -> bool:
    """Whether a shape says what is on its sides."""
    return shape.interior is not None or shape.exterior is not None


def contested(
    placed: Sequence[Shape],
    matter: Callable[[Shape], tuple[Any, ...] | None],
    cached: Callable[..., Any] | None = None,
) -> list[str]:
    """Return a warning where bodies of one priority, but not of one matter, may overlap.

    matter: as of `bodies_around`; its first entry is the priority.
    """
    boxes: list[tuple[tuple[Any, ...], Shape, NDArray[Any], NDArray[Any]]] = []
    for shape in every(placed, lambda one: matter(one) is not None):
        own = matter(shape)
        if own is None or len(boxes) >= MOST_COMPARED:
            continue
        low, high = box(shape, cached)
        for other, second, other_low, other_high in boxes:
            if other[0] != own[0] or other == own:
                continue
            common = np.minimum(high, other_high) - np.maximum(low, other_low)
            if (common > 1e-5 * (high - low)).all():
                return [
                    f"{shapes.where(second)} and {shapes.where(shape)}: their boxes overlap, and "
                    f"both have the priority {own[0]}; where the bodies overlap too, the latter "
                    "fills the place"
                ]
        boxes.append((own, shape, low, high))
    return []


def every(
    placed: Sequence[Shape], bounds: Callable[[Shape], bool] = bounds_media
) -> Iterator[Shape]:
    """Return the shapes of a scene that may bound media.

    Those of instances are where they are placed, with their motion.
    """
    for thing in placed:
        if not isinstance(thing, Instance):
            yield thing
            continue
        for shape in thing.group.shapes:
            if bounds(shape):
                matrix = shapes.placement(thing) @ shapes.placement(shape)
                yield dataclasses.replace(shape, to_world=matrix, motion=thing.motion)


def boundaries(
    placed: Sequence[Shape], matter: Callable[[Shape], tuple[Any, ...] | None] | None = None
) -> list[Shape]:
    """Return nothing but the boundaries of media, or of bodies, where they are placed.

    matter: of bodies, as of `bodies_around`; None: of media.
    """

    def wanted(shape: Shape) -> bool:
        return bounds_media(shape) if matter is None else matter(shape) is not None

    return [shape for shape in every(placed, wanted) if wanted(shape)]


def stands_still(bounding: Sequence[Shape]) -> bool:
    """Whether none of these `boundaries` moves or deforms."""
    moving = ((one.motion, one.deformation) for one in bounding)
    return all(keys is None and points is None for keys, points in moving)


def camera_origin(camera: Camera, film: Film, time: float) -> NDArray[np.float64]:
    """The point from which a camera sees at a time [s], see `Camera.view_point`."""
    origin = camera.view_point(film.width, film.height)
    if camera.motion is None:
        return origin
    matrix = camera.motion.at(time)
    return np.asarray(transforms.transform_points(matrix, origin), np.float64)


def moment(camera: Camera, time: float | None = None) -> float:
    """A time, by default that when the shutter opens [s]."""
    return (camera.shutter or AT_ONCE).open if time is None else time


def _then(shape: Shape, time: float) -> Shape:
    """A shape whose points are where they are at a time, before what its keys do."""
    return shape if shape.deformation is None else at_time(shape, time)


def _swept_box(
    shape: Shape, cached: Callable[..., Any] | None, time: float
) -> tuple[NDArray[Any], NDArray[Any]]:
    """The lowest and the highest corner of a box around a shape at a time."""
    then = _then(shape, time)
    low, high = box(then, cached if then is shape else None)
    if shape.motion is None or not np.isfinite([low, high]).all():
        return low, high
    hull = transforms.transform_points(shape.motion.at(time), corners(np.array([[low, high]]))[0])
    return hull.min(axis=0), hull.max(axis=0)


def _winding(
    shape: Shape, p: NDArray[np.float64], cached: Callable[..., Any] | None, time: float
) -> float:
    """Return how often a shape winds around a point: 1 inside, if closed and facing outward."""
    then = _then(shape, time)
    if shape.motion is not None:
        p = transforms.transform_points(transforms.inverse(shape.motion.at(time)), p)
    if cached is None or then is not shape:
        return winding.winding(then, p, None)
    by = (*shapes.geometry(shape), p.tobytes())
    return float(cached(winding.winding, shape, p, cached, by=by))
