"""Writes scene.json: a ball of water before a screen, and a beam through a hole of the screen.

    python scenes/rainbow/generate.py

The experiment of Theodoric of Freiberg and of Descartes, who took a flask of water for one large
drop. Light comes along +z; what the ball sends back falls on the screen z = 0, a metre before it.
A ray that meets the ball at b radii from its axis comes back under the angle 4 r - 2 i after one
reflection inside, where sin i = b and sin r = b / n; that is largest, 42.4 degrees for red light,
at b = 0.86. After two it is at least 50.4 degrees, at b = 0.95 (Descartes 1637). The beam is a
ring, so that little light is lost on rays that take no part in the bows.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1]))
from making import JSON, write_scene

RADIUS = 0.04  # of the ball [m]
STOP = 0.76  # inner radius of the beam, in radii of the ball
SIDES = 72  # of the ring
HOLE = 0.045  # half its width [m]
SCREEN = (-1.05, 1.7, 1.8)  # lower and upper edge, half the width [m]


def beam() -> JSON:
    """A flat ring of triangles that faces +z."""
    turn = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    circle = np.stack([np.cos(turn), np.sin(turn), np.full(SIDES, -0.1 / RADIUS)], axis=1)
    inner = circle * [STOP, STOP, 1.0]
    i = np.arange(SIDES)
    j = (i + 1) % SIDES
    faces = [*np.stack([i, i + SIDES, j], 1), *np.stack([j, i + SIDES, j + SIDES], 1)]
    return {
        "type": "mesh", "name": "beam", "material": "black",
        "emission": {
            "type": "directional_area",
            "irradiance": {"type": "illuminant", "name": "E", "scale": 6000},
        },
        "vertices": np.round(RADIUS * np.concatenate([circle, inner]), 6).tolist(),
        "faces": [face[::-1].tolist() for face in faces],
    }  # fmt: skip


def screen() -> list[JSON]:
    """Four pieces of paper around the hole."""
    low, high, half = SCREEN
    pieces = {
        "above": (-half, half, HOLE, high),
        "below": (-half, half, low, -HOLE),
        "left of": (-half, -HOLE, -HOLE, HOLE),
        "right of": (HOLE, half, -HOLE, HOLE),
    }
    return [
        {
            "type": "rectangle", "name": f"screen {side} the hole", "material": "paper",
            "to_world": [
                {"scale": [round((right - left) / 2, 6), round((up - down) / 2, 6), 1]},
                {"translate": [round((right + left) / 2, 6), round((up + down) / 2, 6), 0]},
            ],
        }
        for side, (left, right, down, up) in pieces.items()
    ]  # fmt: skip


def scene() -> JSON:
    return {
        "$schema": "../schema.json",
        "name": "rainbow",
        "camera": {
            "type": "perspective", "fov": 60,
            "to_world": {
                "look_at": {"origin": [-0.3, 0.2, 2.4], "target": [0.06, 0.36, 0], "up": [0, 1, 0]}
            },
        },
        "film": {"width": 480, "height": 300},
        "integrator": {"type": "particle_tracer", "max_depth": 7},
        "spp": 4096,
        "materials": {
            "water": {"type": "dielectric", "int_ior": "water"},
            "paper": {"type": "diffuse", "reflectance": 0.8},
            "brass": {"type": "diffuse", "reflectance": [0.4, 0.27, 0.1]},
            "black": {"type": "diffuse", "reflectance": 0},
        },
        "shapes": [
            beam(),
            {
                "type": "sphere", "name": "flask", "material": "water",
                "center": [0, 0, 1], "radius": RADIUS,
            },
            {
                "type": "cylinder", "name": "stand", "material": "brass",
                "p0": [0, -1.05, 1], "p1": [0, -0.041, 1], "radius": 0.006,
            },
            *screen(),
        ],
        "lights": [
            {
                "type": "spot", "intensity": [0.4, 0.5, 0.7], "cutoff": 42, "beam_width": 10,
                "to_world": {
                    "look_at": {"origin": [1.6, 1.4, 2.2], "target": [0, 0.3, 0], "up": [0, 1, 0]}
                },
            }
        ],
    }  # fmt: skip


if __name__ == "__main__":
    write_scene(Path(__file__).with_name("scene.json"), scene())
