"""Curves on their way to the device: pieces of cubics that rays meet as they are.

A cubic is cut into pieces that bend little and whose boxes are not much larger than they are. A
piece has WORDS words in the table `spheres`: CONTROL that each ray reads, and behind them those
that only a hit reads. Pieces that are near to each other lie near to each other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.arrays import Floats32
from clpt.errors import SceneError
from clpt.geometry import analytic, shapes, tubes
from clpt.records import CURVE_SIZES
from clpt.scene.shapes import Curves

CONTROL, WORDS = 16, CURVE_SIZES["words"]  # words of a piece: its control points, and all
BEND = np.pi / 6.0  # most turn of a piece's control polygon
SLENDER = 20.0  # times as large as the piece a box may be, before the piece is cut
MOST_CUTS = 64  # of a cubic
ROUNDS = 4  # of looking at whether pieces turn little, and cutting more
MANY = 1 << 22  # pieces of a shape; above this number, cubics that bend little are cut less
CELL_BITS = 12  # of each axis, in the order of pieces
KINK = 1e-3  # least angle between pieces whose gap is closed by a half sphere [rad]
MOST = (1 << 31) // WORDS - 1  # pieces: kernels count words by an int


def pieces(shape: Curves, cut_as: Curves | None = None) -> Floats32:
    """Return the pieces of all strands in the world, (n, WORDS) float32.

    A row has the four control points of a Bezier cubic: x, then y, z, and the radii [m]; if a half
    sphere closes the piece, the radius at that end is negated. Then an axis (3) across the curve at
    its beginning, the origin of u; v there, and the increase of v; three unused words. cut_as: the
    same curves under another transform; their number of pieces is used.

    Raises SceneError for points that are no curves, or a transform that stretches.
    """
    return _pieces(shape, cut_as)[0]


def strands(shape: Curves) -> NDArray[np.int64]:
    """Return the strand of each of `pieces`, (n,). Raises as that does."""
    return _pieces(shape)[1]


def _pieces(shape: Curves, cut_as: Curves | None = None) -> tuple[Floats32, NDArray[np.int64]]:
    """The pieces of all strands, and the strand of each."""
    name = shapes.where(shape)
    spans, strand = _in_world(shape)
    cuts = _cuts(spans if cut_as is None else _in_world(cut_as)[0])
    span = np.repeat(np.arange(len(spans)), cuts)
    if len(span) > MOST:
        raise SceneError(f"its strands are {len(span):,} pieces, at most {MOST:,}", where=name)
    begin = (np.arange(len(span)) - (np.cumsum(cuts) - cuts)[span]) / cuts[span]
    control = _between(spans[span], begin, begin + 1.0 / cuts[span])
    first = np.append(True, strand[span[1:]] != strand[span[:-1]])
    start, end = _directions(control)
    rows_ = np.zeros((len(span), WORDS), np.float32)
    rows_[:, CONTROL : CONTROL + 3] = tubes.frames(start, first)[0]
    rows_[:, CONTROL + 3] = (span + begin) / len(spans)
    rows_[:, CONTROL + 4] = 1.0 / (cuts[span] * len(spans))
    points = control.astype(np.float32)
    if not np.isfinite(points).all():
        raise SceneError("its transform moves points out of float32", where=name)
    closed_start, closed_end = _closed(control, start, end, first)
    points[closed_start, 0, 3] *= -1.0
    points[closed_end, 3, 3] *= -1.0
    rows_[:, :CONTROL] = points.swapaxes(1, 2).reshape(-1, CONTROL)
    order = _near_to_each_other(points[:, 0, :3])
    return rows_[order], strand[span[order]]


def boxes(placed: Floats32) -> NDArray[np.float32]:
    """Return a box around each piece, (n, 2, 3) float32."""
    control = placed[:, :CONTROL].reshape(-1, 4, 4).swapaxes(1, 2)
    low, high = control[..., :3].min(axis=1), control[..., :3].max(axis=1)
    radius = np.abs(control[..., 3]).max(axis=1)
    size = np.maximum(np.abs(low), np.abs(high)).max(axis=1, initial=0.0) + 2.0 * radius
    reach = (radius + np.float32(analytic.PADDING) * size)[:, None]
    return np.stack([low - reach, high + reach], axis=1).astype(np.float32)


def _in_world(shape: Curves) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The cubics of all strands (s, 4, 4) in the world, and the strand of each."""
    spans, strand = tubes.cubics(shape, shapes.where(shape))
    if spans.shape[1] == 2:  # a straight cubic, at an even speed
        a, b = spans[:, :1], spans[:, 1:]
        spans = np.concatenate([a, (2.0 * a + b) / 3.0, (a + 2.0 * b) / 3.0, b], axis=1)
    matrix, placed = shapes.placement(shape), np.empty(spans.shape)
    points = transforms.transform_points(matrix, spans[..., :3].reshape(-1, 3))
    placed[..., :3] = points.reshape(*spans.shape[:2], 3)
    scale = analytic.row(shape).view(np.float32)[analytic.member("curve", "scale")]
    placed[..., 3] = spans[..., 3] * float(scale)
    return placed, strand


def _near_to_each_other(points: NDArray[np.float32]) -> NDArray[np.intp]:
    """Return an order of points (n, 3) along a Z curve, so that neighbours are close in memory."""
    low, high = points.min(axis=0), points.max(axis=0)
    cells = (points - low) / np.where(high > low, high - low, 1.0) * ((1 << CELL_BITS) - 1)
    keys = np.zeros(len(points), np.uint64)
    for axis, cell in enumerate(cells.astype(np.uint64).T):
        for bit in range(CELL_BITS):
            keys |= (cell >> np.uint64(bit) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(keys, kind="stable")


def _cuts(spans: NDArray[np.float64]) -> NDArray[np.int64]:
    """Into how many pieces each cubic is cut."""
    least = np.maximum(np.ceil(_turn(spans) / BEND), 1.0).astype(np.int64)
    turning = np.flatnonzero(least > 1)
    for _ in range(ROUNDS):  # where a cubic turns most within little of its length
        turns = least[turning]
        span = np.repeat(turning, turns)
        begin = (np.arange(len(span)) - np.repeat(np.cumsum(turns) - turns, turns)) / least[span]
        turn = _turn(_between(spans[span], begin, begin + 1.0 / least[span]))
        turning = np.unique(span[turn > 1.5 * BEND])
        turning = turning[least[turning] < MOST_CUTS]
        least[turning] *= 2
    length = np.linalg.norm(np.diff(spans[..., :3], axis=1), axis=2)
    low, high = spans[..., :3].min(axis=1), spans[..., :3].max(axis=1)
    x, y, z = (high - low).T
    turns = spans[..., 3].mean(axis=1) * np.maximum(length.sum(axis=1), 1e-300)
    slender = SLENDER
    while True:
        wanted = np.ceil((x * y + y * z + z * x) / (slender * np.maximum(turns, 1e-300)))
        cuts = np.clip(np.maximum(least, wanted), 1, MOST_CUTS).astype(np.int64)
        if cuts.sum() <= MANY or (wanted <= least).all():
            return cuts
        slender *= 2.0


def _turn(spans: NDArray[np.float64]) -> NDArray[np.float64]:
    """By how much the control polygon of each cubic turns, (n,) [rad]."""
    edges = np.diff(spans[..., :3], axis=1)
    for i, others in ((2, (1, 0)), (1, (2,)), (0, (1,))):  # of no length: as the next
        for other in others:
            still = ~edges[:, i].any(axis=1)
            edges[still, i] = edges[still, other]
    unit = edges / np.maximum(np.linalg.norm(edges, axis=2), 1e-300)[..., None]
    cosine = np.einsum("sij,sij->si", unit[:, 1:], unit[:, :-1])
    moves = edges.any(axis=(1, 2))
    return np.where(moves, np.arccos(np.clip(cosine, -1.0, 1.0)).sum(axis=1), 0.0)


def _between(
    spans: NDArray[np.float64], begin: NDArray[np.float64], end: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The parts of Bezier cubics between two parameters each, as Bezier cubics (n, 4, 4)."""

    def blossom(*at: NDArray[np.float64]) -> NDArray[np.float64]:
        points = spans
        for t in at:
            points = points[:, :-1] + (points[:, 1:] - points[:, :-1]) * t[:, None, None]
        return points[:, 0]

    a, b = begin, end
    return np.stack([blossom(a, a, a), blossom(a, a, b), blossom(a, b, b), blossom(b, b, b)], 1)


def _directions(control: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit tangents at both ends (n, 3); of a piece that is a point, z."""
    axes = []
    for order in ((0, 1, 2, 3), (3, 2, 1, 0)):
        p = control[:, order, :3]
        tangent = p[:, 1] - p[:, 0]
        size = np.abs(p - p[:, :1]).max(axis=(1, 2))
        for later in (2, 3):
            still = np.linalg.norm(tangent, axis=1) <= 1e-6 * size
            tangent[still] = p[still, later] - p[still, 0]
        tangent = transforms.unit_vectors(tangent)
        axes.append(np.where(tangent.any(axis=1, keepdims=True), tangent, [0, 0, 1]))
    return axes[0], np.where(
        (control[:, :, :3] == control[:, :1, :3]).all((1, 2))[:, None], axes[1], -axes[1]
    )


def _closed(
    control: NDArray[np.float64],
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    first: NDArray[np.bool_],
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Where a half sphere closes a piece: at both ends of strands, and at the end before a kink."""
    last = np.append(first[1:], True)
    speed = np.linalg.norm(np.diff(control[..., :3], axis=1), axis=2)
    lean = np.diff(control[..., 3], axis=1) / np.maximum(speed, 1e-300)
    turned = np.linalg.norm(end[:-1] - start[1:], axis=1)
    widened = np.abs(np.clip(lean[:-1, 2], -2.0, 2.0) - np.clip(lean[1:, 0], -2.0, 2.0))
    kink = np.append(turned + widened > KINK, False)
    return first, last | kink
