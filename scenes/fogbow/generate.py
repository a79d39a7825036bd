"""Writes scene.json: a layer of fog under a clear sky, seen from above with the sun behind.

The fog's drops have 8 um of radius; where its light goes follows from the index of water by Mie's
theory (`clpt mie`), for each wavelength. So there is the fogbow, a rainbow almost without colour,
and around the point opposite to the sun the glory. The fog is thin, and light is followed through
one collision: what is scattered twice is even, but its bright pixels last long. y is up, lengths
are in metres.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from clpt import mie
from clpt.formats.native.write import write_medium

HERE = Path(__file__).parent
TOP, DEEP, WIDE = 0.0, 40.0, 4000.0
HEIGHT, DOWN = 60.0, 40.0  # of the eye above the fog; degrees by which it looks down, as the sun
SUN, ACROSS, IRRADIANCE = 3e4, 0.53, 12.0  # its distance; degrees
RADIUS, VARIANCE, SHARE = 8e-6, 0.01, 5e-8


def main() -> None:
    """Write it."""
    down = np.radians(DOWN)
    look = [0.0, -float(np.sin(down)), -float(np.cos(down))]
    fog = mie.droplets(
        mie.sizes("gamma", RADIUS, VARIANCE, 100), SHARE, lambdas=np.arange(380.0, 741.0, 12.0)
    )
    angle = np.pi * np.radians(0.5 * ACROSS) ** 2  # the sun's solid angle
    scene = {
        "$schema": "../schema.json",
        "name": "fogbow",
        "camera": {
            "type": "perspective",
            "fov": 94,
            "to_world": [
                {"look_at": {
                    "origin": [0, HEIGHT, 0],
                    "target": [HEIGHT * look[0], HEIGHT + HEIGHT * look[1], HEIGHT * look[2]],
                    "up": [0, 1, 0],
                }},
            ],
        },
        "film": {"width": 384, "height": 320, "exposure": 1.4},
        "integrator": {"type": "path", "max_depth": 2},
        "spp": 256,
        "materials": {"moor": {"type": "diffuse", "reflectance": [0.025, 0.03, 0.02]}},
        "media": {"fog": "FOG"},
        "shapes": [
            {
                "type": "cube",
                "to_world": [
                    {"scale": [WIDE, 0.5 * DEEP, WIDE]}, {"translate": [0, TOP - 0.5 * DEEP, 0]},
                ],
                "material": {"type": "null"},
                "interior": "fog",
            },
            {
                "type": "rectangle",
                "to_world": [
                    {"scale": WIDE * 0.99},
                    {"rotate": {"axis": [1, 0, 0], "angle": -90}},
                    {"translate": [0, TOP - DEEP + 0.5, 0]},
                ],
                "material": "moor",
            },
            {
                "type": "sphere",
                "name": "sun",
                "center": [-SUN * one for one in look],
                "radius": SUN * np.radians(0.5 * ACROSS),
                "material": "moor",
                "emission": {"type": "area", "radiance": IRRADIANCE / angle},
            },
        ],
        "lights": [
            {"type": "constant", "radiance": [0.12, 0.2, 0.4]},
        ],
    }  # fmt: skip
    text = json.dumps(scene, indent=2).replace('"FOG"', write_medium(fog, 6))
    (HERE / "scene.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
