"""Makes knot.ply, top.ply, ink.png, and the one scene under two lamps: scene.json, scene_uv.json.

    python scenes/fluorescent_paint/generate.py

The dyes are no measured ones: their spectra have the shapes and places that day-glo pigments, an
optical brightener and an invisible ink are known to have. What a paint absorbs and gives out, and
what it reflects, stay below what arrives at every wavelength.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

Array = NDArray[np.float64]
Json = dict[str, Any]

HERE = Path(__file__).parent
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))  # the angle from seed to seed of a sunflower


def tube(path: Array, radius: float, around: int) -> trimesh.Trimesh:
    """A closed tube around a closed path (n, 3), smooth."""
    ahead = np.roll(path, -1, 0) - np.roll(path, 1, 0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    side = np.cross(ahead, path - path.mean(axis=0))
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    turn = np.linspace(0.0, 2.0 * np.pi, around, endpoint=False)
    up = np.cross(side, ahead)
    out = np.cos(turn)[:, None] * side[:, None] + np.sin(turn)[:, None] * up[:, None]
    index = np.arange(len(path) * around).reshape(len(path), around)
    right, above = np.roll(index, -1, 1), np.roll(index, -1, 0)
    both = np.roll(right, -1, 0)
    faces = np.concatenate([np.stack(c, -1).reshape(-1, 3)
                            for c in ((index, right, both), (index, both, above))])  # fmt: skip
    points = path[:, None] + radius * out
    return trimesh.Trimesh(
        points.reshape(-1, 3), faces, vertex_normals=out.reshape(-1, 3), process=False
    )


def knot() -> trimesh.Trimesh:
    """A trefoil knot of radius 0.62 or so, in the plane z = 0."""
    t = np.linspace(0.0, 2.0 * np.pi, 180, endpoint=False)
    x, y = np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t)
    return tube(0.21 * np.stack([x, y, -np.sin(3 * t)], 1), 0.135, 20)


def top() -> trimesh.Trimesh:
    """A spinning top, turned round the axis y."""
    profile = [
        (0.0, 0.0),
        (0.02, 0.02),
        (0.1, 0.1),
        (0.34, 0.28),
        (0.42, 0.38),
        (0.4, 0.46),
        (0.26, 0.53),
        (0.09, 0.57),
        (0.055, 0.64),
        (0.05, 0.78),
        (0.065, 0.83),
        (0.0, 0.85),
    ]
    radius, height = np.array(profile).T
    fine = np.linspace(0, len(profile) - 1, 60)
    steps = np.arange(len(profile))
    points = np.stack([np.interp(fine, steps, radius), np.interp(fine, steps, height)], 1)
    for _ in range(3):  # rounds the edges, but for both ends
        points[1:-1] = 0.25 * points[:-2] + 0.5 * points[1:-1] + 0.25 * points[2:]
    return trimesh.creation.revolve(np.stack(points.T, 1), sections=64).apply_transform(
        trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0])
    )


def ink(size: int = 768) -> NDArray[np.uint8]:
    """A sunflower of dots, smooth at their edges; black around it."""
    y, x = (np.mgrid[:size, :size] + 0.5) / size * 2.0 - 1.0
    shade = np.zeros((size, size))
    for k in range(6, 430):
        r = 0.0462 * np.sqrt(k)
        far = np.hypot(x - r * np.cos(k * GOLDEN), y - r * np.sin(k * GOLDEN))
        dot = 0.008 + 0.024 * r
        shade = np.maximum(shade, np.clip((dot - far) * size / 4.0 + 0.5, 0.0, 1.0))
    return np.round(255.0 * shade).astype(np.uint8)


def bell(peak: float, short: float, long: float) -> Json:
    """An emission: half as strong `short` below and `long` above its peak [nm]."""
    at = np.arange(peak - 3.0 * short, peak + 3.0 * long, 5.0)
    width = np.where(at < peak, short, long)
    values = np.round(np.exp2(-(((at - peak) / width) ** 2)), 4)
    return {"values": [[round(float(a), 1), float(v)] for a, v in zip(at, values, strict=True)]}


def paint(reflects: list[tuple[float, float]], absorbs: list[tuple[float, float]], emits: Json,
          share: float = 0.9) -> Json:  # fmt: skip
    """A fluorescent material from its spectra, given by points."""
    dye = {"type": "fluorophore", "absorption": {"values": absorbs}, "emission": emits}
    return {
        "type": "fluorescent",
        "reflectance": {"values": reflects},
        "reradiation": {**dye, "quantum_yield": share},
    }


PLASTER = [(300, 0.25), (400, 0.36), (500, 0.4), (600, 0.42), (830, 0.43)]
MATERIALS: Json = {
    "pink": paint(
        [(300, 0.05), (400, 0.12), (440, 0.4), (480, 0.25), (520, 0.06), (580, 0.1), (620, 0.75),
         (660, 0.85), (830, 0.87)],
        [(300, 0.55), (400, 0.5), (440, 0.3), (500, 0.7), (560, 0.9), (585, 0.6), (610, 0)],
        bell(612, 16, 26)),
    "orange": paint(
        [(300, 0.05), (540, 0.06), (570, 0.3), (600, 0.75), (640, 0.86), (830, 0.88)],
        [(300, 0.6), (420, 0.7), (500, 0.92), (550, 0.85), (575, 0.4), (600, 0)],
        bell(592, 15, 30)),
    "yellow": paint(
        [(300, 0.05), (470, 0.06), (505, 0.3), (545, 0.8), (600, 0.86), (830, 0.88)],
        [(300, 0.6), (380, 0.75), (450, 0.92), (490, 0.8), (515, 0.3), (535, 0)],
        bell(546, 17, 36)),
    "green": paint(
        [(300, 0.05), (440, 0.06), (475, 0.3), (510, 0.72), (540, 0.5), (580, 0.12), (830, 0.1)],
        [(300, 0.6), (400, 0.8), (450, 0.92), (475, 0.6), (505, 0)],
        bell(506, 14, 26)),
    "paper": paint(
        [(300, 0.08), (380, 0.12), (410, 0.5), (430, 0.82), (500, 0.88), (830, 0.9)],
        [(300, 0.5), (340, 0.75), (370, 0.8), (390, 0.6), (420, 0.12), (435, 0)],
        bell(437, 18, 40), 0.8),
    "ink": {
        **paint(PLASTER, [(300, 0.5), (340, 0.7), (370, 0.7), (390, 0.1), (400, 0)],
                bell(478, 26, 38), 0.9),
        "amount": {"type": "bitmap", "image": "ink.png", "raw": True, "wrap": "clamp"},
    },
    "plaster": {"type": "diffuse", "reflectance": {"values": PLASTER}},
    "red": {"type": "diffuse", "reflectance": {
        "values": [(300, 0.04), (560, 0.05), (600, 0.3), (630, 0.62), (830, 0.7)]}},
    "table": {"type": "rough_plastic", "diffuse_reflectance": 0.035, "alpha": 0.12},
    "black": {"type": "diffuse", "reflectance": 0},
}  # fmt: skip


def placed(**steps: Any) -> list[Json]:
    """The steps of a transform, in the order given."""
    return [{name: step} for name, step in steps.items()]


def turn(x: float, y: float, z: float, angle: float) -> Json:
    return {"axis": [x, y, z], "angle": angle}


def objects() -> list[Json]:
    """All that stands in the room."""
    gem = trimesh.creation.icosahedron()
    glider = [[0, 0, 0.75], [-0.5, 0.2, -0.5], [-0.06, 0.17, -0.5], [0, -0.04, -0.5],
              [0.06, 0.17, -0.5], [0.5, 0.2, -0.5]]  # fmt: skip
    return [
        {"type": "rectangle", "name": "table", "material": "table",
         "to_world": placed(scale=[9, 9, 1], rotate=turn(1, 0, 0, -90))},
        {"type": "rectangle", "name": "wall", "material": "plaster",
         "to_world": placed(scale=[9, 5, 1], translate=[0, 4, -2.2])},
        {"type": "rectangle", "name": "mural", "material": "ink",
         "to_world": placed(scale=1.75, translate=[0, 1.62, -2.199])},
        {"type": "mesh", "file": "knot.ply", "name": "knot", "material": "orange",
         "to_world": placed(rotate=turn(0, 1, 0, -18), translate=[0, 0.76, -0.6])},
        {"type": "mesh", "file": "top.ply", "name": "spinning top", "material": "green",
         "to_world": placed(rotate=turn(0, 0, 1, 46), scale=1.15, translate=[-0.62, 0.012, 0.75])},
        {"type": "sphere", "name": "ball", "material": "pink", "radius": 0.42,
         "center": [1.36, 0.42, -0.3]},
        {"type": "sphere", "name": "ordinary ball", "material": "red", "radius": 0.24,
         "center": [0.42, 0.24, 0.55]},
        {"type": "mesh", "name": "gem", "material": "yellow",
         "vertices": np.round(0.5 * gem.vertices, 5).tolist(), "faces": gem.faces.tolist(),
         "to_world": placed(rotate=turn(1, 0.3, 0.1, 21), translate=[-1.5, 0.4, -0.35])},
        {"type": "mesh", "name": "paper plane",
         "material": {"type": "two_sided", "front": "paper"},
         "vertices": glider, "faces": [[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 5, 4]],
         "to_world": placed(scale=0.75, rotate=turn(0, 1, 0, -50), translate=[1.16, 0.03, 1.0])},
    ]  # fmt: skip


def scene(name: str, lamp: Any, sky: float, wavelengths: str = "auto") -> Json:
    """The room under a lamp of an emission, and an even light of D65."""
    facing = {"origin": [-1.6, 4.2, 2.6], "target": [0, 0.5, -0.8], "up": [0, 1, 0]}
    view = {"origin": [0, 1.75, 5.9], "target": [0, 1.04, -0.6], "up": [0, 1, 0]}
    return {
        "$schema": "../schema.json",
        "name": name,
        "camera": {"type": "perspective", "fov": 38.5, "to_world": {"look_at": view}},
        "film": {"width": 480, "height": 320, "lambda_min": 300,
                 "wavelengths": wavelengths, "filter": {"type": "blackman_harris"}},
        "integrator": {"type": "path", "max_depth": 8},
        "spp": 1024,
        "materials": MATERIALS,
        "shapes": [*objects(), {
            "type": "rectangle", "name": "lamp", "material": "black",
            "to_world": [{"scale": [1.2, 0.8, 1]}, {"look_at": facing}],
            "emission": {"type": "area", "radiance": lamp},
        }],
        "lights": [{"type": "constant", "radiance": [sky, sky, sky]}] if sky else [],
    }  # fmt: skip


def text(made: dict) -> str:
    """The scene as JSON, a line for each material and shape."""
    parts = []
    for key, value in made.items():
        entries = json.dumps(value)
        if key == "materials":
            lines = (f"{json.dumps(name)}: {json.dumps(entry)}" for name, entry in value.items())
            entries = "{\n    " + ",\n    ".join(lines) + "\n  }"
        elif key == "shapes":
            entries = "[\n    " + ",\n    ".join(json.dumps(entry) for entry in value) + "\n  ]"
        parts.append(f"  {json.dumps(key)}: {entries}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def main() -> None:
    for name, mesh in (("knot", knot()), ("top", top())):
        mesh.export(HERE / f"{name}.ply", vertex_normal=True)
        print(f"{name}.ply: {len(mesh.faces):,} triangles")
    Image.fromarray(ink()).save(HERE / "ink.png", optimize=True)
    # A black-light lamp of 365 nm, whose glass lets a trace of violet through.
    black = [[340, 0], [352, 36], [360, 270], [366, 360], [374, 215], [386, 36], [398, 6],
             [412, 2], [425, 0]]  # fmt: skip
    for file, made in (
        ("scene", scene("fluorescent_paint", [9, 9, 9], 0.25)),
        ("scene_uv", scene("fluorescent_paint_uv", {"values": black}, 0.0, "scene")),
    ):
        (HERE / f"{file}.json").write_text(text(made), "utf-8")


if __name__ == "__main__":
    main()
