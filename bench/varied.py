"""Scenes of other shapes, as Mitsuba XML that both renderers read: see `bench.peer_scenes`.

materials: 400 shapes, each with a material of its own, of seven kinds. textures: colour and
roughness from bitmaps of a megapixel. instances: 300 of a mesh of 69,600 triangles. outdoors: an
environment map with a small sun over 400 thousand triangles. lamps: 400 lamps in a hall. More
materials or instances would be no trouble to clpt; Mitsuba's LLVM variants compile code for each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from bench.meshes import ball, write_ply
from bench.peer_scenes import box, diffuse, grid, joined, knot, light, quad, write_scene
from clpt import images

METAL = '<string name="material" value="Al"/>'  # of others the two have different measurements
SUN = 0.03  # its radius [rad]


def rgb(name: str, value: Sequence[float]) -> str:
    """A colour parameter."""
    return f'<rgb name="{name}" value="{", ".join(f"{v:.4f}" for v in value)}"/>'


def real(name: str, value: float) -> str:
    """A parameter that is a number."""
    return f'<float name="{name}" value="{value:.5g}"/>'


def two_sided(kind: str, *inside: str) -> str:
    """A material that is the same on both sides."""
    return f'<bsdf type="twosided"><bsdf type="{kind}">{"".join(inside)}</bsdf></bsdf>'


def bitmap(name: str, file: str, raw: bool = False) -> str:
    """A parameter that a picture holds, as colours or as plain numbers."""
    flag = '<boolean name="raw" value="true"/>' if raw else ""
    text = f'<string name="filename" value="{file}"/>{flag}'
    return f'<texture name="{name}" type="bitmap">{text}</texture>'


def sky(radiance: float) -> str:
    """An even sky."""
    return f'<emitter type="constant">{rgb("radiance", [radiance] * 3)}</emitter>\n'


def some_material(number: int, rng: np.random.Generator) -> str:
    """Return a unique material of seven kinds in turn."""
    colour, alpha = rgb("diffuse_reflectance", rng.uniform(0.1, 0.9, 3)), rng.uniform(0.05, 0.5)
    ior = real("int_ior", rng.uniform(1.3, 1.8))
    tint = rgb("specular_reflectance", rng.uniform(0.7, 1, 3))
    passed = rgb("specular_transmittance", rng.uniform(0.7, 1, 3))
    kinds: tuple[Callable[[], str], ...] = (
        lambda: diffuse(tuple(rng.uniform(0.1, 0.9, 3).round(4).tolist())),
        lambda: two_sided("roughplastic", colour, ior, real("alpha", alpha)),
        lambda: two_sided("roughconductor", METAL, tint, real("alpha", alpha)),
        lambda: two_sided("plastic", colour, ior),
        lambda: two_sided("conductor", METAL, tint),
        lambda: f'<bsdf type="dielectric">{ior}{passed}</bsdf>',
        lambda: f'<bsdf type="roughdielectric">{ior}{passed}{real("alpha", alpha)}</bsdf>',
    )
    return kinds[number % len(kinds)]()


def write_materials(folder: Path, side: int = 20) -> Path:
    """side^2 cubes and balls, each of its own material, under a lamp and an even sky."""
    rng = np.random.default_rng(5)
    round_ = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
    write_ply(folder / "materials_ball.ply", round_.vertices, round_.faces)
    text = []
    for number, (i, j) in enumerate(np.ndindex(side, side)):
        x, z = np.array([i - side / 2, j - side / 2]) + rng.uniform(0.35, 0.65, 2)
        size, turn = rng.uniform(0.2, 0.38), rng.uniform(0, 360)
        turned = f'<rotate y="1" angle="{turn:.3f}"/>'
        up = size + 0.02  # glass that lies on the ground would share a plane with it
        place = f'<scale value="{size:.4f}"/><translate x="{x:.4f}" y="{up:.4f}" z="{z:.4f}"/>'
        inside = f'<transform name="to_world">{turned}{place}</transform>'
        kind = ("cube", "sphere", "ply")[int(rng.integers(3))]
        file = '<string name="filename" value="materials_ball.ply"/>' if kind == "ply" else ""
        text.append(f'<shape type="{kind}">{file}{inside}{some_material(number, rng)}</shape>\n')
    half = side / 2 + 1
    ground = quad((-half, 0, half), (half, 0, half), (half, 0, -half), (-half, 0, -half))
    lamp = quad((-3, 9, -3), (3, 9, -3), (3, 9, 3), (-3, 9, 3))
    parts = {"ground": (ground, diffuse((0.5, 0.5, 0.5))), "lamp": (lamp, light(4))}
    view = {"depth": 8, "fov": 40, "origin": "0, 6, 13", "target": "0, 0, 4"}
    return write_scene(folder, "materials", parts, view, sky(0.6) + "".join(text))


def marbled(size: int, seed: int) -> NDArray[np.uint8]:
    """A picture (size, size, 3) of waves of four scales, as a file stores it."""
    rng = np.random.default_rng(seed)
    waves = np.zeros((size, size, 3), np.float32)
    x = np.linspace(0, 2 * np.pi, size, endpoint=False, dtype=np.float32)
    for scale in (2, 7, 31, 150):
        for channel in range(3):
            (a, b), (phase, warp) = rng.integers(1, 1 + scale, 2), rng.uniform(0, 6, 2)
            bend = (3 * np.sin(b * x + warp) + phase).astype(np.float32)
            waves[..., channel] += np.sin(a * x[:, None] + bend) / np.float32(np.sqrt(scale))
    waves = (waves - waves.min((0, 1))) / np.ptp(waves, axis=(0, 1))
    return (20 + 220 * waves).astype(np.uint8)


def write_textures(folder: Path, size: int = 1024) -> Path:
    """A room whose floor and walls, and the balls in it, have textures of size^2 and (2 size)^2."""
    for name, pixels, seed in (("floor", 2 * size, 1), ("wall", size, 2), ("back", size, 3)):
        images.write_stored(folder / f"textures_{name}.png", marbled(pixels, seed))
    for n in range(6):
        images.write_stored(folder / f"textures_{n}.png", marbled(size, 10 + n))
    walls = {
        "floor": ("1 0 0", 90, "0 0 0", two_sided("diffuse", _colour("floor"))),
        "back": ("1 0 0", 0, "0 3 -4", two_sided("diffuse", _colour("back"))),
        "left": ("0 1 0", 90, "-4 3 0", two_sided("diffuse", _colour("wall"))),
        "right": ("0 1 0", -90, "4 3 0", two_sided("diffuse", _colour("wall"))),
    }
    text = []
    for axis, angle, at, inside in walls.values():
        turn = f'<scale value="4"/><rotate value="{axis}" angle="{-angle}"/>'
        move = f'{turn}<translate value="{at}"/>'
        text.append(f'<shape type="rectangle">{_moved(move)}{inside}</shape>\n')
    surfaces = (
        two_sided("roughplastic", bitmap("diffuse_reflectance", "textures_0.png")),
        two_sided("diffuse", _colour("1")),
        two_sided("roughconductor", bitmap("alpha", "textures_2.png", True), METAL),
        two_sided("plastic", bitmap("diffuse_reflectance", "textures_3.png")),
        two_sided("roughconductor", bitmap("specular_reflectance", "textures_4.png"), METAL),
        two_sided("diffuse", _colour("5")),
    )
    write_ply(folder / "textures_ball.ply", *ball(160))
    file = '<string name="filename" value="textures_ball.ply"/>'
    for n, surface in enumerate(surfaces):
        x, z = 2.3 * (n % 3 - 1), 1.3 - 2.4 * (n // 3)
        move = f'<rotate y="1" angle="{50 * n}"/><translate x="{x}" y="{0.9 + n // 3}" z="{z}"/>'
        text.append(f'<shape type="ply">{file}{_moved(move)}{surface}</shape>\n')
    lamp = quad((-1, 6, -1), (1, 6, -1), (1, 6, 1), (-1, 6, 1))
    view = {"depth": 8, "fov": 50, "origin": "0, 3, 9", "target": "0, 2, 0"}
    parts = {"lamp": (lamp, light(25))}
    return write_scene(folder, "textures", parts, view, sky(0.1) + "".join(text))


def write_instances(folder: Path, count: int = 300) -> Path:
    """Knots of 69,600 triangles strewn over a ground, under an even sky."""
    rng = np.random.default_rng(8)
    write_ply(folder / "instances_knot.ply", *knot())
    inside = (
        '<string name="filename" value="instances_knot.ply"/>'
        '<boolean name="face_normals" value="true"/>'
    )
    group = f'<shape type="ply">{inside}{diffuse((0.7, 0.5, 0.3))}</shape>'
    text = [f'<shape type="shapegroup" id="knot">{group}</shape>\n']
    for x, z in rng.uniform(-25, 25, (count, 2)):
        turn, size = rng.uniform(0, 360), rng.uniform(0.4, 1.1)
        move = (
            f'<rotate y="1" angle="{turn:.3f}"/><scale value="{size:.4f}"/>'
            f'<translate x="{x:.4f}" z="{z:.4f}"/>'
        )
        text.append(f'<shape type="instance"><ref id="knot"/>{_moved(move)}</shape>\n')
    ground = quad((-27, 0, 27), (27, 0, 27), (27, 0, -27), (-27, 0, -27))
    view = {"depth": 8, "fov": 45, "origin": "0, 9, 22", "target": "0, 0, 4"}
    parts = {"ground": (ground, diffuse((0.4, 0.45, 0.4)))}
    return write_scene(folder, "instances", parts, view, sky(1.0) + "".join(text))


def heavens(width: int = 1024) -> NDArray[np.float32]:
    """An environment map (width / 2, width, 3): blue above, brown below, and a small sun."""
    v, u = np.mgrid[0.5 : width // 2, 0.5:width] / width
    up, around = np.cos(2 * np.pi * v), 2 * np.pi * u
    across = np.sin(2 * np.pi * v)
    d = np.stack([across * np.sin(around), up, across * np.cos(around)], -1)
    to_sun = np.array([0.5, 0.6, 0.62]) / np.linalg.norm([0.5, 0.6, 0.62])
    blue = np.clip(up, 0, 1)[..., None] * np.array([-0.3, -0.1, 0.4]) + np.array([0.5, 0.6, 0.7])
    sky_ = np.where(up[..., None] > 0, blue, np.array([0.2, 0.17, 0.13]))
    sun = (d @ to_sun > np.cos(SUN))[..., None] * np.array([900.0, 800.0, 650.0])
    return (sky_ + sun).astype(np.float32)


def write_outdoors(folder: Path, side: int = 420) -> Path:
    """A hilly ground of 2 side^2 triangles with boulders, under a sky with a sun."""
    images.write(folder / "outdoors.exr", heavens())
    x, z = np.meshgrid(np.linspace(-12, 12, side), np.linspace(12, -12, side), indexing="ij")
    rng = np.random.default_rng(2)
    height = sum(
        np.sin(a * x + p) * np.cos(b * z + q) / (1.5 * np.hypot(a, b))
        for a, b, p, q in zip(
            *rng.uniform(0.3, 6, (2, 30)), *rng.uniform(0, 6, (2, 30)), strict=True
        )
    )
    ground = grid(np.stack([x, 0.5 * height, z], -1))
    stone = trimesh.creation.icosphere(subdivisions=4)
    stones = []
    for at in rng.uniform(-8, 8, (20, 2)):
        bumps = 1 + 0.1 * np.sin(stone.vertices @ rng.normal(0, 5, (3, 3))).sum(1, keepdims=True)
        size = rng.uniform(0.3, 0.9)
        stones.append((stone.vertices * bumps * size + [at[0], 0.6, at[1]], stone.faces))
    parts = {
        "ground": (ground, diffuse((0.35, 0.4, 0.2))),
        "stones": (joined(stones[:12]), diffuse((0.5, 0.48, 0.45))),
        "metal": (
            joined(stones[12:]),
            two_sided("roughconductor", METAL, real("alpha", 0.2)),
        ),
    }
    envmap = '<emitter type="envmap"><string name="filename" value="outdoors.exr"/></emitter>\n'
    view = {"depth": 8, "fov": 50, "origin": "0, 3.5, 11", "target": "0, 0.3, 0"}
    return write_scene(folder, "outdoors", parts, view, envmap)


def write_lamps(folder: Path, side: int = 20) -> Path:
    """A hall of pillars with side^2 small lamps of different colours under its ceiling."""
    rng = np.random.default_rng(4)
    text = []
    for i, j in np.ndindex(side, side):
        x, z = np.array([i + 0.5, j + 0.5]) / side * 16 - 8
        move = (
            f'<scale value="0.08"/><rotate x="1" angle="90"/><translate x="{x}" y="3.9" z="{z}"/>'
        )
        shine = f'<emitter type="area">{rgb("radiance", rng.uniform(0, 12, 3))}</emitter>'
        text.append(f'<shape type="rectangle">{_moved(move)}{diffuse((0, 0, 0))}{shine}</shape>\n')
    pillars = [
        box((-0.25, 0, -0.25), (0.25, 4, 0.25), float(rng.uniform(0, 3)), (x, 0, z))
        for x in (-6, -3, 0, 3, 6)
        for z in (-6, -3, 0, 3)
    ]
    hall = box((-8, 0, -8), (8, 4, 8))
    parts = {
        "hall": (hall, diffuse((0.6, 0.6, 0.6))),
        "pillars": (joined(pillars), two_sided("roughplastic", real("alpha", 0.2))),
    }
    view = {"depth": 8, "fov": 60, "origin": "1.5, 1.7, 7.5", "target": "0, 1.5, 0"}
    return write_scene(folder, "lamps", parts, view, "".join(text))


def _colour(which: str) -> str:
    return bitmap("reflectance", f"textures_{which}.png")


def _moved(steps: str) -> str:
    return f'<transform name="to_world">{steps}</transform>'


SCENES: dict[str, Callable[..., Path]] = {
    "materials": write_materials,
    "textures": write_textures,
    "instances": write_instances,
    "outdoors": write_outdoors,
    "lamps": write_lamps,
}
