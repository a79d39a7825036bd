"""An office by day and by night: lux on its desks by a luminaire's .ies file, glare of its window.

Without a file the example measures a panel of its own and writes panel.ies first.
"""

import dataclasses
from argparse import ArgumentParser
from pathlib import Path

import numpy as np

from clpt import instruments
from clpt import transforms as tf
from clpt.formats import ies
from clpt.scene import Scene, cameras, lights, materials, shapes

WIDTH, HEIGHT, DEPTH = 6.0, 2.8, 4.0  # [m]
DESK = 0.75  # height of the measured plane [m]


def wall(at, turn, size, reflectance, **kind) -> shapes.Rectangle:
    """Return a wall around `at` whose front, +z, is turned by `turn`; size: width, height [m]."""
    place = tf.translate(at) @ turn @ tf.scale([size[0] / 2, size[1] / 2, 1.0])
    paint = materials.Diffuse(reflectance=reflectance)
    return shapes.Rectangle(to_world=place, material=paint, **kind)


def office() -> list[shapes.Shape]:
    """Return walls, ceiling, floor and four desks; the window is in the wall at x = 0."""
    middle, sides = [WIDTH / 2, HEIGHT / 2, DEPTH / 2], np.diag([WIDTH, HEIGHT, DEPTH]) / 2
    parts = []
    for axis, turn, size in (
        (0, tf.rotate([0, 1, 0], 90), (DEPTH, HEIGHT)),
        (1, tf.rotate([1, 0, 0], -90), (WIDTH, DEPTH)),
        (2, np.eye(4), (WIDTH, HEIGHT)),
    ):
        back = turn @ tf.rotate([0, 1, 0], 180) if axis != 1 else tf.rotate([1, 0, 0], 90)
        for sign, facing in ((-1, turn), (1, back)):
            share = (0.6, 0.2 if sign < 0 else 0.8, 0.6)[axis]
            parts.append(wall(middle + sign * sides[axis], facing, size, share))
    wood = materials.Diffuse(reflectance=(0.45, 0.3, 0.18))
    for x in (1.6, 4.4):
        for z in (1.1, 2.9):
            top = tf.translate([x, 0.7, z]) @ tf.scale([0.8, 0.02, 0.4])
            parts.append(shapes.Cube(to_world=top, material=wood))
    return parts


arguments = ArgumentParser(description=__doc__)
arguments.add_argument("folder", type=Path, nargs="?", default=".", help="gets the files")
arguments.add_argument("ies", type=Path, nargs="?", help="the luminaire")
given = arguments.parse_args()
camera = cameras.Perspective()  # of no matter to instruments
if given.ies is None:
    given.ies = given.folder / "panel.ies"
    panel = wall(
        [0, 0, 0], tf.rotate([1, 0, 0], 90), (0.6, 0.6), 0.0, emission=lights.Area(nits=2600.0)
    )
    alone = Scene(camera=camera, shapes=[panel])
    seen = instruments.goniophotometer(alone, np.arange(0.0, 181.0, 7.5), [0.0], rays=64)
    instruments.write_photometry(given.ies, seen, "a panel of 60 cm")
    print(f"{seen.lumens:.0f} lm in {given.ies}")
lamp = lights.Goniometric(**ies.parameters(given.ies))
lamps = [
    dataclasses.replace(lamp, to_world=tf.translate([x, HEIGHT - 0.05, z]))
    for x in (1.0, 3.0, 5.0)
    for z in (1.1, 2.9)
]
night = Scene(camera=camera, shapes=office(), lights=lamps)
x, z = np.meshgrid(np.linspace(0.1, WIDTH - 0.1, 60), np.linspace(0.1, DEPTH - 0.1, 40))
lux = instruments.measure(night, "illuminance", np.stack([x, 0 * x + DESK, z], -1), samples=512)
file = given.folder / "office.png"
instruments.write_false_color(file, lux.values, lux.unit, contours=[400, 500, 600])
mean = lux.values.mean()
print(f"{mean:.0f} lx in the mean, evenness {lux.values.min() / mean:.2f}; wrote {file}")

sky = lights.Area(nits=4000.0)
window = wall([0.01, 1.6, DEPTH / 2], tf.rotate([0, 1, 0], 90), (2.4, 1.4), 0.0, emission=sky)
day = dataclasses.replace(night, shapes=[*night.shapes, window])
eye = tf.look_at([3.2, 1.2, 1.1], [0.0, 1.3, 1.6], [0, 1, 0])
seen = instruments.glare(day, eye, height=64, samples=64)
print(f"by day DGP {seen.dgp:.2f}, UGR {seen.ugr:.0f}, {seen.illuminance:.0f} lx at the eye")
