"""Grows a field of poppies: a few plants from formulas, and where thousands of them stand.

    python scenes/poppy_field/generate.py

Lengths are in metres, y is up. A plant is one to four meshes, `.ply`; its places are matrices
(n, 3, 4), `.npy`, drawn at random in the wedge that the camera sees, the farther away the sparser.
`sky.exr` is an evening's sky in latitude and longitude.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from clpt import images
from clpt import transforms as tf

FOLDER = Path(__file__).parent
SUN = np.array([0.42, 0.2, 0.88])  # where it stands, seen from the field

Mesh = tuple[np.ndarray, np.ndarray]


def height(x: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Of the ground; the camera stands at x = z = 0."""
    near = 0.05 * np.sin(1.3 * x + 0.4) * np.cos(0.9 * z) * np.minimum(1.0, z / 4.0)
    hills = 0.5 * np.sin(0.11 * x + 1.0) + 0.4 * np.cos(0.13 * z + 0.06 * x)
    far = 9.0 * np.exp(-(((x + 60.0) / 70.0) ** 2) - ((z - 190.0) / 60.0) ** 2)
    far = far + 7.0 * np.exp(-(((x - 90.0) / 60.0) ** 2) - ((z - 160.0) / 40.0) ** 2)
    return near + np.minimum(np.maximum(z, 0.0) / 12.0, 1.0) * (hills - 0.4) + far


def sheet(points: np.ndarray) -> Mesh:
    """Triangles over a grid of points (n, m, 3)."""
    n, m = points.shape[:2]
    first = (np.arange(n - 1)[:, None] * m + np.arange(m - 1)).reshape(-1, 1)
    corners = np.array([0, 1, m + 1, 0, m + 1, m])
    return points.reshape(-1, 3), (first + corners).reshape(-1, 3)


def joined(parts: list[Mesh]) -> Mesh:
    """One mesh of several."""
    first = np.cumsum([0] + [len(vertices) for vertices, _ in parts])
    faces = [faces + n for (_, faces), n in zip(parts, first, strict=False)]
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(faces)


def blade(rng: np.random.Generator, reach: float, steps: int = 4) -> Mesh:
    """A blade of grass: a narrow strip that leaves upward and bends over."""
    azimuth, lean = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.1, 0.55)
    out = np.array([np.cos(azimuth), 0.0, np.sin(azimuth)])
    across = np.array([-out[2], 0.0, out[0]])
    t = np.linspace(0.0, 1.0, steps + 1)[:, None]
    long = reach * rng.uniform(0.6, 1.0)
    middle = long * (t * [0.0, 1.0, 0.0] + lean * t**2 * (out - [0.0, 0.4, 0.0]))
    middle = middle + 0.07 * rng.normal() * out + 0.07 * rng.normal() * across
    width = 0.0035 * (1.0 - t**2) + 0.0002
    return sheet(np.stack([middle - width * across, middle + width * across], axis=1))


def turf(rng: np.random.Generator) -> Mesh:
    """A square metre of grass; it is laid like tiles, so that few of them stand in each other."""
    made = []
    for x, z in rng.uniform(-0.5, 0.5, (16, 2)):
        for _ in range(36):
            vertices, faces = blade(rng, rng.uniform(0.25, 0.42))
            made.append(
                (vertices + np.array([x, 0, z]) + rng.normal(size=3) * [0.04, 0, 0.04], faces)
            )
    return joined(made)


def tube(line: np.ndarray, radius: float) -> Mesh:
    """A stem around a line that goes upward, (n, 3)."""
    around = np.linspace(0.0, 2.0 * np.pi, 6)
    ring = np.stack([np.cos(around), 0.0 * around, np.sin(around)], axis=1)
    return sheet(line[:, None] + radius * ring)


def bent(tall: float, lean: float) -> np.ndarray:
    t = np.linspace(0.0, 1.0, 9)
    return np.stack([lean * t**2, tall * t, 0.3 * lean * np.sin(3.0 * t)], axis=1)


def petal(azimuth: float, size: float, cup: float, seed: float) -> Mesh:
    """A crumpled petal: from the middle outward, and up by its cup."""
    u, v = np.meshgrid(np.linspace(0.02, 1.0, 9), np.linspace(-1.0, 1.0, 11), indexing="ij")
    angle = azimuth + v * 0.9 * u**0.4
    r = size * u * (1.0 - 0.18 * v**4 + 0.03 * np.sin(9.0 * v + seed))
    crumple = 0.03 * u**2 * (np.sin(5.0 * v + seed) + 0.4 * np.sin(11.0 * v + 4.0 * u + seed))
    y = size * (cup * u**1.7 + crumple)
    fold = 1.0 - 0.35 * cup * u**2
    return sheet(np.stack([r * fold * np.cos(angle), y, r * fold * np.sin(angle)], axis=-1))


def poppy(rng: np.random.Generator, cup: float) -> dict[str, Mesh]:
    """A stem, four petals and a dark heart."""
    line = bent(0.5, rng.uniform(0.02, 0.1))
    turns = np.arange(4) * np.pi / 2.0
    petals = [petal(a, 0.042 - 0.004 * (i % 2), cup, 3.0 * i) for i, a in enumerate(turns)]
    u, v = np.meshgrid(np.linspace(0, np.pi, 7), np.linspace(0, 2 * np.pi, 9), indexing="ij")
    ball = np.stack([np.sin(u) * np.cos(v), 1.2 * np.cos(u), np.sin(u) * np.sin(v)], axis=-1)
    leaves = joined([blade(rng, 0.2) for _ in range(5)])
    tip = line[-1]
    vertices, faces = joined(petals)
    return {
        "stem": joined([tube(line, 0.0018), leaves]),
        "petals": (vertices + tip, faces),
        "heart": sheet(0.008 * ball + tip + [0.0, 0.008, 0.0]),
    }


def cornflower(rng: np.random.Generator) -> dict[str, Mesh]:
    """A stem, and a head of narrow rays."""
    line = bent(0.45, 0.06)
    rays = []
    for i in range(16):
        azimuth = 2.0 * np.pi * i / 16 + rng.normal() * 0.1
        vertices, faces = petal(azimuth, 0.02 + 0.006 * (i % 2), 0.5 + 0.4 * (i % 3), float(i))
        out = np.array([np.cos(azimuth), 0.0, np.sin(azimuth)])
        side = vertices - (vertices @ out)[:, None] * out - vertices * [0, 1, 0]
        rays.append((vertices - 0.75 * side + line[-1], faces))
    leaves = joined([blade(rng, 0.25) for _ in range(6)])
    return {"stem": joined([tube(line, 0.0015), leaves]), "petals": joined(rays)}


def tree(rng: np.random.Generator) -> dict[str, Mesh]:
    """A trunk, and leaves in a few round clouds around its top."""
    leaves = []
    for _ in range(14):
        middle = rng.normal(size=3) * [1.5, 1.1, 1.5] + [0.0, 5.2, 0.0]
        for _ in range(150):
            ray = rng.normal(size=3)
            at = middle + ray / np.linalg.norm(ray) * rng.uniform(0.7, 1.2)
            a, b = rng.normal(size=(2, 3)) * 0.13
            leaves.append(sheet(at + np.array([[-a - b, a - b], [b - a, a + b]])))
    t = np.linspace(0.0, 5.0, 8)
    trunk = tube(np.stack([0.15 * np.sin(t), t, 0.1 * np.cos(t)], axis=1), 0.2)
    return {"trunk": trunk, "leaves": joined(leaves)}


def wedge(rng: np.random.Generator, count: int, near: float, far: float, power: float) -> tuple:
    """Places x, z in front of the camera; the larger the power, the more of them are near."""
    t = rng.uniform(size=count)
    z = near + (far - near) * t**power
    return rng.uniform(-0.62, 0.62, count) * (z + 1.0), z


def placed(rng: np.random.Generator, x: np.ndarray, z: np.ndarray, size: tuple) -> np.ndarray:
    """Matrices (n, 3, 4) that turn plants at random and set them on the ground."""
    made = []
    for px, pz in zip(x, z, strict=True):
        scale = rng.uniform(*size)
        matrix = tf.translate([px, height(px, pz) - 0.01, pz])
        matrix = matrix @ tf.rotate([0, 1, 0], rng.uniform(0, 360))
        made.append(matrix @ tf.rotate([1, 0, 0], rng.normal() * 5) @ tf.scale(scale))
    return np.stack(made)[:, :3].astype(np.float32)


def tiles(rng: np.random.Generator) -> np.ndarray:
    """Matrices (n, 3, 4) of the turf: a grid of metres, turned by right angles, along the slope."""
    made = []
    for z in np.arange(1.0, 46.0):
        for x in np.arange(-np.ceil(0.62 * (z + 2.0)), 0.62 * (z + 2.0) + 1.0):
            slopes = [
                height(x + 0.5, z) - height(x - 0.5, z),
                height(x, z + 0.5) - height(x, z - 0.5),
            ]
            turn = tf.rotate([0, 1, 0], 90.0 * rng.integers(4))
            shear = np.eye(4)
            shear[1, [0, 2]] = slopes
            tall = tf.scale([1.0, rng.uniform(0.85, 1.15), 1.0])
            made.append(tf.translate([x, height(x, z) - 0.01, z]) @ shear @ tall @ turn)
    return np.stack(made)[:, :3]


def clumps(rng: np.random.Generator, x: np.ndarray, z: np.ndarray, keep: float) -> np.ndarray:
    """Which places are kept, so that flowers stand together."""
    tide = np.sin(0.9 * x + 0.3 * z) + np.sin(0.5 * z - 0.4 * x + 2.0) + np.sin(1.7 * x - z)
    return rng.uniform(size=len(x)) < keep * np.exp(0.8 * tide)


def sky() -> np.ndarray:
    """Radiance (64, 128, 3) of an evening's sky: gold around the sun, blue above."""
    v, u = ((np.arange(n) + 0.5) / n for n in (64, 128))
    polar, azimuth = np.meshgrid(np.pi * v, 2.0 * np.pi * u, indexing="ij")
    up = np.cos(polar)
    d = np.stack([np.sin(polar) * np.sin(azimuth), up, -np.sin(polar) * np.cos(azimuth)], axis=-1)
    toward = np.clip(d @ (SUN / np.linalg.norm(SUN)), 0.0, 1.0)[..., None]
    low = np.exp(-6.0 * np.abs(up))[..., None]
    blue = np.array([0.16, 0.3, 0.62]) * (1.0 - low) + np.array([0.75, 0.62, 0.52]) * low
    gold = np.array([1.0, 0.55, 0.2])
    light = blue + gold * (1.1 * low * toward**3 + 0.5 * toward**12 + 3.0 * toward**90)
    return np.where(up[..., None] > -0.02, light, 0.05 * light)


def save(name: str, mesh: Mesh) -> None:
    vertices, faces = mesh
    whole = trimesh.Trimesh(vertices.astype(np.float32), faces, process=False)
    (FOLDER / f"{name}.ply").write_bytes(trimesh.exchange.ply.export_ply(whole))


def grow() -> None:
    """Write all meshes and places beside this file."""
    rng = np.random.default_rng(3)
    z = 260.0 * np.linspace(0.0, 1.0, 90)[:, None] ** 2.5 - 2.0
    x = np.linspace(-0.9, 0.9, 90)[None, :] * (z + 6.0)
    z = np.broadcast_to(z, x.shape)
    save("ground", sheet(np.stack([x, height(x, z), z], axis=-1)))
    for i in range(3):
        save(f"turf{i}", turf(rng))
    plants = {"poppy0": poppy(rng, 0.35), "poppy1": poppy(rng, 0.8)}
    plants |= {"cornflower": cornflower(rng), "tree": tree(rng)}
    for plant, parts in plants.items():
        for part, mesh in parts.items():
            save(f"{plant}_{part}", mesh)
    laid = tiles(rng)
    which = rng.integers(3, size=len(laid))
    for i in range(3):
        np.save(FOLDER / f"turf{i}.npy", laid[which == i].astype(np.float16))
    flowers = {"poppy0": (3000, 0.3), "poppy1": (2000, 0.3), "cornflower": (1900, 0.2)}
    for name, (count, keep) in flowers.items():
        x, z = wedge(rng, count, 1.5, 50.0, 1.6)
        kept = clumps(rng, x, z, keep)
        matrices = placed(rng, x[kept], z[kept], (0.75, 1.25))
        np.save(FOLDER / f"{name}.npy", matrices.astype(np.float16))
    x, z = np.concatenate([rng.uniform([-110, 120], [110, 200], (70, 2)), [[-14, 46], [-19, 52]]]).T
    np.save(FOLDER / "tree.npy", placed(rng, x, z, (0.8, 1.5)).astype(np.float16))
    images.write(FOLDER / "sky.exr", sky())


if __name__ == "__main__":
    grow()
