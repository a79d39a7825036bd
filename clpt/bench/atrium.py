"""The atrium: a two-storey court of columns and arches, with curtains, plants and hanging lamps.

Formulas give its 309,472 triangles. y is up; the court is 40 long (x), 16 high and 18 wide (z), and
open to the sky in the middle. `scenes/atrium` is written from it.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

LENGTH, HEIGHT, WIDTH = 40.0, 16.0, 18.0
ROWS = (4.5, 13.5)  # z of the two rows of columns
COLUMNS = np.linspace(3, 37, 13)  # x of the columns
TAU = 2 * np.pi

Mesh = tuple[np.ndarray, np.ndarray]
Angles = np.ndarray
Point = tuple[np.ndarray, ...]
Surface = Callable[[Angles, Angles], Point]


def atrium() -> tuple[np.ndarray, np.ndarray, dict[str, slice]]:
    """Return vertices (n, 3) float32, faces (m, 3) uint32, and the faces of each part.

    Parts: floor, walls, galleries, columns, arches, curtains, vases, foliage, chains, lamps and
    relief.
    """
    rng = np.random.default_rng(7)
    makers = {
        "floor": lambda: [grid(lambda u, v: (u * LENGTH, 0 * u, v * WIDTH), 2, 2)],
        "walls": walls,
        "galleries": galleries,
        "columns": columns,
        "arches": arches,
        "curtains": lambda: curtains(rng),
        "vases": vases,
        "foliage": lambda: foliage(rng),
        "chains": chains,
        "lamps": lamps,
        "relief": relief,
    }
    meshes: list[Mesh] = []
    parts: dict[str, slice] = {}
    begin = 0
    for name, make in makers.items():
        part = make()
        meshes += part
        parts[name] = slice(begin, begin + sum(len(faces) for _, faces in part))
        begin = parts[name].stop
    first = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    vertices = np.concatenate([vertices for vertices, _ in meshes]).astype(np.float32)
    faces = np.concatenate([faces + n for (_, faces), n in zip(meshes, first, strict=False)])
    return vertices, faces.astype(np.uint32), parts


def grid(surface: Surface, nu: int, nv: int) -> Mesh:
    """The surface (u, v) -> (x, y, z) over the unit square, as nu by nv cells of two triangles."""
    u, v = np.meshgrid(np.linspace(0, 1, nu + 1), np.linspace(0, 1, nv + 1), indexing="ij")
    index = np.arange(u.size).reshape(u.shape)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.stack([a, b, c, a, c, d], -1).reshape(-1, 3)
    return np.stack(np.broadcast_arrays(*surface(u, v)), -1).reshape(-1, 3), faces


def box(low: tuple[float, ...], high: tuple[float, ...], n: int = 1) -> list[Mesh]:
    """The six sides of a box, each n by n cells."""
    sides = []
    for axis in range(3):
        for end in (low, high):

            def side(u: Angles, v: Angles, axis: Any = axis, end: Any = end) -> Point:
                point = [u, u, u]
                b, c = (axis + 1) % 3, (axis + 2) % 3
                point[axis] = 0 * u + end[axis]
                point[b] = low[b] + (high[b] - low[b]) * u
                point[c] = low[c] + (high[c] - low[c]) * v
                return tuple(point)

            sides.append(grid(side, n, n))
    return sides


def walls() -> list[Mesh]:
    """Four walls with a relief of square waves."""

    def bump(u: Angles, v: Angles) -> Angles:
        return 0.05 * np.sign(np.sin(40 * u)) * np.sign(np.sin(20 * v))

    return [
        grid(lambda u, v: (u * LENGTH, v * HEIGHT, bump(u, v)), 60, 30),
        grid(lambda u, v: (u * LENGTH, v * HEIGHT, WIDTH + bump(u, v)), 60, 30),
        grid(lambda u, v: (bump(u, v), v * HEIGHT, u * WIDTH), 30, 30),
        grid(lambda u, v: (LENGTH + bump(u, v), v * HEIGHT, u * WIDTH), 30, 30),
    ]


def galleries() -> list[Mesh]:
    """Floors around the court at the height of the second storey and of the roof."""
    meshes = []
    for y in (7.0, 15.0):
        for z0, z1 in ((0.0, 4.5), (13.5, WIDTH)):
            meshes += box((0, y, z0), (LENGTH, y + 0.4, z1), 2)
        for x0, x1 in ((0.0, 3.0), (37.0, LENGTH)):
            meshes += box((x0, y, 4.5), (x1, y + 0.4, 13.5), 2)
    return meshes


def columns() -> list[Mesh]:
    """Fluted columns with bases and capitals, in two storeys."""
    meshes = []
    for y0, y1 in ((0.0, 4.6), (7.4, 12.6)):
        for z in ROWS:
            for x in COLUMNS:

                def shaft(
                    u: Angles, v: Angles, x: float = x, z: float = z, y0: float = y0, y1: float = y1
                ) -> Point:
                    r = 0.42 * (1 - 0.12 * v) * (1 + 0.06 * np.cos(12 * TAU * u))
                    r += 0.15 * np.exp(-((14 * v) ** 2)) + 0.18 * np.exp(-((12 * (1 - v)) ** 2))
                    return x + r * np.cos(TAU * u), y0 + (y1 - y0) * v, z + r * np.sin(TAU * u)

                meshes.append(grid(shaft, 36, 20))
                meshes += box((x - 0.6, y0, z - 0.6), (x + 0.6, y0 + 0.25, z + 0.6))
                meshes += box((x - 0.6, y1 - 0.1, z - 0.6), (x + 0.6, y1 + 0.2, z + 0.6))
    return meshes


def arches() -> list[Mesh]:
    """Round arches from column to column."""
    meshes = []
    for y in (4.8, 12.8):
        for z in ROWS:
            for x0, x1 in itertools.pairwise(COLUMNS):

                def arch(
                    u: Angles,
                    v: Angles,
                    x: float = (x0 + x1) / 2,
                    radius: float = (x1 - x0) / 2,
                    y: float = y,
                    z: float = z,
                ) -> Point:
                    a = np.pi * u
                    r = radius - 0.25 + 0.3 * np.cos(TAU * v) * (1 + 0.1 * np.sin(20 * a))
                    return x - r * np.cos(a), y + 1.2 * r * np.sin(a), z + 0.4 * np.sin(TAU * v)

                meshes.append(grid(arch, 26, 14))
    return meshes


def curtains(rng: np.random.Generator) -> list[Mesh]:
    """Wavy cloth in every second arch."""
    meshes = []
    for x in COLUMNS[:-1:2] + 0.5:
        for z in ROWS:
            phase = 6 * rng.random()

            def cloth(
                u: Angles, v: Angles, x: float = x, z: float = z, phase: float = phase
            ) -> Point:
                y = 4.7 - 3.6 * v + 0.1 * np.sin(5 * u + phase)
                depth = 0.22 * np.sin(18 * u + phase + 2 * v) * (0.4 + v)
                depth += 0.1 * np.sin(7 * v + phase)
                return x + 1.9 * u * (1 + 0.2 * np.sin(3 * v)), y, z + depth

            meshes.append(grid(cloth, 56, 40))
    return meshes


def _pots() -> list[tuple[float, float]]:
    return [(x, z) for x in np.linspace(5, 35, 12) for z in (6.0, 12.0)]


def vases() -> list[Mesh]:
    """Vases that stand along the court."""
    meshes = []
    for x, z in _pots():

        def vase(u: Angles, v: Angles, x: float = x, z: float = z) -> Point:
            r = 0.35 + 0.25 * np.sin(3 * v) ** 2 - 0.1 * v
            return x + r * np.cos(TAU * u), 1.1 * v, z + r * np.sin(TAU * u)

        meshes.append(grid(vase, 32, 20))
    return meshes


def foliage(rng: np.random.Generator) -> list[Mesh]:
    """Diamond-shaped leaves, two triangles each, in a cloud above every vase."""
    meshes, leaves = [], 260
    for x, z in _pots():
        centre = np.array([x, 1.5, z]) + rng.normal(0, 1, (leaves, 3)) * (0.45, 0.35, 0.45)
        long = rng.normal(0, 1, (leaves, 3))
        long /= np.linalg.norm(long, axis=1, keepdims=True)
        wide = np.cross(long, rng.normal(0, 1, (leaves, 3)))
        wide /= np.linalg.norm(wide, axis=1, keepdims=True)
        long, wide = 0.16 * long, 0.06 * wide
        corners = np.stack([centre - long, centre - wide, centre + wide, centre + long], 1)
        faces = np.array([[0, 1, 2], [3, 2, 1]]) + 4 * np.arange(leaves)[:, None, None]
        meshes.append((corners.reshape(-1, 3), faces.reshape(-1, 3)))
    return meshes


def chains() -> list[Mesh]:
    """Chains of interlocking rings that the lamps hang from."""
    meshes = []
    for x in np.linspace(6, 34, 8):
        for link in range(14):

            def ring(u: Angles, v: Angles, x: float = x, link: Any = link) -> Point:
                r = 0.12 + 0.035 * np.cos(TAU * v)
                p, q, s = r * np.cos(TAU * u), r * np.sin(TAU * u), 0.035 * np.sin(TAU * v)
                across, along = (p, s) if link % 2 else (s, p)
                return x + across, 14.5 - 0.22 * link + q, 9 + along

            meshes.append(grid(ring, 14, 8))
    return meshes


def lamps() -> list[Mesh]:
    """Dimpled globes."""
    meshes = []
    for x in np.linspace(6, 34, 8):

        def globe(u: Angles, v: Angles, x: float = x) -> Point:
            r = 0.5 + 0.03 * np.sin(12 * TAU * u) * np.sin(6 * TAU * v)
            ring, y = r * np.sin(np.pi * v), 11 + r * np.cos(np.pi * v)
            return x + ring * np.cos(TAU * u), y, 9 + ring * np.sin(TAU * u)

        meshes.append(grid(globe, 64, 40))
    return meshes


def relief() -> list[Mesh]:
    """A finely carved panel at the far end."""

    def panel(u: Angles, v: Angles) -> Point:
        depth = 0.5 * np.sin(9 * u) * np.sin(11 * v) * np.cos(23 * u * v)
        return 38.6 + depth, 1 + 5 * v, 6.5 + 5 * u

    return [grid(panel, 110, 110)]
