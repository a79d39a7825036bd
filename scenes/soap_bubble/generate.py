"""Paints what is around the bubbles, room.exr and garden.png, and their thickness, film.png.

    python scenes/soap_bubble/generate.py

A bubble's water drains: its top is thinner than a tenth of a wavelength and reflects next to
nothing (the black film), below it lie rings in the order of Newton's colours, which air stirs.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from clpt import images

Array = NDArray[np.float64]

ROOM = (256, 512)  # rows, columns
GARDEN = (480, 640)
FILM = (320, 640)
LATTICE = np.random.default_rng(5).random((64, 64, 64))

# The panels that shine: towards their middle, across, up [distances of 1], radiance, panes.
WINDOWS = (
    ((1.25, 0.62, -1.35), (0.55, 0.0, 0.51), (0.0, 0.80, 0.0), (9.5, 10.5, 12.0), (3, 4)),
    ((-1.9, 0.35, -0.75), (0.12, 0.0, -0.36), (0.0, 1.05, 0.0), (6.5, 5.6, 4.4), (1, 1)),
    ((0.1, 2.2, 0.25), (0.95, 0.0, 0.0), (0.0, -0.35, 0.55), (3.4, 3.6, 4.0), (1, 1)),
    ((0.3, -1.9, -0.9), (1.2, 0.0, 0.0), (0.0, 0.35, 0.6), (0.9, 0.75, 0.6), (1, 1)),
)
# Lamps in the garden, out of focus: place (across, up) in [-1, 1], radius, brightness.
LAMPS = [
    (-0.88, -0.62, 0.085, 0.9), (-0.70, -0.36, 0.060, 0.5), (-0.55, -0.74, 0.100, 0.7),
    (-0.33, -0.55, 0.070, 0.4), (-0.12, -0.82, 0.080, 0.6), (0.62, -0.70, 0.090, 0.8),
    (0.80, -0.44, 0.065, 0.6), (0.93, -0.80, 0.100, 0.5), (0.45, -0.86, 0.060, 0.5),
    (-0.97, -0.22, 0.050, 0.35), (0.96, -0.14, 0.050, 0.3), (0.70, -0.20, 0.040, 0.2),
    (-0.62, -0.08, 0.040, 0.18), (0.20, -0.68, 0.075, 0.35),
]  # fmt: skip


def noise(p: Array) -> Array:
    """Smooth noise in [0, 1] at points (..., 3), one bump a unit."""
    cell = np.floor(p).astype(int)
    t = p - cell
    t = t * t * t * (t * (t * 6 - 15) + 10)
    total = np.zeros(p.shape[:-1])
    for corner in np.ndindex(2, 2, 2):
        i, j, k = np.moveaxis((cell + corner) % 64, -1, 0)
        total += np.prod(np.where(corner, t, 1 - t), -1) * LATTICE[i, j, k]
    return total


def billows(p: Array, octaves: int) -> Array:
    """Noise of several scales in about [-1, 1]."""
    total = sum((2 * noise(p * 2.0**k + 9.1 * k) - 1) * 0.5**k for k in range(octaves))
    return np.asarray(total)


def sphere(angle: Array, turn: Array) -> Array:
    """Directions (..., 3) at an angle from +y, turned from -z toward +x."""
    around = np.sin(angle)
    parts = np.broadcast_arrays(around * np.sin(turn), np.cos(angle), -around * np.cos(turn))
    return np.stack(parts, -1)


def film() -> Array:
    """Share of the greatest thickness on a sphere; rows from the bottom up to the top."""
    rows, columns = FILM
    angle = (1 - (np.arange(rows) + 0.5) / rows)[:, None] * np.pi  # from the top
    turn = ((np.arange(columns) + 0.5) / columns)[None, :] * 2 * np.pi
    p = sphere(angle, turn)[..., [0, 2, 1]]
    stir = np.stack([billows(p * 1.7 + 3.0 + 11.0 * i, 3) for i in range(3)], -1)
    folded = p * [1.0, 1.0, 2.2] + 0.9 * stir
    stir = np.stack([billows(folded * 2.1 + 5.0 + 7.0 * i, 3) for i in range(3)], -1)
    swirl = billows(folded * 2.4 + 1.4 * stir, 4)
    down = (1 - p[..., 2]) / 2  # 0 at the top, 1 at the bottom
    calm = np.clip(down / 0.35, 0, 1) ** 1.5
    level = (
        down + 0.035 * billows(p * 3.0 + 2.0, 3) * np.clip(down / 0.1, 0, 1) + 0.10 * calm * swirl
    )
    thick = np.clip((level - 0.035) / 0.965, 0, 1) ** 0.85
    return np.asarray(np.maximum(thick, 0.008))


def panel(d: Array, window: tuple) -> Array:
    """What share of a panel's radiance is seen in directions (..., 3): 1 in its panes."""
    middle, across, up, _, (columns, rows) = window
    m, a, b = (np.array(v, float) for v in (middle, across, up))
    n = np.cross(a, b)
    along = d @ n
    t = (m @ n) / np.where(np.abs(along) < 1e-9, 1e-9, along)
    q = d * t[..., None] - m
    x, y = (q @ a) / (a @ a), (q @ b) / (b @ b)
    inside = (t > 0) & (np.abs(x) < 1) & (np.abs(y) < 1)
    bars = np.ones(x.shape)
    for value, count, length in ((x, columns, a @ a), (y, rows, b @ b)):
        place = (value + 1) / 2 * count
        off = np.abs(place - np.round(place)) * 2 / count * np.sqrt(length)
        inner = (np.round(place) > 0) & (np.round(place) < count)
        bars *= np.where(inner & (off < 0.035), 0.02, 1.0)
    soft = np.clip((1 - np.maximum(np.abs(x), np.abs(y))) * 12, 0, 1)
    return np.where(inside, bars * (1.0 if columns > 1 else soft), 0.0)


def garden() -> Array:
    """A dusky garden, far out of focus, (rows, columns, 3) linear Rec. 709."""
    rows, columns = GARDEN
    y = (1 - 2 * (np.arange(rows) + 0.5) / rows)[:, None] + np.zeros(columns)
    x = (2 * (np.arange(columns) + 0.5) / columns - 1)[None, :] + np.zeros((rows, 1))
    leaves = billows(np.stack([x * 2.6, y * 2.2, 0 * x + 3.3], -1), 3)
    sky = np.clip(0.5 + 0.75 * y + 0.22 * leaves, 0, 1)[..., None]
    seen = (1 - sky) * np.array([0.010, 0.024, 0.020]) + sky**1.5 * np.array([0.035, 0.062, 0.125])
    for across, up, radius, bright in LAMPS:
        away = np.hypot((x - across) * columns / rows, y - up) / radius
        disc = np.clip((1 - away) * 9, 0, 1) * (0.7 + 0.3 * np.clip(away, 0, 1) ** 3)
        seen = seen + (disc * bright * 0.55)[..., None] * np.array([1.0, 0.60, 0.26])
    return np.asarray(seen)


def room(d: Array) -> Array:
    """Radiance (..., 3) in directions (..., 3); +y is up, the camera looks to +z."""
    behind = np.clip(0.45 - 1.3 * d[..., 2], 0, 1)[..., None]  # the room, seen in reflections only
    wall = np.array([1.30, 1.15, 1.02]) * (0.75 + 0.35 * d[..., 1:2])
    seen = 0.03 * (1 - behind) + wall * behind
    for window in WINDOWS:
        share = panel(d, window)[..., None]
        seen = seen * (1 - share) + share * np.array(window[3])
    return np.asarray(seen)


def main() -> None:
    here = Path(__file__).parent
    rows, columns = ROOM
    angle = np.linspace(0, np.pi, rows)[:, None]
    turn = ((np.arange(columns) + 0.5) / columns * 2 * np.pi)[None, :]
    images.write(here / "room.exr", room(sphere(angle, turn)).astype(np.float32))
    images.write(here / "garden.png", garden().astype(np.float32))
    levels = np.round(film() * 1023).astype(np.uint16) * 64
    Image.fromarray(levels).save(here / "film.png", optimize=True)


if __name__ == "__main__":
    main()
