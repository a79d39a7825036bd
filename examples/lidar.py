"""A lidar that turns on a car in a street: returns with intensity, drawn as seen from above."""

from argparse import ArgumentParser
from pathlib import Path

import numpy as np

import clpt
from clpt import transforms as tf
from clpt.instruments import echoes
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.scene.integrators import Direct

CHANNELS, COLUMNS, SECTORS = 32, 60, 12  # of a sector; sectors of a turn
TURN, SPEED = 0.1, 10.0  # [s] of a turn, and of the car [m/s]
REACH, PIXELS = 24.0, 480  # [m] from the middle of the picture, and its side


def box(center, size, material) -> shapes.Cube:
    """Return a box around `center` with sides `size` [m]."""
    place = tf.translate(center) @ tf.scale(np.asarray(size) / 2)
    return shapes.Cube(to_world=place, material=material)


def street(rng: np.random.Generator) -> list[shapes.Shape]:
    """Return houses, parked cars and trees on both sides of a street along z."""
    asphalt, leaves = (materials.Diffuse(reflectance=r) for r in (0.12, 0.45))
    ground = tf.rotate([1, 0, 0], -90) @ tf.scale(100)
    found = [shapes.Rectangle(to_world=ground, material=asphalt)]
    for side in (-1, 1):
        z = -60.0
        while z < 60:
            width, height = rng.uniform(8, 16), rng.uniform(6, 15)
            plaster = materials.Diffuse(reflectance=rng.uniform(0.3, 0.7))
            middle = [side * rng.uniform(14, 16), height / 2, z + width / 2]
            found.append(box(middle, [10, height, width], plaster))
            z += width + rng.choice([0.0, 3.0])
        for z in np.arange(-55, 55, 9.0) + rng.uniform(0, 5, 13):
            paint = materials.Plastic(diffuse_reflectance=rng.uniform(0.05, 0.6))
            found.append(box([side * 5, 0.6, z], [1.7, 0.8, 4.2], paint))
            found.append(box([side * 5, 1.2, z], [1.5, 0.5, 2.0], paint))
            tree = [side * 7.5, 4.0, z + 4.5]
            found.append(shapes.Sphere(center=tree, radius=1.3, material=leaves))
            found.append(box([tree[0], 1.5, tree[2]], [0.3, 3.0, 0.3], asphalt))
    return found


def sector(number: int) -> tuple[np.ndarray, np.ndarray]:
    """Return where the lidar is meanwhile (3,), and its directions (CHANNELS, COLUMNS, 3)."""
    turns = (number + np.arange(COLUMNS) / COLUMNS) / SECTORS
    up, around = np.radians(np.linspace(10, -25, CHANNELS))[:, None], 2 * np.pi * turns
    across, ahead = np.cos(up) * np.sin(around), np.cos(up) * np.cos(around)
    directions = np.stack([across, 0 * around + np.sin(up), ahead], axis=-1)
    return np.array([1.5, 1.9, SPEED * TURN * (number + 0.5) / SECTORS]), directions


arguments = ArgumentParser(description=__doc__)
arguments.add_argument("folder", type=Path, nargs="?", default=".", help="gets the picture")
file = arguments.parse_args().folder / "lidar.png"
film = Film(size=(COLUMNS, CHANNELS), mode="rgb", time_bins=700, time_max=350.0)  # 7.5 cm each
houses = street(np.random.default_rng(4))
points, light, renderer = [], [], None
for number in range(SECTORS):
    place, directions = sector(number)
    rays = directions.reshape(-1, 3)
    camera = cameras.Rays(origins=np.broadcast_to(place, rays.shape), directions=rays)
    lamp = lights.Point(position=place, intensity=1.0)
    scene = Scene(camera=camera, shapes=houses, lights=[lamp], film=film, integrator=Direct())
    renderer = renderer or clpt.Renderer(scene)
    renderer.update(scene=scene)
    renderer.run(4)
    signal = renderer.times()[:, :, :-1, 1]  # (CHANNELS, COLUMNS, bins), one of three channels
    ranges, intensities = echoes(signal, film.time_edges)
    points.append((place + ranges * directions)[np.isfinite(ranges[..., 0])])
    light.append((intensities * ranges**2)[np.isfinite(ranges)])  # as if all were equally far
points, light = np.concatenate(points), np.concatenate(light)[:, None]
at = np.round((points[:, [2, 0]] / REACH + 1) / 2 * (PIXELS - 1)).astype(int)
seen = ((at >= 0) & (at < PIXELS)).all(axis=1)
height = np.clip(points[:, 1:2] / 8, 0, 1)
colors = ((1 - height) * [0.2, 0.6, 1.0] + height * [1.0, 0.5, 0.1]) * (0.3 + 6 * light)
picture = np.full((PIXELS, PIXELS, 3), 0.02, np.float32)
np.maximum.at(picture, tuple(at[seen].T), np.float32(colors[seen]))
clpt.write_image(file, picture)
print(f"{len(points):,} returns of {SECTORS * COLUMNS * CHANNELS:,} beams")
print(f"wrote {file}")
