"""Curves as triangles: a tube of flat facets with smooth normals around each strand.

Rays meet curves as they are, see `strands`. What has no such form is met as `Tubes`: curves that
emit light, that deform, that a transform stretches, or that many instances share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats, Integers, single
from clpt.errors import SceneError
from clpt.scene.params import fields_of
from clpt.scene.shapes import Curves

ERROR = 0.25  # of the radius: how far a tube's axis may be from its curve
FINEST = 32  # most pieces of a cubic
PIECES = 1 << 20  # above this number, axes follow their curves less closely
TRIANGLES = 1 << 23  # above this number, tubes have fewer sides
SIDES = (4, 16)  # least and most sides of a tube
SIDES_OF_WORLD = np.eye(3)[::-1]  # z, y, x: the side of a strand where u is a quarter
THINNEST = 1e-4  # of the thickest, which a tube has where the radius is zero
LEAST = {"linear": 2, "bspline": 4, "bezier": 4}  # points of a strand
# From control points of a uniform cubic B-spline to control points of its Bezier form.
TO_BEZIER = np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Tubes(Curves):
    """Curves that rays meet as tubes of triangles, open at the ends."""


def as_tubes(shape: Curves) -> Tubes:
    """Return the same curves as tubes."""
    return Tubes(**fields_of(shape))


def tubes(shape: Curves, name: str, alike: Sequence[Curves] = ()) -> tuple[Any, Any, Any, Any]:
    """Return the tubes as vertices, faces, normals and uvs, before the transform.

    vertices, normals (n, 3) float32; faces (m, 3) uint32, seen from outside; uvs (n, 2) float32, u
    around, v along, from 0 to 1 over all pieces of all strands. A tube is a little wider than its
    curve, so that it covers the same area, seen from the side from all around. alike: the same
    strands at other times, whose tubes are to have the same faces.

    Raises SceneError for points that are no curves.
    """
    linear = shape.basis == "linear"
    spans, strand, span, t = _rings(shape, name, alike)
    center, slope = _bezier(spans, span, t)
    tangent = _tangents(center[:, :3], slope, strand[span])
    lower = np.flatnonzero(strand[span[1:]] == strand[span[:-1]])
    if linear and not alike:  # what bridges a bend; nothing where there is none
        same = np.einsum("ij,ij->i", tangent[lower], tangent[lower + 1]) > 1.0 - 1e-9
        lower = lower[(span[lower] == span[lower + 1]) | ~same]
    sides = int(np.clip(TRIANGLES // (2 * len(lower)), *SIDES))
    first = np.r_[True, strand[span[1:]] != strand[span[:-1]]]
    v = (span + t) / len(spans)
    from_world = np.linalg.pinv(np.asarray(shape.to_world, np.float64)[:3, :3])
    axes = frames(tangent, first, SIDES_OF_WORLD @ from_world.T)
    return _around(center, slope, tangent, axes, v, lower, sides)


def strands(shape: Curves, name: str, alike: Sequence[Curves], vertices: int) -> Integers:
    """Return the strand of each of the `vertices` that `tubes` returns, (vertices,)."""
    _, strand, span, _ = _rings(shape, name, alike)
    return np.repeat(strand[span], vertices // len(span))


def _rings(
    shape: Curves, name: str, alike: Sequence[Curves]
) -> tuple[Floats, Integers, Integers, Floats]:
    """The pieces and their strands, as of `cubics`; for each ring its piece, and where there."""
    spans, strand = cubics(shape, name)
    linear = shape.basis == "linear"
    parts = np.ones(len(spans), np.int64) if linear else _pieces(spans)
    for other in () if linear else alike:
        parts = np.maximum(parts, _pieces(cubics(other, name)[0]))
    last = np.append(strand[1:] != strand[:-1], True)
    rings = parts + (np.ones_like(last) if linear else last)
    starts = np.cumsum(rings) - rings
    span = np.repeat(np.arange(len(spans)), rings)
    return spans, strand, span, (np.arange(len(span)) - starts[span]) / parts[span]


def cubics(shape: Curves, name: str) -> tuple[Floats, Integers]:
    """Return every piece of the curves in Bezier form, and its strand (s,).

    The pieces are (s, 2 or 4, 4) float64, with the radius last, before the transform. Raises
    SceneError for points that are no curves.
    """
    points, lengths = _checked(shape, name)
    least = LEAST[shape.basis]
    step = 3 if shape.basis == "bezier" else 1
    wrong = (lengths < least) | ((lengths - least) % step != 0)
    if wrong.any():
        wanted = f"{least}" + (" + 3 n" if step == 3 else " or more")
        i = int(np.argmax(wrong))
        raise SceneError(
            f"a {shape.basis} strand needs {wanted} points, strand {i} has {lengths[i]}", where=name
        )
    counts = (lengths - least) // step + 1
    strand = np.repeat(np.arange(len(lengths)), counts)
    within = np.arange(len(strand)) - (np.cumsum(counts) - counts)[strand]
    at = (np.cumsum(lengths) - lengths)[strand] + step * within
    spans = points[at[:, None] + np.arange(least)]
    return (TO_BEZIER @ spans if shape.basis == "bspline" else spans), strand


def _checked(shape: Curves, name: str) -> tuple[Floats, Integers]:
    """The points (n, 4) and the number of them in each strand."""
    try:
        points = np.asarray(shape.points, np.float64)
        lengths = np.asarray(shape.lengths if len(shape.lengths) else [len(points)])
    except (TypeError, ValueError) as error:
        raise SceneError(f"points are not numbers: {error}", where=name) from error
    if points.ndim != 2 or points.shape[1] != 4 or not len(points):
        raise SceneError(f"points must be (n, 4), found {points.shape}", where=name)
    wrong = ~np.isfinite(single(points)).all(axis=1) | (points[:, 3] < 0.0)
    if wrong.any():
        i = int(np.argmax(wrong))
        message = f"points[{i}] is not finite, or its radius negative: {points[i].tolist()}"
        raise SceneError(message, where=name)
    if lengths.ndim != 1 or lengths.dtype.kind not in "iu" or lengths.sum() != len(points):
        raise SceneError(f"lengths must add up to the {len(points)} points", where=name)
    if not points[:, 3].max() > 0.0:
        raise SceneError("all radii are zero", where=name)
    points = points.copy()
    points[:, 3] = np.maximum(points[:, 3], THINNEST * points[:, 3].max())
    return points, lengths.astype(np.int64)


def _pieces(spans: Floats) -> Integers:
    """Return how many straight pieces stand for each cubic; a second derivative bounds errors."""
    bend = spans[:, :-2, :3] - 2.0 * spans[:, 1:-1, :3] + spans[:, 2:, :3]
    most = np.linalg.norm(bend, axis=2).max(axis=1)
    allowed = ERROR * spans[:, :, 3].mean(axis=1)
    while True:
        pieces = np.ceil(np.sqrt(0.75 * most / allowed))
        pieces = np.clip(pieces, 1, FINEST).astype(np.int64)
        if pieces.sum() <= max(PIECES, len(spans)):
            return pieces
        allowed = allowed * 2.0


def _bezier(spans: Floats, span: Integers, t: Floats) -> tuple[Floats, Floats]:
    """The curves and their derivatives at t, (n, 4) each."""
    degree, t = spans.shape[1] - 1, t[:, None]
    points: list[Floats] = [spans[span, i] for i in range(degree + 1)]
    while len(points) > 2:  # de Casteljau
        points = [a + (b - a) * t for a, b in pairwise(points)]
    return points[0] + (points[1] - points[0]) * t, degree * (points[1] - points[0])


def _tangents(center: Floats, slope: Floats, strand: Integers) -> Floats:
    """Unit tangents (n, 3); where a curve stands still, that of the neighbours."""
    tangent = slope[:, :3].copy()
    length = np.linalg.norm(tangent, axis=1)
    size = np.linalg.norm(np.ptp(center, axis=0)) + np.abs(center).max()
    still = np.flatnonzero(length <= 1e-7 * size)
    if len(still):
        before, after = np.maximum(still - 1, 0), np.minimum(still + 1, len(center) - 1)
        before = np.where(strand[before] == strand[still], before, still)
        after = np.where(strand[after] == strand[still], after, still)
        tangent[still] = center[after] - center[before]
        length[still] = np.linalg.norm(tangent[still], axis=1)
    point = length == 0.0
    tangent[point], length[point] = (0.0, 0.0, 1.0), 1.0
    return tangent / length[:, None]


def frames(
    tangent: Floats, first: NDArray[np.bool_], world: Floats = SIDES_OF_WORLD
) -> tuple[Floats, Floats]:
    """Return two unit axes across each tangent, which turn along a strand no more than they must.

    tangent: (n, 3) of unit length, strand after strand; first: (n,), where a strand begins;
    world: (3, 3), the axes z, y and x of the world in the space of the tangents, of any length. u
    is a quarter on the side of the first of them that a strand's beginning does not go along.

    Each is the rotation from the tangent before, after all rotations of the strand up to there:
    quaternions, whose products are found in as many passes as a strand's length has bits.
    """
    before = np.roll(tangent, 1, axis=0)
    before[first] = tangent[first]
    turn = np.empty((len(tangent), 4))
    turn[:, 0] = 1.0 + np.einsum("ij,ij->i", before, tangent)
    turn[:, 1:] = np.cross(before, tangent)
    back = turn[:, 0] < 1e-9
    other = np.where(np.abs(before[back, :1]) < 0.5, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    turn[back, 0], turn[back, 1:] = 0.0, np.cross(before[back], other)
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    index = np.arange(len(tangent))
    within = index - np.maximum.accumulate(np.where(first, index, 0))
    step = 1
    while step <= within.max():
        later = np.flatnonzero(within >= step)
        turn[later] = _product(turn[later], turn[later - step])
        step *= 2
    start = _across(tangent[first], world)[np.cumsum(first) - 1]
    half = 2.0 * np.cross(turn[:, 1:], start)
    across = start + turn[:, :1] * half + np.cross(turn[:, 1:], half)
    across -= tangent * np.einsum("ij,ij->i", across, tangent)[:, None]
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return across, np.cross(tangent, across)


def _across(tangent: Floats, world: Floats) -> Floats:
    """Return unit axes (n, 3) across tangents where u is 0: a quarter before a side of `world`."""
    up, *others = world / np.linalg.norm(world, axis=1, keepdims=True)
    across = np.cross(up, tangent)
    for side in others:
        along = np.linalg.norm(across, axis=1) < 1e-6
        across[along] = np.cross(side, tangent[along])
    return np.asarray(across / np.linalg.norm(across, axis=1, keepdims=True))


def _product(a: Floats, b: Floats) -> Floats:
    """Products of quaternions (n, 4): b's rotation, then a's."""
    w = a[:, 0] * b[:, 0] - np.einsum("ij,ij->i", a[:, 1:], b[:, 1:])
    vector = a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:] + np.cross(a[:, 1:], b[:, 1:])
    quaternion = np.column_stack([w, vector])
    return quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)


def _around(
    center: Floats,
    slope: Floats,
    tangent: Floats,
    axes: tuple[Floats, Floats],
    v: Floats,
    lower: Integers,
    sides: int,
) -> tuple[Any, Any, Any, Any]:
    """Return rings around the axes' points, and facets from rings `lower` to the next rings."""
    u = np.arange(sides + 1) / sides
    wider = np.pi / sides / np.sin(np.pi / sides)  # perimeters are that of the circle
    cos, sin = (f(2.0 * np.pi * u)[:, None].astype(np.float32) for f in (np.cos, np.sin))
    e1, e2 = (axis[:, None].astype(np.float32) for axis in axes)
    out = e1 * cos + e2 * sin
    radius = (wider * center[:, 3])[:, None, None].astype(np.float32)
    vertices = center[:, None, :3].astype(np.float32) + radius * out
    speed = np.linalg.norm(slope[:, :3], axis=1)
    lean = slope[:, 3] / np.where(speed > 0.0, speed, np.inf)
    out -= (lean[:, None] * tangent)[:, None].astype(np.float32)
    uvs = np.empty((len(v), sides + 1, 2), np.float32)
    uvs[..., 0], uvs[..., 1] = u, v[:, None]
    corner = ((sides + 1) * lower[:, None] + np.arange(sides)).astype(np.uint32)
    above = np.uint32(sides + 1)
    quads = [corner, corner + 1, corner + 1 + above, corner, corner + 1 + above, corner + above]
    faces = np.stack(quads, axis=2).reshape(-1, 3)
    out /= np.linalg.norm(out, axis=2, keepdims=True)
    return vertices.reshape(-1, 3), faces, out.reshape(-1, 3), uvs.reshape(-1, 2)
