"""A dataset in BOP's form: twenty objects in a bin, seen by a robot, with masks and poses."""

import colorsys
from argparse import ArgumentParser
from pathlib import Path

import numpy as np

import clpt
from clpt import dataset
from clpt import transforms as tf
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.scene.integrators import Path as PathTracer

PICTURES, OBJECTS = 3, 20
HALF, WALL, HEIGHT = 0.16, 0.008, 0.12  # of the bin [m]
PARTS = {"nut": 0.022, "bolt": 0.03, "pipe": 0.026, "ball": 0.02}  # radii around them [m]


def part(name: str, place: np.ndarray, number: int, rng: np.random.Generator) -> shapes.Shape:
    """Return an object of a kind, of metal or plastic, at a place (4, 4)."""
    color = colorsys.hsv_to_rgb(rng.random(), 0.8, 0.7)
    metal = materials.RoughConductor(metal="aluminium", alpha=rng.uniform(0.15, 0.4))
    paint = metal if rng.random() < 0.4 else materials.Plastic(diffuse_reflectance=color)
    given = {"material": paint, "name": f"{name}.{number:03d}"}
    if name == "ball":
        return shapes.Sphere(center=place[:3, 3], radius=PARTS[name], **given)
    sizes = {
        "nut": (0.016, 0.014, 0.007),
        "bolt": (0.006, 0.006, 0.028),
        "pipe": (0.01, 0.01, 0.02),
    }
    return shapes.Cube(to_world=place @ tf.scale(sizes[name]), **given)


def dropped(at: np.ndarray, radius: float, others: list[tuple[np.ndarray, float]]) -> float:
    """Return the height at which a ball that falls over (x, y) meets the floor or others."""
    heights = [radius]
    for middle, other in others:
        beside, reach = np.sum((middle[:2] - at) ** 2), radius + other
        if beside < reach * reach:
            heights.append(middle[2] + np.sqrt(reach * reach - beside))
    return max(heights)


def make_scene(index: int, rng: np.random.Generator) -> Scene:
    """Return a bin with objects that were dropped one after the other."""
    grey = materials.Diffuse(reflectance=0.25)
    content = [shapes.Rectangle(to_world=tf.scale(2.0), material=grey)]
    for turn in range(4):
        side = tf.rotate([0, 0, 1], 90 * turn) @ tf.translate([HALF, 0, HEIGHT / 2])
        size = tf.scale([WALL / 2, HALF + WALL / 2, HEIGHT / 2])
        content.append(shapes.Cube(to_world=side @ size, material=materials.Plastic()))
    inside: list[tuple[np.ndarray, float]] = []
    for number in range(OBJECTS):
        name = rng.choice([*PARTS])
        at = rng.uniform(-0.11, 0.11, 2)
        middle = np.array([*at, dropped(at, PARTS[name], inside)])
        inside.append((middle, PARTS[name]))
        turn = tf.rotate(rng.normal(size=3), rng.uniform(0, 360))
        content.append(part(name, tf.translate(middle) @ turn, number, rng))
    eye = [*rng.uniform(-0.12, 0.12, 2), rng.uniform(0.55, 0.7)]
    lamp = tf.translate([0.3, 0.2, 1.2]) @ tf.rotate([1, 0, 0], 180) @ tf.scale(0.25)
    return Scene(
        camera=cameras.Perspective(to_world=tf.look_at(eye, [0, 0, 0.03], [0, 1, 0]), fov=40),
        shapes=[*content, shapes.Rectangle(to_world=lamp, emission=lights.Area(radiance=9.0))],
        lights=[lights.Constant(radiance=0.25)],
        film=Film(size=(192, 144), mode="rgb"),
        integrator=PathTracer(max_depth=5, light_paths=0),
    )


arguments = ArgumentParser(description=__doc__)
arguments.add_argument("folder", type=Path, nargs="?", default=".", help="gets the dataset")
folder = arguments.parse_args().folder
report = dataset.generate(make_scene, PICTURES, folder / "bin", form="bop", spp=32)
print(f"{report.written} pictures written to {folder / 'bin'}, {report.present} were there")
rows = []
for picture in dataset.pictures(make_scene, range(PICTURES), spp=32):
    hues = np.float32(
        [(0, 0, 0), *(colorsys.hsv_to_rgb(i * 0.618 % 1, 0.8, 0.9) for i in range(99))]
    )
    rows.append(np.hstack([picture.image, hues[picture.truth.instances] ** 2.2]))
clpt.write_image(folder / "bin_picking.png", np.vstack(rows))
print(f"wrote {folder / 'bin_picking.png'}")
