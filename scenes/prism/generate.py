"""Writes scene.json: a sheet of white light, a prism of flint glass, and the fan behind it.

    python scenes/prism/generate.py

Lengths are in decimetres; the prism stands on the table y = 0, its edge away from the camera. The
beam passes it at the least deviation for the helium line d (Born and Wolf 1999, 4.7.2), and slopes
down a little, so that it meets the table all along its way and is seen there.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from clpt import spectra

sys.path.append(str(Path(__file__).parents[1]))
from making import JSON, write_scene

APEX = 60.0  # angle at the edge [degrees]
SLOPE = 5.0  # of the beam [degrees]
WAY = 3.6  # from the slit to the prism
SLIT = (0.022, 0.66)  # width and height
HEIGHT = 0.5  # of the prism


def prism() -> tuple[list[JSON], np.ndarray]:
    """The prism's polished and its ground sides, and the middle of the side that light meets."""
    corners = [(-0.5, 0.2887), (0.0, -0.5774), (0.5, 0.2887)]  # x and z: left, edge, right
    vertices = [[x, y, z] for y in (0.002, HEIGHT) for x, z in corners]
    left, right = [[0, 3, 1], [1, 3, 4]], [[1, 4, 2], [2, 4, 5]]
    base, top, bottom = [[2, 5, 0], [0, 5, 3]], [[3, 5, 4]], [[0, 1, 2]]
    middle = np.array([-0.25, -0.1443])
    return [
        _mesh("polished sides", "glass", vertices, left + right),
        _mesh("ground sides", "ground glass", vertices, base + top + bottom),
    ], middle


def _mesh(name: str, material: str, vertices: list, faces: list) -> JSON:
    return {
        "type": "mesh",
        "name": name,
        "material": material,
        "vertices": vertices,
        "faces": faces,
    }


def box(name: str, material: str, low: Any, high: Any, place: list[JSON]) -> JSON:
    """A block between two corners, then placed."""
    low, high = np.asarray(low, float), np.asarray(high, float)
    return {
        "type": "cube", "name": name, "material": material,
        "to_world": [
            {"scale": rounded((high - low) / 2)},
            {"translate": rounded((high + low) / 2)},
            *place,
        ],
    }  # fmt: skip


def rounded(values: Any) -> list[float]:
    return [round(float(v), 5) for v in values]


def lamp(middle: np.ndarray) -> list[JSON]:
    """A lamp house whose slit sends the sheet along its +z; x across, y up."""
    index = float(spectra.glass("sf11").sample(587.56))
    incidence = np.degrees(np.arcsin(index * np.sin(np.radians(APEX / 2.0))))
    turn = incidence - APEX / 2.0  # to the right and away from the camera
    a = np.radians(turn)
    start = middle - WAY * np.array([np.cos(a), -np.sin(a)])
    place: list[JSON] = [
        {"rotate": {"axis": [0, 1, 0], "angle": round(90.0 + turn, 4)}},
        {"translate": rounded([start[0], 0.0, start[1]])},
    ]
    w, h = SLIT
    beam = {
        "type": "rectangle", "name": "slit", "material": "black",
        "emission": {
            "type": "directional_area",
            "irradiance": {"type": "illuminant", "name": "E", "scale": 330},
        },
        "to_world": [
            {"scale": [w / 2, h / 2, 1]},
            {"rotate": {"axis": [1, 0, 0], "angle": SLOPE}},
            {"translate": [0, h / 2 + 0.005, 0.004]},
            *place,
        ],
    }  # fmt: skip
    return [
        beam,
        box("lamp house", "metal", [-0.42, 0.0, -1.3], [0.42, 1.05, -0.1], place),
        box("left jaw", "metal", [-0.3, 0.0, -0.1], [-w / 2 - 0.002, 0.85, 0.06], place),
        box("right jaw", "metal", [w / 2 + 0.002, 0.0, -0.1], [0.3, 0.85, 0.06], place),
        box("lintel", "metal", [-0.3, 0.72, -0.1], [0.3, 0.85, 0.059], place),
    ]


def scene() -> JSON:
    glass, middle = prism()
    return {
        "$schema": "../schema.json",
        "name": "prism",
        "camera": {
            "type": "perspective", "fov": 50,
            "to_world": {
                "look_at": {"origin": [1.5, 3.6, 4.3], "target": [0.7, 0.0, 0.36], "up": [0, 1, 0]}
            },
        },
        "film": {"width": 640, "height": 400},
        "integrator": {"type": "particle_tracer", "max_depth": 10},
        "spp": 2048,
        "materials": {
            "glass": {"type": "dielectric", "int_ior": "sf11"},
            "ground glass": {
                "type": "rough_dielectric", "int_ior": "sf11", "alpha_u": 0.5, "alpha_v": 0.5,
            },
            "table": {"type": "diffuse", "reflectance": 0.75},
            "metal": {"type": "diffuse", "reflectance": [0.1, 0.1, 0.11]},
            "black": {"type": "diffuse", "reflectance": 0},
        },
        "shapes": [
            {
                "type": "rectangle", "name": "table", "material": "table",
                "to_world": [{"scale": 6}, {"rotate": {"axis": [1, 0, 0], "angle": -90}}],
            },
            *glass,
            *lamp(middle),
        ],
        "lights": [
            {
                "type": "spot", "intensity": [3, 3.6, 4.8], "cutoff": 32, "beam_width": 5,
                "to_world": {
                    "look_at": {"origin": [-0.6, 5, -2.6], "target": [0.5, 0, 0.5], "up": [1, 0, 0]}
                },
            }
        ],
    }  # fmt: skip


if __name__ == "__main__":
    write_scene(Path(__file__).with_name("scene.json"), scene())
