"""Paints a street after rain: asphalt.png, puddle.png, oil.png and the sky, sky.exr.

    python scenes/oil_film/generate.py

A few drops of oil have spread on the water, thinner outward, and been stirred: oil.png is the share
of the greatest thickness. puddle.png is where water stands.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from clpt import images

Array = NDArray[np.float64]

ASPHALT, PUDDLE, OIL, SKY = 512, 512, 640, (320, 640)
RANDOM = np.random.default_rng(3)
LATTICE = RANDOM.random((256, 256))
# Where oil has dripped: place in the unit square of the puddle, how far it has spread, how much.
DROPS = (
    (0.42, 0.56, 0.30, 1.0),
    (0.63, 0.40, 0.22, 0.85),
    (0.30, 0.33, 0.16, 0.7),
    (0.70, 0.66, 0.14, 0.6),
)


def noise(x: Array, y: Array) -> Array:
    """Smooth noise in [-1, 1], one bump a unit."""
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    u, v = (t * t * t * (t * (t * 6 - 15) + 10) for t in (x - i, y - j))
    a, b = LATTICE[i % 256, j % 256], LATTICE[(i + 1) % 256, j % 256]
    c, d = LATTICE[i % 256, (j + 1) % 256], LATTICE[(i + 1) % 256, (j + 1) % 256]
    return 2 * ((a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v) - 1


def billows(x: Array, y: Array, octaves: int) -> Array:
    """Noise of several scales in about [-1, 1]."""
    scales = range(octaves)
    return np.asarray(
        sum(noise(x * 2.0**k + 37.7 * k, y * 2.0**k + 11.3 * k) * 0.5**k for k in scales)
    )


def square(size: int) -> tuple[Array, Array]:
    """x to the right and y up in [0, 1], at the middles of a picture's pixels."""
    at = (np.arange(size) + 0.5) / size
    return np.broadcast_to(at, (size, size)), np.broadcast_to(at[::-1, None], (size, size))


def asphalt() -> Array:
    """Reflectance of stones in tar, (n, n), of a pattern that repeats."""
    x, y = square(ASPHALT)
    nearest = np.full((2, ASPHALT, ASPHALT), 9.0)
    shade = np.zeros((ASPHALT, ASPHALT))
    for px, py, bright in RANDOM.random((1600, 3)):
        dx, dy = (np.abs((a - b + 0.5) % 1 - 0.5) for a, b in ((x, px), (y, py)))
        away = np.hypot(dx, dy)
        closer = away < nearest[0]
        nearest[1] = np.where(closer, nearest[0], np.minimum(nearest[1], away))
        nearest[0] = np.where(closer, away, nearest[0])
        shade = np.where(closer, bright, shade)
    stone = np.clip((nearest[1] - nearest[0]) * 120, 0, 1)
    grain = RANDOM.random((ASPHALT, ASPHALT))
    return (0.005 + 0.006 * grain) * (1 - stone) + (0.008 + 0.05 * shade**3 + 0.008 * grain) * stone


def puddle() -> Array:
    """1 where water stands, (n, n)."""
    x, y = square(PUDDLE)
    out = np.hypot((x - 0.5) / 0.47, (y - 0.5) / 0.44)
    edge = 0.88 - out + 0.22 * billows(x * 4 + 3, y * 4 + 8, 3) + 0.05 * billows(x * 24, y * 24, 3)
    return np.asarray(np.clip(edge * 40 + 0.5, 0, 1))


def stirred(x: Array, y: Array) -> tuple[Array, Array]:
    """Where the oil at (x, y) was before it was stirred, along the lines of stream functions."""
    e = 1e-3
    for scale, speed, steps in ((2.6, 0.0125, 22), (6.0, 0.0022, 14)):

        def stream(x: Array, y: Array, scale: float = scale) -> Array:
            return billows(x * scale + 3.0 * scale, y * scale + 8.0, 2) / scale

        for _ in range(steps):
            here = stream(x, y)
            across, up = (stream(x, y + e) - here) / e, (here - stream(x + e, y)) / e
            x, y = x + speed * across, y + speed * up
    return x, y


def oil() -> Array:
    """Share of the oil's greatest thickness, (n, n)."""
    x, y = stirred(*square(OIL))
    thick = np.zeros(x.shape)
    for px, py, spread, amount in DROPS:
        away = np.hypot(x - px, y - py) / spread
        thick = thick + amount * np.exp(-(away**1.5))
    ripples = 0.07 * billows(x * 5 + 2, y * 5 + 9, 3) + 0.05 * billows(x * 17, y * 17 + 4, 2)
    return np.asarray(np.clip(0.66 * thick + ripples + 0.02, 0, 1))


def sky() -> Array:
    """Evening clouds over roofs, (rows, columns, 3) linear Rec. 709."""
    rows, columns = SKY
    up = np.cos(np.linspace(0, np.pi, rows))[:, None] + np.zeros(columns)
    turn = (np.arange(columns) + 0.5)[None, :] / columns * 2 * np.pi + np.zeros((rows, 1))
    level = np.sqrt(1 - up**2)
    x, z = level * np.sin(turn), -level * np.cos(turn)
    overhead = 1.8 / (np.maximum(up, 0) + 0.25)
    clouds = billows(x * overhead + 20, z * overhead + 30, 5)
    cover = np.clip(0.55 + 0.9 * clouds, 0, 1)[..., None]
    glow = np.exp(-np.maximum(up, 0) * 3.2)[..., None] * np.clip(0.55 + 0.45 * z, 0, 1)[..., None]
    blue = np.array([0.42, 0.62, 1.0]) * (0.9 - 0.35 * up[..., None])
    white = np.array([1.75, 1.65, 1.6])
    seen = blue * (1 - cover) + white * cover + glow * np.array([1.6, 0.95, 0.5])
    roofs = 0.20 + 0.07 * np.floor(2.2 * noise(turn * 4.0, 0 * turn + 5.5)) / 2.2
    dark = (up < roofs)[..., None]
    return np.where(dark, np.array([0.05, 0.047, 0.05]), seen)


def grey(path: Path, values: Array, bits: int) -> None:
    """Write [0, 1] as 16-bit values of which so many bits are used."""
    steps = 2**bits - 1
    levels = np.round(np.clip(values, 0, 1) * steps).astype(np.uint16) * (65535 // steps)
    Image.fromarray(levels).save(path, optimize=True)


def main() -> None:
    here = Path(__file__).parent
    images.write(here / "asphalt.png", asphalt().astype(np.float32))
    grey(here / "puddle.png", puddle(), 4)
    grey(here / "oil.png", oil(), 10)
    images.write(here / "sky.exr", sky().astype(np.float32))


if __name__ == "__main__":
    main()
