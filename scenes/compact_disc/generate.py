"""Draws what a compact disc is made of along its radius, and the room that it mirrors.

    python scenes/compact_disc/generate.py

A disc's radius is 60 mm; u of a `disk` is the radius over that. The zones are those of IEC 60908:
a hole of 15 mm, a clear hub, aluminium with the grooves, a clear rim. plastic.png and foil.png are
one row high, and so is depth.exr, which has the depth of the grooves in nm: shallower where nothing
has been written. studio.exr is the room, dim, with two soft lights. The bright lamps stand in
scene.json.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

from clpt import images

FOLDER = Path(__file__).parent
TEXELS = 2048
RADIUS = np.linspace(0.0, 60.0, TEXELS)  # [mm]


def between(low: float, high: float) -> np.ndarray:
    """One from `low` to `high` [mm], zero elsewhere."""
    return ((low <= RADIUS) & (high >= RADIUS)).astype(float)


def save(name: str, values: np.ndarray) -> None:
    """Write values in [0, 1] as a grey image of one row."""
    row = np.round(values * 255.0).astype(np.uint8)[None]
    Image.fromarray(row).save(FOLDER / name)


def soft_light(u: float, v: float) -> np.ndarray:
    """A smooth spot in a map in latitude and longitude, at u and v in [0, 1]."""
    polar, azimuth = ((np.arange(n) + 0.5) / n for n in (32, 64))
    along = (azimuth - u + 0.5) % 1.0 - 0.5
    return np.exp(-((along[None] / 0.085) ** 2) - ((polar[:, None] - v) / 0.11) ** 2)


def draw() -> None:
    """Write all four files beside this one."""
    save("plastic.png", between(7.5, 60.0))
    save("foil.png", between(19.0, 20.5) + between(21.5, 58.4))
    depth = 120.0 * between(23.0, 44.0) + 80.0 * between(44.3, 58.0)
    images.write(FOLDER / "depth.exr", np.repeat(depth[None, :, None], 3, axis=2))
    up = np.maximum(np.cos((np.arange(32)[:, None] + 0.5) / 32 * np.pi), 0.0)
    room = 0.035 + 0.06 * up + 0.95 * soft_light(0.70, 0.24) + 0.7 * soft_light(0.03, 0.22)
    images.write(FOLDER / "studio.exr", room[..., None] * [0.9, 0.96, 1.1])


if __name__ == "__main__":
    draw()
