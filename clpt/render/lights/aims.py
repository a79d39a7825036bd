"""Spheres around specular shapes, the targets of light paths: kernels/lights/aiming.cl."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Collection, Iterator
from itertools import count

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.geometry import shapes
from clpt.render.geometry.find import Geometry
from clpt.render.scene_index import SceneIndex
from clpt.scene import materials as mt

AIMED = 0.7  # share of the light paths that aim
MOST = 32  # spheres
SHARP = 0.2  # roughness alpha of microfacets below which a surface counts as specular
LARGE = 0.5  # of the scene's radius: a single sphere that is larger is no aim
CLUSTERS = 256  # most clusters into which specular pieces are cut
CELLS = 16  # along each side of a grid that merges many pieces cell by cell
GAP = 0.05  # of the span of pieces along an axis: wider gaps are cut first
SEVERAL = 1 << 12  # most pieces among which gaps are searched
PRICE = 1e-3  # of a sphere, over the area of all: a cut that gains less is not made
PAD = 1.01  # radius over the radius of the pieces inside
ROUNDING = 4e-6  # of the scene's coordinates, added to a radius

# Pieces are (n, 10): three corners of a triangle, and how far a piece reaches beyond it [m]. Cuts
# use columns (16, n), with the lowest and highest coordinates: numpy is slow along short axes.


def aims(index: SceneIndex, geometry: Geometry, scene_radius: float) -> NDArray[np.float32]:
    """Return centre, radius and share (k, 5) of the spheres by their size, k from 0 to MOST [m].

    They enclose all shapes with a specular material; close shapes share a sphere. The shares of the
    light paths add up to AIMED: half is spread evenly over the spheres, half by the areas of their
    disks. k is 0 where no path is aimed: a single large sphere would gain nothing.
    """
    none = np.zeros((0, 5), np.float32)
    by_shape = sharp_pieces(geometry, index.motions.shapes) if index.balanced else ()
    pieces = [part for part in by_shape if len(part)]
    if not pieces:
        return none
    spheres = _spheres(np.concatenate(pieces))
    centre, radius = np.split(spheres[np.argsort(spheres[:, 3], kind="stable")], [3], axis=1)
    if len(radius) == 1 and radius[0] > LARGE * scene_radius:
        return none
    radius = radius * PAD + ROUNDING * (np.abs(centre).max(axis=1, keepdims=True) + scene_radius)
    share = AIMED * (0.5 / len(radius) + 0.5 * radius**2 / (radius**2).sum())
    return np.hstack([centre, radius, share]).astype(np.float32)


def is_sharp(material: mt.Material, below: float = SHARP) -> bool:
    """Whether a material, or a part of it, is specular or nearly so.

    A coat over a diffuse base does not count, nor does a material that ends light paths. below:
    the upper limit of the roughness alpha.
    """
    if not material.reversible:
        return False
    if material.is_composite:
        return any(is_sharp(part, below) for part in material.shared_parts.values())
    if material.delta:
        return not material.is_null
    return material.least_alpha < below


def sharp_pieces(
    geometry: Geometry,
    moving: Collection[int] = (),
    wanted: Callable[[mt.Material], bool] = is_sharp,
) -> Iterator[Floats]:
    """Yield the pieces of every specular shape, in the world: a row for each triangle or ball.

    moving: numbers of shapes that move: the boxes around their ways are taken; wanted: whether a
    material counts as specular.
    """
    owners, placed = geometry.owners, geometry.instances
    ends = [*(face for _, _, _, face in owners), len(geometry.faces)][1:]
    firsts = len(geometry.faces) - sum(placed.triangles) + np.cumsum((0, *placed.triangles))[:-1]
    boxes = geometry.boxes.astype(np.float64)
    for i, ((row, shape, _, face), end) in enumerate(zip(owners, ends, strict=True)):
        if not wanted(shape.material):
            continue
        if row["kind"]:
            many = shape.kind in shapes.ONE_OF
            first = int(row["prim"]) if many else i - geometry.first_analytic
            behind = owners[i + 1][0]["prim"] if i + 1 < len(owners) else len(boxes)
            shape_boxes = boxes[first : int(behind) if many else first + 1]
            still = int(row["number"]) not in moving
            still &= shape.deformation is None
            yield _fewer(_in_boxes(shape_boxes, still and "sphere" in shape.kind))
        elif end > face:
            pieces = _of_triangles(geometry, face, end)
            prototype = int(np.searchsorted(firsts, face, side="right")) - 1
            yield _fewer(pieces if prototype < 0 else _placed(geometry, pieces, prototype, moving))


def _pieces(middles: NDArray[np.float64], reach: NDArray[np.float64]) -> Floats:
    return np.hstack([middles, middles, middles, reach[:, None]])


def _in_boxes(boxes: NDArray[np.float64], round_: bool) -> Floats:
    """Return pieces around boxes (n, 2, 3); round_: each box is filled by a sphere."""
    half = (boxes[:, 1] - boxes[:, 0]) / 2
    return _pieces(boxes.mean(axis=1), half.max(axis=1) if round_ else np.linalg.norm(half, axis=1))


def _of_triangles(geometry: Geometry, face: int, end: int) -> Floats:
    corners = geometry.vertices[geometry.faces[face:end]].astype(np.float64)
    return np.hstack([corners.reshape(-1, 9), np.zeros((len(corners), 1))])


def _placed(geometry: Geometry, pieces: Floats, prototype: int, moving: Collection[int]) -> Floats:
    """Return a piece around each instance of a prototype; pieces: of the prototype."""
    mine = geometry.instances.prototypes == prototype
    rows = geometry.instances.rows[mine]
    linear = np.linalg.inv(np.stack([rows[name] for name in "xyz"], axis=1).astype(np.float64))
    centre, radius = np.split(_around(_columns(pieces)), [3])
    placed = _pieces(linear @ centre + rows["origin"], np.linalg.norm(linear, 2, (1, 2)) * radius)
    ways = np.isin(rows["number"], list(moving))
    if ways.any():
        boxes = geometry.instances.boxes[mine][ways].astype(np.float64)
        placed[ways] = _in_boxes(boxes, False)
    return placed


def _columns(pieces: Floats) -> Floats:
    columns = np.empty((16, len(pieces)))
    columns[:10] = pieces.T
    (a, b, c), reach = columns[:9].reshape(3, 3, -1), columns[9]
    columns[10:13] = np.minimum(np.minimum(a, b), c) - reach
    columns[13:] = np.maximum(np.maximum(a, b), c) + reach
    return columns


def _around(columns: Floats) -> NDArray[np.float64]:
    """Return centre and radius (4,) of a sphere about the middle of the pieces' box."""
    centre = (columns[10:13].min(axis=1) + columns[13:].max(axis=1)) / 2
    squares = (columns[:9].reshape(3, 3, -1) - centre[:, None]) ** 2
    away = np.sqrt(squares[:, 0] + squares[:, 2] + squares[:, 1])
    return np.append(centre, (away + columns[9]).max())


def _cut(columns: Floats) -> tuple[tuple[Floats, ...], bool]:
    """Return pieces in two parts, and whether a wide gap separates these.

    Without a wide gap along an axis, the longest axis is halved.
    """
    lows, highs = columns[10:13], columns[13:]
    number = columns.shape[1]
    if number <= SEVERAL:
        span = np.maximum(highs.max(axis=1) - lows.min(axis=1), 1e-30)
        order = np.argsort(lows, axis=1)
        reached = np.maximum.accumulate(np.take_along_axis(highs, order[:, :-1], axis=1), axis=1)
        gaps = (np.take_along_axis(lows, order[:, 1:], axis=1) - reached) / span[:, None]
        places = gaps.argmax(axis=1)
        axis = min(range(3), key=lambda i: (-gaps[i, places[i]], places[i]))
        if gaps[axis, places[axis]] > GAP:
            left, right = np.split(order[axis], [places[axis] + 1])
            return (columns[:, left], columns[:, right]), True
    middles = (lows + highs) / 2
    along = middles[np.ptp(middles, axis=1).argmax()]
    low = along < (along.min() + along.max()) / 2
    if not low.any():  # all at the same point
        low = np.arange(number) < number // 2
    return (columns[:, low], columns[:, ~low]), False


def _fewer(pieces: Floats) -> Floats:
    """Merge many pieces: the result has a piece for each cell of a grid."""
    if len(pieces) <= CELLS**3:
        return pieces
    columns = _columns(pieces)
    lows, highs = columns[10:13], columns[13:]
    middles = (lows + highs) / 2
    least = middles.min(axis=1, keepdims=True)
    span = np.maximum(np.ptp(middles, axis=1, keepdims=True), 1e-30)
    cells = np.minimum((middles - least) / span * CELLS, CELLS - 1).astype(np.int64)
    cells = np.array([CELLS * CELLS, CELLS, 1]) @ cells
    order = np.argsort(cells)
    firsts = np.flatnonzero(np.diff(cells[order], prepend=-1))
    low = np.minimum.reduceat(lows[:, order], firsts, axis=1)
    high = np.maximum.reduceat(highs[:, order], firsts, axis=1)
    return _in_boxes(np.stack([low.T, high.T], axis=1), False)


class _Cluster:
    """Some pieces, the sphere around them, and the clusters into which they are cut."""

    def __init__(self, columns: Floats):
        self.sphere = _around(columns)
        self.area = float(self.sphere[3] ** 2)
        self.halves, self.gap = _cut(columns) if columns.shape[1] > 1 else ((), False)
        self.parts: list[_Cluster] = []

    def cut(self) -> list[_Cluster]:
        """Return the two parts; a single piece has none."""
        self.parts, self.halves = [_Cluster(half) for half in self.halves], ()
        return self.parts

    def cover(self, price: float) -> tuple[float, list[NDArray[np.float64]]]:
        """Return the cheapest spheres around all pieces; each costs its area and a price."""
        whole = self.area + price
        if self.parts:
            costs, spheres = zip(*(part.cover(price) for part in self.parts), strict=True)
            if sum(costs) < whole:
                return sum(costs), [sphere for some in spheres for sphere in some]
        return whole, [self.sphere]


def _spheres(pieces: Floats) -> NDArray[np.float64]:
    """Return at most MOST spheres (k, 4) around pieces, whose disks have little area together."""
    root, number = _Cluster(_columns(pieces)), count()
    leaves: list[tuple[bool, float, int, _Cluster]] = []
    cut = [root]
    while cut or leaves:
        for cluster in cut:  # a gap comes first, then the largest, then the earliest
            heapq.heappush(leaves, (not cluster.gap, -cluster.area, next(number), cluster))
        if len(leaves) >= CLUSTERS:
            break
        cut = heapq.heappop(leaves)[-1].cut()
    price = PRICE * root.cover(0.0)[0]
    while len(spheres := root.cover(price)[1]) > MOST:
        price *= 2.0
    return np.array(spheres)
