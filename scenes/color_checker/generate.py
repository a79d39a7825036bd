"""Writes scene.json: a chart of 24 measured reflectances on a table, between two balls.

    python scenes/color_checker/generate.py

The chart's sizes are those of the photographers' one, in decimetres.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).parent
COLUMNS, ROWS = 6, 4
PATCH, PITCH = 0.405, 0.455  # side of a patch, and from one to the next
BOARD = (2.90, 2.05, 0.06)
LEAN = [{"rotate": {"axis": [1, 0, 0], "angle": -17}}, {"translate": [0, 1.09, 0.02]}]


def box(name: str, size: tuple[float, float, float], place: list[Any], material: str) -> Any:
    """A cuboid of a size, placed by steps."""
    scale = {"scale": [side / 2 for side in size]}
    return {"type": "cube", "name": name, "material": material, "to_world": [scale, *place]}


def daylight(luminance: float) -> dict[str, Any]:
    """The illuminant D65 of a luminance."""
    return {"type": "illuminant", "name": "D65", "scale": luminance}


def patches() -> tuple[dict[str, Any], list[Any]]:
    """Materials of the 24 patches by name, and the patches on the board."""
    path = HERE / "reflectances.csv"
    names = path.read_text("utf-8").splitlines()[2].split(", ")[1:]
    table = np.loadtxt(path, delimiter=",").T
    materials, shapes = {}, []
    for i, (name, values) in enumerate(zip(names, table[1:], strict=True)):
        x = PITCH * (i % COLUMNS - (COLUMNS - 1) / 2)
        y = PITCH * ((ROWS - 1) / 2 - i // COLUMNS) + 0.06
        curve = {"lambdas": table[0].tolist(), "values": values.tolist(), "outside": "hold"}
        materials[name] = {"type": "diffuse", "reflectance": {"type": "tabulated", **curve}}
        place = [{"scale": [PATCH / 2] * 2 + [1]}, {"translate": [x, y, BOARD[2] / 2 + 0.002]}]
        shapes.append({"type": "rectangle", "material": name, "to_world": [*place, *LEAN]})
    return materials, shapes


def scene() -> dict[str, Any]:
    """The whole scene, as scene.json has it."""
    colours, chart = patches()
    look = {"origin": [0.75, 2.35, 6.3], "target": [0.0, 0.88, 0.15], "up": [0, 1, 0]}
    softbox = [
        {"scale": [1.4, 1.4, 1]},
        {"look_at": {"origin": [-3.2, 4.4, 3.6], "target": [0, 0.8, 0], "up": [0, 1, 0]}},
    ]
    black = {"type": "diffuse", "reflectance": 0}
    return {
        "$schema": "../schema.json",
        "name": "color_checker",
        "camera": {
            "type": "thin_lens", "fov": 44, "aperture_radius": 0.05, "focus_distance": 6.35,
            "to_world": {"look_at": look},
        },
        "film": {"width": 540, "height": 360, "filter": {"type": "blackman_harris"}},
        "integrator": {"type": "path", "max_depth": 6},
        "spp": 256,
        "lights": [{"type": "constant", "radiance": daylight(0.22)}],
        "materials": {
            "board": {"type": "rough_plastic", "alpha": 0.35, "diffuse_reflectance": 0.03},
            "table": {
                "type": "rough_plastic", "alpha": 0.12, "diffuse_reflectance": [0.2, 0.105, 0.055],
            },
            "wall": {"type": "diffuse", "reflectance": [0.2, 0.225, 0.25]},
            "grey": {"type": "diffuse", "reflectance": 0.18},
            "chrome": {"type": "conductor", "metal": "Cr"},
            "wood": {
                "type": "rough_plastic", "alpha": 0.3, "diffuse_reflectance": [0.5, 0.3, 0.14],
            },
            "black": black,
            **colours,
        },
        "shapes": [
            {
                "type": "rectangle", "name": "table", "material": "table",
                "to_world": [{"scale": [9, 5, 1]}, {"rotate": {"axis": [1, 0, 0], "angle": -90}}],
            },
            {
                "type": "rectangle", "name": "wall", "material": "wall",
                "to_world": [{"scale": 12}, {"translate": [0, 5, -3.2]}],
            },
            {
                "type": "rectangle", "name": "softbox", "material": "black", "to_world": softbox,
                "emission": {"type": "area", "radiance": daylight(16.5)},
            },
            box("board", BOARD, LEAN, "board"),
            box("ledge", (3.2, 0.1, 0.16), [{"translate": [0, 0.05, 0.34]}], "wood"),
            {"type": "sphere", "name": "grey ball", "material": "grey", "radius": 0.44,
             "center": [-1.9, 0.44, 0.62]},
            {"type": "sphere", "name": "mirror ball", "material": "chrome", "radius": 0.44,
             "center": [1.87, 0.44, 0.62]},
            *chart,
        ],
    }  # fmt: skip


if __name__ == "__main__":
    text = json.dumps(scene(), indent=2)
    text = re.sub(r"\[[^\[\]{}]*\]", lambda numbers: " ".join(numbers[0].split()), text)
    (HERE / "scene.json").write_text(text + "\n", "utf-8")
