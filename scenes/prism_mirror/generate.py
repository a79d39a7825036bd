"""Writes scene.json: a slit's light through a prism, its colours on a screen, both in a mirror.

    python scenes/prism_mirror/generate.py

Lengths are in decimetres; the prism stands on the table y = 0, its edge toward the camera. Light
comes from a point, as if through a slit, as a thin upright sheet. It passes the prism at the least
deviation for the helium line d (Born and Wolf 1999, 4.7.2). Its lower part meets the table.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from clpt import spectra

sys.path.append(str(Path(__file__).parents[1]))
from making import JSON, Array, write_scene

APEX = 60.0  # angle at the edge [degrees]
TALL = 1.3  # the prism
WAY, AWAY = 4.0, 4.3  # from the slit to the prism's axis, from there to the screen
EYE = np.array([1.0, 2.2, 5.7])
MIRROR = np.array([-1.2, 1.3, -2.7])  # its middle
SCREEN = (1.8, 2.0)  # width and height


def heading() -> tuple[Array, Array]:
    """Directions of the light before and behind the prism; it is turned away from the camera."""
    index = float(spectra.glass("sf11").sample(587.56))
    turn = np.arcsin(index * np.sin(np.radians(APEX / 2))) - np.radians(APEX / 2)
    before = np.array([np.cos(turn), 0.0, np.sin(turn)])
    return before, before * [1, 1, -1]


def facing(place: Array, toward: Array) -> JSON:
    """A step that puts +z of a thing at a place to a point."""
    return {
        "look_at": {"origin": rounded(place), "target": rounded(place + toward), "up": [0, 1, 0]}
    }


def rounded(values: object) -> list:
    return np.round(values, 4).tolist()


def box(name: str, material: str, low: list[float], high: list[float], place: list[JSON]) -> JSON:
    """A block between two corners, then placed."""
    half, middle = (np.array(high) - low) / 2, (np.array(high) + low) / 2
    return {
        "type": "cube", "name": name, "material": material,
        "to_world": [{"scale": rounded(half)}, {"translate": rounded(middle)}, *place],
    }  # fmt: skip


def prism() -> list[JSON]:
    """The polished sides of the prism, and its ground top and bottom; it stands a hair above."""
    corners = np.array([[-0.5, -0.2887], [0.5, -0.2887], [0.0, 0.5774]])  # left, right, edge
    vertices = [[x, y, z] for y in (0.002, TALL) for x, z in corners]
    sides = [[0, 3, 1], [1, 3, 4], [1, 4, 2], [2, 4, 5], [2, 5, 0], [0, 5, 3]]
    return [
        {"type": "mesh", "name": name, "material": material, "vertices": rounded(vertices),
         "faces": faces}
        for name, material, faces in (
            ("polished sides", "glass", sides),
            ("ground ends", "ground glass", [[0, 1, 2], [3, 5, 4]]),
        )
    ]  # fmt: skip


def scene() -> JSON:
    before, behind = heading()
    middle = np.array([0.0, 0.6, 0.1443])  # of the light's way in the glass
    slit, screen = middle - WAY * before, middle + AWAY * behind
    screen[1] = SCREEN[1] / 2 + 0.02
    to_eye, to_screen = EYE - MIRROR, screen - MIRROR
    normal = to_eye / np.linalg.norm(to_eye) + to_screen / np.linalg.norm(to_screen)
    lamp, paper, glass = (
        [facing(place * [1, 0, 1], toward)]
        for place, toward in ((slit, before), (screen, -behind), (MIRROR, normal * [1, 0, 1]))
    )
    w, h = SCREEN[0] / 2, SCREEN[1]
    return {
        "$schema": "../schema.json",
        "name": "prism_mirror",
        "camera": {
            "type": "perspective", "fov": 49,
            "to_world": {
                "look_at": {"origin": EYE.tolist(), "target": [0.72, 0.85, -0.8], "up": [0, 1, 0]}
            },
        },
        "film": {"width": 560, "height": 350, "filter": {"type": "blackman_harris"}},
        "integrator": {"type": "vcm", "max_depth": 12},
        "spp": 256,
        "materials": {
            "glass": {"type": "dielectric", "int_ior": "sf11"},
            "ground glass": {
                "type": "rough_dielectric", "int_ior": "sf11", "alpha_u": 0.4, "alpha_v": 0.4,
            },
            "table": {"type": "diffuse", "reflectance": [0.3, 0.31, 0.34]},
            "wall": {"type": "diffuse", "reflectance": [0.2, 0.22, 0.27]},
            "paper": {"type": "diffuse", "reflectance": 0.85},
            "wood": {"type": "rough_plastic", "diffuse_reflectance": [0.2, 0.09, 0.04]},
            "metal": {"type": "diffuse", "reflectance": [0.1, 0.1, 0.11]},
            "silver": {"type": "conductor", "metal": "Ag"},
        },
        "shapes": [
            {
                "type": "rectangle", "name": "table", "material": "table",
                "to_world": [{"scale": 8}, {"rotate": {"axis": [1, 0, 0], "angle": -90}}],
            },
            {
                "type": "rectangle", "name": "wall", "material": "wall",
                "to_world": [{"scale": [8, 3, 1]}, {"translate": [0, 3, -5]}],
            },
            *prism(),
            box("lamp house", "metal", [-0.4, 0.0, -1.2], [0.4, 1.3, -0.02], lamp),
            box("screen", "paper", [-w, 0.02, -0.06], [w, h + 0.02, 0.0], paper),
            box("foot of the screen", "wood", [-w - 0.1, 0.0, -0.2], [w + 0.1, 0.08, 0.1], paper),
            {
                "type": "rectangle", "name": "mirror", "material": "silver",
                "to_world": [{"scale": [1.3, 1.0, 1]}, {"translate": [0, MIRROR[1], 0]}, *glass],
            },
            box("frame", "wood", [-1.4, 0.2, -0.1], [1.4, 2.4, -0.01], glass),
            box("foot of the frame", "wood", [-1.4, 0.0, -0.3], [1.4, 0.201, 0.2], glass),
        ],
        "lights": [
            {
                "type": "projector", "fov": 0.5, "aspect": 0.0276,
                "irradiance": {"type": "illuminant", "name": "E", "scale": 3000},
                "to_world": [facing(slit, before)],
            },
            {
                "type": "spot", "intensity": [52, 58, 70], "cutoff": 40, "beam_width": 10,
                "to_world": {
                    "look_at": {"origin": [3, 7, 4], "target": [0.5, 0, -1], "up": [1, 0, 0]}
                },
            },
        ],
    }  # fmt: skip


if __name__ == "__main__":
    write_scene(Path(__file__).with_name("scene.json"), scene())
