"""Openings of a room: rectangles through which the light of infinite lights comes in.

In a room most rays to a sky end at walls. So rays from surfaces around the camera find out where
they leave, before a render, and kernels/lights/openings.cl samples the light through rectangles
there, as portals do that other renderers ask their users for (Bitterli et al. 2015,
"Portal-Masked Environment Map Sampling", section 2). The light's own sampling goes on beside it,
so no light is lost where an opening was overlooked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.files import disk_cache
from clpt.geometry import casting
from clpt.render.geometry import surroundings
from clpt.render.geometry.find import Geometry
from clpt.render.records.lights import OPENING
from clpt.render.records.tables import LoweringCache
from clpt.render.scene_index import SceneIndex, leaves_of
from clpt.scene.cameras.camera import View

MOST_TRIANGLES = 1 << 16  # the largest ones
AROUND = 192  # rays from the camera
ONWARD, SECOND = 6, 256  # rays from each of their hits; second hits, from which rays go on
WIDE = 1.4  # [rad] from the view's axis, at most
MOST_SHARE = 0.8  # of the samples, if all rays that escape do so through the openings
OUTDOORS = 0.35  # share of escaping rays beyond which a place is no room
FEWEST = 8  # escaping rays of an opening
MOST = 6  # openings
SEEN = 0.3  # least share of escaping rays among the rays to an opening
WORTH = 3.0  # the same, over the share of all rays
CAPTURED = 0.9  # of escaping rays: no more rectangles are sought
WALLS, MOST_WALLS = 12, 1 << 14  # planes along an axis; triangles among which they are sought
SLICES = 256  # along an axis, whose walls count as one
LEAST = 0.1  # of the escaping rays: fewer are no reason for openings in a plane
STEEP = 0.15  # least component of a direction through a plane
MARGIN = 0.1  # of a side, around rays that escaped
SHRINK = 0.1  # of the rays through a box that a smaller box leaves out, in each step
AIMED, FINALLY = 512, 2048  # rays to a plane, for the choice of one, and for its openings
TRIED = 3  # planes
CELLS = 24  # along a side, for these rays
RARE = 0.25  # of the mean share: where less escapes at a side, the opening ends
FAR = 1e9  # [m] no room is so large
OFFSET = 1e-4  # of the size of the scene, from a surface


@dataclass(frozen=True)
class Rectangle:
    """An opening: its centre (3,) and its half edges (3,) [m]."""

    center: Floats
    x: Floats
    y: Floats


@dataclass(frozen=True)
class Openings:
    """The openings of a room, and the share of samples of infinite lights that go through them."""

    rectangles: tuple[Rectangle, ...] = ()
    share: float = 0.0

    def words(self) -> NDArray[np.uint32]:
        """Return their rows of clpt.render.records.lights.OPENING."""
        rows = np.zeros(len(self.rectangles), OPENING.dtype)
        for row, opening in zip(rows, self.rectangles, strict=True):
            x, y = opening.x, opening.y
            across = np.cross(x, y)
            half = np.linalg.norm(across)
            row["center"], row["n"], row["area"] = opening.center, across / half, 4.0 * half
            row["x"], row["y"], row["reach"] = x / (x @ x), y / (y @ y), np.sqrt(x @ x + y @ y)
        return rows.view(np.uint32)


CLOSED = Openings()


def openings_around(index: SceneIndex, geometry: Geometry, cache: LoweringCache) -> Openings:
    """Return the openings of the room around a scene's camera; none outdoors.

    Instances and analytic shapes do not count as walls; what rays to lights pass does not either.
    """
    lit = any(light.reach == "infinite" for light in index.lights)
    if index.shared or index.light_paths or not lit:
        return CLOSED
    eye = surroundings.camera_halfway(index)
    if not np.isfinite(eye).all():
        return CLOSED
    view = index.camera.view_of(index.film.width, index.film.height)
    where = (*eye.tolist(), *(view.axis.tolist() if view else ()), view.angle if view else 0.0)
    return cache(_openings, index, geometry, eye, view, by=(index.listed, *where))


def _sees_sky_beside(geometry: Geometry, eye: Floats) -> bool:
    """Return whether so many rays around a camera miss the box of all meshes that it is outdoors.

    It is so above a landscape, and costs less than the search.
    """
    if not len(geometry.mesh_corners):
        return True
    around = casting.sphere(np.random.default_rng(0), AROUND).T
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (geometry.mesh_corners - eye)[:, :, None] / around
        near, far = np.minimum(one, other).max(axis=0), np.maximum(one, other).min(axis=0)
    return int((np.maximum(near, 0.0) <= far).sum()) < (1.0 - OUTDOORS) * AROUND


def _openings(index: SceneIndex, geometry: Geometry, eye: Floats, view: View | None) -> Openings:
    if _sees_sky_beside(geometry, eye):
        return CLOSED
    walls = [
        geometry.vertices[geometry.faces[faces]]
        for shape, _, faces in geometry.meshes()
        if not all(map(index.passes_shadow_rays, leaves_of(shape.material)))
    ]
    triangles = np.concatenate([np.zeros((0, 3, 3), np.float32), *walls])
    with np.errstate(all="ignore"):
        near = np.abs(triangles).max(initial=0.0) < FAR
        return _remembered(triangles, eye, view) if near else CLOSED


def _remembered(triangles: NDArray[np.float32], eye: Floats, view: View | None) -> Openings:
    """Return the result of `find`; read it from the disk if a process has stored it."""
    asked = repr((eye.tolist(), view and (view.axis.tolist(), view.angle))).encode()
    code, content = (__file__, casting.__file__), (asked, triangles)
    found: Openings = disk_cache.remembered(code, content, lambda: find(triangles, eye, view))
    return found if found.rectangles else CLOSED


def find(triangles: NDArray[np.floating], eye: Floats, view: View | None = None) -> Openings:
    """Return the openings around a camera.

    triangles: opaque ones (n, 3, 3) [m]; eye: where the camera is (3,) [m]; view: what it sees.
    """
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(normals.astype(np.float64), axis=1)
    largest = np.argsort(-area, kind="stable")[:MOST_TRIANGLES]
    largest = largest[area[largest] > 0.0]
    if not len(largest):
        return CLOSED
    area = area[largest]
    search = _Search(triangles[largest], normals[largest] / area[:, None], area)
    if not search.spread(eye, view):
        return CLOSED
    rectangles, share = search.rectangles()
    return Openings(tuple(rectangles), MOST_SHARE * share) if rectangles else CLOSED


class _Search:
    """Rays from surfaces around a camera: their origins, directions, and whether they escape.

    Triangles come with their normals and twice their areas, the largest first.
    """

    def __init__(self, triangles: NDArray[np.floating], normals: Floats, area: Floats):
        self.triangles, self.normals, self.area = triangles, normals, area
        self.caster = casting.Caster(triangles)
        self.offset = OFFSET * float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
        self.random = np.random.default_rng(0)

    @property
    def share(self) -> float:
        """The share of escaping rays."""
        return float(self.escaped.mean())

    def spread(self, eye: Floats, view: View | None) -> bool:
        """Send rays from the camera, from the surfaces that they meet, and from second surfaces.

        Returns whether the place is a room with openings.
        """
        around = casting.sphere(self.random, AROUND)
        points, normals = self._met(np.broadcast_to(eye, around.shape), around)
        if len(points) < (1.0 - OUTDOORS) * AROUND:
            return False
        if view is not None:
            ahead = view.axis + math.tan(min(view.angle, WIDE)) * casting.sphere(
                self.random, AROUND
            )
            ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
            seen = self._met(np.broadcast_to(eye, ahead.shape), ahead)
            points, normals = (
                np.concatenate(pair) for pair in zip((points, normals), seen, strict=True)
            )
        origins, directions = self._onward(points, normals)
        again, faces = self._met(origins, directions)
        some = self.random.permutation(len(again))[:SECOND]
        more = self._onward(again[some], faces[some])
        self.points = np.concatenate([points, again[some]])
        self.faces = np.concatenate([normals, faces[some]])
        origins = np.concatenate([origins, more[0]])
        directions = np.concatenate([directions, more[1]])
        self.escaped = self._escape(origins, directions)
        if self.share >= OUTDOORS or self.escaped.sum() < FEWEST:
            return False
        largest = slice(MOST_WALLS)
        walls = self.triangles[largest], self.normals[largest], self.area[largest]
        self.axes = _axes(*walls[1:])
        self.walls = [_walls(*walls, axis) for axis in self.axes]
        self.along_axes = origins @ self.axes.T, directions @ self.axes.T
        return True

    def _met(self, origins: Floats, directions: Floats) -> tuple[Floats, Floats]:
        """Return where rays meet surfaces, and the normals there, on the rays' side."""
        triangle, t = self.caster.nearest(origins, directions)
        met = triangle >= 0
        normals = self.normals[triangle[met]]
        normals = normals * -np.sign(np.einsum("ij,ij->i", normals, directions[met]))[:, None]
        return origins[met] + directions[met] * t[met, None] + self.offset * normals, normals

    def _onward(self, points: Floats, normals: Floats) -> tuple[Floats, Floats]:
        """Return ONWARD rays from each point, by the cosine."""
        points, normals = np.repeat(points, ONWARD, axis=0), np.repeat(normals, ONWARD, axis=0)
        directions = normals + casting.sphere(self.random, len(points))
        return points, directions / np.linalg.norm(directions, axis=1, keepdims=True)

    def _escape(self, origins: Floats, directions: Floats) -> NDArray[np.bool_]:
        return self.caster.nearest(origins, directions)[0] < 0

    def rectangles(self) -> tuple[list[Rectangle], float]:
        """Return openings, and the share of escaping rays in all of them."""
        chosen: list[Rectangle] = []
        left = self.escaped.copy()
        while len(chosen) < MOST and left.sum() > (1.0 - CAPTURED) * self.escaped.sum():
            planes = sorted(self._planes(left), key=lambda plane: -plane.good)[:TRIED]
            plans = [self._aimed(plane, left, AIMED) for plane in planes]
            best = max(plans, key=lambda plan: plan.gain, default=None)
            if best is None or not best.gain:
                break
            best = self._aimed(best.plane, left, FINALLY)
            if not best.rectangles:
                break
            chosen += best.rectangles[: MOST - len(chosen)]
            left &= ~best.inside
        return chosen, 1.0 - float(left.sum() / self.escaped.sum())

    def _planes(self, left: NDArray[np.bool_]) -> Iterator[_Plane]:
        """Yield the best plane of walls for each axis and side, for the rays that are left."""
        for axis in range(3):
            for sign in (1, -1):
                planes = [
                    _Plane(axis, sign, at, *self._through(axis, sign, at, left))
                    for at in self.walls[axis]
                ]
                best = max(planes, key=lambda plane: plane.good, default=None)
                if best is not None and best.good:
                    yield best

    def _through(
        self, axis: int, sign: int, place: float, left: NDArray[np.bool_]
    ) -> tuple[Floats, float]:
        """Return a box around the rays that escape through a plane, and how good it is."""
        across, through = self._crossings(axis, sign, place)
        escaped = across[through & left]
        if len(escaped) < max(FEWEST, LEAST * left.sum()):
            return np.zeros((2, 2)), 0.0
        return _tight(escaped, across[through])

    def _crossings(self, axis: int, sign: int, place: float) -> tuple[Floats, NDArray[np.bool_]]:
        """Return where rays cross a plane (n, 2), and which of them do it, towards a side."""
        o, d = self.along_axes
        along = d[:, axis] * sign
        through = (along > STEEP) & ((place - o[:, axis]) * sign > 0.0)
        t = (place - o[:, axis]) / np.where(through, d[:, axis], 1.0)
        return np.delete(o + d * t[:, None], axis, axis=1), through

    def _aimed(self, plane: _Plane, left: NDArray[np.bool_], count: int) -> _Plan:
        """Return the openings of a plane, by a number of rays to a box there."""
        axis, margin = plane.axis, MARGIN * (plane.box[1] - plane.box[0])
        low, high = plane.box[0] - margin, plane.box[1] + margin
        which = self.random.integers(len(self.points), size=count)
        to = self.random.uniform(low, high, (count, 2))
        d = np.insert(to, axis, plane.place, axis=1) @ self.axes - self.points[which]
        d /= np.linalg.norm(d, axis=1, keepdims=True)
        along = d @ self.axes[axis] * plane.sign
        ahead = (along > STEEP) & (np.einsum("ij,ij->i", d, self.faces[which]) > 0.0)
        to, escapes = to[ahead], self._escape(self.points[which][ahead], d[ahead])
        boxes = [*_parts(to, escapes, np.array([low, high]))]
        across, through = self._crossings(axis, plane.sign, plane.place)
        first, second = (self.axes[k] for k in range(3) if k != axis)
        rectangles, gain, inside, used = [], 0.0, np.zeros(len(left), bool), []
        for box in boxes:
            seen = float(escapes[_within(to, box)].mean())
            here = through & _within(across, box)
            if seen > max(SEEN, WORTH * self.share) and (here & left).any():
                center = np.insert(box.mean(axis=0), axis, plane.place) @ self.axes
                half = (box[1] - box[0]) / 2.0
                rectangles.append(Rectangle(center, half[0] * first, half[1] * second))
                gain += seen * float((here & left).sum())
                inside |= here
                used.append(box)
        around = np.array([np.min(used, axis=0)[0], np.max(used, axis=0)[1]]) if used else plane.box
        return _Plan(rectangles, gain, inside, replace(plane, box=around))


@dataclass(frozen=True)
class _Plane:
    """A plane across an axis, towards a side of it, a box (2, 2) there, and how good it is."""

    axis: int
    sign: int
    place: float
    box: Floats
    good: float


@dataclass(frozen=True)
class _Plan:
    """Openings in a plane.

    inside: the rays through them; gain: their number, each by the share of the rays to its opening
    that escape; plane: with a box around the openings.
    """

    rectangles: list[Rectangle]
    gain: float
    inside: NDArray[np.bool_]
    plane: _Plane


def _tight(escaped: Floats, every: Floats) -> tuple[Floats, float]:
    """Return the best box (2, 2) for points (n, 2) among others, and how good it is.

    Each side of the box moves inwards by a tenth of its points, as long as this pays.
    """
    box = np.array([escaped.min(axis=0), escaped.max(axis=0)])
    best = len(escaped) ** 2 / len(every)
    while len(escaped) >= FEWEST:
        plans = []
        for side, k in ((0, 0), (0, 1), (1, 0), (1, 1)):
            smaller = box.copy()
            place = int((len(escaped) - 1) * (SHRINK, 1.0 - SHRINK)[side])
            smaller[side, k] = np.partition(escaped[:, k], place)[place]
            plans.append(
                (_within(escaped, smaller).sum() ** 2 / _within(every, smaller).sum(), smaller)
            )
        score, smaller = max(plans, key=lambda plan: plan[0])
        if score <= best:
            break
        best, box = score, smaller
        escaped, every = escaped[_within(escaped, box)], every[_within(every, box)]
    return box, float(best)


def _within(points: Floats, box: Floats) -> NDArray[np.bool_]:
    """Whether points (n, 2) lie in a box (2, 2)."""
    return ((points >= box[0]) & (points <= box[1])).all(axis=1)


def _parts(at: Floats, escapes: NDArray[np.bool_], box: Floats) -> Iterator[Floats]:
    """Yield the boxes (2, 2) of a square, within a box, through which rays escape.

    at: where rays cross the square (n, 2).
    """
    inside = _within(at, box)
    escaped = int((inside & escapes).sum())
    if not escaped:
        return
    cells = min(escaped // FEWEST, CELLS)
    for k in range(2) if cells > 1 else ():
        edges = np.linspace(box[0, k], box[1, k], cells + 1)
        count = np.histogram(at[inside, k], edges)[0]
        often = np.histogram(at[inside & escapes, k], edges)[0] / np.maximum(count, 1)
        open_ = np.concatenate([[False], often > RARE * np.median(often[often > 0.0]), [False]])
        open_[1:-1] |= open_[:-2] & open_[2:]  # a bar between panes
        turns = np.flatnonzero(np.diff(open_.astype(int)))
        runs = turns.reshape(-1, 2)
        if len(runs) > 1 or runs[0, 0] > 0 or runs[0, 1] < cells:
            for begin, end in runs:
                part = box.copy()
                part[:, k] = edges[begin], edges[end]
                yield from _parts(at, escapes, part)
            return
    yield box


def _walls(triangles: NDArray[np.floating], normals: Floats, area: Floats, axis: Floats) -> Floats:
    """The places along an axis of the largest walls across it."""
    facing = np.abs(normals @ axis) > 0.99
    at, area = triangles[facing].mean(axis=1) @ axis, area[facing]
    if not len(at):
        return np.zeros(0)
    cell = np.minimum((at - at.min()) * (SLICES / max(float(np.ptp(at)), 1e-30)), SLICES - 1)
    cell = cell.astype(int)
    sums = np.bincount(cell, weights=area)
    largest = [i for i in np.argsort(-sums)[:WALLS] if sums[i] > 0.0]
    return np.array([np.average(at[cell == i], weights=area[cell == i]) for i in largest])


def _axes(normals: Floats, area: Floats) -> Floats:
    """The directions (3, 3) of most walls, perpendicular to each other."""
    axes: list[Floats] = []
    for _ in range(2):
        for axis in axes:
            flat = np.abs(normals @ axis) < 0.1
            normals, area = normals[flat], area[flat]
        if not len(normals):
            break
        upper = normals * np.where(normals @ [1.0, 1e-3, 1e-6] < 0.0, -1.0, 1.0)[:, None]
        cells, which = np.unique(np.round(upper * 16.0), axis=0, return_inverse=True)
        best = (
            which.ravel() == np.bincount(which.ravel(), weights=area, minlength=len(cells)).argmax()
        )
        mean = (upper[best] * area[best, None]).sum(axis=0)
        for axis in axes:
            mean -= (mean @ axis) * axis
        axes.append(mean / np.linalg.norm(mean))
    if len(axes) < 2:
        axes = [axes[0] if axes else np.array([0.0, 0.0, 1.0])]
        other = np.cross(axes[0], np.eye(3)[np.abs(axes[0]).argmin()])
        axes.append(other / np.linalg.norm(other))
    return np.array([*axes, np.cross(axes[0], axes[1])])
