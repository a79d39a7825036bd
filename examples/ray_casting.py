"""Ray queries on a mesh: sun and sky over a town, and how long trimesh takes for the same rays."""

import time
from argparse import ArgumentParser
from pathlib import Path

import numpy as np
import pyopencl as cl
import trimesh
from pyopencl.array import to_device

import clpt

WIDTH, HEIGHT, SKY_RAYS = 640, 400, 32
SUN = np.float32([0.55, -0.45, 0.7])


def town(rng: np.random.Generator, side: int = 24) -> trimesh.Trimesh:
    """Houses on a plane, higher ones in the middle."""
    houses = [trimesh.creation.box((4 * side, 4 * side, 0.2))]
    for x, y in np.stack(np.meshgrid(*[np.arange(side) - side / 2] * 2), -1).reshape(-1, 2):
        height = rng.uniform(0.3, 1.2) + 5 * rng.random() ** 2 * np.exp(-(x * x + y * y) / 30)
        house = trimesh.creation.box((*rng.uniform(0.45, 0.8, 2), height))
        houses.append(house.apply_translation((x, y, height / 2)))
    return trimesh.util.concatenate(houses)


def camera_rays(origin, target, fov: float):
    """A ray through the middle of each pixel: origins and directions, (n, 3) float32."""
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5 - WIDTH / 2, np.arange(HEIGHT) + 0.5 - HEIGHT / 2)
    plane = np.stack([-x, -y, np.full_like(x, WIDTH / 2 / np.tan(np.radians(fov) / 2))], -1)
    rotation = clpt.transforms.look_at(origin, target, [0, 0, 1])[:3, :3]
    directions = plane.reshape(-1, 3) @ rotation.T
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.float32(np.tile(origin, (len(directions), 1))), np.float32(directions)


def seconds(function, repeats: int = 3) -> float:
    """What one of some runs takes in the mean."""
    start = time.perf_counter()
    for _ in range(repeats):
        function()
    return (time.perf_counter() - start) / repeats


arguments = ArgumentParser(description=__doc__)
arguments.add_argument("folder", type=Path, nargs="?", default=".", help="gets the picture")
folder = arguments.parse_args().folder
rng = np.random.default_rng(7)
mesh = town(rng)
origins, directions = camera_rays([-13, -20, 12], [0.3, 0, 1.2], 42)

context = cl.create_some_context(interactive=False)
queue = cl.CommandQueue(context)
accel = clpt.Accel(queue, mesh.vertices, mesh.faces)
hits = accel.intersect(origins, directions)  # numpy in, numpy out

met = np.isfinite(hits.t)
normals = np.float32(mesh.face_normals[hits.primitive[met]])
points = origins[met] + hits.t[met, None] * directions[met] + 1e-4 * normals
on_device = to_device(queue, points)  # device arrays in, device arrays out: nothing is waited for
lit = ~accel.occluded(points, np.broadcast_to(SUN, points.shape)).astype(bool)
light = 1.5 * np.float32([1.0, 0.85, 0.6]) * (lit * (normals @ SUN).clip(0))[:, None]
covered = []
for _ in range(SKY_RAYS):
    ball = rng.normal(size=points.shape)  # a normal plus a point of the sphere: cosine-weighted
    around = normals + ball / np.linalg.norm(ball, axis=1, keepdims=True)
    covered.append(accel.occluded(on_device, to_device(queue, np.float32(around)), t_max=8.0))
sky = 1 - np.mean([array.get() for array in covered], axis=0)
picture = np.tile(np.float32([0.3, 0.5, 0.85]), (len(met), 1))
picture[met] = 0.6 * (light + np.float32([0.3, 0.42, 0.65]) * sky[:, None])
clpt.write_image(folder / "ray_casting.png", picture.reshape(HEIGHT, WIDTH, 3))
print(f"wrote {folder / 'ray_casting.png'}")

theirs = mesh.ray.intersects_first(origins, directions)
ours = seconds(lambda: accel.intersect(origins, directions))
other = seconds(lambda: mesh.ray.intersects_first(origins, directions))
print(f"{np.mean(theirs == hits.primitive):.4%} of {len(met)} rays meet the same triangle")
print(f"clpt {ours * 1e3:.0f} ms; {type(mesh.ray).__module__} {other / ours:.1f} times as long")
