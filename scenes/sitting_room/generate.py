"""Makes what a room by a window needs: the curtains, a vase, a pendant lamp, boards and books.

python scenes/sitting_room/generate.py
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
import making  # noqa: E402

JSON = dict[str, Any]
HIGH, LEFT, BACK = 2.7, -2.4, -2.6  # of the room; the window is in the wall on the left
WINDOW = (-1.9, 0.1, 0.75, 2.3)  # z from and to, y from and to


def box(name: str, material: str, low: tuple[float, ...], high: tuple[float, ...]) -> JSON:
    """Return a box between two corners."""
    ends = np.array([low, high])
    half, middle = np.diff(ends, axis=0)[0] / 2, ends.mean(axis=0)
    return {
        "type": "cube", "name": name, "material": material,
        "to_world": [{"scale": half.round(4).tolist()}, {"translate": middle.round(4).tolist()}],
    }  # fmt: skip


def curtain(z: float, width: float) -> trimesh.Trimesh:
    """Return a cloth that hangs in folds from a rail beside the window."""
    u, v = np.meshgrid(np.linspace(0, 1, 97), np.linspace(0, 1, 13), indexing="ij")
    fold = 0.045 * (0.55 + 0.45 * v) * np.sin(2 * np.pi * 7 * u + 0.9 * np.sin(5 * u + 2 * v))
    points = np.stack([LEFT + 0.16 + fold, 2.5 - 2.46 * v, z + width * (u - 0.5)], axis=-1)
    along, down = np.gradient(points, axis=0), np.gradient(points, axis=1)
    normals = np.cross(along, down)
    return making.surface(points, normals / np.linalg.norm(normals, axis=-1, keepdims=True))


def vase() -> trimesh.Trimesh:
    """Return a vase of thin clay."""
    outside = making.curve(
        [[0, 0], [0.055, 0.004], [0.085, 0.06], [0.1, 0.13], [0.07, 0.2], [0.04, 0.25], [0.05, 0.3],
         [0.044, 0.298], [0.034, 0.25], [0.06, 0.2], [0.088, 0.13], [0.07, 0.06], [0, 0.02]], 4
    )  # fmt: skip
    return making.lathe(outside, 48)


def shade() -> trimesh.Trimesh:
    """Return the shade of the pendant lamp."""
    profile = making.curve(
        [[0.02, 0.21], [0.06, 0.19], [0.14, 0.12], [0.19, 0], [0.182, 0.002], [0.135, 0.11],
         [0.055, 0.18], [0.02, 0.2]], 4
    )  # fmt: skip
    return making.lathe(profile[1:-1], 48)


def boards() -> Image.Image:
    """Return a floor of oak: ten boards, each with its own tone and grain."""
    rng = np.random.default_rng(5)
    across, along = 160, 256
    grain = rng.normal(size=(along, across))
    for _ in range(5):  # drawn out along the board
        grain = (np.roll(grain, 9, 0) + np.roll(grain, -7, 0) + np.roll(grain, 3, 0) + grain) / 2.6
    grain = (grain - grain.mean()) / grain.std()
    board = np.arange(across) // 16
    end = (rng.integers(0, along, 10)[board][None] + np.arange(along)[:, None]) % along
    tone = rng.uniform(0.82, 1.12, (10, 2))[board[None].repeat(along, 0), (2 * end // along)]
    gap = (np.arange(across) % 16 == 0)[None] | (end % (along // 2) < 2)
    light = np.clip(tone * (1 + 0.05 * grain), 0, 1.3) * np.where(gap, 0.35, 1.0)
    colour = np.array([150, 112, 76])[None, None] * light[..., None] ** 0.6
    return Image.fromarray(np.clip(colour, 0, 255).astype(np.uint8))


def books() -> list[JSON]:
    """Return two shelves of books."""
    rng = np.random.default_rng(11)
    shapes = []
    for shelf, (left, right) in ((1.32, (0.55, 1.45)), (1.72, (0.35, 1.15))):
        x = left
        while x < right:
            thick, tall, deep = rng.uniform((0.018, 0.16, 0.11), (0.045, 0.25, 0.16))
            name = f"book {rng.integers(5)}"
            at = (round(x, 3), shelf, BACK + 0.02)
            shapes.append(box("book", name, at, (round(x + thick, 3), shelf + tall, BACK + deep)))
            x += thick + 0.002
    return shapes


def room() -> list[JSON]:
    """Return walls, window and floor."""
    near, far, low, top = WINDOW[1], WINDOW[0], *WINDOW[2:]
    out, right, front = LEFT - 0.25, 2.6, 3.2
    bars = [
        box("sill", "white", (out, low - 0.04, far - 0.05), (LEFT + 0.12, low, near + 0.05)),
        box("rail", "brass", (LEFT + 0.15, 2.5, far - 0.5), (LEFT + 0.17, 2.52, near + 0.5)),
    ]
    for z in (far, (far + near) / 2 - 0.025, near - 0.05):
        bars.append(box("frame", "white", (out + 0.08, low, z), (out + 0.14, top, z + 0.05)))
    for y in (low, low + 0.7 * (top - low), top - 0.05):
        bars.append(box("frame", "white", (out + 0.08, y, far), (out + 0.14, y + 0.05, near)))
    return [
        {"type": "rectangle", "name": "floor", "material": "oak",
         "to_world": [{"scale": [3.2, 3.2, 1]}, {"rotate": {"axis": [1, 0, 0], "angle": -90}},
                      {"translate": [0.1, 0, 0.2]}]},
        box("ceiling", "white", (out, HIGH, BACK - 0.2), (right + 0.2, HIGH + 0.2, front)),
        box("back", "wall", (out, 0, BACK - 0.2), (right + 0.2, HIGH, BACK)),
        box("right", "wall", (right, 0, BACK), (right + 0.2, HIGH, front)),
        box("behind", "wall", (out, 0, front), (right + 0.2, HIGH, front + 0.2)),
        box("left, below", "wall", (out, 0, BACK), (LEFT, low, front)),
        box("left, above", "wall", (out, top, BACK), (LEFT, HIGH, front)),
        box("left, far", "wall", (out, low, BACK), (LEFT, top, far)),
        box("left, near", "wall", (out, low, near), (LEFT, top, front)),
        box("skirting", "white", (LEFT, 0, BACK), (right, 0.09, BACK + 0.015)),
        *bars,
    ]  # fmt: skip


def furniture() -> list[JSON]:
    """Return a table with chairs, a sofa, shelves and pictures."""
    legs = [
        box("leg", "walnut", (x, 0, z), (x + 0.05, 0.7, z + 0.05))
        for x in (-1.35, -0.2) for z in (-1.55, -0.75)
    ]  # fmt: skip
    chair = [
        box("seat", "walnut", (-0.22, 0.43, -0.2), (0.22, 0.46, 0.22)),
        box("back", "walnut", (-0.22, 0.66, -0.22), (0.22, 0.86, -0.195)),
        *(box("leg", "walnut", (x, 0, z), (x + 0.035, 0.86 if z < 0 else 0.43, z + 0.035))
          for x in (-0.22, 0.185) for z in (-0.225, 0.18)),
    ]  # fmt: skip
    chairs = [
        {"type": "instance", "group": "chair", "name": f"chair {i}",
         "to_world": [{"rotate": {"axis": [0, 1, 0], "angle": turn}}, {"translate": [x, 0, z]}]}
        for i, (x, z, turn) in enumerate(((0.25, -1.1, -82), (-0.85, -0.4, 176)))
    ]  # fmt: skip
    fruit = [
        {"type": "sphere", "name": "orange", "material": "orange", "center": [x, y, z], "radius": r}
        for x, y, z, r in ((-0.42, 0.768, -1.0, 0.038), (-0.5, 0.77, -1.06, 0.04),
                           (-0.49, 0.767, -0.95, 0.037))
    ]  # fmt: skip
    return chair, [
        box("table", "walnut", (-1.4, 0.7, -1.6), (-0.1, 0.73, -0.65)), *legs, *chairs, *fruit,
        {"type": "mesh", "name": "vase", "file": "vase.ply", "material": "glaze",
         "to_world": [{"translate": [-0.95, 0.7301, -1.2]}]},
        {"type": "mesh", "name": "shade", "file": "shade.ply", "material": "brass",
         "to_world": [{"translate": [-0.75, 1.62, -1.1]}]},
        box("cord", "black", (-0.753, 1.8, -1.103), (-0.747, HIGH, -1.097)),
        {"type": "mesh", "name": "curtain", "file": "far.ply", "material": "linen"},
        {"type": "mesh", "name": "curtain", "file": "near.ply", "material": "linen"},
        box("shelf", "walnut", (0.45, 1.295, BACK), (2.0, 1.32, BACK + 0.2)),
        box("shelf", "walnut", (0.25, 1.695, BACK), (1.7, 1.72, BACK + 0.2)),
        {"type": "sphere", "name": "globe", "material": "glaze", "center": [1.75, 1.44, BACK + 0.1],
         "radius": 0.09},
        {"type": "rectangle", "name": "painting", "material": "painting",
         "to_world": [{"scale": [0.4, 0.3, 1]}, {"translate": [-0.75, 1.55, BACK + 0.032]}]},
        box("frame", "walnut", (-1.18, 1.22, BACK), (-0.32, 1.88, BACK + 0.03)),
        box("sofa", "wool", (0.75, 0.12, -2.45), (2.45, 0.42, -1.6)),
        box("sofa, back", "wool", (0.75, 0.42, -2.5), (2.45, 0.82, -2.25)),
        box("sofa, arm", "wool", (0.6, 0.12, -2.5), (0.78, 0.6, -1.6)),
        box("cushion", "mustard", (0.86, 0.44, -2.24), (1.26, 0.8, -2.1)),
        {"type": "rectangle", "name": "rug", "material": "rug",
         "to_world": [{"scale": [1.1, 0.75, 1]}, {"rotate": {"axis": [1, 0, 0], "angle": -90}},
                      {"translate": [1.15, 0.006, -0.6]}]},
    ]  # fmt: skip


def scene() -> JSON:
    """Return the scene."""
    chair, things = furniture()
    covers = [[0.42, 0.07, 0.05], [0.08, 0.18, 0.34], [0.62, 0.52, 0.36]]
    covers += [[0.12, 0.3, 0.18], [0.6, 0.3, 0.08]]

    def satin(colour: Any, alpha: float = 0.25) -> JSON:
        return {"type": "rough_plastic", "alpha": alpha, "diffuse_reflectance": colour}

    def matt(colour: Any) -> JSON:
        return {"type": "diffuse", "reflectance": colour}

    return {
        "$schema": "../schema.json",
        "name": "sitting_room",
        "camera": {
            "type": "perspective", "fov": 62,
            "to_world": {"look_at": {"origin": [1.55, 1.4, 2.7], "target": [-0.35, 1.12, -1.6],
                                     "up": [0, 1, 0]}},
        },
        "film": {"width": 640, "height": 360, "exposure": 6.5,
                 "filter": {"type": "blackman_harris"}},
        "integrator": {"type": "path", "max_depth": 16},
        "spp": 256,
        "materials": {
            "white": matt(0.82), "black": matt(0.03), "wall": matt([0.72, 0.7, 0.64]),
            "oak": satin({"type": "bitmap", "image": "boards.png",
                          "to_uv": [{"scale": [2, 2, 1]}]}),
            "walnut": satin([0.3, 0.16, 0.08], 0.2), "glaze": satin([0.05, 0.16, 0.24], 0.06),
            "wool": matt([0.36, 0.42, 0.4]), "mustard": matt([0.5, 0.27, 0.04]),
            "orange": satin([0.75, 0.24, 0.02], 0.3),
            "brass": {"type": "two_sided",
                      "front": {"type": "rough_conductor", "metal": "brass", "alpha": 0.2}},
            "linen": {"type": "diffuse_transmission", "reflectance": [0.5, 0.46, 0.4],
                      "transmittance": [0.32, 0.28, 0.22]},
            "rug": matt({"type": "checkerboard", "color0": [0.4, 0.32, 0.24],
                         "color1": [0.26, 0.07, 0.05], "to_uv": [{"scale": [5, 3, 1]}]}),
            "painting": matt({"type": "bitmap", "image": "../hidden_whale/painting.exr"}),
            **{f"book {i}": matt(colour) for i, colour in enumerate(covers)},
        },
        "groups": {"chair": chair},
        "shapes": [*room(), *things, *books()],
        "lights": [{"type": "sky", "sun_elevation": 32, "sun_azimuth": -68, "aerosol": 0.08,
                    "ground": [0.09, 0.11, 0.05]}],
    }  # fmt: skip


if __name__ == "__main__":
    boards().save(HERE / "boards.png", optimize=True)
    for name, mesh in {
        "far": curtain(WINDOW[0] - 0.2, 0.55), "near": curtain(WINDOW[1] + 0.2, 0.55),
        "vase": vase(), "shade": shade(),
    }.items():  # fmt: skip
        mesh.export(HERE / f"{name}.ply")
    making.write_scene(HERE / "scene.json", scene())
