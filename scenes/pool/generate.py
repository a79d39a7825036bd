"""Fills a swimming pool: water.ply, rail.ply, three textures, sky.exr and the two scenes.

    python scenes/pool/generate.py

The water is a closed body. Its top is a sum of plane waves; its other sides lie inside of the
walls, so that it has no face in common with them. It absorbs what pure water does (Pope and Fry
1997), which makes it blue. A wave of height a and wave number k bends light as a lens of focal
length n / ((n - 1) a k^2) within the water; the waves are so high that this is about the depth.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

sys.path.append(str(Path(__file__).parents[1]))
from making import JSON, Array, curve, daylight, rod, surface, write_scene

HERE = Path(__file__).parent
HALF = np.array([3.0, 1.8])  # of the basin in x and z [m]
DEPTH, LEVEL = -1.5, -0.17  # of its floor, of the water
CELL = 0.05  # of the water's top
BEYOND = 0.05  # how far the water goes into the walls
SUN = np.array([-0.8, 1.0, 0.3])
PURE_WATER = [  # absorption [nm, 1/m]
    [380, 0.0114], [400, 0.0066], [420, 0.0045], [440, 0.0064], [460, 0.0098], [480, 0.0127],
    [500, 0.0204], [520, 0.0409], [540, 0.0474], [560, 0.0619], [580, 0.0896], [600, 0.2224],
    [620, 0.2755], [640, 0.3108], [660, 0.410], [680, 0.465], [700, 0.624], [720, 1.231],
]  # fmt: skip


def waves(x: Array, z: Array) -> tuple[Array, Array]:
    """Heights and upward normals of the rippled water at points of the plane."""
    rng = np.random.default_rng(5)
    count = 28
    k = 2 * np.pi / np.geomspace(0.4, 1.1, count)
    azimuth = rng.normal(0.6, 1.1, count)
    phase = rng.uniform(0, 2 * np.pi, count)
    lens = 0.75 / (0.25 * (LEVEL - DEPTH))  # root mean square of the curvature [1/m]
    a = lens * np.sqrt(2 / count) / k**2
    kx, kz = k * np.cos(azimuth), k * np.sin(azimuth)
    angle = kx * x[..., None] + kz * z[..., None] + phase
    slope = -np.sin(angle) * a
    normals = np.stack([-(slope @ kx), np.ones_like(x), -(slope @ kz)], -1)
    return np.cos(angle) @ a, normals / np.linalg.norm(normals, axis=-1, keepdims=True)


def water() -> trimesh.Trimesh:
    """The body of water: its top, four sides and bottom."""
    half = HALF + BEYOND
    x, z = (np.linspace(-h, h, round(2 * h / CELL) + 1) for h in half)
    x, z = np.meshgrid(x, z, indexing="ij")
    height, normals = waves(x, z)
    top = np.stack([x, LEVEL + height, z], -1)
    parts = [surface(top[:, ::-1], normals[:, ::-1])]
    low = DEPTH - BEYOND
    for edge, out in (
        (top[::-1, 0], [0, 0, -1]), (top[:, -1], [0, 0, 1]), (top[0], [-1, 0, 0]),
        (top[-1, ::-1], [1, 0, 0]),
    ):  # fmt: skip
        side = np.stack([edge, np.where([False, True, False], low, edge)])
        parts.append(surface(side, np.broadcast_to(np.array(out, float), side.shape)))
    rim = np.concatenate([top[:-1, 0], top[-1, :-1], top[:0:-1, -1], top[0, :0:-1]])
    rim = np.concatenate([rim, rim[:1]])
    rim[:, 1] = low
    bottom = np.stack([np.broadcast_to([0, low, 0], rim.shape), rim])
    parts.append(surface(bottom, np.broadcast_to(np.array([0.0, -1, 0]), bottom.shape)))
    return trimesh.util.concatenate(parts)


def basin(name: str, material: str, high: float, low: float) -> JSON:
    """The walls of the basin between two heights, seen from within; uv in metres."""
    x, z = HALF
    corners = np.array([[-x, z], [-x, -z], [x, -z], [x, z], [-x, z]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    vertices, faces, uvs = [], [], []
    for i in range(4):
        first = len(vertices)
        for j, y in ((i, low), (i + 1, low), (i + 1, high), (i, high)):
            vertices.append([corners[j, 0], y, corners[j, 1]])
            uvs.append([along[j], y - DEPTH])
        faces += [[first, first + 1, first + 2], [first, first + 2, first + 3]]
    return mesh(name, material, vertices, faces, uvs)


def frame(name: str, material: str, profile: list[tuple[float, float]]) -> JSON:
    """What a profile of (distance from the basin, height) sweeps around it; uv are x and z."""
    turns = np.array([[-1, 1], [1, 1], [1, -1], [-1, -1], [-1, 1]])
    points = np.array([
        [[*(turn * (HALF + out)), y] for turn in turns] for out, y in profile
    ])[..., [0, 2, 1]]  # fmt: skip
    made = surface(points, np.zeros_like(points))
    return mesh(name, material, made.vertices, made.faces, made.vertices[:, [0, 2]])


def mesh(name: str, material: str, vertices: object, faces: object, uvs: object) -> JSON:
    """A mesh of flat triangles within the scene file."""
    return {
        "type": "mesh", "name": name, "material": material,
        "vertices": np.round(vertices, 4).tolist(), "faces": np.array(faces).tolist(),
        "uvs": np.round(uvs, 4).tolist(),
    }  # fmt: skip


def rail() -> trimesh.Trimesh:
    """The two handrails of a ladder and its three rungs, at x = 0; the wall is at z = 0."""
    line = curve([(0.42, -0.02), (0.42, 0.45), (0.34, 0.66), (0.16, 0.74), (-0.02, 0.66),
                  (-0.1, 0.45), (-0.1, -0.3), (-0.1, -1.05)], 6)  # fmt: skip
    rods = [
        rod(np.stack([np.full(len(line), x), line[:, 1], -line[:, 0]], -1), 0.02, 16)
        for x in (-0.24, 0.24)
    ]
    rods += [rod([[-0.24, y, 0.1], [0.24, y, 0.1]], 0.025, 16) for y in (-0.3, -0.62, -0.94)]
    return trimesh.util.concatenate(rods)


def tiles(name: str, count: int, colour: list[float], spread: float, joint: float) -> None:
    """Paint a square of `count` by `count` tiles, each of its own shade, with joints between."""
    size = 32 if count > 4 else 128
    rng = np.random.default_rng(count)
    shade = 1 + spread * rng.uniform(-1, 1, (count, count, 1))
    tint = 1 + 0.4 * spread * rng.uniform(-1, 1, (count, count, 3))
    picture = np.kron(shade * tint * colour, np.ones((size, size, 1)))
    edge = np.minimum(np.arange(size), np.arange(size)[::-1]) < joint * size
    edge = np.tile(edge, count)
    picture[edge[:, None] | edge] = [0.62, 0.63, 0.6]
    Image.fromarray(np.uint8(255 * np.clip(picture, 0, 1) ** (1 / 2.2))).save(
        HERE / f"{name}.png", optimize=True
    )


def look(origin: list[float], target: list[float], fov: float) -> JSON:
    """A camera."""
    to_world = {"look_at": {"origin": origin, "target": target, "up": [0, 1, 0]}}
    return {"type": "perspective", "fov": fov, "to_world": to_world}


def scene(name: str, camera: JSON, integrator: JSON, spp: int) -> JSON:
    corners = HALF * [[-1, 1], [1, 1], [1, -1], [-1, -1]]

    def tiled(image: str, period: float) -> JSON:
        scale = [{"scale": [round(1 / period, 6), round(1 / period, 6), 1]}]
        return {"type": "diffuse", "reflectance": {
            "type": "bitmap", "image": f"{image}.png", "to_uv": scale}}  # fmt: skip

    return {
        "$schema": "../schema.json",
        "name": name,
        "camera": camera,
        "film": {"width": 480, "height": 360, "filter": {"type": "blackman_harris"}},
        "integrator": {**integrator, "max_depth": 12},
        "spp": spp,
        "materials": {
            "water": {"type": "dielectric", "int_ior": 1.333, "absorption": {"values": PURE_WATER}},
            "tiles": tiled("tiles", 1.2),
            "band": tiled("band", 0.6),
            "stones": tiled("stones", 2.4),
            "coping": {"type": "diffuse", "reflectance": [0.72, 0.68, 0.6]},
            "chrome": {"type": "conductor", "metal": "Cr"},
            "ball": {
                "type": "plastic",
                "diffuse_reflectance": {"type": "bitmap", "image": "ball.png", "filter": "nearest"},
            },
        },
        "shapes": [
            {"type": "mesh", "name": "water", "file": "water.ply", "material": "water"},
            mesh(
                "floor", "tiles",
                np.insert(corners, 1, DEPTH, axis=1), [[0, 1, 2], [0, 2, 3]], corners * [1, -1],
            ),
            basin("walls", "tiles", -0.3, DEPTH),
            basin("band", "band", -0.02, -0.3),
            frame("coping", "coping", [
                (0.3, -0.05), (-0.03, -0.05), (-0.04, -0.04), (-0.04, 0.02), (-0.03, 0.03),
                (0.3, 0.03), (0.31, 0.02), (0.31, -0.04), (0.3, -0.05),
            ]),
            frame("stones", "stones", [(0.29, 0), (1.7, 0), (1.7, -0.1)]),
            {
                "type": "mesh", "name": "ladder", "file": "rail.ply", "material": "chrome",
                "to_world": [{"translate": [-1.6, 0, -1.8]}],
            },
            {
                "type": "sphere", "name": "ball", "material": "ball", "radius": 0.2,
                "to_world": [
                    {"rotate": {"axis": [1, 0, 0.3], "angle": -55}},
                    {"translate": [0.55, -0.05, -0.35]},
                ],
            },
        ],
        "lights": [{"type": "envmap", "image": "sky.exr"}],
    }  # fmt: skip


def main() -> None:
    for name, made in (("water", water()), ("rail", rail())):
        made.export(HERE / f"{name}.ply", vertex_normal=True)
        print(f"{name}.ply: {len(made.faces):,} triangles")
    tiles("tiles", 8, [0.76, 0.84, 0.84], 0.08, 0.04)
    tiles("band", 6, [0.1, 0.3, 0.5], 0.35, 0.05)
    tiles("stones", 4, [0.66, 0.59, 0.5], 0.1, 0.012)
    stripes = [[0.8, 0.05, 0.04], [0.85, 0.85, 0.82], [0.85, 0.6, 0.03], [0.85, 0.85, 0.82],
               [0.02, 0.15, 0.55], [0.85, 0.85, 0.82]]  # fmt: skip
    Image.fromarray(np.uint8(255 * np.array([stripes]) ** (1 / 2.2))).save(HERE / "ball.png")
    daylight(
        HERE / "sky.exr", SUN, [2.6, 2.45, 2.15],
        zenith=[0.1, 0.2, 0.42], horizon=[0.5, 0.6, 0.7], ground=[0.1, 0.16, 0.05],
    )  # fmt: skip
    above = look([2.6, 2.6, 4], [-0.4, -0.62, -0.1], 48)
    under = look([2.3, -0.5, 1.3], [-0.6, -1.42, -0.3], 80)
    write_scene(HERE / "scene.json", scene("pool", above, {"type": "vcm"}, 256))
    both = {"type": "path", "light_paths": 2}
    write_scene(HERE / "scene_under.json", scene("pool_under", under, both, 1024))


if __name__ == "__main__":
    main()
