"""The noises of graphs: those of MaterialX's standard library, which are Open Shading Language's.

Perlin's noise (2002) on a lattice whose gradients Jenkins' hash lookup3 chooses, cells, and
Worley's (1996). Places are (..., 2 or 3) float64. `kernels/core/lattice_noise.cl` has the same.
"""

from __future__ import annotations

import itertools

import numpy as np

from clpt.arrays import Floats, Words

SCALES = {2: 0.6616, 3: 0.9820}  # of Perlin's noise, to about [-1, 1]
MOST_OCTAVES = 32
APART = (19.0, 193.0, 17.0)  # from the first three channels of a noise to the fourth


def _turned(x: Words, bits: int) -> Words:
    return (x << np.uint32(bits)) | (x >> np.uint32(32 - bits))


def jenkins(*words: Words) -> Words:
    """Return Jenkins' hash lookup3 of one to four words."""
    seed = np.uint32((0xDEADBEEF + (len(words) << 2) + 13) & 0xFFFFFFFF)
    state = [np.full_like(words[0], seed) for _ in range(3)]
    for i, word in enumerate(words[:3]):
        state[i] = state[i] + word
    if len(words) == 4:
        for i, bits in enumerate((4, 6, 8, 16, 19, 4)):
            a, b, c = i % 3, (i + 1) % 3, (i + 2) % 3
            state[a] = (state[a] - state[c]) ^ _turned(state[c], bits)
            state[c] = state[c] + state[b]
        state[0] = state[0] + words[3]
    for i, bits in enumerate((14, 11, 25, 16, 4, 14, 24)):
        c, b = (2, 0, 1)[i % 3], (1, 2, 0)[i % 3]
        state[c] = (state[c] ^ state[b]) - _turned(state[b], bits)
    return state[2]


def lattice(whole: Floats) -> list[Words]:
    """Return whole numbers (..., n) as n words."""
    return [whole[..., i].astype(np.int64).astype(np.uint32) for i in range(whole.shape[-1])]


def fade(t: Floats) -> Floats:
    """Return Perlin's weight of the upper corner, for shares t."""
    return t**3 * (t * (t * 6.0 - 15.0) + 10.0)


def _gradient(hashed: Words, at: Floats) -> Floats:
    """The product of a place within a cell and a corner's gradient."""
    x, y = at[..., 0], at[..., 1]
    if at.shape[-1] == 2:
        h = hashed & np.uint32(7)
        u, v = np.where(h < 4, x, y), 2.0 * np.where(h < 4, y, x)
    else:
        h = hashed & np.uint32(15)
        z = at[..., 2]
        u = np.where(h < 8, x, y)
        v = np.where(h < 4, y, np.where((h == 12) | (h == 14), x, z))
    return np.where(h & 1, -u, u) + np.where(h & 2, -v, v)


def perlin(at: Floats, channels: int) -> Floats:
    """Return Perlin's noise (..., channels)."""
    if channels == 2:
        return np.concatenate([perlin(at, 1), perlin(at + APART[: at.shape[-1]], 1)], axis=-1)
    if channels == 4:
        return np.concatenate([perlin(at, 3), perlin(at + APART[: at.shape[-1]], 1)], axis=-1)
    whole = np.floor(at)
    within = at - whole
    smooth = fade(within)
    sums = np.zeros((*at.shape[:-1], channels))
    for corner in itertools.product((0.0, 1.0), repeat=at.shape[-1]):
        weight = np.prod(np.where(corner, smooth, 1.0 - smooth), axis=-1)
        hashed = jenkins(*lattice(whole + corner))
        for channel in range(channels):
            bits = hashed if channels == 1 else (hashed >> np.uint32(8 * channel)) & np.uint32(255)
            sums[..., channel] += weight * _gradient(bits, within - corner)
    return sums * SCALES[at.shape[-1]]


def fractal(
    at: Floats, octaves: Floats, lacunarity: Floats, diminish: Floats, channels: int
) -> Floats:
    """Return octaves of Perlin's noise (..., channels); octaves: at most MOST_OCTAVES."""
    total, strength = np.zeros((*at.shape[:-1], channels)), np.ones(1)
    for i in range(min(int(octaves.max()), MOST_OCTAVES)):
        total = total + np.where(i < octaves, strength * perlin(at, channels), 0.0)
        strength, at = strength * diminish, at * lacunarity
    return total


def cells(at: Floats, channels: int) -> Floats:
    """Return a number in [0, 1] for each unit cell and channel, (..., channels)."""
    words = lattice(np.floor(at))
    if channels == 1:
        return (jenkins(*words) / 0xFFFFFFFF)[..., None]
    numbers = (np.full_like(words[0], i) for i in range(channels))
    return np.stack([jenkins(*words, number) / 0xFFFFFFFF for number in numbers], axis=-1)


def worley(at: Floats, jitter: Floats, channels: int, style: int) -> Floats:
    """Return distances to the nearest points of cells, or with style 1 the nearest cell's number.

    (..., channels): the nearest, the next, and the one after it.
    """
    count = at.shape[-1]
    whole = np.floor(at)
    distances, points = [], []
    for corner in itertools.product((-1.0, 0.0, 1.0), repeat=count):
        off = (cells(whole + corner, 3)[..., :count] - 0.5) * jitter + 0.5
        point = whole + corner + off
        distances.append(np.linalg.norm(point - at, axis=-1))
        points.append(point)
    near = np.stack(distances, axis=-1)
    if style == 1:
        first = np.argmin(near, axis=-1)[..., None, None]
        nearest = np.take_along_axis(np.stack(points, axis=-2), first, axis=-2)[..., 0, :]
        return cells(nearest, channels)
    return np.sort(near, axis=-1)[..., :channels]
