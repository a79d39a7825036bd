"""Curves on their way to the device: pieces of cubics that rays meet as they are.

A cubic is cut into pieces that bend little and whose boxes are not much larger than they are. A
piece has PIECE_WORDS words in the table `spheres`: a hot row of 16 that each ray reads, and behind
all hot rows a cold row of 8 that only a hit reads.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clpt import transforms
from clpt.errors import SceneError
from clpt.render.lowering.geometry import analytic, shapes, tubes
from clpt.scene.shapes import Curves

HOT, COLD = 16, 8  # words of a piece
BEND = np.pi / 6.0  # by which the control polygon of a piece may turn
SLENDER = 20.0  # times as large as the piece a box may be, before the piece is cut
MOST_CUTS = 64  # of a cubic
MANY = 1 << 22  # pieces of a shape from which on cubics are cut less, as far as they bend little
CELL_BITS = 12  # of each axis, in the order of pieces
KINK = 1e-3  # between pieces, from which on the gap is closed by a half sphere [rad]
MOST = (1 << 31) // (HOT + COLD) - 1  # pieces: kernels count words by an int


@dataclass(frozen=True)
class Pieces:
    """Pieces of curves in the world.

    hot: (n, 16) float32, of the four control points of a Bezier cubic the x, then the y, the z, and
    the radii [m]; where a half sphere closes the piece, the radius at that end is negated. cold: (n, 8) float32, an axis
    (3) across the curve at its beginning, from which u is counted, v there and its growth, and
    three that mean nothing.
    """

    hot: NDArray[np.float32]
    cold: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.hot)


def pieces(shape: Curves) -> Pieces:
    """Return the pieces of all strands.

    Raises SceneError for points that are no curves, or a transform that stretches.
    """
    name, matrix = shapes.where(shape), shapes.placement(shape)
    scale = float(analytic.row(shape).view(np.float32)[analytic.member("curve", "scale")])
    spans, strand = tubes.cubics(shape, name)
    if spans.shape[1] == 2:  # a straight cubic, at an even speed
        a, b = spans[:, :1], spans[:, 1:]
        spans = np.concatenate([a, (2.0 * a + b) / 3.0, (a + 2.0 * b) / 3.0, b], axis=1)
    spans = spans.copy()
    spans[..., :3] = transforms.transform_points(matrix, spans[..., :3].reshape(-1, 3)).reshape(
        *spans.shape[:2], 3
    )
    spans[..., 3] *= scale
    cuts = _cuts(spans)
    span = np.repeat(np.arange(len(spans)), cuts)
    if len(span) > MOST:
        raise SceneError(f"its strands are {len(span):,} pieces, at most {MOST:,}", where=name)
    begin = (np.arange(len(span)) - (np.cumsum(cuts) - cuts)[span]) / cuts[span]
    control = _between(spans[span], begin, begin + 1.0 / cuts[span])
    first = np.append(True, strand[span[1:]] != strand[span[:-1]])
    start, end = _directions(control)
    cold = np.zeros((len(span), COLD), np.float32)
    cold[:, :3] = tubes.frames(start, first)[0]
    cold[:, 3], cold[:, 4] = (span + begin) / len(spans), 1.0 / (cuts[span] * len(spans))
    hot = control.astype(np.float32)
    if not np.isfinite(hot).all():
        raise SceneError("its transform moves points out of float32", where=name)
    closed_start, closed_end = _closed(control, start, end, first)
    hot[closed_start, 0, 3] *= -1.0
    hot[closed_end, 3, 3] *= -1.0
    order = _near_to_each_other(hot[:, 0, :3])
    return Pieces(np.ascontiguousarray(hot.swapaxes(1, 2)[order]).reshape(-1, HOT), cold[order])


def boxes(placed: Pieces) -> NDArray[np.float32]:
    """Return a box around each piece, (n, 2, 3) float32."""
    control = placed.hot.reshape(-1, 4, 4).swapaxes(1, 2)
    low, high = control[..., :3].min(axis=1), control[..., :3].max(axis=1)
    radius = np.abs(control[..., 3]).max(axis=1)
    size = np.maximum(np.abs(low), np.abs(high)).max(axis=1, initial=0.0) + 2.0 * radius
    reach = (radius + np.float32(analytic.PADDING) * size)[:, None]
    return np.stack([low - reach, high + reach], axis=1).astype(np.float32)


def _near_to_each_other(points: NDArray[np.float32]) -> NDArray[np.intp]:
    """An order of points (n, 3) along a Z curve: rays that meet one soon meet its neighbours."""
    low, high = points.min(axis=0), points.max(axis=0)
    cells = (points - low) / np.where(high > low, high - low, 1.0) * ((1 << CELL_BITS) - 1)
    keys = np.zeros(len(points), np.uint64)
    for axis, cell in enumerate(cells.astype(np.uint64).T):
        for bit in range(CELL_BITS):
            keys |= (cell >> np.uint64(bit) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return np.argsort(keys, kind="stable")


def _cuts(spans: NDArray[np.float64]) -> NDArray[np.int64]:
    """Into how many pieces each cubic is cut."""
    edges = np.diff(spans[..., :3], axis=1)
    length = np.linalg.norm(edges, axis=2)
    unit = edges / np.maximum(length, 1e-300)[..., None]
    cosine = np.clip(np.einsum("sij,sij->si", unit[:, 1:], unit[:, :-1]), -1.0, 1.0)
    turn = np.where(np.minimum(length[:, 1:], length[:, :-1]) > 0.0, np.arccos(cosine), 0.0)
    least = np.ceil(turn.sum(axis=1) / BEND)
    low, high = spans[..., :3].min(axis=1), spans[..., :3].max(axis=1)
    x, y, z = (high - low).T
    own = spans[..., 3].mean(axis=1) * np.maximum(length.sum(axis=1), 1e-300)
    slender = SLENDER
    while True:
        wanted = np.ceil((x * y + y * z + z * x) / (slender * np.maximum(own, 1e-300)))
        cuts = np.clip(np.maximum(least, wanted), 1, MOST_CUTS).astype(np.int64)
        if cuts.sum() <= MANY or (wanted <= least).all():
            return cuts
        slender *= 2.0


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
    found = []
    for order in ((0, 1, 2, 3), (3, 2, 1, 0)):
        p = control[:, order, :3]
        tangent = p[:, 1] - p[:, 0]
        size = np.abs(p - p[:, :1]).max(axis=(1, 2))
        for later in (2, 3):
            still = np.linalg.norm(tangent, axis=1) <= 1e-6 * size
            tangent[still] = p[still, later] - p[still, 0]
        length = np.linalg.norm(tangent, axis=1, keepdims=True)
        tangent = np.where(length > 0.0, tangent / np.where(length > 0.0, length, 1.0), [0, 0, 1])
        found.append(tangent)
    return found[0], np.where((control[:, :, :3] == control[:, :1, :3]).all((1, 2))[:, None],
                              found[1], -found[1])


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
