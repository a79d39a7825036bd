"""Pours a glass of wine: glass.ply and wine.ply.

    python scenes/wine_and_jade/generate.py

Both are closed bodies turned on a lathe, in centimetres; the scene makes them metres. The wine
reaches into the wall of the glass, which has the higher priority and displaces it there. The pawn
is that of scenes/glass_caustics.
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
    (0.0, 0.12), (2.9, 0.02), (3.5, 0.06), (3.55, 0.18), (3.2, 0.34), (2.0, 0.62), (0.9, 1.1),
    (0.46, 2.2), (0.38, 4.6), (0.62, 8.0), (1.5, 8.75), (2.9, 9.9), (3.75, 11.6), (3.95, 13.4),
    (3.65, 15.6), (3.1, 17.9), (2.97, 18.48), (2.91, 18.53), (2.85, 18.48), (2.97, 17.9),
    (3.5, 15.6), (3.79, 13.4), (3.58, 11.7), (2.74, 10.15), (1.4, 9.1), (0.0, 8.72),
]  # fmt: skip
# Its sides are in the middle of the wall; at the top it rises a little where it wets the glass.
WINE = [
    (0.0, 8.62), (1.4, 8.98), (2.8, 10.05), (3.66, 11.65), (3.86, 13.1), (3.62, 12.92),
    (3.3, 12.82), (2.0, 12.8), (0.0, 12.8),
]  # fmt: skip


def main() -> None:
    for name, points, steps in (("glass", GLASS, 4), ("wine", WINE, 4)):
        body = lathe(curve(points, steps), AROUND)
        body.export(HERE / f"{name}.ply", vertex_normal=True)
        print(name, len(body.faces), "triangles", np.round(body.bounds, 2).tolist())


if __name__ == "__main__":
    main()
