"""The scenes of hard light, as Mitsuba XML and LuxCore text of the same triangles.

    python -m bench.hard_light.scenes FOLDER

256x256 pixels, box filter, constant indices, flat normals. Diffuse shapes are parallelograms of two
triangles, which `bench.hard_light.reference` requires. `SCENES` says what each scene shows.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from bench.meshes import write_ply
from bench.peer_scenes import Mesh, Point

Corners = tuple[Point, ...]
SIZE = 256  # pixels of a side
WALLS = "xXyYzZ"  # sides of a box; a capital letter is the far side of its axis


@dataclass(frozen=True)
class Diffuse:
    """A material that is the same on both sides."""

    colour: Point


@dataclass(frozen=True)
class Mirror:
    colour: Point


@dataclass(frozen=True)
class Glass:
    index: float


@dataclass(frozen=True)
class Lamp:
    """A black surface that shines from its front."""

    radiance: float


Surface = Diffuse | Mirror | Glass | Lamp


@dataclass(frozen=True)
class HardScene:
    """A scene and what it shows.

    depth: the most surfaces of a path, including the light; aim: a rectangle at height y, from x0
    to x1 and z0 to z1, that all light passes, if any; sky: radiance of a constant sky; point:
    position and intensity of a point light.
    """

    shows: str
    depth: int
    eye: Point
    at: Point
    fov: float
    shapes: dict[str, tuple[Mesh, Surface]]
    aim: tuple[float, float, float, float, float] | None = None
    sky: float = 0.0
    point: tuple[Point, float] | None = field(default=None)


def quads(*corners: Corners) -> Mesh:
    """Parallelograms, counter-clockwise from the front; triangles 2i and 2i + 1 are number i."""
    first = np.arange(len(corners))[:, None] * 4
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])], 1)
    return np.reshape(corners, (-1, 3)).astype(float), faces.reshape(-1, 3)


def floor(x0: float, x1: float, z0: float, z1: float, y: float) -> Corners:
    """A level parallelogram that is seen from above."""
    return (x0, y, z1), (x1, y, z1), (x1, y, z0), (x0, y, z0)


def sides(
    low: Point, high: Point, which: str = WALLS, turn: float = 0.0, pivot: Point = (0, 0, 0)
) -> list[Corners]:
    """Sides of a box, facing outward, turned about the vertical through the pivot [rad]."""
    (x, y, z), (X, Y, Z) = low, high
    corners = {
        "x": ((x, y, z), (x, y, Z), (x, Y, Z), (x, Y, z)),
        "X": ((X, y, Z), (X, y, z), (X, Y, z), (X, Y, Z)),
        "y": ((x, y, z), (X, y, z), (X, y, Z), (x, y, Z)),
        "Y": ((x, Y, Z), (X, Y, Z), (X, Y, z), (x, Y, z)),
        "z": ((X, y, z), (x, y, z), (x, Y, z), (X, Y, z)),
        "Z": ((x, y, Z), (X, y, Z), (X, Y, Z), (x, Y, Z)),
    }
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])

    def turned(point: Point) -> Point:
        a, b, d = ((np.array(point) - pivot) @ matrix + pivot).tolist()
        return a, b, d

    return [tuple(map(turned, corners[name])) for name in which]


def inside(low: Point, high: Point, which: str = WALLS) -> list[Corners]:
    """Sides of a box, facing inward."""
    return [side[::-1] for side in sides(low, high, which)]


def square(centre: Point, target: Point, side: float) -> Mesh:
    """A square that looks at the target."""
    c = np.array(centre, float)
    n = (target - c) / np.linalg.norm(target - c)
    u = np.cross(n, [0, 0, 1.0] if abs(n[2]) < 0.9 else [1.0, 0, 0])
    u *= side / 2 / np.linalg.norm(u)
    v = np.cross(n, u)
    return quads(tuple(tuple(p.tolist()) for p in (c - u - v, c + u - v, c + u + v, c - u + v)))


def ball(level: int, centre: Point, radius: float, inward: bool = False) -> Mesh:
    """An icosahedron, `level` times made finer."""
    icosphere = trimesh.creation.icosphere(subdivisions=level, radius=radius)
    return icosphere.vertices + np.array(centre), icosphere.faces[
        :, ::-1
    ] if inward else icosphere.faces


def ring(radius: float, height: float, n: int) -> Mesh:
    """An open tube of n sides that stands on y = 0."""
    t = np.arange(n) * 2 * np.pi / n
    low = np.stack([radius * np.cos(t), 0 * t, radius * np.sin(t)], 1)
    i, j = np.arange(n), (np.arange(n) + 1) % n
    faces = [np.stack([i, j, j + n], 1), np.stack([i, j + n, i + n], 1)]
    return np.concatenate([low, low + np.array([0, height, 0])]), np.concatenate(faces)


def ripples(half: float, n: int) -> Mesh:
    """Water, normals up: a sum of six waves, whose curvature focuses about a metre below."""
    x, z = np.meshgrid(*[np.linspace(-half, half, n + 1)] * 2, indexing="ij")
    waves = np.array(  # wave number, direction, phase, height
        [
            (3.1, 0.3, 0.0, 0.040), (4.7, 1.9, 1.3, 0.028), (6.2, -0.7, 2.9, 0.018),
            (8.3, 1.1, 4.1, 0.012), (11.7, 2.6, 0.7, 0.006), (15.1, -1.6, 5.2, 0.003),
        ]
    )  # fmt: skip
    y = sum(h * np.sin(k * (x * np.cos(a) + z * np.sin(a)) + p) for k, a, p, h in waves)
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    faces = [np.stack([first, first + i, first + j], 1) for i, j in ((1, n + 2), (n + 2, n + 1))]
    return np.stack([x, y, z], -1).reshape(-1, 3), np.concatenate(faces)


def prism(corners: tuple[tuple[float, float], ...], z0: float, z1: float) -> Mesh:
    """A triangle in x and y, counter-clockwise, drawn out along z."""
    points = np.array([(x, y, z) for z in (z0, z1) for x, y in corners])
    faces = [(0, 2, 1), (3, 4, 5), (0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4), (2, 0, 3), (2, 3, 5)]
    return points, np.array(faces)


def _tiles(odd: int) -> Mesh:
    at = [(i, j) for i in range(8) for j in range(8) if (i + j) % 2 == odd]
    return quads(*(floor(i / 2 - 2, i / 2 - 1.5, j / 2 - 2, j / 2 - 1.5, -1.2) for i, j in at))


WHITE, GLASS = Diffuse((0.75, 0.75, 0.75)), Glass(1.5)
DOOR = 0.45  # how far its leaf is open [rad]
POOL, ROOM, DARK = (
    ((-2, -1.2, -2), (2, 0.15, 2)),
    ((-2, 0, -2), (2, 3, 2)),
    ((-2, 0, -2), (2, 2.6, 2)),
)

SCENES = {
    "ring": HardScene(
        "a mirror ring under a small lamp far away: the nephroid, seen again in the ring",
        depth=16, eye=(-1.1, 3.3, 2.9), at=(0.1, 0, 0.1), fov=38, aim=(0.51, -4, 4.5, -4.5, 4.5),
        shapes={
            "floor": (quads(floor(-4, 4, -4, 4, 0)), WHITE),
            "lamp": (square((3, 2.6, -0.6), (0, 0, 0), 0.12), Lamp(4500)),
            "ring": (ring(1, 0.5, 2048), Mirror((0.95, 0.86, 0.65))),
        },
    ),
    "pool": HardScene(
        "rippled water over tiles under a small sun and a weak sky: sharp, diffuse, sharp",
        depth=16, eye=(0, 5.2, 3.6), at=(0, -0.7, 0.1), fov=42, aim=(0.2, -4.1, 4.1, -4.1, 4.1),
        sky=0.08,
        shapes={
            "water": (ripples(2.02, 174), Glass(1.33)),
            "pale": (_tiles(1), Diffuse((0.8, 0.8, 0.78))),
            "blue": (_tiles(0), Diffuse((0.15, 0.4, 0.6))),
            "rim": (
                quads(
                    *inside(*POOL, "xXzZ"),
                    floor(-4, 4, -4, -2, 0.15), floor(-4, 4, 2, 4, 0.15),
                    floor(-4, -2, -2, 2, 0.15), floor(2, 4, -2, 2, 0.15),
                ),
                Diffuse((0.6, 0.55, 0.5)),
            ),
            "sun": (square((5, 12.5, 3.1), (0, 0, 0), 0.25), Lamp(9000)),
        },
    ),
    "bulb": HardScene(
        "a lamp in a thick glass shell, its hollow off the middle: all light is a caustic",
        depth=24, eye=(-1.2, 1.5, 1.9), at=(0.25, 1.1, -1), fov=70,
        shapes={
            "room": (
                quads(
                    *inside(*ROOM, "yYz"),
                    *sides((-1.5, 0, -1.5), (-0.7, 0.8, -0.7), WALLS, 0.4, (-1.1, 0, -1.1)),
                ),
                WHITE,
            ),
            "left": (quads(*inside(*ROOM, "x")), Diffuse((0.65, 0.2, 0.15))),
            "right": (quads(*inside(*ROOM, "XZ")), Diffuse((0.2, 0.5, 0.25))),
            "mirror": (
                quads(((1.95, 0.4, 1.2), (1.95, 0.4, -1.4), (1.8, 2.4, -1.4), (1.8, 2.4, 1.2))),
                Mirror((0.9, 0.9, 0.9)),
            ),
            "lamp": (ball(2, (0, 1.3, -0.6), 0.06), Lamp(150)),
            "shell": (ball(5, (0, 1.3, -0.6), 0.4), GLASS),
            "hollow": (ball(5, (0.03, 1.36, -0.58), 0.26, True), GLASS),
        },
    ),
    "lens": HardScene(
        "a glass ball and a prism under a small lamp, their caustics directly and in a mirror",
        depth=24, eye=(0.2, 2.3, 4.2), at=(0, 0.55, -0.2), fov=46,
        shapes={
            "floor": (quads(floor(-3, 3, -2, 3, 0), *inside((-3, 0, -2), (3, 3, 3), "z")), WHITE),
            "mirror": (
                quads(((-1.9, 0.1, -1.9), (1.9, 0.1, -1.9), (1.9, 1.9, -1.5), (-1.9, 1.9, -1.5))),
                Mirror((0.9, 0.9, 0.9)),
            ),
            "ball": (ball(6, (-0.75, 0.8, 0.1), 0.55), GLASS),
            "prism": (prism(((0.3, 0.35), (1.2, 0.35), (0.75, 1.13)), -0.6, 0.7), Glass(1.7)),
            "lamp": (square((0.6, 4, 1.4), (0, 0.5, 0), 0.16), Lamp(1500)),
        },
    ),
    "flat_pool": HardScene(
        "a point light over flat water over a floor: no path from the camera finds it",
        depth=4, eye=(0.6, 2.6, 2.4), at=(0.2, -1, 0), fov=45, point=((0, 1, 0), 6),
        shapes={
            "water": (quads(floor(-20, 20, -20, 20, 0)), Glass(1.33)),
            "floor": (quads(floor(-20, 20, -20, 20, -1)), Diffuse((0.5, 0.5, 0.5))),
        },
    ),
    "door": HardScene(
        "a room lit only through a door ajar, nothing sharp in it",
        depth=24, eye=(-1.3, 1.5, 1.85), at=(0.35, 0.95, -1), fov=68,
        shapes={
            "room": (
                quads(
                    *inside(*DARK, "yYxZ"), *inside((2.1, 0, -2), (5, 2.6, 2), "yYXzZ"),
                    *sides((2, 0, -2), (2.1, 2.6, -0.6), "xX"),
                    *sides((2, 0, 0.4), (2.1, 2.6, 2), "xX"),
                    *sides((2, 2, -0.6), (2.1, 2.6, 0.4), "xXy"),
                    *sides((2, 0, -2), (2.1, 2, -0.6), "Z"), *sides((2, 0, 0.4), (2.1, 2, 2), "z"),
                    floor(2, 2.1, -0.6, 0.4, 0),
                ),
                WHITE,
            ),
            "back": (quads(*inside(*DARK, "z")), Diffuse((0.25, 0.4, 0.65))),
            "leaf": (
                quads(
                    *sides((2, 0.005, -0.595), (2.05, 1.99, 0.395), WALLS, DOOR, (2, 0, -0.595))
                ),
                Diffuse((0.5, 0.3, 0.15)),
            ),
            "things": (
                quads(
                    *sides((-1.2, 0, -1.4), (-0.4, 0.7, -0.7), WALLS, 0.5, (-0.8, 0, -1)),
                    *sides((0.3, 0, -1.5), (0.9, 1.4, -0.9), WALLS, -0.3, (0.6, 0, -1.2)),
                    *sides((0.6, 0, 0), (1.1, 0.45, 0.5), WALLS, 0.2, (0.8, 0, 0.2)),
                ),
                Diffuse((0.6, 0.6, 0.3)),
            ),
            "lamp": (square((3.6, 2.55, 0.9), (3.6, 0, 0.9), 0.6), Lamp(60)),
        },
    ),
}  # fmt: skip


def flat_pool_floor(n: int = 400) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Radiance of the floor of `flat_pool`, in the water, by the distance from below the lamp [m].

    The energy of a cone of rays, spread over the ring of the floor that it lights.
    """
    index, h1, h2, intensity, albedo = 1.33, 1.0, 1.0, 6.0, 0.5
    t1 = np.linspace(1e-4, 1.45, n)
    t2 = np.arcsin(np.sin(t1) / index)
    s = (np.sin(t1 - t2) / np.sin(t1 + t2)) ** 2
    p = (np.tan(t1 - t2) / np.tan(t1 + t2)) ** 2
    rho = h1 * np.tan(t1) + h2 * np.tan(t2)
    spread = h1 / np.cos(t1) ** 2 + h2 * np.cos(t1) / (index * np.cos(t2) ** 3)
    irradiance = intensity * (1 - (s + p) / 2) * np.sin(t1) / (rho * spread)
    return rho, albedo / np.pi * irradiance


def write(name: str, folder: Path) -> Path:
    """Write a scene as `NAME/scene.xml` and `NAME/scene.scn`, with its meshes; return the former's
    path."""
    scene, target = SCENES[name], folder / name
    target.mkdir(parents=True, exist_ok=True)
    for part, ((vertices, faces), _) in scene.shapes.items():
        write_ply(target / f"{part}.ply", vertices, faces)
    (target / "scene.scn").write_text(luxcore_text(scene), "utf-8")
    path = target / "scene.xml"
    path.write_text(mitsuba_text(scene), "utf-8")
    return path


def mitsuba_text(scene: HardScene) -> str:
    """A scene as Mitsuba XML; the variable `integrator` may be set when it is loaded."""
    origin, target = (", ".join(map(str, point)) for point in (scene.eye, scene.at))
    lines = [
        '<scene version="3.0.0"><default name="integrator" value="path"/>',
        f'<integrator type="$integrator"><integer name="max_depth" value="{scene.depth}"/>'
        '<integer name="rr_depth" value="8"/></integrator>',
        f'<sensor type="perspective"><float name="fov" value="{scene.fov}"/>',
        f'<transform name="to_world"><lookat origin="{origin}" target="{target}" up="0, 1, 0"/>'
        '</transform><sampler type="independent"/>',
        f'<film type="hdrfilm"><integer name="width" value="{SIZE}"/>'
        f'<integer name="height" value="{SIZE}"/><string name="pixel_format" value="rgb"/>'
        '<rfilter type="box"/></film></sensor>',
    ]
    if scene.sky:
        lines.append(f'<emitter type="constant">{_rgb("radiance", (scene.sky,) * 3)}</emitter>')
    if scene.point:
        place, intensity = scene.point
        at = f'<point name="position" value="{", ".join(map(str, place))}"/>'
        lines.append(f'<emitter type="point">{at}{_rgb("intensity", (intensity,) * 3)}</emitter>')
    for part, (_, surface) in scene.shapes.items():
        file = f'<string name="filename" value="{part}.ply"/>'
        flat = '<boolean name="face_normals" value="true"/>'
        lines.append(f'<shape type="ply" id="{part}">{file}{flat}{_mitsuba(surface)}</shape>')
    return "\n".join([*lines, "</scene>", ""])


def _rgb(name: str, colour: Point) -> str:
    return f'<rgb name="{name}" value="{", ".join(map(str, colour))}"/>'


def _mitsuba(surface: Surface) -> str:
    if isinstance(surface, Glass):
        index = f'<float name="int_ior" value="{surface.index}"/>'
        return f'<bsdf type="dielectric">{index}<float name="ext_ior" value="1"/></bsdf>'
    if isinstance(surface, Mirror):
        bare = '<string name="material" value="none"/>'
        inner = (
            f'<bsdf type="conductor">{bare}{_rgb("specular_reflectance", surface.colour)}</bsdf>'
        )
    else:
        colour = surface.colour if isinstance(surface, Diffuse) else (0.0, 0.0, 0.0)
        inner = f'<bsdf type="diffuse">{_rgb("reflectance", colour)}</bsdf>'
    text = f'<bsdf type="twosided">{inner}</bsdf>'
    if isinstance(surface, Lamp):
        text += f'<emitter type="area">{_rgb("radiance", (surface.radiance,) * 3)}</emitter>'
    return text


def luxcore_text(scene: HardScene) -> str:
    """Return a scene as LuxCore's properties. Its rows begin a pixel lower than the others': the
    window is moved by a pixel."""
    step = 2 / SIZE
    lines = [
        "scene.camera.type = perspective",
        f"scene.camera.lookat.orig = {_blanks(scene.eye)}",
        f"scene.camera.lookat.target = {_blanks(scene.at)}",
        "scene.camera.up = 0 1 0",
        f"scene.camera.fieldofview = {scene.fov}",
        f"scene.camera.screenwindow = -1 1 {-1 - step} {1 - step}",
        "scene.camera.cliphither = 0.01",
        "scene.camera.autofocus.enable = 0",
    ]
    if scene.sky:
        sky = _blanks((scene.sky,) * 3)
        lines += ["scene.lights.sky.type = constantinfinite", f"scene.lights.sky.color = {sky}"]
    if scene.point:
        place, intensity = scene.point
        lamp = "scene.lights.point"
        lines += [
            f"{lamp}.type = point", f"{lamp}.position = {_blanks(place)}", f"{lamp}.color = 1 1 1",
            f"{lamp}.gain = {_blanks((4 * np.pi * intensity,) * 3)}", f"{lamp}.power = 0",
            f"{lamp}.efficency = 0",
        ]  # fmt: skip
    for part, (_, surface) in scene.shapes.items():
        material_key, object_key = f"scene.materials.{part}", f"scene.objects.{part}"
        lines += [f"{material_key}.{line}" for line in _luxcore(surface)]
        lines += [f"{object_key}.ply = {part}.ply", f"{object_key}.material = {part}"]
    return "\n".join([*lines, ""])


def _luxcore(surface: Surface) -> list[str]:
    if isinstance(surface, Glass):
        index = [f"interiorior = {surface.index}", "exteriorior = 1"]
        return ["type = glass", "kr = 1 1 1", "kt = 1 1 1", *index]
    if isinstance(surface, Mirror):
        return ["type = mirror", f"kr = {_blanks(surface.colour)}"]
    if isinstance(surface, Diffuse):
        return ["type = matte", f"kd = {_blanks(surface.colour)}"]
    shines = f"emission.gain = {_blanks((surface.radiance,) * 3)}"
    spent = ["emission.power = 0", "emission.efficency = 0"]
    return ["type = matte", "kd = 0 0 0", "emission = 1 1 1", shines, *spent]


def _blanks(values: Point) -> str:
    return " ".join(f"{value:g}" for value in values)


if __name__ == "__main__":
    for scene_name in SCENES:
        print(write(scene_name, Path(sys.argv[1])))
