"""Lays a breakfast table at a window: the meshes (.ply), the cloth, the paper, the morning outside.

    python scenes/breakfast/generate.py

Lengths are in centimetres, the scene makes them metres; y is up. A liquid has no gap to its glass:
the wet wall is one surface between both, as in scenes/table_glasses.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image, ImageDraw
from scipy import ndimage

sys.path.append(str(Path(__file__).parents[1]))
from making import WINE_GLASS, Array, curve, filled, lathe, surface

from clpt import images

HERE = Path(__file__).parent
AROUND = 96
SUN = np.array([-0.62, 0.50, -0.62])  # where it stands, seen from the table
# Profiles of radius and height, counter-clockwise: up the outside, over the rim, down the inside.
JAR = [
    (0.0, 0.35), (2.0, 0.3), (2.9, 0.05), (3.3, 0.1), (3.6, 0.5), (3.75, 1.3), (3.8, 3.0),
    (3.8, 5.2), (3.7, 6.1), (3.2, 6.9), (2.95, 7.3), (2.95, 7.7), (3.12, 7.85), (3.12, 8.15),
    (2.95, 8.3), (2.95, 8.6), (2.85, 8.72), (2.72, 8.6), (2.7, 7.3), (3.0, 6.75), (3.42, 6.0),
    (3.5, 5.2), (3.5, 3.0), (3.42, 1.5), (3.2, 0.95), (2.4, 0.75), (0.0, 0.8),
]  # fmt: skip
CUP = [
    (0.0, 0.5), (1.2, 0.45), (1.9, 0.05), (2.15, 0.1), (2.2, 0.3), (1.7, 0.75), (0.8, 1.4),
    (0.65, 2.0), (0.95, 2.7), (1.75, 3.4), (2.2, 4.4), (2.36, 5.35), (2.3, 5.45), (2.2, 5.38),
    (2.02, 4.5), (1.6, 3.7), (0.8, 3.25), (0.0, 3.15),
]  # fmt: skip
PLATE = [
    (0.0, 0.35), (4.0, 0.3), (4.8, 0.02), (5.1, 0.05), (5.3, 0.4), (7.0, 0.85), (9.0, 1.5),
    (9.7, 1.75), (9.78, 1.88), (9.65, 1.95), (8.9, 1.75), (7.0, 1.1), (5.2, 0.72), (4.0, 0.65),
    (0.0, 0.62),
]  # fmt: skip
MARKER = [
    (0.0, 0.0), (0.55, 0.0), (0.62, 0.08), (0.62, 4.2), (0.70, 4.3), (0.70, 9.3), (0.62, 9.5),
    (0.55, 9.55), (0.45, 9.6), (0.42, 10.3), (0.3, 10.45), (0.22, 10.5), (0.2, 11.0), (0.0, 11.15),
]  # fmt: skip


def smooth_noise(shape: tuple[int, int], sigma: float, seed: int) -> Array:
    """Gaussian noise, blurred over `sigma` texels around the borders, of variance one."""
    noise = np.random.default_rng(seed).normal(size=shape)
    blurred = ndimage.gaussian_filter(noise, sigma, mode="wrap")
    return blurred / blurred.std()


def egg() -> trimesh.Trimesh:
    """A hen's egg, 5.7 high and 4.4 wide, its blunt end below."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 64)
    height = 2.85 * np.sin(t)
    radius = 2.2 * np.cos(t) * (1 - 0.13 * np.sin(t))
    return lathe(np.stack([radius, height], -1), AROUND)


def orange() -> trimesh.Trimesh:
    """An orange of radius 3.7 with a dent at its stalk; its pores are a bump map's."""
    t = np.linspace(-np.pi / 2, np.pi / 2, 96)
    dent = 1 - 0.09 * np.exp(-(((np.pi / 2 - t) / 0.22) ** 2))
    profile = np.stack([3.7 * np.cos(t), 3.5 * np.sin(t) * dent], -1)
    return lathe(profile, AROUND)


def cloth() -> trimesh.Trimesh:
    """Return an ironed table cloth, 180 by 120: two creases each way, slow waves of millimetres."""
    x, z = np.meshgrid(np.linspace(-90, 90, 181), np.linspace(-60, 60, 121))
    height = 0.10 * smooth_noise((121, 181), 6.0, 5)
    across, down = x + 0.06 * z, z - 0.05 * x
    for along, place in ((across, -31.0), (across, 33.0), (down, -17.0), (down, 17.5)):
        off = along - place
        height += 0.16 * np.exp(-np.abs(off) / 1.3) - 0.04 * np.exp(-((off / 4) ** 2))
    points = np.stack([x, height, z], -1)
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    mesh = surface(points, normals)
    uv = np.stack([(x + 90) / 180, (z + 60) / 120], -1).reshape(-1, 2)
    mesh.visual = trimesh.visual.TextureVisuals(uv=uv)
    return mesh


def linen() -> None:
    """Paint a square of linen, 3 cm wide (linen.png): threads that go over and under each other."""
    size, threads = 512, 40
    rng = np.random.default_rng(7)
    along = np.arange(size) * threads / size
    thread, inside = along.astype(int), along % 1
    round_thread = np.sqrt(np.clip(1 - (2 * inside - 1) ** 2, 0, 1))
    over = np.where((thread[:, None] + thread[None, :]) % 2 == 0, 1, -1)
    wave = 0.45 * np.sin(np.pi * inside)
    warp = round_thread[None, :] * (0.55 + over * wave[:, None])
    weft = round_thread[:, None] * (0.55 - over * wave[None, :])
    height = np.maximum(warp, weft)[..., None]
    of_warp, of_weft = (
        ndimage.gaussian_filter1d(rng.normal(0, 1, threads), 0.5, mode="wrap")[thread]
        for _ in range(2)
    )
    shade = np.where(warp > weft, of_warp[None, :], of_weft[:, None])
    shade = (shade + 0.5 * smooth_noise((size, size), 5, 3))[..., None]
    linear = np.array([0.84, 0.80, 0.73]) * (1 + 0.045 * shade) * (0.72 + 0.28 * height)
    stored = np.clip(linear, 0, 1) ** (1 / 2.2)
    Image.fromarray(np.uint8(255 * stored)).save(HERE / "linen.png", optimize=True)


def stroke() -> None:
    """Draw what the marker has written on the card: loops and a line (ink.png, white is ink)."""
    width, height = 1024, 680
    picture = Image.new("L", (width, height), 0)
    draw = ImageDraw.Draw(picture)
    t = np.linspace(0, 1, 240)
    turn = 2 * np.pi * 6 * t
    loops = (120 + 640 * t - 60 * np.sin(turn), 250 - 95 * np.cos(turn) * (1 - 0.55 * t), 15)
    line = (110 + 760 * t, 470 + 14 * np.sin(9 * t), 20)
    for xs, ys, radius in (loops, line):
        points = list(zip(xs, ys, strict=True))
        draw.line(points, fill=255, width=2 * radius, joint="curve")
        for x, y in points:
            draw.ellipse([x - radius, y - radius, x + radius, y + radius], fill=255)
    ink = ndimage.gaussian_filter(np.asarray(picture, float), 2.0)
    ink *= 1 - 0.12 * np.clip(smooth_noise((height, width), 6, 11), -1, 1)
    Image.fromarray(np.uint8(np.clip(ink, 0, 255))).save(HERE / "ink.png", optimize=True)


def morning() -> None:
    """Paint what lies around (morning.exr): a garden behind the window, the room before it."""
    height, width = 512, 1024
    polar, azimuth = np.meshgrid(
        (np.arange(height)) / (height - 1) * np.pi,
        2 * np.pi * (np.arange(width) + 0.5) / width,
        indexing="ij",
    )
    up = np.cos(polar)
    forward = np.sin(polar) * np.cos(azimuth)  # toward -z, where the window is
    haze = np.exp(-4.0 * np.maximum(up, 0))[..., None]
    sky = (1 - haze) * [0.55, 0.80, 1.25] + haze * [1.5, 1.45, 1.3]
    leaves = smooth_noise((height, width), 14, 1) + 0.7 * smooth_noise((height, width), 5, 2)
    crown = up + 0.02 * leaves - 0.10 - 0.07 * smooth_noise((height, width), 40, 8)
    tree = 1 / (1 + np.exp(60 * crown))[..., None]
    light = np.clip(0.5 + 0.4 * leaves, 0.05, 1.6)[..., None]
    garden = light * [0.16, 0.27, 0.07] + np.clip(leaves - 0.9, 0, 1)[..., None] * [0.55, 0.6, 0.22]
    outside = (1 - tree) * sky + tree * garden
    room = 0.16 + 0.10 * np.clip(up, 0, 1)[..., None] * np.ones(3) * [1.0, 0.93, 0.82]
    share = 1 / (1 + np.exp(-12 * (forward - 0.05)))[..., None]
    light = share * outside + (1 - share) * room * [1.0, 0.95, 0.88]
    d = np.stack([np.sin(polar) * np.sin(azimuth), up, -forward], -1)
    from_sun = np.arccos(np.clip(d @ (SUN / np.linalg.norm(SUN)), -1, 1))
    texel = np.pi / (height - 1)
    cover = np.clip((np.radians(0.4) - from_sun) / texel + 0.5, 0, 1)
    solid_angle = (cover * np.sin(polar)).sum() * texel * 2 * np.pi / width
    light = light + cover[..., None] * np.array([9.5, 8.2, 6.6]) / solid_angle
    images.write(HERE / "morning.exr", light.astype(np.float32))


def main() -> None:
    meshes = {"egg": egg(), "orange": orange(), "cloth": cloth()}
    for name, profile in (("cup", CUP), ("plate", PLATE), ("marker", MARKER)):
        meshes[name] = lathe(curve(profile, 4), AROUND)
    for name, profile, level in (("glass", WINE_GLASS, 15.2), ("jar", JAR, 6.3)):
        air, wet, top = filled(curve(profile, 5), level, AROUND)
        meshes |= {f"{name}_air": air, f"{name}_wet": wet, f"{name}_top": top}
    for name, mesh in meshes.items():
        mesh.export(HERE / f"{name}.ply", vertex_normal=True)
        print(f"{name}.ply: {len(mesh.faces):,} triangles")
    linen()
    stroke()
    morning()


if __name__ == "__main__":
    main()
