"""Blows a lamp of fluted glass and turns what holds it: glass.ply, hollow.ply, cap.ply, stand.ply.

    python scenes/bulb/generate.py

All bodies are turned on a lathe; lengths are in centimetres, the scene makes them metres. The
hollow is a surface of its own within the glass, whose front is the side of the air. Flutes of
depth d R bend light as lenses of focal length R / ((n - 1) d flutes^2), to the sides.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))
from making import curve, lathe, rod

HERE = Path(__file__).parent
# Upward: the outside of the glass, of its hollow, and of the brass cap and the stand.
GLASS = [
    (0.0, 0.0), (0.8, 0.02), (1.2, 0.12), (1.32, 0.5), (1.34, 1.5), (1.62, 2.7), (2.6, 4.3),
    (3.6, 6.2), (4.0, 8.0), (3.7, 9.9), (2.7, 11.3), (1.4, 12.1), (0.0, 12.4),
]  # fmt: skip
HOLLOW = [
    (0.0, 1.2), (0.45, 1.25), (0.8, 1.5), (1.22, 2.9), (2.2, 4.6), (3.15, 6.4), (3.5, 8.0),
    (3.22, 9.6), (2.3, 10.9), (1.2, 11.55), (0.0, 11.8),
]  # fmt: skip
STAND = [
    (0.0, -6.0), (3.0, -6.0), (3.9, -5.95), (4.1, -5.6), (4.0, -5.2), (3.2, -4.7), (2.1, -4.0),
    (1.7, -3.2), (1.9, -2.6), (1.8, -2.2), (1.2, -2.1), (0.0, -2.1),
]  # fmt: skip
FLUTES, DEPTH = 18, 0.003


def main() -> None:
    outside = curve(GLASS, 5)
    high = np.clip((outside[:, 1] - 2.0) / (12.4 - 2.0), 0, 1)
    turns = np.linspace(0, 1, 60)
    thread = np.stack([1.52 + 0.07 * np.sin(2 * np.pi * 6 * turns), -1.9 + 2.6 * turns], -1)
    cap = np.concatenate([
        [(0.0, -2.3), (0.9, -2.28), (1.2, -2.2), (1.4, -2.07), (1.49, -1.97)],
        thread,
        [(1.525, 0.8), (1.51, 0.86), (1.47, 0.89), (1.43, 0.86), (1.415, 0.8), (1.41, 0.6),
         (1.41, 0.1), (1.39, 0.0), (1.33, -0.06), (1.2, -0.08), (0.6, -0.08), (0.0, -0.08)],
    ])  # fmt: skip
    made = {
        "glass": lathe(outside, FLUTES * 8, FLUTES, DEPTH * np.sin(np.pi * high) ** 2),
        "hollow": lathe(curve(HOLLOW, 4)[::-1], 64),
        "cap": lathe(cap, 48),
        "stand": lathe(curve(STAND, 4), 48),
        "frame": lathe(curve([(18.8, 0.0), (19.2, -0.4), (20.3, -0.3), (20.7, 0.3), (20.3, 0.9),
                              (19.3, 0.7), (18.8, 0.0)], 4, closed=True), 64),
        "lead": rod(curve([(-0.45, 0.6), (-0.45, 3.0), (-0.7, 6.0), (-0.7, 9.0), (-0.45, 9.74),
                           (0.0, 9.76)], 4) @ np.eye(2, 3), 0.035, 8),
    }  # fmt: skip
    for name, mesh in made.items():
        mesh.export(HERE / f"{name}.ply", vertex_normal=True)
        print(f"{name}.ply: {len(mesh.faces):,} triangles")


if __name__ == "__main__":
    main()
