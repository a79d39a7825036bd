"""The media around a point, such as the camera, from the winding numbers of their boundaries.

A body whose material absorbs fills its inside as a medium does.

A closed boundary subtends the solid angle 4 pi at a point inside, and 0, signed, at a point
outside. So a medium fills a point if the shapes with this interior wind around the point once more
than the shapes with this exterior. A medium whose signed volume is negative extends to infinity: it
fills a point if both wind equally often. A boundary may have several parts, such as a tube and two
disks; no ray can slip between its triangles.

For moving shapes the caller states a time [s], by default when the shutter opens: the point moves
back to the place where a shape was lowered.

A ray knows its medium from the boundaries that it crosses. If it passes through a hole, its medium
is undefined: paths from the camera and paths from lights may assume different media, and their
pictures differ. So holes are warned of. The edges of a hole have a triangle on a single side, or
triangles of opposite winding. Its size is the area that its edges enclose, so a vertex on the edge
of another triangle makes no hole.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from itertools import dropwhile, islice
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import on_device
from clpt.geometry import shapes, winding
from clpt.geometry.motion import AT_ONCE, corners
from clpt.geometry.winding import box, triangles_of
from clpt.render.records.tables import LoweringCache
from clpt.render.scene_index import SceneIndex
from clpt.render.spectra.slopes import Slope
from clpt.scene import Film, Scene
from clpt.scene import materials as mt
from clpt.scene.cameras import Camera
from clpt.scene.media import Medium
from clpt.scene.params import fields_of
from clpt.scene.shapes import Cylinder, Disk, Shape
from clpt.spectra import RGB, Constant, RGBUnbounded, Spectrum, index

MOST_COMPARED = 500  # bodies whose boxes are compared
NEAR = 1e-3  # least winding number of the boundaries around a point, of a filling of many bodies
SODIUM = 589.3  # [nm] handbooks give indices for this wavelength
OPEN = 1e-2  # largest sum of area vectors of a closed boundary, over its area

# The matter of a shape's body, whose first entry is its priority; None for a shape without a body.
MatterOf = Callable[[Shape], "tuple[Any, ...] | None"]


@dataclasses.dataclass(frozen=True)
class Absorber:
    """The inside of a body whose material absorbs, and which names no media."""

    absorption: Spectrum
    scatters: ClassVar[bool] = False

    @classmethod
    def of(cls, shape: Shape) -> Absorber | None:
        """Return the inside of a shape, None if it names media or absorbs nothing."""
        if bounds_media(shape):
            return None
        for part in mt.parts(shape.material):
            absorption = cast(Spectrum, part.absorption)
            if part.absorbs_inside and not part.is_sheet and not _is_clear(absorption):
                return cls(absorption)
        return None


Filling = Medium | Absorber


def _is_clear(absorption: Spectrum) -> bool:
    """Whether an absorption is a number or a colour of zeros."""
    plain = isinstance(absorption, Constant | RGB | RGBUnbounded)
    return plain and not np.any(absorption.to_rgb("unbounded"))


def media_around(scene: Scene, cached: LoweringCache | None = None) -> tuple[Filling, ...]:
    """Return what fills the camera's place, as `media_at` does, or `camera.medium`.

    camera.medium is taken to be around a body that absorbs. cached: keeps the triangles of
    boundaries. Raises SceneError for invalid shapes and cameras.
    """
    camera, time = scene.camera, moment(scene.camera)
    fillings = media_at(scene.shapes, camera_origin(camera, scene.film, time), time, cached)
    if camera.medium is not None:
        fillings = (*(f for f in fillings[:1] if isinstance(f, Absorber)), camera.medium)
    return fillings


def for_rays(
    fillings: Sequence[Filling], elsewhere: tuple[Medium, ...] = ()
) -> tuple[Filling | None, Filling | None]:
    """Return the filling in which rays from a point begin, and that around the first absorber.

    A ray that leaves an absorber comes into the latter. fillings: of `media_at`; elsewhere: the
    medium of places that nothing fills.
    """
    every = [*fillings, *elsewhere]
    beyond = dropwhile(lambda filling: not isinstance(filling, Absorber), every)
    return next(iter(every), None), next(islice(beyond, 1, None), None)


def media_at(
    placed: Sequence[Shape],
    p: NDArray[np.float64],
    time: float,
    cached: LoweringCache | None = None,
) -> tuple[Filling, ...]:
    """Return what fills a point (3,) [m], by ascending extent: media, and bodies that absorb."""
    sides: dict[Filling, list[tuple[float, Shape]]] = {}
    for shape in every(placed, fills):
        for filling, sign in (
            (shape.interior, 1.0), (shape.exterior, -1.0), (Absorber.of(shape), 1.0),
        ):  # fmt: skip
            if filling is not None:
                sides.setdefault(filling, []).append((sign, shape))
    extents = {filling: _extent(parts, p, time, cached) for filling, parts in sides.items()}
    around = {filling: extent for filling, extent in extents.items() if extent is not None}
    return tuple(sorted(around, key=around.__getitem__))


def _extent(
    sides: Sequence[tuple[float, Shape]],
    p: NDArray[np.float64],
    time: float,
    cached: LoweringCache | None,
) -> float | None:
    """Return the extent [m] of a filling around a point (3,), None if it does not fill the point.

    sides: its boundaries, and 1 where it is inside of them, else -1.
    """
    boxes = np.array([_swept_box(shape, cached, time) for _, shape in sides])
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    volumes = (sign * winding.volume(shape, cached) for sign, shape in sides)
    endless = any(sign < 0.0 for sign, _ in sides) and sum(volumes) < 0.0
    windings = np.zeros(len(sides))
    if ((p >= low) & (p <= high)).all():
        windings[:] = [sign * _winding(shape, p, cached, time) for sign, shape in sides]
    if endless + windings.sum() <= 0.5:
        return None
    near = boxes[np.abs(windings) > NEAR]
    return np.inf if endless else float(np.linalg.norm(near[:, 1].max(0) - near[:, 0].min(0)))


def open_medium(
    placed: Sequence[Shape], time: float, cached: LoweringCache | None = None
) -> Medium | None:
    """Return a medium whose boundary has a hole; None if all boundaries are closed.

    The area vectors of a closed surface add up to zero.
    """
    sums: dict[Medium, NDArray[np.float64]] = {}
    for shape in every(placed):
        then = _deformed(shape, time)
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
    scene: Scene, matter: MatterOf, cached: LoweringCache | None = None
) -> tuple[tuple[Any, ...], ...]:
    """Return the matter of the bodies around the camera. Raises as `media_around` does.

    A shape inside of a body faces it, as the inner side of a glass does.
    """
    time = moment(scene.camera)
    origin = camera_origin(scene.camera, scene.film, time)
    return bodies_at(scene.shapes, matter, origin, time, cached)


def bodies_at(
    placed: Sequence[Shape],
    matter: MatterOf,
    p: NDArray[np.float64],
    time: float,
    cached: LoweringCache | None = None,
) -> tuple[tuple[Any, ...], ...]:
    """Return the matter of the bodies around a point (3,) [m]."""
    numbers: dict[tuple[Any, ...], float] = {}  # winding numbers
    for shape in boundaries(placed, matter):
        body = matter(shape)
        if body is not None:
            low, high = _swept_box(shape, cached, time)
            within = ((p >= low) & (p <= high)).all()
            number = _winding(shape, p, cached, time) if within else 0.0
            numbers[body] = numbers.get(body, 0.0) + number
    return tuple(body for body, number in numbers.items() if number > 0.5)


def index_around(scene: Scene, cached: LoweringCache | None = None) -> tuple[float, float]:
    """Return the index of refraction at the camera's place, and its `Slope`, at sodium's line.

    Outside of all bodies they are 1 and 0. Bodies lie one in another, or have a priority: then the
    highest fills the place. Raises as `media_around` does.
    """
    time = moment(scene.camera)
    p = camera_origin(scene.camera, scene.film, time)
    factors: dict[int, tuple[float, float]] = {}  # by priority
    for shape in every(scene.shapes, lambda shape: _bends(shape) != 1.0):
        low, high = _swept_box(shape, cached, time)
        if _bends(shape) != 1.0 and ((p >= low) & (p <= high)).all():
            turns = round(_winding(shape, p, cached, time))
            factor, slope = factors.get(shape.priority, (1.0, 0.0))
            slopes = filter(None, map(Slope.of, mt.parts(shape.material)))
            more = sum(float(each.sample(SODIUM)) for each in slopes)
            factors[shape.priority] = factor * _bends(shape) ** turns, slope + more * turns
    return factors[max(factors)] if factors else (1.0, 0.0)


def _bends(shape: Shape) -> float:
    """Return the index behind the boundary of a shape, over that before it; 1 of a sheet."""
    for part in mt.parts(shape.material):
        inside = float(index(cast("Spectrum | str", part.inside_index)).sample(SODIUM))
        if part.transmits and not part.is_sheet and inside > 0.0:
            outside = index(fields_of(part).get("ext_ior", Constant(1.0)))
            return inside / float(outside.sample(SODIUM))
    return 1.0


def warnings_of(around: tuple[Filling, ...]) -> list[str]:
    """Return a warning if the camera is in several media, else an empty list."""
    media = [filling for filling in around if isinstance(filling, Medium)]
    if len(media) < 2:
        return []
    names = " and ".join(repr(medium.name or medium.kind) for medium in media)
    return [
        f"camera: it is in {len(media)} media at once, {names}; the one of the smallest extent is "
        "taken. Name one by camera.medium, or the outer one by the inner shape's exterior"
    ]


def bounds_media(shape: Shape) -> bool:
    """Return whether a shape names a medium on either side."""
    return shape.interior is not None or shape.exterior is not None


def fills(shape: Shape) -> bool:
    """Return whether a shape names a medium, or its inside absorbs."""
    return bounds_media(shape) or Absorber.of(shape) is not None


def contested(
    placed: Sequence[Shape],
    matter: MatterOf,
    cached: LoweringCache | None = None,
) -> list[str]:
    """Return a warning if bodies of equal priority and different matter may overlap."""
    boxes: list[tuple[tuple[Any, ...], Shape, NDArray[Any], NDArray[Any]]] = []
    for shape in boundaries(placed, matter):
        body = matter(shape)
        if body is None or len(boxes) >= MOST_COMPARED:
            continue
        low, high = box(shape, cached)
        for other, second, other_low, other_high in boxes:
            if other[0] != body[0] or other == body:
                continue
            common = np.minimum(high, other_high) - np.maximum(low, other_low)
            if (common > 1e-5 * (high - low)).all():
                return [
                    f"{shapes.where(second)} and {shapes.where(shape)}: their boxes overlap, and "
                    f"both have the priority {body[0]}; where the bodies overlap too, the latter "
                    "fills the place"
                ]
        boxes.append((body, shape, low, high))
    return []


def every(
    placed: Sequence[Shape], bounds: Callable[[Shape], bool] = bounds_media
) -> Iterator[Shape]:
    """Yield all shapes that are no instances, and shapes of groups that pass `bounds`.

    A shape of a group comes once for each instance, at its place and with its motion.
    """
    for outer in placed:
        for shape in outer.members:
            if shape is outer:
                yield shape
            elif bounds(shape):
                matrix = shapes.placement(outer) @ shapes.placement(shape)
                yield dataclasses.replace(shape, to_world=matrix, motion=outer.motion)


def boundaries(placed: Sequence[Shape], matter: MatterOf | None = None) -> list[Shape]:
    """Return the boundaries of bodies, or of fillings without `matter`, where they are placed."""

    def wanted(shape: Shape) -> bool:
        return fills(shape) if matter is None else matter(shape) is not None

    return [shape for shape in every(placed, wanted) if wanted(shape)]


def stands_still(bounding: Sequence[Shape]) -> bool:
    """Return whether none of these `boundaries` moves or deforms."""
    return all(shape.motion is None and shape.deformation is None for shape in bounding)


def camera_origin(camera: Camera, film: Film, time: float) -> NDArray[np.float64]:
    """Return a camera's `view_point` (3,) [m] at a time [s]."""
    origin = camera.view_point(film.width, film.height)
    if camera.motion is None:
        return origin
    matrix = camera.motion.at(time)
    return np.asarray(transforms.transform_points(matrix, origin), np.float64)


def camera_halfway(index: SceneIndex) -> NDArray[np.float64]:
    """Return where the camera is in the middle of the shutter's time (3,) [m]."""
    shutter = index.motions.shutter
    return camera_origin(index.camera, index.film, (shutter.open + shutter.close) / 2.0)


def moment(camera: Camera) -> float:
    """Return the time [s] when the shutter opens."""
    return (camera.shutter or AT_ONCE).open


def _deformed(shape: Shape, time: float) -> Shape:
    """Return a shape with its points at a time, before its `motion`."""
    return shape if shape.deformation is None else shape.at_time(time)


def _swept_box(
    shape: Shape, cached: LoweringCache | None, time: float
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the lowest and the highest corner of a box around a shape at a time."""
    then = _deformed(shape, time)
    low, high = box(then, cached if then is shape else None)
    if shape.motion is None or not np.isfinite([low, high]).all():
        return low, high
    hull = transforms.transform_points(shape.motion.at(time), corners(np.array([[low, high]]))[0])
    return hull.min(axis=0), hull.max(axis=0)


def _winding(
    shape: Shape, p: NDArray[np.float64], cached: LoweringCache | None, time: float
) -> float:
    """Return a shape's winding number at a point: 1 inside if it is closed and faces outward."""
    then = _deformed(shape, time)
    if shape.motion is not None:
        p = transforms.transform_points(transforms.inverse(shape.motion.at(time)), p)
    if cached is None or then is not shape:
        return winding.winding(then, p, None)
    by = (*shapes.geometry(shape), p.tobytes())
    return float(cached(winding.winding, shape, p, cached, by=by))


HOLE = 1e-4  # of a mesh's area: smaller holes are ignored
ROUND = Disk, Cylinder


def warnings_of_holes(index: SceneIndex, cached: LoweringCache | None = None) -> list[str]:
    """Return a warning if meshes with an inside are not closed, else an empty list."""
    suspects: list[tuple[Any, Shape]] = []
    for shape in index.shapes:
        if shape.vertices is not None and not on_device(shape.vertices):
            for inside in _insides(shape):
                known = any(inside == other for other, _ in suspects)
                if not known and _largest_hole(shape, cached) > HOLE:
                    suspects.append((inside, shape))
    shares = [(shape, hole_around(index, inside, cached)) for inside, shape in suspects]
    open_meshes = [(shape, share) for shape, share in shares if share > HOLE]
    if not open_meshes:
        return []
    (shape, share), more = open_meshes[0], len(open_meshes) - 1
    others = f", and {more} other{'s' * (more > 1)}" * (more > 0)
    return [
        f"{shapes.where(shape)}{others}: not closed, a hole has {100.0 * share:.2g}% of the area, "
        "but it has an inside that absorbs or scatters; where rays go through the hole what they "
        "are in is not defined, and integrators differ. Close the mesh, and turn its triangles to "
        "one side; or leave its medium or `absorption` out"
    ]


def _insides(shape: Shape) -> Iterator[Any]:
    """Yield the insides of a shape: its medium, or the absorptions of its materials."""
    if shape.interior is not None:
        yield shape.interior
        return
    for part in mt.parts(shape.material):
        if part.absorbs_inside and not part.is_sheet:
            yield part.absorption


def _largest_hole(shape: Shape, cached: LoweringCache | None) -> float:
    """Return the size of a shape's largest hole over the shape's area."""
    if cached is None:
        return winding.largest_hole(*triangles_of(shape))
    vertices, faces = triangles_of(shape, cached)
    share: float = cached(winding.largest_hole, vertices, faces)
    return share


def hole_around(index: SceneIndex, inside: object, cached: LoweringCache | None) -> float:
    """Return the size of the largest hole in all shapes around an inside, over their area."""
    around: list[tuple[float, Shape]] = []
    for shape in every(index.listed, lambda shape: True):
        around += [(1.0, shape)] * any(inside == other for other in _insides(shape))
        around += [(-1.0, shape)] * (shape.exterior is inside)
    if len(around) == 1:
        return _largest_hole(around[0][1], cached)
    if any(isinstance(shape, ROUND) for _, shape in around):
        return 0.0  # their rims have no edges
    points: list[NDArray[Any]] = []
    faces: list[NDArray[Any]] = []
    first = 0
    for sign, shape in around:
        if on_device(shape.vertices):
            return 0.0
        vertices, triangles = triangles_of(shape, cached)
        points.append(np.asarray(vertices, np.float64))
        faces.append(np.asarray(triangles, np.int64)[:, :: int(sign)] + first)
        first += len(vertices)
    return winding.largest_hole(winding.snapped(np.concatenate(points)), np.concatenate(faces))
