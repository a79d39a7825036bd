"""Writes a street at night, through an old lens and through one with coatings.

    python scenes/lens_street/generate.py

scene.json looks through a Sonnar of 1937 without coatings, modern.json through a Planar of 1973
with three films on each surface. Both are wide open and focus on the bollard.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
RANDOM = np.random.default_rng(5)
JSON = dict[str, Any]
FOCUS = 4.2  # of the bollard, from the film [m]
LENSES: dict[str, JSON] = {
    "scene": {"lens": "sonnar", "losses": True},
    "modern": {"lens": "planar", "losses": True, "coating": "multi"},
}


def box(material: str, low: list[float], high: list[float], **more: Any) -> JSON:
    """A cuboid between two corners."""
    a, b = np.array(low), np.array(high)
    steps = [{"scale": ((b - a) / 2).tolist()}, {"translate": ((a + b) / 2).tolist()}]
    return {"type": "cube", "material": material, "to_world": steps, **more}


def glow(kelvin: float, luminance: float) -> JSON:
    radiance = {"type": "blackbody", "kelvin": kelvin, "scale": luminance, "normalised": True}
    return {"type": "area", "radiance": radiance}


def ball(name: str, place: list[float], radius: float, kelvin: float, luminance: float) -> JSON:
    return {
        "type": "sphere", "name": name, "material": "black", "center": place, "radius": radius,
        "emission": glow(kelvin, luminance),
    }  # fmt: skip


def houses() -> list[JSON]:
    """Walls along both sides, with windows of which some are lit."""
    made: list[JSON] = []
    for side in (-1.0, 1.0):
        z = 2.0
        while z < 60.0:
            deep, tall = RANDOM.uniform(6.0, 9.0), RANDOM.uniform(8.0, 13.0)
            x = sorted([side * 6.5, side * 12.0])
            made.append(box("wall", [x[0], 0.0, z], [x[1], tall, z + deep - 0.1]))
            for y in np.arange(1.4, tall - 1.5, 2.7):
                for across in np.arange(z + 0.9, z + deep - 1.2, 1.7):
                    if RANDOM.random() < 0.3:
                        wide = sorted([side * 6.45, side * 6.6])
                        more = {
                            "emission": glow(RANDOM.uniform(2400, 4200), RANDOM.uniform(0.5, 3))
                        }
                        low, high = [wide[0], y, across], [wide[1], y + 1.3, across + 0.85]
                        made.append(box("black", low, high, **more))
            z += deep
    return made


def lamps() -> list[JSON]:
    """Street lamps on poles, and small lights far away."""
    made: list[JSON] = []
    for i, z in enumerate(np.arange(1.5, 56.0, 7.5)):
        side = 1.0 if i % 2 else -1.0
        foot = [side * 4.6 - 0.06, 0.0, z - 0.06]
        made.append(box("pole", foot, [foot[0] + 0.12, 4.9, foot[2] + 0.12]))
        made.append(ball(f"lamp {i}", [side * 4.6, 5.1, float(z)], 0.26, 2700.0, 240.0))
    for i in range(26):
        place = [RANDOM.uniform(-3.8, 3.8), RANDOM.uniform(0.5, 2.6), RANDOM.uniform(25.0, 58.0)]
        kelvin = float(RANDOM.choice([1500.0, 3000.0, 6500.0, 12000.0]))
        made.append(ball(f"light {i}", place, 0.1, kelvin, 60.0))
    return made


def scene(lens: JSON) -> JSON:
    look = {"origin": [0.5, 1.5, -0.2], "target": [-0.15, 1.95, 8.0], "up": [0, 1, 0]}
    return {
        "$schema": "../schema.json",
        "name": "lens_street",
        "camera": {
            "type": "lens", "focus_distance": FOCUS, "to_world": {"look_at": look}, **lens,
        },
        "film": {"width": 390, "height": 260, "exposure": 0.8},
        "integrator": {"type": "path", "max_depth": 4},
        "spp": 224,
        "lights": [{"type": "constant", "radiance": [0.002, 0.003, 0.007]}],
        "materials": {
            "road": {"type": "rough_plastic", "alpha": 0.4, "diffuse_reflectance": 0.06},
            "wall": {"type": "diffuse", "reflectance": [0.3, 0.25, 0.2]},
            "pole": {"type": "diffuse", "reflectance": 0.05},
            "black": {"type": "diffuse", "reflectance": 0.02},
            "paint": {
                "type": "rough_plastic", "alpha": 0.1, "diffuse_reflectance": [0.5, 0.03, 0.02],
            },
            "white": {"type": "rough_plastic", "alpha": 0.1, "diffuse_reflectance": 0.75},
        },
        "shapes": [
            box("road", [-14.0, -0.2, -6.0], [14.0, 0.0, 70.0]),
            box("wall", [-14.0, 0.0, 66.0], [14.0, 9.0, 68.0]),
            *houses(),
            *lamps(),
            box("paint", [-0.62, 0.0, 3.9], [-0.42, 1.5, 4.1]),
            box("white", [-0.63, 1.1, 3.89], [-0.41, 1.3, 4.11]),
            {"type": "sphere", "material": "white", "center": [-0.52, 1.6, 4.0], "radius": 0.13},
        ],
    }  # fmt: skip


if __name__ == "__main__":
    for name, lens in LENSES.items():
        RANDOM = np.random.default_rng(5)
        (HERE / f"{name}.json").write_text(json.dumps(scene(lens), indent=1) + "\n", "utf-8")
