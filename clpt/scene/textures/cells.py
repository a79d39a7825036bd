"""Patterns of nodes of graphs that MaterialX does not have: those of Blender's nodes.

Voronoi's cells with other metrics, bricks, noise of one and four numbers, and numbers at random for
each place. Places are (..., n) float64. `kernels/textures/graph_cells.cl` has the same.
"""

from __future__ import annotations

import itertools

import numpy as np

from clpt.arrays import Floats, Integers, Words
from clpt.scene.textures.noise import fade, jenkins, lattice

NEAREST, NEXT, SMOOTH, EDGE, RADIUS = range(5)  # features of voronoi
DISTANCE, COLOR, PLACE = range(3)  # outputs of voronoi
EUCLIDEAN, MANHATTAN, CHEBYCHEV, MINKOWSKI = range(4)
MASK = 0xFFFFFFFF
POSITIVE = 0x7FFFFFFF
SCALES = {1: 0.25, 4: 0.8344}  # of noise, to about [-1, 1]
ALIKE = 1e-4  # points whose squared distance is less are one


def _signed(x: Integers) -> Integers:
    return ((x + 0x80000000) & MASK) - 0x80000000


def points(cell: Floats) -> Floats:
    """Return numbers in [0, 1] of cells (..., n), n of them: pcg2d, pcg3d (Jarzynski, Olano 2020).

    Shifts keep the sign, and nothing is shifted last.
    """
    count = cell.shape[-1]
    v = [_signed(cell[..., i].astype(np.int64) * 1664525 + 1013904223) for i in range(count)]
    for turn in range(2):
        for i in range(count):
            j, k = (1 - i, 1 - i) if count == 2 else ((i + 1) % 3, (i + 2) % 3)
            factor = _signed(v[j] * 1664525) if count == 2 else _signed(v[j] * v[k])
            v[i] = _signed(v[i] + factor)
        if turn == 0:
            v = [x ^ (x >> 16) for x in v]
    return np.stack([(x & POSITIVE) / POSITIVE for x in v], axis=-1)


def color_of(cell: Floats) -> Floats:
    """Return three numbers in [0, 1] of cells (..., 2 or 3)."""
    return points(np.pad(cell, [(0, 0)] * (cell.ndim - 1) + [(0, 3 - cell.shape[-1])]))


def _length(d: Floats, metric: int, exponent: Floats) -> Floats:
    if metric == EUCLIDEAN:
        return np.linalg.norm(d, axis=-1)
    d = np.abs(d)
    if metric == MINKOWSKI:
        return (d**exponent).sum(axis=-1) ** (1.0 / exponent[..., 0])
    return d.sum(axis=-1) if metric == MANHATTAN else d.max(axis=-1)


def voronoi(
    at: Floats, randomness: Floats, smoothness: Floats, exponent: Floats,
    feature: int, metric: int, output: int,
) -> Floats:  # fmt: skip
    """Return distances to points of cells, or the colors or the places of points (..., 3).

    randomness: how far points lie from the corners of their cells; smoothness: of SMOOTH, to 1/2.
    """
    count = at.shape[-1]
    cell = np.floor(at)
    within = at - cell
    reach = range(-2, 3) if feature == SMOOTH else range(-1, 2)
    steps = [np.array(step, float)[::-1] for step in itertools.product(reach, repeat=count)]
    offsets = np.stack([step + points(cell + step) * randomness for step in steps])
    distances = np.stack([_length(o - within, metric, exponent) for o in offsets])
    if feature == SMOOTH:
        return _smooth(cell, steps, offsets, distances, smoothness, output)
    order = np.argsort(distances, axis=0, kind="stable")
    chosen = order[1 if feature == NEXT else 0]
    place = np.take_along_axis(offsets, chosen[None, ..., None], axis=0)[0]
    if feature == EDGE:
        distance = _to_edge(offsets, place, within)
    elif feature == RADIUS:
        distance = _radius(cell, np.array(steps)[chosen], place, randomness, metric, exponent)
    else:
        distance = np.take_along_axis(distances, chosen[None], axis=0)[0]
    return _output(output, distance, color_of(cell + np.array(steps)[chosen]), cell + place)


def _output(output: int, distance: Floats, color: Floats, place: Floats) -> Floats:
    if output == DISTANCE:
        return np.repeat(distance[..., None], 3, axis=-1)
    if output == COLOR:
        return color
    return np.pad(place, [(0, 0)] * (place.ndim - 1) + [(0, 3 - place.shape[-1])])


def _smooth(
    cell: Floats, steps: list[Floats], offsets: Floats, distances: Floats, smoothness: Floats,
    output: int,
) -> Floats:  # fmt: skip
    """The nearest distance with round ridges, and values that blend there."""
    s = np.maximum(smoothness[..., 0], 1e-6)
    near, color, place = np.zeros_like(distances[0]), 0.0, 0.0
    for i, step in enumerate(steps):
        t = np.clip(0.5 + 0.5 * (near - distances[i]) / s, 0.0, 1.0)
        h = t * t * (3.0 - 2.0 * t) if i else np.ones_like(near)
        bend = s * h * (1.0 - h)
        near = near + (distances[i] - near) * h - bend
        h, bend = h[..., None], (bend / (1.0 + 3.0 * s))[..., None]
        color = color + (color_of(cell + step) - color) * h - bend
        place = place + (offsets[i] - place) * h - bend
    return _output(output, near, np.asarray(color), cell + np.asarray(place))


def _to_edge(offsets: Floats, place: Floats, within: Floats) -> Floats:
    best = np.full(within.shape[:-1], 8.0)
    for offset in offsets:
        away = offset - place
        square = (away * away).sum(axis=-1)
        middle = 0.5 * (offset + place) - within
        distance = (middle * away).sum(axis=-1) / np.sqrt(np.maximum(square, ALIKE))
        best = np.where(square > ALIKE, np.minimum(best, distance), best)
    return best


def _radius(
    cell: Floats, step: Floats, place: Floats, randomness: Floats, metric: int, exponent: Floats
) -> Floats:
    """Half of the distance from a point to the one nearest to it."""
    best = np.full(cell.shape[:-1], 8.0)
    for around in itertools.product((-1.0, 0.0, 1.0), repeat=cell.shape[-1]):
        if any(around):
            there = step + np.array(around)
            other = there + points(cell + there) * randomness
            best = np.minimum(best, _length(other - place, metric, exponent))
    return 0.5 * best


def _grad4(hashed: Words, d: Floats) -> Floats:
    h = hashed & np.uint32(31)
    x, y, z, w = (d[..., i] for i in range(4))
    u, v, s = np.where(h < 24, x, y), np.where(h < 16, y, z), np.where(h < 8, z, w)
    return np.where(h & 1, -u, u) + np.where(h & 2, -v, v) + np.where(h & 4, -s, s)


def _grad1(hashed: Words, d: Floats) -> Floats:
    h = hashed & np.uint32(15)
    return np.where(h & 8, -1.0, 1.0) * (1.0 + (h & 7)) * d[..., 0]


def perlin(at: Floats) -> Floats:
    """Return Perlin's noise (..., 1) of one or four numbers."""
    count = at.shape[-1]
    whole = np.floor(at)
    within = at - whole
    total = np.zeros(at.shape[:-1])
    for corner in itertools.product((0.0, 1.0), repeat=count):
        weight = np.prod(np.where(corner, fade(within), 1.0 - fade(within)), axis=-1)
        hashed = jenkins(*lattice(whole + corner))
        total += weight * (_grad1 if count == 1 else _grad4)(hashed, within - corner)
    return SCALES[count] * total[..., None]


def white(at: Floats, dimensions: int) -> Floats:
    """Return three numbers in [0, 1] (..., 3) by the bits of float32 of the first numbers."""
    words = [at[..., i].astype(np.float32).view(np.uint32) for i in range(dimensions)]
    if dimensions == 4:
        orders = ([0, 1, 2, 3], [2, 0, 3, 1], [3, 2, 1, 0])
        keys = [[words[i] for i in order] for order in orders]
    else:
        more = [np.full_like(words[0], np.float32(k).view(np.uint32)) for k in (1.0, 2.0)]
        keys = [words, [*words, more[0]], [*words, more[1]]]
    return np.stack([jenkins(*key) / MASK for key in keys], axis=-1)


def brick(
    at: Floats, size: Floats, mortar: Floats, bias: Floats, offset: Floats, squash: Floats
) -> Floats:
    """Return a number in [0, 1] for each brick, and the share of mortar (..., 2).

    mortar: its width and its softness; offset: of every so many rows, as a share of a brick;
    squash: a factor on the width of bricks of every so many rows.
    """
    row = np.floor(at[..., 1:] / size[..., 1:])
    squashed, moved = (row % each[..., 1:] == 0.0 for each in (squash, offset))
    width = size[..., :1] * np.where(squashed, squash[..., :1], 1.0)
    x = at[..., :1] + np.where(moved, width * offset[..., :1], 0.0)
    number = np.floor(x / width)
    x, y = x - width * number, at[..., 1:] - size[..., 1:] * row
    within = np.minimum(np.minimum(x, y), np.minimum(width - x, size[..., 1:] - y))
    wide, soft = (np.maximum(mortar[..., i : i + 1], 1e-9) for i in (0, 1))
    t = np.clip((1.0 - within / wide) / soft, 0.0, 1.0)
    share = np.where(within < mortar[..., :1], t * t * (3.0 - 2.0 * t), 0.0)
    tint = np.clip(_brick_number(row, number) + bias, 0.0, 1.0)
    return np.concatenate(np.broadcast_arrays(tint, share), axis=-1)


def _brick_number(row: Floats, number: Floats) -> Floats:
    key = (row.astype(np.int64) << 16) + (number.astype(np.int64) & 0xFFFF)
    n = (key + 1013) & POSITIVE
    n = (n >> 13) ^ n
    whole = (n * n) & MASK
    whole = (n * ((whole * 60493 + 19990303) & MASK) + 1376312589) & POSITIVE
    return np.asarray(0.5 * whole / 1073741824.0, np.float64)
