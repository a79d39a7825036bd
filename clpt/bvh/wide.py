"""Collapse of a binary tree to 8-wide nodes, by kernels/bvh/collapse.cl."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pyopencl as cl

from ..records import TREE_SIZES
from .building import Building
from .tree import Tree

_ROOT = "bvh/collapse.cl"
_DEEPEST = TREE_SIZES["depth"]


@dataclass(frozen=True)
class Collapse:
    """The binary nodes that become wide nodes and leaves, on the device.

    costs, occlusion: of the binary nodes; roots: binary nodes that become wide nodes; firsts: a
    wide node's first child and first leaf; leaf_roots: binary nodes that become wide leaves;
    totals: the numbers of both, and the wide tree's figures.
    """

    built: Tree
    costs: cl.Buffer
    occlusion: cl.Buffer
    roots: cl.Buffer
    firsts: cl.Buffer
    leaf_roots: cl.Buffer
    totals: cl.Buffer


@dataclass(frozen=True)
class Figures:
    """The numbers of a wide tree's nodes and leaves.

    steps: (begin, count) of the nodes of each level, the lowest first; stats: see `Bvh`.
    """

    nodes: int
    leaves: int
    steps: tuple[tuple[int, int], ...]
    stats: dict[str, float]


def collapse(building: Building, built: Tree) -> Collapse:
    """Enqueue the choice and numbering of wide nodes; the host does not wait."""
    n = built.count
    costs, occlusion = building.allocate(64 * n), building.allocate(8 * n)
    below = {"nodes": built.nodes, "costs": costs, "occlusion": occlusion}
    parts = {"items": built.items, "ranges": built.ranges, **below}
    begin = (1 << built.levels) - 1
    building.run(_ROOT, "collapse_subtree", 1 << built.levels, begin=begin, **parts)
    for level in reversed(range(built.levels)):
        begin = (1 << level) - 1
        building.run(_ROOT, "collapse_level", 1 << level, begin=begin, **parts)

    roots, firsts = building.allocate(4 * n), building.allocate(8 * n)
    leaf_roots, totals = building.allocate(4 * n), building.allocate(4 * (4 + _DEEPEST))
    numbers = {"roots": roots, "firsts": firsts, "leaf_roots": leaf_roots, "totals": totals}
    binary = {"nodes": built.nodes, "costs": costs, "count": 2 * n}
    building.run(_ROOT, "collapse_number", 1, **binary, **numbers)
    return Collapse(built, costs, occlusion, roots, firsts, leaf_roots, totals)


def figures(building: Building, chosen: Collapse) -> Figures:
    """Wait and return the figures of a wide tree."""
    words = building.read(chosen.totals, 4 + _DEEPEST, np.uint32)
    n_nodes, n_leaves, levels = words[:3].tolist()
    starts = [*words[4 : 4 + levels].tolist(), n_nodes]
    steps = tuple((begin, end - begin) for begin, end in pairwise(starts))[::-1]
    cost = float(words[3:].view(np.float32)[0])
    stats = {"nodes": n_nodes, "leaves": n_leaves, "depth": levels - 1, "cost": cost}
    return Figures(n_nodes, n_leaves, steps, stats)


def write_nodes(building: Building, chosen: Collapse, nodes: cl.Buffer) -> None:
    """Enqueue writing of all wide nodes, or as many as the buffer holds."""
    building.run_each(
        _ROOT, "collapse_nodes", nodes.size // 256, nodes=chosen.built.nodes, costs=chosen.costs,
        occlusion=chosen.occlusion, roots=chosen.roots, firsts=chosen.firsts,
        totals=chosen.totals, wide=nodes,
    )  # fmt: skip


def write_indices(building: Building, chosen: Collapse, indices: cl.Buffer) -> None:
    """Enqueue the boxes of leaves with a box each; binary leaves get these numbers."""
    built = chosen.built
    leaves = {"nodes": built.nodes, "items": built.items, "leaf_roots": chosen.leaf_roots}
    building.run_each(_ROOT, "collapse_indices", built.count, indices=indices, **leaves)
