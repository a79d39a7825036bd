"""What the scripts of several scenes share: bodies on a lathe, rods, a sky with a sun, scene.json.

A script puts this folder on its path. y is up; meshes have normals, and their front outside.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

from clpt import images

Array = NDArray[np.float64]
JSON = dict[str, Any]
# Radius and height [cm]: from the middle of the foot up the outside, over the rim, down inside.
WINE_GLASS = [
    (0.0, 0.12), (1.6, 0.10), (2.9, 0.02), (3.5, 0.06), (3.55, 0.18), (3.2, 0.34), (2.0, 0.62),
    (0.9, 1.1), (0.46, 2.2), (0.38, 4.6), (0.42, 7.0), (0.62, 8.0), (1.5, 8.75), (2.9, 9.9),
    (3.75, 11.6), (3.95, 13.4), (3.65, 15.6), (3.1, 17.9), (3.0, 18.35), (2.97, 18.48),
    (2.91, 18.53), (2.85, 18.48), (2.87, 18.35), (2.97, 17.9), (3.5, 15.6), (3.79, 13.4),
    (3.58, 11.7), (2.74, 10.15), (1.4, 9.1), (0.55, 8.78), (0.0, 8.72),
]  # fmt: skip


def curve(points: ArrayLike, steps: int, closed: bool = False) -> Array:
    """Points (n, 2) on a Catmull-Rom curve through `points`, `steps` from each to the next.

    One that is not closed begins and ends on a lathe's axis, or as if it went on beyond it.
    """
    p = np.array(points)
    before, after = (p[-2], p[1]) if closed else (p[0] * [-1, 1], p[-1] * [-1, 1])
    p = np.vstack([before, p, after])
    t = np.linspace(0, 1, steps, endpoint=False)[:, None]
    a, b, c, d = (p[i : len(p) - 3 + i, None] for i in range(4))
    inner = 0.5 * (
        2 * b + (c - a) * t + (2 * a - 5 * b + 4 * c - d) * t**2 + (3 * b - a - 3 * c + d) * t**3
    )
    return np.vstack([inner.reshape(-1, 2), p[-2]])


def surface(points: Array, normals: Array) -> trimesh.Trimesh:
    """Triangles over a grid of points (n, m, 3); those without an area are left out.

    Seen from the front, columns go to the right where rows go downward.
    """
    n, m = points.shape[:2]
    index = np.arange(n * m).reshape(n, m)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
    flat = points.reshape(-1, 3)
    corners = flat[faces]
    double = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    kept = faces[double > 1e-9 * np.ptp(flat, axis=0).max() ** 2]
    return trimesh.Trimesh(flat, kept, vertex_normals=normals.reshape(-1, 3), process=False)


def lathe(profile: Array, around: int, flutes: int = 0, depth: ArrayLike = 0) -> trimesh.Trimesh:
    """The surface that a profile (n, 2) of radius and height sweeps around y; its right is outside.

    With `flutes` a radius is 1 + depth cos(flutes azimuth) times that of the profile; `depth` is
    one number, or one for each point of the profile.
    """
    turn = np.linspace(0, 2 * np.pi, around + 1)
    deep = np.broadcast_to(np.asarray(depth, float), len(profile))[:, None]
    wave = 1 + deep * np.cos(flutes * turn)
    radius = np.maximum(profile[:, 0], 0)[:, None] * wave
    height = np.broadcast_to(profile[:, 1][:, None], radius.shape)
    steps = np.linalg.norm(np.diff(profile, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    # The cross product of the two tangents: outward, along the azimuth, and up.
    out = np.gradient(height, way, axis=0)
    along = flutes * deep * np.sin(flutes * turn) / wave * out
    up = -np.gradient(radius, way, axis=0)
    x, z = np.cos(turn), np.sin(turn)
    normals = np.stack([out * x - along * z, up, out * z + along * x], -1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return surface(np.stack([radius * x, height, radius * z], -1), normals)


def filled(
    profile: Array, level: float, around: int
) -> tuple[trimesh.Trimesh, trimesh.Trimesh, trimesh.Trimesh]:
    """A glass filled up to a height: its surface to air, the wet wall, and the liquid's top."""
    rim = int(np.argmax(profile[:, 1]))
    under = rim + int(np.argmax(profile[rim:, 1] < level))
    (r0, y0), (r1, y1) = profile[under - 1 : under + 1]
    edge = [r0 + (r1 - r0) * (level - y0) / (y1 - y0), level]
    wet = np.vstack([edge, profile[under:]])[::-1]
    dry = np.vstack([profile[:under], edge])
    top = np.linspace(edge, [0, level], 3)
    return lathe(dry, around), lathe(wet, around), lathe(top, around)


def rod(line: ArrayLike, radius: float, around: int = 12) -> trimesh.Trimesh:
    """A round rod with flat ends around a line (n, 3) that turns back nowhere."""
    line = np.asarray(line, float)
    ahead = np.gradient(line, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    side = np.eye(3)[np.argmin(np.abs(ahead[0]))]
    sides = []
    for direction in ahead:  # carried along, so that the rod has no twist
        side = side - direction * (side @ direction)
        side /= np.linalg.norm(side)
        sides.append(side)
    turn = np.linspace(0, 2 * np.pi, around + 1)[:, None]
    x, y = np.array(sides)[:, None], np.cross(ahead, sides)[:, None]
    outward = np.cos(turn) * x - np.sin(turn) * y
    rings = line[:, None] + radius * outward

    def end(i: int) -> tuple[Array, Array]:
        return np.broadcast_to(line[i], rings[i].shape), np.broadcast_to(ahead[i], rings[i].shape)

    (first, back), (last, front) = end(0), end(-1)
    points = [first, rings[0], *rings, rings[-1], last]
    return surface(np.array(points), np.array([-back, -back, *outward, front, front]))


def daylight(
    path: Path,
    sun: ArrayLike,
    irradiance: ArrayLike,
    *,
    zenith: ArrayLike,
    horizon: ArrayLike,
    ground: ArrayLike,
    half_angle: float = 0.5,
) -> None:
    """Write an image in latitude and longitude: an even sky over a ground, and a sun.

    The sun is seen toward `sun`, under `half_angle` [degrees], twice the true sun's so that it
    covers a few texels. `irradiance` is what it gives to a surface that faces it, the other
    colours are radiances; all are linear Rec. 709.
    """
    height, width = 512, 1024
    polar, azimuth = np.meshgrid(
        np.linspace(0, np.pi, height), 2 * np.pi * (np.arange(width) + 0.5) / width, indexing="ij"
    )
    up, across = np.cos(polar), np.sin(polar)
    d = np.stack([across * np.sin(azimuth), up, -across * np.cos(azimuth)], -1)
    haze = np.exp(-5 * np.maximum(up, 0))[..., None]
    sky = np.asarray(zenith) * (1 - haze) + np.asarray(horizon) * haze
    light = np.where(up[..., None] > 0, sky, np.asarray(ground))
    from_sun = np.arccos(np.clip(d @ (np.asarray(sun, float) / np.linalg.norm(sun)), -1, 1))
    texel = np.pi / (height - 1)
    cover = np.clip((np.radians(half_angle) - from_sun) / texel + 0.5, 0, 1)
    solid_angle = (cover * across).sum() * texel * 2 * np.pi / width
    light += cover[..., None] * np.asarray(irradiance) / solid_angle
    images.write(path, light.astype(np.float32))


def write_scene(path: Path, scene: JSON) -> None:
    """Write a scene file; what fits in a line of 100 characters stands in one."""
    path.write_text(_text(scene, 0) + "\n", encoding="utf-8")


def _text(value: Any, indent: int) -> str:
    """A value as JSON, on a line that begins with `indent` spaces."""
    line = json.dumps(value)
    if indent + len(line) <= 100 or not isinstance(value, dict | list):
        return line
    pad = "\n" + " " * (indent + 2)
    if isinstance(value, dict):
        parts = [f"{json.dumps(key)}: {_text(part, indent + 2)}" for key, part in value.items()]
        return f"{{{pad}{f',{pad}'.join(parts)}{pad[:-2]}}}"
    return f"[{pad}{f',{pad}'.join(_text(part, indent + 2) for part in value)}{pad[:-2]}]"
