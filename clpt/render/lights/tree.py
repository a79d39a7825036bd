"""The light tree: chooses a light about in proportion to its light at a point.

Conty Estevez and Kulla 2018: a node bounds the positions of its lights, and sums their power. It
has the mean of their light in each direction, where theirs has a bound. The tree is built from the
top by their surface area orientation heuristic, over bins as in pbrt-v4 (12.6.3), a level at a
time. Every second level is then dropped: a point looks at up to WIDTH neighbouring nodes at once.

Cones are as in Conty Estevez and Kulla 2018, 4.1. Lobes are the mean light in each direction. A
flat light sends its power in proportion to max(n . w, 0), half of n . w + |n . w|. Over many lights
the mean of the first term is the mean normal times w. The mean of the second is about the root of
the mean of (n . w)^2, a quadratic form of w: exact where normals are parallel, 2 / sqrt(3) of it
where they point to all sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from clpt import transforms
from clpt.arrays import Floats
from clpt.files import budget
from clpt.render.lights.bounds import Bounds
from clpt.render.records.lights import LINE, NODE, WIDTH

BINS = 12  # along an axis; a node is split between two bins
DEEPEST = 31  # levels below the root; half remain, with two bits of a trail each


@dataclass(frozen=True)
class Tree:
    """A tree over lights, as kernels read it.

    nodes (k, WIDTH) structured as NODE, a group each, the root's first, padded with nodes of power
    0. trails (n,) uint32: the nodes on the way from the root to each light.
    """

    nodes: np.ndarray
    trails: NDArray[np.uint32]

    def words(self, before: int) -> NDArray[np.uint32]:
        """Return the words that follow the rows in `lights`: trails, then the aligned groups.

        before: the number of words of the rows.
        """
        gap = np.zeros(-(before + len(self.trails)) % LINE, np.uint32)
        return np.concatenate([self.trails, gap, self.nodes.ravel().view(np.uint32)])


def build(bounds: Bounds, power: Floats) -> Tree:
    """Build a light tree; power (n,): of each light, in any unit.

    Lights that are not placed have the same weight at every point; they have a separate branch.
    """
    power = np.asarray(power, np.float64)
    builder = _Builder(bounds, power / max(power.sum(), 1e-300))
    rows = np.arange(len(bounds))
    groups = [g for g in (rows[bounds.placed], rows[~bounds.placed]) if len(g)]
    if len(groups) == 2:
        order = np.concatenate(groups)
        builder.node(np.array([0]), builder.summed(order, np.array([0])), child=np.array([1]))
        starts, depth = np.array([0, len(groups[0])]), 1
    else:
        order, starts, depth = rows, np.array([0]), 0
    builder.run(order, starts, depth)
    return _widened(builder.nodes[: builder.count], split_root=depth == 1)


def _widened(nodes: np.ndarray, split_root: bool) -> Tree:
    """Return the groups of a binary tree (k,) structured as NODE.

    split_root: the root's two children become a separate group.
    """
    empty = np.zeros(1, NODE.dtype)
    empty["child"] = -1
    nodes = np.concatenate([nodes, empty])
    trails = np.zeros(int((nodes["child"][:-1] < 0).sum()), np.uint32)
    if nodes["child"][0] < 0:
        return Tree(nodes[[[0] + [-1] * (WIDTH - 1)]], trails)
    groups, inner, trail = [], np.array([0]), np.zeros(1, np.uint32)
    count, depth = 1, 0
    while len(inner):
        pairs = nodes["child"][inner][:, None] + [0, 1]
        down = nodes["child"][pairs]
        split = (down >= 0) & (depth > 0 or not split_root)
        first, second = np.where(split, down, pairs), np.where(split, down + 1, -1)
        slots = np.stack([first, second], axis=2).reshape(-1, WIDTH)
        group = nodes[slots]
        trail = trail[:, None] | np.arange(WIDTH, dtype=np.uint32) << np.uint32(2 * depth)
        leaf, more = (group["child"] < 0) & (slots >= 0), group["child"] >= 0
        trails[-1 - group["child"][leaf]] = trail[leaf]
        inner, trail = slots[more], trail[more]
        group["child"][more] = count + np.arange(len(inner))
        groups.append(group)
        count, depth = count + len(inner), depth + 1
    return Tree(np.concatenate(groups), trails)


@dataclass
class _Level:
    """Sums and bounds (k,) of the nodes of a level, over segments of lights."""

    low: Floats
    high: Floats
    cones: Cones
    lobes: Lobes


def _counts(starts: NDArray[np.int64], n: int) -> NDArray[np.int64]:
    return np.diff(np.append(starts, n))


class _Builder:
    """The nodes of an unfinished binary tree."""

    def __init__(self, bounds: Bounds, power: Floats):
        self.bounds, self.power, self.lobes = bounds, power, Lobes.of(bounds, power)
        self.nodes = np.zeros(2 * len(bounds) + 1, NODE.dtype)
        self.count = 1

    def summed(self, order: NDArray[np.int64], starts: NDArray[np.int64]) -> _Level:
        """Return bounds and power over the segments of `order` that begin at `starts`."""
        bounds = self.bounds[order]
        return _Level(
            np.minimum.reduceat(bounds.low, starts),
            np.maximum.reduceat(bounds.high, starts),
            around(Cones.of(bounds), starts),
            self.lobes.summed(order, starts),
        )

    def node(self, at: NDArray[np.int64], level: _Level, child: NDArray[np.int64]) -> None:
        """Fill in nodes; nodes of lights without a place get their radius afterwards."""
        nodes = np.zeros(len(at), NODE.dtype)
        mean, second, center = level.lobes.means()
        far = np.maximum(center - level.low, level.high - center)
        nodes["center"] = center
        nodes["radius"] = np.linalg.norm(np.maximum(far, 0.0), axis=1) * (1.0 + 1e-5)
        nodes["mean"], nodes["cos_e"] = mean, reach(mean, level.cones)
        nodes["squares"] = second[:, [0, 1, 2], [0, 1, 2]]
        nodes["products"] = second[:, [1, 2, 0], [2, 0, 1]]
        nodes["power"], nodes["child"] = level.lobes.power, child
        self.nodes[at] = nodes
        self.count = max(self.count, int(at.max()) + 1)

    def run(self, order: NDArray[np.int64], starts: NDArray[np.int64], depth: int) -> None:
        """Make the nodes of a level, for segments of `order`, and all levels below."""
        at = depth + np.arange(len(starts))
        free = int(at[-1]) + 1
        while len(order):
            budget.check_time()
            level, counts = self.summed(order, starts), _counts(starts, len(order))
            inner = counts > 1
            child = np.where(inner, free + 2 * (np.cumsum(inner) - 1), -1 - order[starts])
            self.node(at, level, child)
            self.nodes["radius"][at[~self.bounds.placed[order[starts]]]] = -1.0
            kept = np.repeat(inner, counts)
            order, counts = order[kept], counts[inner]
            if not len(order):
                break
            starts = np.concatenate([[0], np.cumsum(counts)[:-1]])
            side = self._sides(order, starts, counts, level, inner, depth)
            segment = np.repeat(np.arange(len(counts)), counts)
            order = order[np.argsort(2 * segment + side, kind="stable")]
            right = np.add.reduceat(side.astype(np.int64), starts)
            starts = np.stack([starts, starts + counts - right], axis=1).ravel()
            at = free + np.arange(2 * len(counts))
            free += 2 * len(counts)
            depth += 1

    def _sides(
        self,
        order: NDArray[np.int64],
        starts: NDArray[np.int64],
        counts: NDArray[np.int64],
        level: _Level,
        inner: NDArray[np.bool_],
        depth: int,
    ) -> NDArray[np.int64]:
        """Return the child (n,) of each light, 0 or 1; both get some."""
        segment = np.repeat(np.arange(len(counts)), counts)
        place = np.arange(len(order)) - starts[segment]
        side = (2 * place >= counts[segment]).astype(np.int64)
        deep = depth + np.ceil(np.log2(counts)).astype(np.int64) + 1 >= DEEPEST
        large = (counts > 2) & ~deep
        if not large.any():
            return side
        chosen = large[segment]
        number = np.cumsum(large) - 1
        size = (level.high - level.low)[inner][large]
        best, split = self._splits(order[chosen], number[segment[chosen]], size)
        side[chosen] = np.where(split[number[segment[chosen]]], best, side[chosen])
        return side

    def _splits(
        self, order: NDArray[np.int64], segment: NDArray[np.int64], size: Floats
    ) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Return the best side of each light (n,), and whether each segment (k,) can be split."""
        bounds, power, k = self.bounds[order], self.power[order], len(size)
        starts = np.searchsorted(segment, np.arange(k))
        centers = 0.5 * (bounds.low + bounds.high)
        lo, hi = np.minimum.reduceat(centers, starts), np.maximum.reduceat(centers, starts)
        best = np.full(k, np.inf)
        side = np.zeros(len(order), np.int64)
        longest = np.maximum(size.max(axis=1), 1e-30)
        for axis in range(3):
            extent = hi[:, axis] - lo[:, axis]
            scale = np.where(extent > 0.0, BINS / np.where(extent > 0.0, extent, 1.0), 0.0)
            bins = np.minimum((centers[:, axis] - lo[segment, axis]) * scale[segment], BINS - 1)
            bins = bins.astype(np.int64)
            costs = _costs(bounds, power, segment * BINS + bins, k)
            costs *= (longest / np.maximum(size[:, axis], 1e-3 * longest))[:, None]
            costs[extent <= 0.0] = np.inf
            at = np.argmin(costs, axis=1)
            cost = costs[np.arange(k), at]
            better = cost < best
            best = np.where(better, cost, best)
            side = np.where(better[segment], bins > at[segment], side)
        return side, np.isfinite(best)


def _costs(bounds: Bounds, power: Floats, key: NDArray[np.int64], k: int) -> Floats:
    """Return costs (k, BINS - 1) of splitting behind each bin; infinite where a side is empty.

    Conty Estevez and Kulla 2018 eq. 1: the sum over both sides of power times surface area times
    measure of directions. Flat boxes and points get a little more area.
    """
    sort = np.argsort(key, kind="stable")
    ordered = key[sort]
    starts = np.flatnonzero(np.diff(ordered, prepend=ordered[0] - 1))
    present = ordered[starts]
    shape = (k, BINS)
    low, high = np.full((k * BINS, 3), np.inf), np.full((k * BINS, 3), -np.inf)
    low[present] = np.minimum.reduceat(bounds.low[sort], starts)
    high[present] = np.maximum.reduceat(bounds.high[sort], starts)
    cones = Cones.none(k * BINS)
    cones[present] = around(Cones.of(bounds[sort]), starts)
    sums = np.bincount(key, power, k * BINS).reshape(shape)
    number = np.bincount(key, minlength=k * BINS).reshape(shape)
    boxes = low.reshape(*shape, 3), high.reshape(*shape, 3)
    total = np.zeros((k, BINS - 1))
    empty = np.zeros((k, BINS - 1), bool)
    for step in (1, -1):
        span = slice(None, None, step)
        lows = np.minimum.accumulate(boxes[0][:, span], axis=1)
        highs = np.maximum.accumulate(boxes[1][:, span], axis=1)
        reach = np.maximum(highs - lows, 0.0)
        area = (reach * np.roll(reach, 1, axis=2)).sum(axis=2) + 1e-6 * reach.max(axis=2) ** 2
        counts = np.cumsum(number[:, span], axis=1)
        part = np.cumsum(sums[:, span], axis=1) * np.maximum(area, 1e-30)
        part *= _measures(cones, shape, step)
        total += part[:, :-1] if step == 1 else part[:, :-1][:, ::-1]
        none = counts[:, :-1] == 0
        empty |= none if step == 1 else none[:, ::-1]
    return np.where(empty, np.inf, total)


def _measures(cones: Cones, shape: tuple[int, int], step: int) -> Floats:
    """Return measures (k, BINS) of cones around all bins up to each; step -1: from the last."""
    at = np.arange(shape[0] * shape[1]).reshape(shape)[:, ::step]
    measures = np.empty(shape)
    sofar = cones[at[:, 0]]
    for i in range(shape[1]):
        sofar = sofar if i == 0 else merged(sofar, cones[at[:, i]])
        measures[:, i] = measure(sofar)
    return measures


EMPTY = -1.0  # theta_o of an empty cone


@dataclass
class Cones:
    """The cones of n lights; see Bounds.

    axis (n, 3); theta_o, theta_e (n,) [rad]; both (n,) bool.
    """

    axis: Floats
    theta_o: Floats
    theta_e: Floats
    both: NDArray[np.bool_]

    @classmethod
    def of(cls, bounds: Bounds) -> Cones:
        return cls(bounds.axis, bounds.theta_o, bounds.theta_e, bounds.both)

    @classmethod
    def none(cls, count: int) -> Cones:
        """Return empty cones."""
        axis = np.tile([0.0, 0.0, 1.0], (count, 1))
        return cls(axis, np.full(count, EMPTY), np.zeros(count), np.zeros(count, bool))

    @property
    def arrays(self) -> tuple[Any, ...]:
        """The arrays, in the order of the fields."""
        return self.axis, self.theta_o, self.theta_e, self.both

    def __getitem__(self, rows: ArrayLike) -> Cones:
        return Cones(*(array[rows] for array in self.arrays))

    def __setitem__(self, rows: ArrayLike, others: Cones) -> None:
        for array, values in zip(self.arrays, others.arrays, strict=True):
            array[rows] = values


def around(cones: Cones, starts: NDArray[np.int64]) -> Cones:
    """Return the cones around the segments of `cones` that begin at `starts`."""
    total = np.add.reduceat(cones.axis, starts)
    lost = np.linalg.norm(total, axis=1) < 1e-6
    axis = np.where(lost[:, None], [0.0, 0.0, 1.0], transforms.unit_vectors(total))
    counts = np.diff(np.append(starts, len(cones.theta_o)))
    leans = angle(np.repeat(axis, counts, axis=0), cones.axis) + cones.theta_o
    theta_o = np.where(lost, np.pi, np.minimum(np.maximum.reduceat(leans, starts), np.pi))
    return Cones(
        axis,
        theta_o,
        np.maximum.reduceat(cones.theta_e, starts),
        np.logical_or.reduceat(cones.both, starts),
    )


def merged(a: Cones, b: Cones) -> Cones:
    """Return the smallest cones around pairs of cones; either may be empty."""
    swap = b.theta_o > a.theta_o
    wide, thin = _where(swap, b, a), _where(swap, a, b)
    between = angle(wide.axis, thin.axis)
    inside = (thin.theta_o < 0.0) | (np.minimum(between + thin.theta_o, np.pi) <= wide.theta_o)
    theta_o = 0.5 * (wide.theta_o + between + thin.theta_o)
    whole = (theta_o >= np.pi) | (between > np.pi - 1e-6)
    turn = theta_o - wide.theta_o
    sine = np.maximum(np.sin(between), 1e-12)[:, None]
    axis = np.sin(between - turn)[:, None] / sine * wide.axis
    axis = axis + np.sin(turn)[:, None] / sine * thin.axis
    keep = inside | whole
    return Cones(
        np.where(keep[:, None], wide.axis, axis),
        np.where(inside, wide.theta_o, np.where(whole, np.pi, theta_o)),
        np.maximum(wide.theta_e, np.where(thin.theta_o < 0.0, 0.0, thin.theta_e)),
        a.both | b.both,
    )


def measure(cones: Cones) -> Floats:
    """Return the measure of the lit directions (ibid. eq. 2), (n,); 0 for an empty cone."""
    o = np.maximum(cones.theta_o, 0.0)
    w = np.minimum(o + cones.theta_e, np.pi)
    sine, cosine = np.sin(o), np.cos(o)
    edge = 2.0 * w * sine - np.cos(o - 2.0 * w) - 2.0 * o * sine + cosine
    total = 2.0 * np.pi * (1.0 - cosine) + 0.5 * np.pi * edge
    return np.where(cones.theta_o < 0.0, 0.0, total)


def _where(mask: NDArray[np.bool_], a: Cones, b: Cones) -> Cones:
    return Cones(
        np.where(mask[:, None], a.axis, b.axis),
        np.where(mask, a.theta_o, b.theta_o),
        np.where(mask, a.theta_e, b.theta_e),
        np.where(mask, a.both, b.both),
    )


def angle(a: Floats, b: Floats) -> Floats:
    """Return the angles (n,) between unit vectors (n, 3), exact for small angles too (Kahan)."""
    return 2.0 * np.arctan2(np.linalg.norm(a - b, axis=1), np.linalg.norm(a + b, axis=1))


FLAT, ROUND = 0.625, 0.375  # give 1, (2 sqrt(2) / pi)^2 and 3/4 for 1, 2 and 3 equal axes
NEARLY = 1e-3  # [rad]


@dataclass
class Lobes:
    """Sums over lights: power (n,); power times normals (n, 3), times products of the normals'
    components (n, 3, 3), and times centres (n, 3) [m]."""

    power: Floats
    mean: Floats
    second: Floats
    center: Floats

    @classmethod
    def of(cls, bounds: Bounds, power: Floats) -> Lobes:
        """Return the lobes of lights whose normals spread evenly around their axes.

        A light that shines evenly into a cone, up to a hemisphere, counts at most as a surface
        along its normal: the power of several does not lie in a single direction. In a wider cone
        light spreads evenly around the axis, as normals do.
        """
        cosine = np.cos(bounds.theta_o)[:, None]
        square = (1.0 + cosine + cosine**2)[..., None] / 3.0
        outer = bounds.axis[:, :, None] * bounds.axis[:, None, :]
        second = square * outer + 0.5 * (1.0 - square) * (np.eye(3) - outer)
        mean = np.where(bounds.both[:, None], 0.0, bounds.axis * (1.0 + cosine) / 2.0)
        right = np.pi / 2.0
        narrow = (bounds.theta_e < right - NEARLY) & (bounds.theta_o < right + NEARLY)
        height = np.minimum(0.5 / np.maximum(1.0 - cosine, 1e-6), 1.0)
        mean = np.where(narrow[:, None], height * bounds.axis, mean)
        second = np.where(narrow[:, None, None], height[..., None] ** 2 * np.eye(3), second)
        weight = power[:, None]
        return cls(power, weight * mean, weight[..., None] * second, weight * bounds.center)

    def summed(self, order: NDArray[np.int64], starts: NDArray[np.int64]) -> Lobes:
        """Return the sums over the segments of `order` that begin at `starts`."""
        arrays = self.power, self.mean, self.second, self.center
        return Lobes(*(np.add.reduceat(array[order], starts) for array in arrays))

    def means(self) -> tuple[Floats, Floats, Floats]:
        """Return mean (n, 3), second (n, 3, 3) and center (n, 3) of NODE.

        The deviation from the mean in `second` is scaled down, as the root of a mean of squares is
        above the mean: by 1, (2 sqrt(2) / pi)^2 and 3/4 where normals vary equally along 1, 2 and 3
        axes. The factor is linear in the sum of the squared shares of the axes.
        """
        over = 1.0 / np.maximum(self.power, 1e-300)[:, None]
        mean, center = self.mean * over, self.center * over
        parallel = mean[:, :, None] * mean[:, None, :]
        deviation = self.second * over[..., None] - parallel
        trace = np.maximum(np.einsum("nii->n", deviation), 1e-12)
        shares = np.minimum(np.square(deviation).sum(axis=(1, 2)) / trace**2, 1.0)
        return mean, parallel + (FLAT + ROUND * shares)[:, None, None] * deviation, center


def reach(mean: Floats, cones: Cones) -> Floats:
    """Return the cosine (n,) of the largest angle between `mean` (n, 3) and a direction with light.

    -1 where it is unknown, or more than a right angle.
    """
    length = np.linalg.norm(mean, axis=1, keepdims=True)
    between = angle(mean / np.maximum(length, 1e-12), cones.axis)
    total = between + np.maximum(cones.theta_o, 0.0) + cones.theta_e
    bounded = (cones.theta_e < np.pi / 2.0 - NEARLY) & (length[:, 0] > 1e-6)
    return np.where(bounded & (total < np.pi / 2.0), np.cos(total), -1.0)
