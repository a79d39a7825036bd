"""The scenes that renders are timed on, as Mitsuba XML that both renderers read.

    python -m bench.peer_scenes FOLDER

writes cornell.xml (42 triangles), atrium.xml (284 thousand, under an even sky) and glass.xml (82
thousand, a caustic) with their meshes: 256x256, box filter, next-event estimation and MIS, path
depth 8 (glass 12). The variables `spp`, `res` and `sampler` can be set when a file is loaded.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh

Mesh = tuple[np.ndarray, np.ndarray]
Point = tuple[float, float, float]

HEAD = """<scene version="3.0.0">
  <default name="spp" value="64"/><default name="res" value="256"/>
  <default name="sampler" value="independent"/>
  <integrator type="path"><integer name="max_depth" value="{depth}"/></integrator>
  <sensor type="perspective">
    <float name="fov" value="{fov}"/>
    <transform name="to_world">
      <lookat origin="{origin}" target="{target}" up="0, 1, 0"/>
    </transform>
    <sampler type="$sampler"><integer name="sample_count" value="$spp"/></sampler>
    <film type="hdrfilm">
      <integer name="width" value="$res"/><integer name="height" value="$res"/>
      <string name="pixel_format" value="rgb"/><rfilter type="box"/>
    </film>
  </sensor>
"""
SHAPE = """  <shape type="ply">
    <string name="filename" value="{name}.ply"/><boolean name="face_normals" value="true"/>
    {inside}
  </shape>
"""
GLASS = (
    '<bsdf type="dielectric"><float name="int_ior" value="1.7847"/>'
    '<float name="ext_ior" value="1.0"/></bsdf>'
)


def diffuse(rgb: Point) -> str:
    """A two-sided diffuse material."""
    value = ", ".join(map(str, rgb))
    return (
        '<bsdf type="twosided"><bsdf type="diffuse">'
        f'<rgb name="reflectance" value="{value}"/></bsdf></bsdf>'
    )


def light(radiance: float) -> str:
    """A black surface that shines."""
    value = f'<rgb name="radiance" value="{radiance}, {radiance}, {radiance}"/>'
    return f'{diffuse((0, 0, 0))}<emitter type="area">{value}</emitter>'


def joined(meshes: list[Mesh]) -> Mesh:
    """Return many meshes as a single mesh."""
    first = np.cumsum([0] + [len(v) for v, _ in meshes[:-1]])
    faces = [f + n for (_, f), n in zip(meshes, first, strict=True)]
    return np.concatenate([v for v, _ in meshes]), np.concatenate(faces)


def quad(a: Point, b: Point, c: Point, d: Point) -> Mesh:
    """A flat quadrilateral; its normal by the right hand."""
    return np.array([a, b, c, d], float), np.array([[0, 1, 2], [0, 2, 3]])


def rotated(points: np.ndarray, angle: float) -> np.ndarray:
    """Points (..., 3) turned about y by an angle [rad]."""
    k, q = np.cos(angle), np.sin(angle)
    return points @ np.array([[k, 0, -q], [0, 1, 0], [q, 0, k]])


def box(low: Point, high: Point, angle: float = 0.0, at: Point = (0, 0, 0)) -> Mesh:
    """A box between two corners, turned about y and moved."""
    x, y, z = zip(low, high, strict=True)
    corners = np.array([(i, j, k) for i in x for j in y for k in z], float)
    corners = rotated(corners, angle) + at
    sides = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    return joined([quad(*corners[list(side)]) for side in sides])


def grid(points: np.ndarray, around_u: bool = False, around_v: bool = False) -> Mesh:
    """Two triangles for each cell of points (nu, nv, 3); a side may join the opposite side."""
    nu, nv = points.shape[:2]
    index = np.arange(nu * nv).reshape(nu, nv)
    index = np.pad(index, ((0, int(around_u)), (0, int(around_v))), mode="wrap")
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], 2)
    return points.reshape(-1, 3), faces.reshape(-1, 3)


def knot() -> Mesh:
    """A trefoil tube of 69,600 triangles, 1 high, standing on y = 0."""
    t = np.linspace(0, 2 * np.pi, 1200, endpoint=False)
    v = np.linspace(0, 2 * np.pi, 29, endpoint=False)

    def curve(t: np.ndarray) -> np.ndarray:
        x, y = np.sin(t) + 2 * np.sin(2 * t), np.cos(t) - 2 * np.cos(2 * t)
        return np.stack([x, y, -np.sin(3 * t)], -1)

    along = curve(t + 1e-4) - curve(t - 1e-4)
    along /= np.linalg.norm(along, axis=1)[:, None]
    n = np.cross(along, [0.0, 0.0, 1.0])
    n /= np.linalg.norm(n, axis=1)[:, None]
    b = np.cross(along, n)
    radius = (0.62 + 0.05 * np.sin(31 * t)[:, None] * np.cos(3 * v))[..., None]
    ring = np.cos(v)[:, None] * n[:, None] + np.sin(v)[:, None] * b[:, None]
    points, faces = grid(curve(t)[:, None] + radius * ring, True, True)
    low, high = points.min(0), points.max(0)
    middle = (low + high) / 2
    return (points - [middle[0], low[1], middle[2]]) / (high[1] - low[1]), faces


def column(x: float, y: float, z: float, height: float, top: float) -> list[Mesh]:
    """A fluted column on a plinth, with a block that reaches up to `top`."""
    turn, up = np.meshgrid(
        np.linspace(0, 2 * np.pi, 64, endpoint=False), np.linspace(0, 1, 36), indexing="ij"
    )
    swell = 0.10 * np.exp(-((up / 0.03) ** 2)) + 0.10 * np.exp(-(((up - 1) / 0.03) ** 2))
    r = (0.26 - 0.05 * up + swell) * (1 + 0.06 * np.cos(16 * turn))
    shaft = np.stack([x + r * np.cos(turn), y + up * height, z + r * np.sin(turn)], -1)
    return [
        grid(shaft, around_u=True),
        box((x - 0.35, y, z - 0.35), (x + 0.35, y + 0.12, z + 0.35)),
        box((x - 0.35, y + height, z - 0.35), (x + 0.35, top, z + 0.35)),
    ]


def arch(x: float, y: float, z: float) -> Mesh:
    """Half a ring, standing."""
    u, v = np.meshgrid(
        np.linspace(0, np.pi, 33), np.linspace(0, 2 * np.pi, 12, endpoint=False), indexing="ij"
    )
    r = 1.40 + 0.15 * np.cos(v)
    points = [x + r * np.cos(u), y + r * np.sin(u), z + 0.15 * np.sin(v)]
    return grid(np.stack(points, -1), around_v=True)


def court() -> Mesh:
    """The atrium's stone: on each side a wall, two galleries, two storeys of columns and arches."""
    parts = []
    for side in (-1, 1):
        wall, row = 4 * side, 2.2 * side
        near, far = sorted((1.9 * side, wall))
        parts.append(box((-12, 0, min(wall, 4.2 * side)), (12, 8.3, max(wall, 4.2 * side))))
        parts += [box((-12, y, near), (12, y + 0.3, far)) for y in (4, 8)]
        parts.append(box((12 * side - 0.1, 0, -4), (12 * side + 0.1, 8.3, 4)))
        for floor, height, top in ((0.0, 3.0, 4.0), (4.3, 2.9, 8.0)):
            places = -10.5 + 3.5 * np.arange(7)
            for x in places:
                parts += column(x, floor, row, height, top)
            parts += [arch(x + 1.75, floor + height - 0.6, row) for x in places[:-1]]
    return joined(parts)


def write_cornell(folder: Path) -> Path:
    """42 triangles, and a light in the ceiling."""
    h = 0.25
    around = ((-1, 1, -1, -h), (-1, 1, h, 1), (-1, -h, -h, h), (h, 1, -h, h))
    ceiling = [quad((a, 1, c), (b, 1, c), (b, 1, d), (a, 1, d)) for a, b, c, d in around]
    white = [
        quad((-1, -1, 1), (1, -1, 1), (1, -1, -1), (-1, -1, -1)),
        quad((-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)),
        *ceiling,
        box((-0.3, 0, -0.3), (0.3, 0.6, 0.3), -0.3, (0.335, -1, 0.38)),
        box((-0.3, 0, -0.3), (0.3, 1.2, 0.3), 0.3, (-0.33, -1, -0.28)),
    ]
    red = quad((-1, -1, 1), (-1, -1, -1), (-1, 1, -1), (-1, 1, 1))
    green = quad((1, -1, -1), (1, -1, 1), (1, 1, 1), (1, 1, -1))
    lamp = quad((-h, 1, -h), (h, 1, -h), (h, 1, h), (-h, 1, h))
    parts = {
        "white": (joined(white), diffuse((0.885809, 0.698859, 0.666422))),
        "red": (red, diffuse((0.570068, 0.0430135, 0.0443706))),
        "green": (green, diffuse((0.105421, 0.37798, 0.076425))),
        "light": (lamp, light(15)),
    }
    view = {"depth": 8, "fov": 39.3077, "origin": "0, 0, 3.9", "target": "0, 0, 0"}
    return write_scene(folder, "cornell", parts, view)


def write_atrium(folder: Path) -> Path:
    """283,842 triangles under an even sky."""
    points, faces = knot()
    knots = [
        (size * rotated(points, angle) + at, faces)
        for size, angle, at in ((1.6, 0.6, (-5.5, 0, 0.7)), (2.0, -0.9, (-1.5, 0, -0.6)))
    ]
    floor = quad((-12, 0, 4), (12, 0, 4), (12, 0, -4), (-12, 0, -4))
    parts = {
        "stone": (court(), diffuse((0.6, 0.55, 0.5))),
        "floor": (floor, diffuse((0.4, 0.4, 0.45))),
        "knots": (joined(knots), diffuse((0.7, 0.5, 0.3))),
    }
    sky = '  <emitter type="constant"><rgb name="radiance" value="1, 1, 1"/></emitter>\n'
    view = {"depth": 8, "fov": 60, "origin": "-10, 1.8, 0.4", "target": "0, 2.6, -0.2"}
    return write_scene(folder, "atrium", parts, view, sky)


def write_glass(folder: Path) -> Path:
    """A glass ball of 81,920 triangles and a prism under a small light: caustics."""
    ground = quad((-4, 0, 4), (4, 0, 4), (4, 0, -2), (-4, 0, -2))
    wall = quad((-4, 0, -2), (4, 0, -2), (4, 4, -2), (-4, 4, -2))
    lamp = quad((-0.5, 3.5, -0.5), (0.5, 3.5, -0.5), (0.5, 3.5, 0.5), (-0.5, 3.5, 0.5))
    ball = trimesh.creation.icosphere(subdivisions=6, radius=0.6)
    end = np.array([(0.35, 0.1, -0.6), (1.35, 0.1, -0.6), (0.85, 0.966, -0.6)])
    sides = [(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)]
    parts = {
        "white": (joined([ground, wall]), diffuse((0.8, 0.8, 0.8))),
        "light": (lamp, light(12)),
        "sphere": ((ball.vertices + np.array([-0.8, 0.75, 0]), ball.faces), GLASS),
        "prism": ((np.concatenate([end, end + np.array([0, 0, 1.4])]), np.array(sides)), GLASS),
    }
    view = {"depth": 12, "fov": 45, "origin": "0, 2, 4.5", "target": "0, 0.6, 0"}
    return write_scene(folder, "glass", parts, view)


SCENES: dict[str, Callable[[Path], Path]] = {
    "cornell": write_cornell,
    "atrium": write_atrium,
    "glass": write_glass,
}


def write_scene(
    folder: Path, scene: str, parts: dict[str, tuple[Mesh, str]], view: dict, more: str = ""
) -> Path:
    """Write meshes with their shapes' content, and a scene of them with further elements."""
    text = HEAD.format(**view) + more
    for part, ((vertices, faces), inside) in parts.items():
        name = f"{scene}_{part}"
        trimesh.Trimesh(vertices, faces, process=False).export(folder / f"{name}.ply")
        text += SHAPE.format(name=name, inside=inside)
    path = folder / f"{scene}.xml"
    path.write_text(text + "</scene>\n")
    return path


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    for write in SCENES.values():
        print(write(target))
