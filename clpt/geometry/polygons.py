"""Polygons as triangles that keep their shape, whether they are convex or not.

A fan around the first corner fits a simple polygon if none of its triangles is turned over: their
signed areas add up to the polygon's, so they cover it once. The test holds for all convex polygons
and runs in bulk. Quadrilaterals that fail are split at their other diagonal; ears of other polygons
are clipped, by mapbox_earcut, in the plane of the polygon's vector area (Newell's normal).
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, Integers
from clpt.errors import SceneError
from clpt.files import budget
from clpt.transforms import crosses, edge_crosses, unit_vectors

MOST_CORNERS = 24_000  # of a polygon whose ears are clipped: time may grow with their square
CHUNK = 1 << 18  # corners that are tested at a time: in float64 they take 200 bytes each
CANCELLED = 1e-9  # of a polygon's triangles: a sum of their areas that has no direction
ROUNDING = 1e-7  # of a polygon's area: a triangle that is turned over by less is a line


def triangulate(
    vertices: NDArray[Any], counts: NDArray[Any], corners: NDArray[Any]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return triangles (t, 3), as positions in `corners`, and the polygon of each, (t,).

    vertices: (n, 3); counts: (p,) how many corners each polygon has; corners: (sum of counts,)
    their vertices, polygon by polygon. A polygon of n corners gives n - 2 triangles, none if n < 3;
    triangles turn as their polygon does. A polygon with a missing or non-finite vertex is a fan.

    Raises SceneError for a polygon of more than MOST_CORNERS corners that no fan fits, and where
    the load has no more time.
    """
    counts = np.asarray(counts, np.int64)
    starts = np.cumsum(counts) - counts
    if (counts == 3).all():
        return np.arange(3 * len(counts), dtype=np.int32).reshape(-1, 3), _range(len(counts))
    triangles, polygon = _fans(counts, starts)
    rows, points, corners = _first(counts), np.asarray(vertices), np.asarray(corners)
    if not len(points):
        return triangles, polygon
    quads, larger = np.flatnonzero(counts == 4), np.flatnonzero(counts > 4)
    for some in np.split(quads, range(CHUNK // 4, len(quads), CHUNK // 4)):
        _mend_quads(triangles, points, starts[some], rows[some], corners)
    pieces = np.searchsorted(np.cumsum(counts[larger]), np.arange(0, counts[larger].sum(), CHUNK))
    for some in np.split(larger, np.unique(pieces)[1:]):
        _mend(triangles, points, counts[some], starts[some], rows[some], corners)
    return triangles, polygon


def _range(count: int) -> NDArray[np.int32]:
    return np.arange(count, dtype=np.int32)


def _first(counts: Integers) -> Integers:
    """Return the row of each polygon's first triangle, (p,)."""
    triangles = np.maximum(counts - 2, 0)
    return np.cumsum(triangles) - triangles


def _fans(counts: Integers, starts: Integers) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return all polygons as triangles around their first corners, and the polygon of each."""
    polygon = np.repeat(_range(len(counts)), np.maximum(counts - 2, 0))
    step = np.arange(len(polygon)) - _first(counts)[polygon] + 1
    first = starts[polygon]
    return np.stack([first, first + step, first + step + 1], axis=1).astype(np.int32), polygon


def _outlines(
    points: NDArray[Any], corners: NDArray[Any], at: Integers
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the positions (k, 3) of corners, and whether each is present and finite."""
    named = corners[at]
    there = (named >= 0) & (named < len(points))
    places = points[np.where(there, named, 0).astype(np.int64)].astype(np.float64)
    return places, there & np.isfinite(places).all(axis=1)


def _mend_quads(
    triangles: NDArray[np.int32],
    points: NDArray[Any],
    starts: Integers,
    rows: Integers,
    corners: NDArray[Any],
) -> None:
    """Split quadrilaterals at their other diagonal where a triangle of the fan is turned over."""
    places, usable = _outlines(points, corners, np.add.outer(starts, range(4)).reshape(-1))
    outline = places.reshape(-1, 4, 3)
    with np.errstate(over="ignore", invalid="ignore"):
        a, b, c = (outline[:, i] - outline[:, 0] for i in (1, 2, 3))
        first, second = crosses(a, b), crosses(b, c)
        normals = first + second
        least = -ROUNDING * (normals**2).sum(axis=1)
        turned = ((first * normals).sum(axis=1) < least) | ((second * normals).sum(axis=1) < least)
        finite = usable.reshape(-1, 4).all(axis=1) & np.isfinite(least)
    wrong = np.flatnonzero(turned & finite)
    triangles[rows[wrong]] = np.add.outer(starts[wrong], (1, 2, 3))
    triangles[rows[wrong] + 1] = np.add.outer(starts[wrong], (1, 3, 0))


def _mend(
    triangles: NDArray[np.int32],
    points: NDArray[Any],
    counts: Integers,
    starts: Integers,
    rows: Integers,
    corners: NDArray[Any],
) -> None:
    """Clip the ears of polygons whose fan has a triangle that is turned over.

    rows: (p,) the first triangle of each.
    """
    if not len(counts):
        return
    begins, first = np.cumsum(counts) - counts, _first(counts)
    fans, polygon = _fans(counts, begins)
    at = np.repeat(starts - begins, counts) + np.arange(counts.sum())
    outline, usable = _outlines(points, corners, at)
    with np.errstate(over="ignore", invalid="ignore"):
        outline -= np.repeat(outline[begins], counts, axis=0)
        crosses = np.cross(outline[fans[:, 1]], outline[fans[:, 2]])  # the first corner is at zero
        normals = np.add.reduceat(crosses, first)
        square = (normals**2).sum(axis=1)
        whole = np.add.reduceat(np.sqrt((crosses**2).sum(axis=1)), first)
        turned = (crosses * normals[polygon]).sum(axis=1) < -ROUNDING * square[polygon]
    wrong = np.logical_or.reduceat(turned, first) & np.isfinite(square)
    wrong &= square > (CANCELLED * whole) ** 2
    for i in np.flatnonzero(wrong & np.logical_and.reduceat(usable, begins)):
        if counts[i] > MOST_CORNERS:
            message = f"a polygon that is not convex has {counts[i]:,} corners, at most "
            raise SceneError(f"{message}{MOST_CORNERS:,} are read: save it as triangles")
        budget.check_time()
        ears = _clip(outline[begins[i] : begins[i] + counts[i]], normals[i])
        if ears is not None:
            triangles[rows[i] : rows[i] + counts[i] - 2] = starts[i] + ears


def _clip(outline: Floats, normal: Floats) -> Integers | None:
    """Return a polygon (n, 3) as n - 2 triangles of its corners; None where they cannot be found.

    Corners in a straight line that the ears leave out are put back, so that neighbours which share
    them still meet the polygon without a gap. What is missing then are triangles without an area.
    """
    kept = _without_spikes(outline)
    flat = outline - (outline @ normal / (normal @ normal))[:, None] * normal
    flat = np.delete(flat, int(np.argmax(np.abs(normal))), axis=1)[kept]
    flat = np.ascontiguousarray(flat / np.abs(flat).max())
    ears_found = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32))
    ears = np.asarray(ears_found, np.int64).reshape(-1, 3)
    if not len(ears):
        return None
    turned = _turned_alike(outline[kept], normal, ears)
    _put_back(turned, outline[kept])
    missing = len(outline) - 2 - len(turned)
    return np.array([*kept[np.array(turned)].tolist(), *[(0, 0, 0)] * missing])


def _without_spikes(outline: Floats) -> Integers:
    """Return the corners without repetitions and without edges that go there and back."""
    points = [tuple(point) for point in outline.tolist()]
    kept: list[int] = []
    for corner, point in enumerate(points):
        kept.append(corner)
        while len(kept) > 1 and points[kept[-2]] == point:
            kept.pop()
        if len(kept) > 2 and points[kept[-3]] == point:
            del kept[-2:]
    while len(kept) > 1 and points[kept[0]] == points[kept[-1]]:
        kept.pop()
    return np.array(kept)


def _turned_alike(outline: Floats, normal: Floats, ears: Integers) -> list[Any]:
    """Return triangles that all turn about the normal."""
    a, b, c = outline[ears.T]
    about = np.cross(b - a, c - a) @ normal
    return np.where(about[:, None] < 0, ears[:, [0, 2, 1]], ears).tolist()


def _put_back(ears: list[Any], outline: Floats) -> None:
    """Split the edge between the neighbours of each corner on it that no triangle has."""
    count = len(outline)
    used = {corner for ear in ears for corner in ear}
    if len(used) == count:
        return
    edges = {(ear[i - 1], ear[i]): row for row, ear in enumerate(ears) for i in range(3)}
    start = min(used)
    around = [*range(start, count), *range(start + 1)]
    kept = [at for at, corner in enumerate(around) if corner in used]
    for first, last in pairwise(kept):
        before, after = around[first], around[last]
        for corner in around[first + 1 : last]:
            row = edges.pop((before, after), None)
            there, on = outline[corner] - outline[before], outline[after] - outline[corner]
            if row is None or there @ on < 0.0:
                break
            apex = next(i for i in ears[row] if i not in (before, after))
            ears[row] = [before, corner, apex]
            ears.append([corner, after, apex])
            edges[before, corner] = row
            edges[corner, after] = edges[after, apex] = len(ears) - 1
            before = corner


SUMMED = 1 << 20  # triangles whose normals are summed at a time


def smooth_normals(vertices: NDArray[Any], faces: NDArray[Any]) -> NDArray[np.float32]:
    """Return vertex normals (n, 3): of the faces, weighted by angle (Thuermer, Wuethrich 1998)."""
    total = np.zeros((len(vertices), 3))
    for first in range(0, len(faces), SUMMED):
        _add_normals(total, vertices, faces[first : first + SUMMED])
    return unit_vectors(total).astype(np.float32)


def _add_normals(total: NDArray[Any], vertices: NDArray[Any], faces: NDArray[Any]) -> None:
    corners = vertices[faces].astype(np.float64)
    normals = unit_vectors(edge_crosses(vertices, faces))
    for i in range(3):
        a = unit_vectors(corners[:, (i + 1) % 3] - corners[:, i])
        b = unit_vectors(corners[:, (i + 2) % 3] - corners[:, i])
        angles = np.arccos(np.clip((a * b).sum(axis=1), -1.0, 1.0))
        for axis in range(3):
            weights = angles * normals[:, axis]
            total[:, axis] += np.bincount(faces[:, i], weights, len(vertices))
