"""Lays a table in the evening: glasses, a bottle and what is in them (.ply), cloth.png, sky.exr.

    python scenes/table_glasses/generate.py

All bodies are turned on a lathe; lengths are in centimetres, the scene makes them metres. What is
poured in has no gap to its glass: the wall that is wet is one surface for both. Its inside is the
liquid, with the index and the absorption of that; `ext_ior` is the index of the glass. The liquid's
top and the rest of the glass are surfaces to air, and end where the wet wall begins.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.append(str(Path(__file__).parents[1]))
from making import WINE_GLASS, curve, daylight, filled, lathe

HERE = Path(__file__).parent
SUN = np.array([-0.62, 0.36, -0.7])  # where it stands, seen from the table
AROUND = 64
# From the middle of the foot up the outside, over the rim, and down to the middle inside.
TUMBLER = [
    (0.0, 0.22), (2.4, 0.18), (3.2, 0.03), (3.55, 0.12), (3.68, 0.5), (3.8, 2.0), (4.05, 5.5),
    (4.2, 7.8), (4.25, 8.5), (4.24, 8.72), (4.18, 8.86), (4.1, 8.9), (4.02, 8.86), (3.96, 8.72),
    (3.95, 8.5), (3.9, 7.8), (3.76, 5.5), (3.52, 2.6),
    (3.3, 1.9), (2.7, 1.58), (1.4, 1.42), (0.0, 1.38),
]  # fmt: skip
BOTTLE = [
    (0.0, 1.5), (1.4, 1.2), (2.6, 0.25), (3.1, 0.03), (3.6, 0.25), (3.75, 0.9), (3.75, 4.0),
    (3.75, 10.0), (3.75, 17.0), (3.62, 18.8), (3.0, 20.6), (2.0, 22.4), (1.5, 24.2), (1.38, 26.5),
    (1.34, 28.2), (1.42, 28.5), (1.6, 28.7), (1.62, 29.2), (1.5, 29.6), (1.3, 29.72), (1.08, 29.6),
    (0.98, 28.8), (0.98, 26.5), (1.1, 24.2), (1.6, 22.3), (2.6, 20.5), (3.2, 18.7), (3.32, 17.0),
    (3.32, 10.0), (3.32, 4.0), (3.25, 1.6), (2.6, 1.25), (1.3, 1.9), (0.0, 2.1),
]  # fmt: skip


def cloth() -> None:
    """Paint a square of linen: two lines each way, on threads of uneven white."""
    size = 256
    rng = np.random.default_rng(2)
    threads = 1 + 0.05 * rng.integers(-2, 2, (2, size))
    weave = np.where(np.indices((size, size)).sum(0) % 2, *np.meshgrid(*threads))
    at = np.abs((np.arange(size) + 0.5) / size - 0.5)
    stripe = np.abs(at - 0.03) < 0.01
    amount = 0.5 * (stripe[:, None] + 1.0 * stripe)[..., None]
    linear = (1 - amount) * [0.82, 0.8, 0.76] + amount * [0.5, 0.56, 0.66]
    stored = np.clip(linear * weave[..., None], 0, 1) ** (1 / 2.2)
    Image.fromarray(np.uint8(255 * stored)).save(HERE / "cloth.png", optimize=True)


def main() -> None:
    made = {"bottle": lathe(curve(BOTTLE, 3), AROUND)}
    for name, profile, level in (
        ("red", WINE_GLASS, 12.6),
        ("white", WINE_GLASS, 11.9),
        ("tumbler", TUMBLER, 5.2),
    ):
        made[f"{name}_glass"], made[f"{name}_wet"], made[f"{name}_top"] = filled(
            curve(profile, 3), level, AROUND
        )
    for name, mesh in made.items():
        mesh.export(HERE / f"{name}.ply", vertex_normal=True)
        print(f"{name}.ply: {len(mesh.faces):,} triangles")
    cloth()
    daylight(
        HERE / "sky.exr", SUN, [6.0, 4.5, 2.9],
        zenith=[0.11, 0.17, 0.33], horizon=[0.85, 0.5, 0.28], ground=[0.13, 0.15, 0.2],
    )  # fmt: skip


if __name__ == "__main__":
    main()
