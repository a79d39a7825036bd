"""Surfaces of signed distances on a grid, as triangles: marching tetrahedra (Doi and Koide 1991).

Between the grid's points the distance is trilinear. Each cell that the surface goes through is cut
into pieces. A piece is skipped if its corners are all inside or all outside: the distance in it
lies between its corners' distances. Other pieces are cut into six tetrahedra that meet their
neighbours' tetrahedra. Vertices lie where the trilinear distance is zero. Normals are those of
Mitsuba's smooth sdfgrids (Soderlund et al. 2022): the gradients of the eight cells around a point,
trilinear between their middles.
"""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Floats, Integers, on_host
from clpt.errors import SceneError
from clpt.files import budget
from clpt.scene.shapes import SdfGrid

MOST_PIECES = 16
MOST_POINTS = 1 << 26  # most corners of pieces; the distance at each is computed, cell by cell
AT_ONCE = 1 << 21  # of them
CORNERS = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])  # of a cell, z fastest
# Six tetrahedra around the diagonal of a cell, by the orders of the axes (Kuhn 1960).
TETRAHEDRA = np.array(
    [
        np.cumsum([np.zeros(3, int), *np.eye(3, dtype=int)[list(order)]], axis=0)
        for order in permutations(range(3))
    ]
)
EDGES = ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3))
HALVINGS = 8  # of an edge, until its zero is looked for along a straight line


def surface(shape: SdfGrid, name: str) -> tuple[Any, Any, Any, Any]:
    """Return vertices, faces, normals or None, and uvs, before the transform.

    vertices, normals (n, 3) float32 in the unit cube; faces (m, 3) uint32, whose front is on the
    side of positive distances; uvs (n, 2) float32, all 0, so that a texture does not show the
    triangles. name: for messages. Raises SceneError for values that are no grid, for a grid without
    a surface, and for a grid of too many pieces.
    """
    values, pieces = _checked(shape, name), shape.pieces
    cells = _crossed(values)
    if not len(cells):
        message = "its distances are all of one sign, so that it has no surface"
        raise SceneError(message, where=name)
    if len(cells) * (pieces + 1) ** 3 > MOST_POINTS:
        message = f"{len(cells):,} cells of {pieces}^3 pieces are too many; lower `pieces`"
        raise SceneError(message, where=name)
    points, faces = _march(values, cells, pieces)
    scale = 1.0 / (np.array(values.shape) - 1.0)
    normals = _normals(values, points) / scale if shape.smooth else None
    if normals is not None:
        normals = transforms.unit_vectors(normals).astype(np.float32)
    uvs = np.zeros((len(points), 2), np.float32)
    return (points * scale).astype(np.float32), faces.astype(np.uint32), normals, uvs


def _checked(shape: SdfGrid, name: str) -> Floats:
    try:
        values = np.asarray(on_host(shape.values), np.float64)
    except (TypeError, ValueError) as error:
        raise SceneError(f"values are not numbers: {error}", where=name) from error
    if values.ndim != 3 or min(values.shape) < 2:
        message = f"values must be (nx, ny, nz), each 2 or more, found {values.shape}"
        raise SceneError(message, where=name)
    if not np.isfinite(values).all():
        raise SceneError("values are not finite", where=name)
    if not 1 <= shape.pieces <= MOST_PIECES:
        message = f"pieces must be 1 to {MOST_PIECES}, not {shape.pieces}"
        raise SceneError(message, where=name)
    return values


def _crossed(values: Floats) -> Integers:
    """The cells (n, 3) whose corners have distances of both signs; 0 counts as outside."""
    inside = values < 0.0
    count = np.zeros(np.array(values.shape) - 1, np.int8)
    for x, y, z in CORNERS:
        ends = [slice(o, o + n) for o, n in zip((x, y, z), count.shape, strict=True)]
        count += inside[tuple(ends)]
    return np.argwhere((count > 0) & (count < 8))


def _distance(values: Floats, cells: Integers, at: Floats) -> Floats:
    """The trilinear distance (n,) of cells (n, 3) at places (n, 3), 0 to 1 inside of them."""
    total = np.zeros(len(cells))
    for corner in CORNERS:
        weight = np.where(corner, at, 1.0 - at).prod(axis=1)
        total += weight * values[tuple((cells + corner).T)]
    return total


def _gradient(values: Floats, cells: Integers, at: Floats) -> Floats:
    """Its gradient (n, 3), by cells."""
    total = np.zeros((len(cells), 3))
    for corner in CORNERS:
        corner_values = values[tuple((cells + corner).T)]
        weights = np.where(corner, at, 1.0 - at)
        for axis in range(3):
            others = np.delete(weights, axis, axis=1).prod(axis=1)
            total[:, axis] += (1.0 if corner[axis] else -1.0) * others * corner_values
    return total


def _march(values: Floats, cells: Integers, pieces: int) -> tuple[Floats, Integers]:
    """Vertices (n, 3) [cells] and faces (m, 3)."""
    fine = np.array(values.shape) * pieces
    step = max(AT_ONCE // (pieces + 1) ** 3, 1)
    parts = [
        _tetrahedra(values, cells[first : first + step], first, pieces)
        for first in range(0, len(cells), step)
    ]
    corners, owner, local, distances = (np.concatenate(each) for each in zip(*parts, strict=True))
    inside = distances < 0.0
    keys = np.ravel_multi_index(tuple(np.moveaxis(corners, -1, 0)), tuple(fine))
    ends = []
    for number, edges in _cases():
        mine = np.flatnonzero((inside * [1, 2, 4, 8]).sum(axis=1) == number)
        for edge in edges:  # three edges a triangle
            ends.append(np.stack([np.stack([mine, np.full_like(mine, e)], 1) for e in edge], 1))
    triangles = np.concatenate(ends)  # (m, 3, 2): tetrahedron and edge
    tetrahedron, edge = triangles.reshape(-1, 2).T
    a, b = np.array(EDGES)[edge].T
    first, second = keys[tetrahedron, a], keys[tetrahedron, b]
    low, high = np.minimum(first, second), np.maximum(first, second)
    _, index, inverse = np.unique(
        low * np.int64(fine.prod()) + high, return_index=True, return_inverse=True
    )
    tetrahedron, a, b = tetrahedron[index], a[index], b[index]
    zero = _zeros(
        values, cells[owner[tetrahedron]], local[tetrahedron, a], local[tetrahedron, b],
        distances[tetrahedron, a], distances[tetrahedron, b],
    )  # fmt: skip
    points, faces = cells[owner[tetrahedron]] + zero, inverse.reshape(-1, 3)
    return points, _outward(points, faces, corners, inside, triangles[:, 0, 0], pieces)


def _tetrahedra(
    values: Floats, cells: Integers, first: int, pieces: int
) -> tuple[Integers, Integers, Floats, Floats]:
    """The tetrahedra of cells (k, 3) that the surface goes through.

    Their corners (n, 4, 3) on the fine grid; the cell of each, counted from `first`; where its
    corners are in it (n, 4, 3); the distances there (n, 4).
    """
    budget.check_time()
    side = pieces + 1
    lattice = np.indices((side,) * 3).reshape(3, -1).T
    points = cells[:, None] * pieces + lattice
    whose = np.repeat(np.arange(len(cells)), len(lattice))
    distance = _distance(
        values, cells[whose], (points / pieces - cells[:, None]).reshape(-1, 3)
    ).reshape(len(cells), side, side, side)
    count = np.zeros((len(cells), pieces, pieces, pieces), np.int8)
    for x, y, z in CORNERS:
        count += distance[:, x : x + pieces, y : y + pieces, z : z + pieces] < 0.0
    crossed = np.argwhere((count > 0) & (count < 8))
    ends = (crossed[:, None, None, 1:] + TETRAHEDRA).reshape(-1, 4, 3)  # in their cell
    cell = np.repeat(crossed[:, 0], len(TETRAHEDRA))
    x, y, z = np.moveaxis(ends, -1, 0)
    distances = distance[cell[:, None], x, y, z]
    inside = distances < 0.0
    some = inside.any(axis=1) & ~inside.all(axis=1)
    cell, distances = cell[some], distances[some]
    corners = cells[cell][:, None] * pieces + ends[some]
    return corners, first + cell, corners / pieces - cells[cell][:, None], distances


def _cases() -> list[tuple[int, list[tuple[int, ...]]]]:
    """Return for each set of corners inside, as bits, the edges of its triangles."""
    cases: list[tuple[int, list[tuple[int, ...]]]] = []
    for number in range(1, 15):
        within = [i for i in range(4) if number >> i & 1]
        outside = [i for i in range(4) if i not in within]
        edge = {(i, j): EDGES.index((min(i, j), max(i, j))) for i in within for j in outside}
        if len(within) != 2:
            cases.append((number, [tuple(edge.values())]))
            continue
        (p, q), (r, s) = within, outside
        ring = [edge[p, r], edge[p, s], edge[q, s], edge[q, r]]
        cases.append((number, [(ring[0], ring[1], ring[2]), (ring[0], ring[2], ring[3])]))
    return cases


def _zeros(
    values: Floats, cells: Integers, a: Floats, b: Floats, at_a: Floats, at_b: Floats
) -> Floats:
    """Where the trilinear distance is zero between a and b (n, 3): halving, then a secant."""
    low, high, f_low, f_high = np.zeros(len(a)), np.ones(len(a)), at_a, at_b
    for _ in range(HALVINGS):
        t = 0.5 * (low + high)
        f = _distance(values, cells, a + (b - a) * t[:, None])
        same = (f < 0.0) == (f_low < 0.0)
        low, high = np.where(same, t, low), np.where(same, high, t)
        f_low, f_high = np.where(same, f, f_low), np.where(same, f_high, f)
    t = low + (high - low) * f_low / (f_low - f_high)
    return a + (b - a) * t[:, None]


def _outward(
    points: Floats,
    faces: Integers,
    corners: Integers,
    inside: NDArray[np.bool_],
    owner: Integers,
    pieces: int,
) -> Integers:
    """The faces, turned to the corners of their tetrahedra that are outside."""
    weights = np.where(inside[owner], -1.0, 0.0)
    weights /= -weights.sum(axis=1, keepdims=True)
    outside = np.where(inside[owner], 0.0, 1.0)
    outside /= outside.sum(axis=1, keepdims=True)
    toward = np.einsum("nk,nkj->nj", outside + weights, corners[owner] / pieces)
    turned = (transforms.edge_crosses(points, faces) * toward).sum(axis=1) < 0.0
    return np.where(turned[:, None], faces[:, ::-1], faces)


def _normals(values: Floats, points: Floats) -> Floats:
    """Gradients (n, 3) [1/cell], continuous over the faces of cells."""
    last = np.array(values.shape) - 2
    base = np.floor(points - 0.5).astype(np.int64)
    share = points - 0.5 - base
    total = np.zeros_like(points)
    for corner in CORNERS:
        cells = np.clip(base + corner, 0, last)
        weight = np.where(corner, share, 1.0 - share).prod(axis=1)[:, None]
        gradient = _gradient(values, cells, np.clip(points - cells, 0.0, 1.0))
        total += weight * transforms.unit_vectors(gradient)
    return total
