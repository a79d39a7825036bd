"""Writes scene.json: the same things in three booths, each with another lamp.

    python scenes/three_lamps/generate.py

The balls are painted in two greys that look alike by day: of all reflectances that have the X, Y
and Z of grey under D65, the two whose X under the lamps F11 and A differs most.
Needs scipy.
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from clpt.spectra import cie_xyz, illuminant

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
import making  # noqa: E402

Array = NDArray[np.float64]
NM = np.arange(400.0, 701.0, 10.0)
GREY, BEND = 0.4, 0.16  # of the balls; the sharpest bend of a paint's curve: its second difference
LAMPS = {"D65": ("daylight", -1.62), "A": ("bulb", 0.0), "F11": ("fluorescent tube", 1.62)}
WIDE, DEEP, HIGH = 1.54, 1.3, 1.5  # of a booth


def paint(sign: float) -> Array:
    """Return the reflectance at NM that is grey under D65, with most (1) or least (-1) red."""
    day = illuminant("D65").sample(NM)[:, None] * cie_xyz(NM)
    others = sum(illuminant(lamp).sample(NM) * cie_xyz(NM)[:, 0] for lamp in ("A", "F11"))
    bend = np.diff(np.eye(len(NM)), 2, axis=0)
    found = linprog(
        -sign * others,
        A_ub=np.vstack([bend, -bend]), b_ub=np.full(2 * len(bend), BEND),
        A_eq=day.T / day.sum(), b_eq=GREY * day.sum(axis=0) / day.sum(),
        bounds=(0.03, 0.9),
    )  # fmt: skip
    assert found.success, found.message
    return np.asarray(found.x)


def table(nm: Array, values: Array) -> dict[str, Any]:
    """Return a reflectance as scene files have it."""
    rows = [[float(at), round(float(value), 3)] for at, value in zip(nm, values, strict=True)]
    return {"values": [[300, rows[0][1]], *rows, [900, rows[-1][1]]]}


def patches() -> dict[str, Any]:
    """Return materials of twelve patches of a ColorChecker, measured."""
    path = HERE.parent / "color_checker" / "reflectances.csv"
    lines = path.read_text(encoding="utf-8").splitlines()
    names = lines[2].removeprefix("# lambda [nm],").split(",")
    rows = np.array(list(csv.reader(lines[3:])), float)[::2]
    return {
        names[i].strip(): {"type": "diffuse", "reflectance": table(rows[:, 0], rows[:, 1 + i])}
        for i in (1, 2, 6, 7, 10, 11, 12, 13, 14, 15, 16, 17)
    }


def cube(name: str, material: str, half: list[float], at: list[float]) -> dict[str, Any]:
    """Return a box."""
    return {
        "type": "cube", "name": name, "material": material,
        "to_world": [{"scale": half}, {"translate": at}],
    }  # fmt: skip


def things(chart: list[str]) -> list[dict[str, Any]]:
    """Return what stands in each booth."""
    back, half = -DEEP + 0.03, WIDE / 2
    shapes = [
        cube("back", "wall", [half, HIGH / 2, 0.02], [0, HIGH / 2, -DEEP]),
        cube("floor", "wall", [half, 0.02, DEEP / 2], [0, -0.02, -DEEP / 2]),
        cube("ceiling", "wall", [half, 0.02, DEEP / 2], [0, HIGH + 0.02, -DEEP / 2]),
        cube("left", "wall", [0.02, HIGH / 2, DEEP / 2], [-half, HIGH / 2, -DEEP / 2]),
        cube("right", "wall", [0.02, HIGH / 2, DEEP / 2], [half, HIGH / 2, -DEEP / 2]),
        cube("board", "board", [0.56, 0.2, 0.015], [0, 1.02, back]),
        {"type": "sphere", "name": "ball", "material": "two greys", "center": [0.3, 0.27, -0.62],
         "radius": 0.27},
        {"type": "mesh", "name": "knot", "file": "../fluorescent_paint/knot.ply",
         "material": "coral",
         "to_world": [{"scale": 0.3}, {"translate": [-0.38, 0.23, -0.75]}]},
        {"type": "mesh", "name": "pawn", "file": "../glass_caustics/pawn.ply", "material": "brass",
         "to_world": [{"scale": 0.16}, {"translate": [-0.05, 0, -0.3]}]},
    ]  # fmt: skip
    for i, name in enumerate(chart):
        x, y = -0.45 + 0.18 * (i % 6), 1.11 - 0.18 * (i // 6)
        shapes.append(
            {"type": "rectangle", "name": name, "material": name,
             "to_world": [{"scale": [0.08, 0.08, 1]}, {"translate": [x, y, back + 0.017]}]}
        )  # fmt: skip
    return shapes


def scene() -> dict[str, Any]:
    """Return the scene."""
    chart = patches()
    greys = {
        "type": "checkerboard", "color0": table(NM, paint(1.0)), "color1": table(NM, paint(-1.0)),
        "to_uv": [{"scale": [8, 4, 1]}],
    }  # fmt: skip
    lamps = [
        {"type": "rectangle", "name": what, "material": "black",
         "emission": {"type": "area",
                      "radiance": {"type": "illuminant", "name": lamp, "scale": 4.2}},
         "to_world": [{"scale": [0.5, 0.3, 1]}, {"rotate": {"axis": [1, 0, 0], "angle": 90}},
                      {"translate": [x, HIGH - 0.01, -0.55]}]}
        for lamp, (what, x) in LAMPS.items()
    ]  # fmt: skip
    booths = [
        {"type": "instance", "group": "things", "name": f"booth of {what}",
         "to_world": [{"translate": [x, 0, 0]}]}
        for what, x in LAMPS.values()
    ]  # fmt: skip
    return {
        "$schema": "../schema.json",
        "name": "three_lamps",
        "camera": {
            "type": "perspective", "fov": 38.5,
            "to_world": {"look_at": {"origin": [0, 0.86, 6.9], "target": [0, 0.72, -0.5],
                                     "up": [0, 1, 0]}},
        },
        "film": {"width": 640, "height": 240, "exposure": 1.2,
                 "filter": {"type": "blackman_harris"}},
        "integrator": {"type": "path", "max_depth": 8},
        "spp": 256,
        "materials": {
            "wall": {"type": "diffuse", "reflectance": 0.55},
            "board": {"type": "diffuse", "reflectance": 0.03},
            "black": {"type": "diffuse", "reflectance": 0},
            "two greys": {"type": "rough_plastic", "alpha": 0.2, "diffuse_reflectance": greys},
            "coral": {"type": "rough_plastic", "alpha": 0.15,
                      "diffuse_reflectance": [0.62, 0.1, 0.07]},
            "brass": {"type": "rough_conductor", "metal": "brass", "alpha": 0.12},
            **chart,
        },
        "groups": {"things": things(list(chart))},
        "shapes": [*booths, *lamps],
    }  # fmt: skip


if __name__ == "__main__":
    making.write_scene(HERE / "scene.json", json.loads(json.dumps(scene())))
