"""Pictures of shapes, on which a chart of uv shows where the corners are."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from clpt.scene import shapes
from clpt.scene.materials import Diffuse, TwoSided
from clpt.scene.textures import Bitmap, MeshAttribute
from clpt.transforms import rotate, scale, translate

from .studio import SMALL, Picture, arc, knob, lathe, near_camera, studio

UPRIGHT = rotate([1, 0, 0], -90)  # z becomes y


def chart() -> TwoSided:
    """u as red, v as green, in eight by eight fields."""
    y, x = (np.mgrid[0:256, 0:256] + 0.5) / 256.0
    odd = (np.floor(x * 8) + np.floor(y * 8)) % 2
    image = np.stack([x, 1.0 - y, np.full_like(x, 0.25)], -1) * (0.45 + 0.4 * odd[..., None])
    paint = Diffuse(reflectance=Bitmap(image=image.astype(np.float32), filter="nearest"))
    return TwoSided(front=paint)


def alone(caption: str, make: Callable[[], Sequence[shapes.Shape]]) -> Picture:
    """Shapes in the studio."""
    return Picture(caption, lambda: studio(make(), size=SMALL, camera=near_camera()))


def meshes() -> list[shapes.Shape]:
    """The same ball, coarse: flat, and with smooth normals."""
    ball = lathe([*arc(0.0, 0.0, 0.7, -90.0, 90.0, 8)], around=12)
    parts = {name: ball[name] for name in ("vertices", "faces")}
    return [
        shapes.Mesh(
            **parts,
            normals=normals,
            material=Diffuse(reflectance=(0.7, 0.45, 0.2)),
            to_world=translate([x, 0.7, 0.0]),
        )
        for x, normals in ((-0.78, None), (0.78, ball["normals"]))
    ]


def particles() -> list[shapes.Shape]:
    """Four hundred balls on a spiral, of growing size."""
    n = np.arange(400)
    turn, radius = n * 2.39996, 1.25 * np.sqrt(n / 400.0)
    size = 0.035 + 0.04 * radius
    height = size + 0.75 * np.exp(-4.0 * radius**2)
    centers = np.stack([radius * np.cos(turn), height, radius * np.sin(turn)], -1)
    colours = 0.42 + 0.36 * np.cos(n[:, None] * 0.016 + np.array([0.0, 2.1, 4.2]))
    return [
        shapes.Spheres(
            centers=centers.astype(np.float32),
            radii=size.astype(np.float32),
            attributes={"vertex_color": colours.astype(np.float32)},
            material=Diffuse(reflectance=MeshAttribute(name="vertex_color")),
        )
    ]


def strands() -> list[shapes.Shape]:
    """Grass: strands of four points that bend to one side."""
    random = np.random.default_rng(11)
    count = 500
    root = np.stack(
        [random.uniform(-1.2, 1.2, count), np.zeros(count), random.uniform(-0.8, 0.8, count)], -1
    )
    tall = random.uniform(0.6, 1.3, (count, 1, 1))
    lean = random.normal([0.35, 0.0, 0.0], [0.2, 0.02, 0.2], (count, 1, 3))
    t = np.linspace(0.0, 1.0, 6)[:, None]
    points = root[:, None] + tall * (np.array([0.0, 1.0, 0.0]) * t * (1.0 - 0.25 * t) + lean * t**2)
    width = np.broadcast_to(0.018 * (1.0 - 0.85 * t), (count, 6, 1))
    return [
        shapes.Curves(
            points=np.concatenate([points, width], -1).reshape(-1, 4),
            lengths=[6] * count,
            material=Diffuse(reflectance=(0.16, 0.36, 0.05)),
        )
    ]


def distances() -> list[shapes.Shape]:
    """A sheet that parts space in two, as thick as a wall, in a ball."""
    x, y, z = np.meshgrid(*[np.linspace(-1.0, 1.0, 40)] * 3, indexing="ij")
    a, b, c = (5.5 * v for v in (x, y, z))
    sheet = np.sin(a) * np.cos(b) + np.sin(b) * np.cos(c) + np.sin(c) * np.cos(a)
    wall, ball = np.abs(sheet) / 5.5 - 0.06, np.sqrt(x * x + y * y + z * z) - 0.95
    return [
        shapes.SdfGrid(
            values=np.maximum(wall, ball).astype(np.float32),
            material=TwoSided(front=Diffuse(reflectance=(0.5, 0.28, 0.12))),
            to_world=translate([-0.85, 0.0, -0.85]) @ scale(1.7),
        )
    ]


def instances() -> list[shapes.Shape]:
    """A hundred knobs, of which one is held."""
    group = shapes.Group(shapes=(knob(Diffuse(reflectance=(0.55, 0.2, 0.05))),))
    return [
        shapes.Instance(
            group=group,
            to_world=translate([i * 0.42, 0.0, 0.7 - j * 0.42])
            @ scale(0.2 + 0.045 * ((i + 2 * j) % 4)),
        )
        for i in range(-5, 6)
        for j in range(9)
    ]


def tilted(shape: type[shapes.Shape], size: float, **more: object) -> list[shapes.Shape]:
    place = translate([0.0, 0.85, 0.0]) @ rotate([0, 1, 0], -32) @ rotate([1, 0, 0], -18)
    return [shape(material=chart(), to_world=place @ scale(size), **more)]  # type: ignore[arg-type]


SHAPES = {
    "mesh": alone("Triangles, flat; the same with normals of the vertices.", meshes),
    "sphere": alone(
        "u is red, v green.",
        lambda: [
            shapes.Sphere(material=chart(), to_world=translate([0, 0.8, 0]) @ UPRIGHT @ scale(0.8))
        ],
    ),
    "spheres": alone("Four hundred, each of its own size and colour.", particles),
    "rectangle": alone("u is red, v green.", lambda: tilted(shapes.Rectangle, 0.78)),
    "disk": alone("u is red, v green.", lambda: tilted(shapes.Disk, 0.82)),
    "cube": alone(
        "u is red, v green, on each side.",
        lambda: [
            shapes.Cube(
                material=chart(),
                to_world=translate([0, 0.62, 0]) @ rotate([0, 1, 0], 33) @ scale(0.62),
            )
        ],
    ),
    "cylinder": alone(
        "u is red, v green. Both ends are open.",
        lambda: [
            shapes.Cylinder(
                p0=(-0.95, 0.58, -0.35), p1=(0.85, 0.58, 0.45), radius=0.58, material=chart()
            )
        ],
    ),
    "curves": alone("Five hundred strands of six points.", strands),
    "sdf_grid": alone("A gyroid within a ball, on 40 x 40 x 40 points.", distances),
    "instance": alone("A hundred instances of one knob.", instances),
}
