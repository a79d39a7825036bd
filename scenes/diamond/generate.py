"""Cuts three stones and grinds the amber: diamond.ply, ruby.ply, sapphire.ply, amber.ply.

    python scenes/diamond/generate.py

A cut stone is what a set of planes leaves: each facet is one plane n.p = d, its outline follows
from the others. The round brilliant has its 57 facets by the proportions of Tolkowsky (Diamond
Design, 1919), in today's usual terms: table 53 %, crown 34.5 degrees, pavilion 40.75 degrees, stars
50 %, lower halves 77 %. A girdle's radius is 1; every stone lies on a facet of its pavilion.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import HalfspaceIntersection

from clpt import transforms as tf

Array = NDArray[np.float64]

TABLE, CROWN, PAVILION, STAR, LOWER = 0.53, 34.5, 40.75, 0.50, 0.77
GIRDLE = 0.02  # half its height
STEP = np.pi / 4  # from one main facet to the next
UP = np.array([0.0, 1.0, 0.0])


def around(angle: float, radius: float, height: float) -> Array:
    """A point (3,) at an azimuth, a distance from the axis y and a height."""
    return np.array([radius * np.sin(angle), height, radius * np.cos(angle)])


def through(a: Array, b: Array, c: Array) -> Array:
    """The plane (4,) n.p - d <= 0 through three points, the stone's middle being inside."""
    n = np.cross(b - a, c - a)
    n /= np.linalg.norm(n)
    n = n if n @ a > 0.0 else -n
    return np.append(n, -n @ a)


def brilliant() -> Array:
    """The planes (n, 4) of a round brilliant: 57 facets, and a girdle of 96 sides."""
    slope, dip = np.tan(np.radians(CROWN)), np.tan(np.radians(PAVILION))
    top = GIRDLE + (1.0 - TABLE) * slope
    edge = TABLE * np.cos(STEP / 2)  # of the table, from the axis
    tip = edge + STAR * (1.0 - edge)
    tip_height = GIRDLE + (1.0 - tip * np.cos(STEP / 2)) * slope
    low = 1.0 - LOWER
    low_height = -GIRDLE - (1.0 - low * np.cos(STEP / 2)) * dip
    planes = [np.append(UP, -top)]
    for k in range(8):
        main = k * STEP
        corners = around(main, TABLE, top), around(main + STEP, TABLE, top)
        star = around(main + STEP / 2, tip, tip_height)
        planes.append(through(*corners, star))
        level = around(main + STEP / 2, 1.0, GIRDLE)
        below = around(main + STEP / 2, 1.0, -GIRDLE)
        half = around(main + STEP / 2, low, low_height)
        for side in (main, main + STEP):
            planes.append(through(around(side, 1.0, GIRDLE), star, level))
            planes.append(through(around(side, 1.0, -GIRDLE), half, below))
        for turn, height, angle in ((1.0, GIRDLE, CROWN), (-1.0, -GIRDLE, PAVILION)):
            tilt = np.radians(angle)
            n = around(main, np.sin(tilt), turn * np.cos(tilt))
            planes.append(np.append(n, -n @ around(main, 1.0, height)))
    sides = [around(a, 1.0, 0.0) for a in np.linspace(0.0, 2 * np.pi, 96, endpoint=False)]
    return np.array([*planes, *(np.append(n, -1.0) for n in sides)])


def step_cut(width: float, depth: float) -> Array:
    """The planes (n, 4) of a step cut ("emerald cut"): an octagon, three steps above and below."""
    planes = [np.append(UP, -0.34)]
    steps = [(62.0, 0.10), (44.0, 0.235), (27.0, 0.31)]  # angle, and the height where it ends
    below = [(68.0, 0.22), (53.0, 0.50), (41.0, 0.90)]
    for k in range(8):
        corner = (width + depth) * np.sqrt(0.5) - 0.16  # cut off
        azimuth, reach = k * STEP, (depth, corner, width, corner)[k % 4]
        planes.append(np.append(around(azimuth, 1.0, 0.0), -reach))
        for turn, table in ((1.0, steps), (-1.0, below)):
            r, h = reach, 0.03
            for angle, end in table:
                tilt = np.radians(angle)
                n = around(azimuth, np.sin(tilt), turn * np.cos(tilt))
                planes.append(np.append(n, -n @ around(azimuth, r, turn * h)))
                r, h = r - (end - h) / np.tan(tilt), end
    return np.array(planes)


def cut(planes: Array) -> trimesh.Trimesh:
    """The body that the planes (n, 4) leave, every facet flat; triangles wind counterclockwise."""
    found = HalfspaceIntersection(planes, np.array([0.0, 0.01, 0.0])).intersections
    points, faces = [], []
    for n in planes:
        outline = found[np.abs(found @ n[:3] + n[3]) < 1e-7]
        outline = outline[np.unique(np.round(outline, 6), axis=0, return_index=True)[1]]
        if len(outline) < 3:
            continue
        u = np.cross(n[:3], np.eye(3)[np.argmin(np.abs(n[:3]))])
        v = np.cross(n[:3], u)
        from_middle = outline - outline.mean(axis=0)
        outline = outline[np.argsort(np.arctan2(from_middle @ v, from_middle @ u))]
        first = sum(map(len, points))  # corners are not shared, so that facets stay flat
        faces += [(first, first + i, first + i + 1) for i in range(1, len(outline) - 1)]
        points.append(outline)
    return trimesh.Trimesh(np.concatenate(points), faces, process=False)


def lay(mesh: trimesh.Trimesh, facet: Array, heading: float, scale: float, at: tuple) -> None:
    """Lay a mesh on the facet of a normal; its crown then looks to a heading [degrees] from +z."""
    down = trimesh.geometry.align_vectors(facet, -UP)
    crown = down[:3, 1]
    turn = heading - np.degrees(np.arctan2(crown[0], crown[2]))
    mesh.apply_transform(tf.rotate(UP, turn) @ down @ tf.scale(scale))
    mesh.apply_translation([at[0], 0.002 - mesh.bounds[0, 1], at[1]])


def pebble(seed: int) -> trimesh.Trimesh:
    """A smooth, uneven pebble: a ball pushed in and out by a few slow waves."""
    ball = trimesh.creation.icosphere(4, 1.0)
    rng = np.random.default_rng(seed)
    p = np.asarray(ball.vertices)
    bumps = np.ones(len(p))
    for _ in range(7):
        k, phase = rng.normal(size=3) * 1.6, rng.uniform(0.0, 2 * np.pi)
        bumps += 0.05 * np.sin(p @ k + phase)
    return trimesh.Trimesh(p * bumps[:, None] * [1.15, 0.72, 0.85], ball.faces, process=False)


def main() -> None:
    here = Path(__file__).parent
    dip, low = np.radians(PAVILION), np.radians(41.0)
    made = {}
    made["diamond"] = cut(brilliant())
    lay(made["diamond"], around(0.0, np.sin(dip), -np.cos(dip)), -8.0, 1.0, (0.0, 0.0))
    made["ruby"] = cut(brilliant())
    lay(made["ruby"], around(0.0, np.sin(dip), -np.cos(dip)), 34.0, 0.64, (-1.62, 0.45))
    made["sapphire"] = cut(step_cut(0.72, 1.0))
    lay(made["sapphire"], around(0.0, np.sin(low), -np.cos(low)), -40.0, 0.72, (1.62, -0.1))
    made["amber"] = pebble(4)
    lay(made["amber"], -UP, 20.0, 0.8, (-0.95, -2.0))
    for name, mesh in made.items():
        mesh.export(here / f"{name}.ply", vertex_normal=name == "amber")
        print(f"{name}.ply: {len(mesh.faces):,} triangles")


if __name__ == "__main__":
    main()
