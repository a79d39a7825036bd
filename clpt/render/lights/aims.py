"""Spheres around specular shapes, the targets of light paths: kernels/lights/aiming.cl."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, Integers
from clpt.files import disk_cache
from clpt.geometry import shapes
from clpt.render.geometry.find import Geometry
from clpt.render.scene_index import SceneIndex
from clpt.scene import materials as mt

MOST = 32  # spheres
SHARP = 0.2  # roughness alpha of microfacets below which a surface counts as specular
LARGE = 0.5  # of the scene's radius: a single sphere that is larger is no aim
CLUSTERS = 256  # most clusters into which specular pieces are cut
CELLS = 16  # along each side of a grid that merges a shape's many pieces cell by cell
MANY = 1 << 16  # pieces of all shapes; beyond, the grids have FEWER_CELLS
FEWER_CELLS = 8
GAP = 0.05  # of the span of pieces along an axis: wider gaps are cut first
PRICE = 1e-3  # of a sphere, over the area of all: a cut that gains less is not made
COMPACT = 0.5  # of the area of its surface, of the disk of a shape that no cut improves: a ball's
# has .25, a cube's .39, that of a ring with a tenth of its radius .96, a square's 1.57
PAD = 1.01  # radius over the radius of the pieces inside
ROUNDING = 4e-6  # of the scene's coordinates, added to a radius

# Pieces are (n, 11): three corners of a triangle, how far a piece reaches beyond it [m], and the
# area of its surface [m^2]. Cuts use columns (21, n), with the lowest and highest coordinates, and
# the number and the middle of the shape: numpy is slow along short axes.
LOW, HIGH, SHAPE, MIDDLE = slice(11, 14), slice(14, 17), 17, slice(18, 21)


def aims(
    index: SceneIndex, geometry: Geometry, scene_radius: float, edited: bool = False
) -> NDArray[np.float32]:
    """Return centre, radius and share (k, 5) of the spheres by their size, k from 0 to MOST [m].

    They enclose all shapes with a specular material; close shapes share a sphere. The shares of the
    light paths add up to `aimed` of the integrator: half is spread evenly over the spheres, half by
    the areas of their disks. k is 0 where no path is aimed: a single large sphere would gain
    nothing. edited: other scenes like this one follow, so the disk does not keep the spheres.
    """
    none = np.zeros((0, 5), np.float32)
    wanted = index.balanced and index.integrator.aimed > 0.0
    if not wanted:
        return none
    sharp = Sharp(geometry, index.motions.shapes)
    spheres = _spheres(sharp.pieces()) if edited else sharp.remembered(__file__, (), _spheres)
    if not len(spheres):
        return none
    centre, radius = np.split(spheres[np.argsort(spheres[:, 3], kind="stable")], [3], axis=1)
    if len(radius) == 1 and radius[0] > LARGE * scene_radius:
        return none
    radius = radius * PAD + ROUNDING * (np.abs(centre).max(axis=1, keepdims=True) + scene_radius)
    share = index.integrator.aimed * (0.5 / len(radius) + 0.5 * radius**2 / (radius**2).sum())
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


class Sharp:
    """The specular shapes of a scene.

    moving: numbers of shapes that move: the boxes around their ways are taken; wanted: whether a
    material counts as specular.
    """

    def __init__(
        self,
        geometry: Geometry,
        moving: Collection[int] = (),
        wanted: Callable[[mt.Material], bool] = is_sharp,
    ):
        self.geometry, self.moving = geometry, moving
        owners = geometry.owners
        ends = [*(face for _, _, _, face in owners), len(geometry.faces)][1:]
        self._shapes = [
            (i, row, shape, face, end)
            for i, ((row, shape, _, face), end) in enumerate(zip(owners, ends, strict=True))
            if wanted(shape.material)
        ]

    def remembered(
        self, code: str, by: tuple[Any, ...], make: Callable[[Iterable[Floats]], Any]
    ) -> Any:
        """Return make(self.pieces()), from the disk after the first time.

        code: the file of `make`; by: what else it depends on.
        """
        which = [
            (i, row.tobytes(), shape.kind, shape.deformation is None, face, end)
            for i, row, shape, face, end in self._shapes
        ]
        asked = repr((which, sorted(self.moving), self.geometry.first_analytic, by)).encode()
        given = self.geometry.digest, asked
        return disk_cache.remembered((code, __file__), given, lambda: make(self.pieces()))

    def pieces(self) -> Iterator[Floats]:
        """Yield each shape's pieces in the world: a row for each triangle or ball."""
        geometry, owners = self.geometry, self.geometry.owners
        triangles = geometry.instances.triangles
        firsts = len(geometry.faces) - sum(triangles) + np.cumsum((0, *triangles))[:-1]
        boxes = geometry.boxes.astype(np.float64)
        for i, row, shape, face, end in self._shapes:
            if row["kind"]:
                many = shape.kind in shapes.ONE_OF
                first = int(row["prim"]) if many else i - geometry.first_analytic
                behind = owners[i + 1][0]["prim"] if i + 1 < len(owners) else len(boxes)
                shape_boxes = boxes[first : int(behind) if many else first + 1]
                still = int(row["number"]) not in self.moving
                still &= shape.deformation is None
                yield _fewer(_in_boxes(shape_boxes, still and "sphere" in shape.kind))
            elif end > face:
                pieces = _of_triangles(geometry, face, end)
                prototype = int(np.searchsorted(firsts, face, side="right")) - 1
                if prototype >= 0:
                    pieces = _placed(geometry, pieces, prototype, self.moving)
                yield _fewer(pieces)


def _pieces(middles: Floats, reach: Floats, areas: Floats | None = None) -> Floats:
    """Return pieces around points; areas: by default those of balls that a cut may part."""
    areas = 2 * np.pi * reach * reach if areas is None else areas
    return np.column_stack([middles, middles, middles, reach, areas])


def _in_boxes(boxes: NDArray[np.float64], round_: bool) -> Floats:
    """Return pieces around boxes (n, 2, 3); round_: each box is filled by a sphere."""
    half = (boxes[:, 1] - boxes[:, 0]) / 2
    return _pieces(boxes.mean(axis=1), half.max(axis=1) if round_ else np.linalg.norm(half, axis=1))


def _of_triangles(geometry: Geometry, face: int, end: int) -> Floats:
    corners = geometry.vertices[geometry.faces[face:end]].astype(np.float64).reshape(-1, 9)
    ax, ay, az, bx, by, bz = np.hstack([corners[:, 3:6], corners[:, 6:]]).T - np.tile(
        corners[:, :3].T, (2, 1)
    )
    squares = (ay * bz - az * by) ** 2 + (az * bx - ax * bz) ** 2 + (ax * by - ay * bx) ** 2
    return np.column_stack([corners, np.zeros(len(corners)), 0.5 * np.sqrt(squares)])


def _placed(geometry: Geometry, pieces: Floats, prototype: int, moving: Collection[int]) -> Floats:
    """Return a piece around each instance of a prototype; pieces: of the prototype."""
    mine = geometry.instances.prototypes == prototype
    rows = geometry.instances.rows[mine]
    linear = np.linalg.inv(np.stack([rows[name] for name in "xyz"], axis=1).astype(np.float64))
    centre, radius = np.split(_around(_columns(pieces), np.zeros(1, np.int64))[0], [3])
    placed = _pieces(linear @ centre + rows["origin"], np.linalg.norm(linear, 2, (1, 2)) * radius)
    ways = np.isin(rows["number"], list(moving))
    if ways.any():
        boxes = geometry.instances.boxes[mine][ways].astype(np.float64)
        placed[ways] = _in_boxes(boxes, False)
    return placed


def _columns(pieces: Floats, shape: int = 0) -> Floats:
    columns = np.empty((21, len(pieces)))
    columns[:11] = pieces.T
    (a, b, c), reach = columns[:9].reshape(3, 3, -1), columns[9]
    columns[LOW] = low = np.minimum(np.minimum(a, b), c) - reach
    columns[HIGH] = high = np.maximum(np.maximum(a, b), c) + reach
    columns[SHAPE] = shape
    columns[MIDDLE] = ((low.min(axis=1) + high.max(axis=1)) / 2)[:, None]
    return columns


def _around(columns: Floats, runs: Integers) -> Floats:
    """Return spheres (k, 4) about the middles of the boxes of runs; runs: their first pieces."""
    sizes = np.diff(runs, append=columns.shape[1])
    low = np.minimum.reduceat(columns[LOW], runs, axis=1)
    centre = (low + np.maximum.reduceat(columns[HIGH], runs, axis=1)) / 2
    squares = (columns[:9].reshape(3, 3, -1) - np.repeat(centre, sizes, axis=1)) ** 2
    away = np.sqrt(squares[:, 0] + squares[:, 2] + squares[:, 1])
    radius = np.maximum.reduceat((away + columns[9]).max(axis=0), runs)
    return np.vstack([centre, radius]).T


def _cuts(columns: Floats, runs: Integers) -> tuple[Integers, Integers, NDArray[np.bool_]]:
    """Return an order of the pieces in which each run is cut, its first part, and whether by a gap.

    Pieces stay in their runs. The first part has a number of pieces (k,), 0 of a single piece.
    Without a wide gap along an axis, the longest axis is halved, whole shapes on each side.
    """
    lows, highs = columns[LOW], columns[HIGH]
    sizes = np.diff(runs, append=columns.shape[1])
    run = np.repeat(np.arange(len(runs)), sizes)
    low = np.minimum.reduceat(lows, runs, axis=1)
    span = np.maximum(np.maximum.reduceat(highs, runs, axis=1) - low, 1e-30)
    orders, widths, places = zip(
        *(_widest_gaps(lows[i], highs[i], run, runs) for i in range(3)), strict=True
    )
    gaps = np.array(widths) / span
    axis = gaps.argmax(axis=0)
    each = np.arange(len(runs))
    has_gap = gaps[axis, each] > GAP
    middles = np.where(_several(columns, runs)[run], columns[MIDDLE], (lows + highs) / 2)
    least = np.minimum.reduceat(middles, runs, axis=1)
    most = np.maximum.reduceat(middles, runs, axis=1)
    longest = (most - least).argmax(axis=0)
    along = middles[longest[run], np.arange(len(run))]
    first = along < ((least + most) / 2)[longest, each][run]
    halved = np.lexsort((~first, run))
    left = np.add.reduceat(first, runs, dtype=np.int64)
    left = np.where(left == 0, sizes // 2, left)  # all at the same point
    order = np.where(has_gap[run], np.array(orders)[axis[run], np.arange(len(run))], halved)
    return order, np.where(has_gap, np.array(places)[axis, each] - runs + 1, left), has_gap


def _several(columns: Floats, runs: Integers) -> NDArray[np.bool_]:
    """Return whether runs are of several shapes (k,)."""
    shapes_ = columns[SHAPE]
    return np.asarray(np.minimum.reduceat(shapes_, runs) < np.maximum.reduceat(shapes_, runs))


def _widest_gaps(
    low: Floats, high: Floats, run: Integers, runs: Integers
) -> tuple[Integers, Floats, Integers]:
    """Return the order of pieces along an axis, each run's widest gap, and the piece before it.

    run: of each piece; runs: their first pieces.
    """
    order = np.lexsort((low, run))
    reach = high[order]
    by_reach = np.argsort(reach, kind="stable")
    rank = np.empty(len(reach), np.int64)
    rank[by_reach] = np.arange(len(reach))
    farthest = np.maximum.accumulate(rank + run * len(reach)) - run * len(reach)
    gaps = np.full(len(reach), -np.inf)
    gaps[:-1] = low[order[1:]] - reach[by_reach[farthest[:-1]]]
    gaps[runs[1:] - 1] = -np.inf  # the last piece of a run
    widest = np.maximum.reduceat(gaps, runs)
    at = np.where(gaps == widest[run], np.arange(len(reach)), len(reach))
    return order, widest, np.minimum.reduceat(at, runs)


def _fewer(pieces: Floats, cells: int = CELLS) -> Floats:
    """Merge many pieces: the result has a piece for each cell of a grid."""
    if len(pieces) <= cells**3:
        return pieces
    columns = _columns(pieces)
    lows, highs = columns[LOW], columns[HIGH]
    middles = (lows + highs) / 2
    least = middles.min(axis=1, keepdims=True)
    span = np.maximum(np.ptp(middles, axis=1, keepdims=True), 1e-30)
    places = np.minimum((middles - least) / span * cells, cells - 1).astype(np.int64)
    places = np.array([cells * cells, cells, 1]) @ places
    order = np.argsort(places)
    firsts = np.flatnonzero(np.diff(places[order], prepend=-1))
    low = np.minimum.reduceat(lows[:, order], firsts, axis=1)
    high = np.maximum.reduceat(highs[:, order], firsts, axis=1)
    reach = np.linalg.norm(high - low, axis=0) / 2
    areas = np.add.reduceat(pieces[order, 10], firsts)
    return _pieces((low + high).T / 2, reach, areas)


class _Clusters:
    """Clusters of pieces by number: the sphere around each, and the two into which it is cut.

    Each is a run of `columns`; pieces of a cluster stand in the order of its parts. bounds: its
    first column, that of its second part, and its end; the first two are the same if it stays.
    """

    def __init__(self, columns: Floats):
        self.columns = columns
        self.bounds, self.spheres = np.zeros((0, 3), np.int64), np.zeros((0, 4))
        self.gaps = np.zeros(0, bool)
        self.parts: dict[int, tuple[int, int]] = {}
        self._add(np.array([[0, columns.shape[1]]]))

    def _add(self, bounds: Integers) -> None:
        """Add clusters, from their first columns to their ends (k, 2); order those to be cut."""
        sizes = bounds[:, 1] - bounds[:, 0]
        runs = np.cumsum(sizes) - sizes
        rows = np.arange(sizes.sum()) + np.repeat(bounds[:, 0] - runs, sizes)
        columns = self.columns[:, rows]
        spheres = _around(columns, runs)
        compact = spheres[:, 3] ** 2 <= COMPACT / np.pi * np.add.reduceat(columns[10], runs)
        parted = (sizes > 1) & (_several(columns, runs) | ~compact)
        left, gaps = np.zeros(len(runs), np.int64), np.zeros(len(runs), bool)
        if parted.any():
            of_parted = np.repeat(parted, sizes)
            rows, columns = rows[of_parted], columns[:, of_parted]
            ends = np.cumsum(sizes[parted])
            order, left[parted], gaps[parted] = _cuts(columns, ends - sizes[parted])
            self.columns[:, rows] = columns[:, order]
        added = np.column_stack([bounds[:, 0], bounds[:, 0] + left, bounds[:, 1]])
        self.bounds = np.concatenate([self.bounds, added])
        self.spheres = np.concatenate([self.spheres, spheres])
        self.gaps = np.concatenate([self.gaps, gaps])

    def cut(self, numbers: Integers) -> Integers:
        """Cut clusters; return the numbers of their parts."""
        new = len(self.spheres) + np.arange(2 * len(numbers))
        pairs = zip(new[::2].tolist(), new[1::2].tolist(), strict=True)
        self.parts |= dict(zip(numbers.tolist(), pairs, strict=True))
        self._add(np.stack([self.bounds[numbers, :2], self.bounds[numbers, 1:]], 1).reshape(-1, 2))
        return new

    def cover(self, price: float) -> tuple[float, list[int]]:
        """Return the cheapest spheres around all pieces; each costs its area and a price."""
        costs = (self.spheres[:, 3] ** 2 + price).tolist()
        whole = set(range(len(costs)))
        for number, (near, far) in reversed(self.parts.items()):  # parts follow what they are of
            if costs[near] + costs[far] < costs[number]:
                costs[number] = costs[near] + costs[far]
                whole.discard(number)
        numbers, waiting = list[int](), [0]
        while waiting:
            number = waiting.pop()
            if number in whole:
                numbers.append(number)
            else:
                waiting += reversed(self.parts[number])
        return costs[0], numbers


def _spheres(by_shape: Iterable[Floats]) -> NDArray[np.float64]:
    """Return at most MOST spheres (k, 4) around the pieces of shapes, whose disks are small.

    Compact shapes are not cut: their parts would have more disks of the same area together.
    """
    parts = [part for part in by_shape if len(part)]
    if not parts:
        return np.zeros((0, 4))
    if sum(map(len, parts)) > MANY:
        parts = [_fewer(part, FEWER_CELLS) for part in parts]
    columns = [_columns(part, number) for number, part in enumerate(parts)]
    clusters = _Clusters(np.concatenate(columns, axis=1))
    leaves = np.zeros(1, np.int64)
    while len(leaves) < CLUSTERS:  # those with gaps come first, then the largest
        several = leaves[np.ptp(clusters.bounds[leaves][:, :2], axis=1) > 0]
        order = np.lexsort((-clusters.spheres[several, 3], ~clusters.gaps[several]))
        chosen = several[order[: min(CLUSTERS - len(leaves), -(-len(leaves) // 2))]]
        if not len(chosen):
            break
        leaves = np.concatenate([np.setdiff1d(leaves, chosen), clusters.cut(chosen)])
    price = PRICE * clusters.cover(0.0)[0]
    while len(numbers := clusters.cover(price)[1]) > MOST:
        price *= 2.0
    return clusters.spheres[numbers]
