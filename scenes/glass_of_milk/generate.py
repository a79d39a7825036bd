"""Pours a glass of milk: glass.ply and milk.ply.

    python scenes/glass_of_milk/generate.py

Both are closed bodies turned on a lathe, in centimetres; the scene makes them metres. The milk
reaches into the wall of the glass, which has the higher priority and displaces it there: so they
share the wall without a gap, and no surface had to be made for both.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))
from making import curve, lathe

HERE = Path(__file__).parent
AROUND = 48
# From the middle of the foot up the outside, over the rim, and down to the middle inside.
GLASS = [
    (0.0, 0.22), (2.4, 0.18), (3.0, 0.03), (3.25, 0.12), (3.35, 0.5), (3.5, 2.0), (3.75, 5.5),
    (3.95, 9.0), (3.99, 9.6), (3.93, 9.8), (3.82, 9.86), (3.71, 9.8), (3.66, 9.6), (3.62, 9.0),
    (3.42, 5.5), (3.2, 2.4), (2.9, 1.55), (2.2, 1.3), (0.0, 1.22),
]  # fmt: skip
# Its sides are in the middle of the wall; at the top it rises a little where it wets the glass.
MILK = [
    (0.0, 0.8), (2.4, 0.85), (3.0, 1.3), (3.32, 2.2), (3.58, 5.5), (3.7, 7.75), (3.55, 7.62),
    (3.3, 7.5), (2.0, 7.48), (0.0, 7.48),
]  # fmt: skip


def main() -> None:
    for name, points, steps in (("glass", GLASS, 6), ("milk", MILK, 5)):
        body = lathe(curve(points, steps), AROUND)
        body.export(HERE / f"{name}.ply", vertex_normal=True)
        print(name, len(body.faces), "triangles", np.round(body.bounds, 2).tolist())


if __name__ == "__main__":
    main()
