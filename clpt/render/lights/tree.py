"""The light tree: chooses a light about in proportion to its light at a point.

Conty Estevez and Kulla 2018: a node bounds the places of its lights, and sums their power. It knows
the mean of their light in each direction (tree_nodes.py), where theirs knows a bound. It is built
from the top by their surface area orientation heuristic, over bins as in pbrt-v4 (12.6.3), a level
at a time. Every second level is then dropped: a point looks at up to WIDTH neighbouring nodes at
once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from clpt.arrays import Floats
from clpt.render.lights.bounds import Bounds
from clpt.render.lights.tree_nodes import Cones, Lobes, around, measure, merged, reach
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
