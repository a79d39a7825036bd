"""Turns a chess pawn and a ring on a lathe: pawn.ply and ring.ply.

    python scenes/glass_caustics/generate.py

A profile of (radius, height) goes through given points as a Catmull-Rom curve and round the axis y.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).parents[1]))
from making import curve, lathe

# From the middle of the foot, up the outside to the top of the head.
PAWN = [
    (0.00, 0.000), (0.35, 0.000), (0.66, 0.003), (0.72, 0.040), (0.70, 0.16), (0.62, 0.24),
    (0.55, 0.29), (0.52, 0.35), (0.40, 0.45), (0.29, 0.62), (0.235, 0.85), (0.215, 1.05),
    (0.25, 1.12), (0.37, 1.165), (0.385, 1.20), (0.30, 1.235), (0.26, 1.29),
    *((0.42 * math.sin(t), 1.66 - 0.42 * math.cos(t)) for t in (0.85, 1.25, 1.65, 2.05, 2.45)),
    (0.12, 2.063), (0.00, 2.08),
]  # fmt: skip
RING = [
    (1.00, 0.00), (1.05, 0.02), (1.07, 0.10), (1.07, 0.34), (1.05, 0.42), (1.00, 0.44),
    (0.97, 0.42), (0.96, 0.34), (0.96, 0.10), (0.97, 0.02), (1.00, 0.00),
]  # fmt: skip


def main() -> None:
    here = Path(__file__).parent
    for name, points, closed in (("pawn", PAWN, False), ("ring", RING, True)):
        mesh = lathe(curve(points, 3 if closed else 4, closed), 72)
        mesh.export(here / f"{name}.ply", vertex_normal=True)
        print(f"{name}.ply: {len(mesh.faces):,} triangles")


if __name__ == "__main__":
    main()
