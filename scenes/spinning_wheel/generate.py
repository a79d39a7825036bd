"""Writes a wheel at a fair by night, which turns while the shutter is open.

    python scenes/spinning_wheel/generate.py

The wheel is one group of rods and lamps about its axle. Its instance has keys of a rotation; a car
passes before it, whose lamps draw straight lines. The shutter opens and closes slowly.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
JSON = dict[str, Any]
HUB = 2.6  # height of the axle [m]
RADIUS, SPOKES, TURN = 2.0, 12, 26.0  # [m], number, degrees while the shutter is open
COLOURS = ([1.0, 0.25, 0.08], [1.0, 0.62, 0.2], [0.15, 0.55, 1.0])


def rod(material: str, begin: list[float], end: list[float], radius: float) -> JSON:
    return {"type": "cylinder", "material": material, "p0": begin, "p1": end, "radius": radius}


def lamp(centre: list[float], radius: float, colour: list[float], strength: float) -> JSON:
    return {
        "type": "sphere", "material": "black", "center": centre, "radius": radius,
        "emission": {"type": "area", "radiance": [round(strength * c, 4) for c in colour]},
    }  # fmt: skip


def rim(share: float, number: float, depth: float = 0.0) -> list[float]:
    """A point on a ring of the wheel; number: of a spoke."""
    angle = 2.0 * math.pi * number / SPOKES
    x, y = (share * RADIUS * f(angle) for f in (math.cos, math.sin))
    return [round(x, 4), round(y, 4), depth]


def wheel() -> list[JSON]:
    """Two rings of rods, spokes and lamps, about the origin in the plane of x and y."""
    made = []
    for i in range(SPOKES):
        colour = COLOURS[i % len(COLOURS)]
        made += [
            rod("steel", rim(0.0, i), rim(1.0, i), 0.018),
            rod("steel", rim(1.0, i), rim(1.0, i + 1), 0.025),
            rod("steel", rim(0.55, i), rim(0.55, i + 1), 0.015),
            lamp(rim(1.0, i, 0.06), 0.06, colour, 30.0),
            lamp(rim(0.55, i + 0.5, 0.06), 0.035, COLOURS[(i + 1) % len(COLOURS)], 24.0),
        ]
    return made


def scene() -> JSON:
    turned = [{"rotate": {"axis": [0, 0, 1], "angle": 0}}, {"translate": [0, HUB, 0]}]
    keys = []
    for time in (0.0, 1.0):
        turned[0] = {"rotate": {"axis": [0, 0, 1], "angle": TURN * time}}
        keys.append({"time": time, "transform": [*turned]})
    legs = [
        rod("steel", [x, 0.0, z], [0.0, HUB, 0.6 * z], 0.05)
        for x in (-1.0, 1.0)
        for z in (-0.35, 0.35)
    ]
    drive = [{"time": t, "transform": [{"translate": [6.0 * t, 0, 0]}]} for t in (0.0, 1.0)]
    car = [
        {**lamp([-3.4, y, 1.4], 0.03, colour, 60.0), "motion": drive}
        for y, colour in ((0.42, [1.0, 0.08, 0.03]), (0.34, [1.0, 0.85, 0.6]))
    ]
    hub = lamp([0.0, HUB, 0.2], 0.13, [1.0, 0.8, 0.55], 9.0)
    booth = {
        "type": "cube", "material": "booth",
        "to_world": [{"scale": [0.5, 0.55, 0.4]}, {"translate": [2.3, 0.55, -0.2]}],
    }  # fmt: skip
    ground = {
        "type": "disk", "material": "ground",
        "to_world": [{"scale": 40}, {"rotate": {"axis": [1, 0, 0], "angle": -90}}],
    }  # fmt: skip
    look = {"origin": [-1.2, 1.5, 8.2], "target": [0.0, 2.2, 0], "up": [0, 1, 0]}
    return {
        "$schema": "../schema.json",
        "name": "spinning_wheel",
        "camera": {
            "type": "perspective", "fov": 42, "to_world": {"look_at": look},
            "shutter": {"open": 0, "close": 1, "shape": [0.4, 1, 1, 1, 0.4]},
        },
        "film": {"width": 416, "height": 364, "filter": {"type": "blackman_harris"}},
        "integrator": {"type": "path", "max_depth": 6},
        "spp": 192,
        "materials": {
            "steel": {"type": "two_sided", "front": {
                "type": "rough_conductor", "eta": 2.6, "k": 3.4, "alpha_u": 0.25, "alpha_v": 0.25,
            }},
            "black": {"type": "diffuse", "reflectance": 0.02},
            "booth": {"type": "diffuse", "reflectance": [0.55, 0.5, 0.42]},
            "ground": {
                "type": "rough_plastic", "diffuse_reflectance": [0.08, 0.08, 0.09], "alpha": 0.12,
            },
        },
        "groups": {"wheel": wheel()},
        "shapes": [
            ground, booth, *legs, hub, *car,
            {"type": "instance", "name": "wheel", "group": "wheel", "motion": keys},
        ],
        "lights": [{"type": "constant", "radiance": [0.006, 0.009, 0.02]}],
    }  # fmt: skip


if __name__ == "__main__":
    text = json.dumps(scene(), indent=1)
    (HERE / "scene.json").write_text(f"{text}\n", "utf-8")
