"""A turntable: the camera goes once around a thing that an image of a studio (HDRI) lights.

It writes turntable.png, a sheet of all frames, and turntable.mp4, which needs
`pip install 'clpt[video]'`.
"""

import dataclasses
import sys
from argparse import ArgumentParser
from pathlib import Path

import numpy as np
from PIL import Image

import clpt
from clpt.scene import Film, Scene, cameras, lights, materials, shapes
from clpt.transforms import look_at

FRAMES, SAMPLES, SIZE = 12, 64, 208


def ring() -> shapes.Mesh:
    """Return a twisted ring with four edges."""
    t, s = np.meshgrid(*(np.arange(n) * 2 * np.pi / n for n in (400, 120)), indexing="ij")
    thick = 0.42 * (1 + 0.16 * np.cos(4 * s + 5 * t))
    away = 1 + thick * np.cos(s)
    vertices = np.stack([away * np.cos(t), thick * np.sin(s), away * np.sin(t)], -1).reshape(-1, 3)
    a = np.arange(t.size).reshape(t.shape)
    b, c = np.roll(a, -1, 0), np.roll(a, -1, 1)
    d = np.roll(b, -1, 1)
    faces = [np.stack(each, -1).reshape(-1, 3) for each in ((a, c, d), (a, d, b))]
    return shapes.Mesh(vertices=vertices, faces=np.concatenate(faces), normals="smooth")


def studio() -> np.ndarray:
    """Return a grey image (h, w, 3) in latitude and longitude with two softboxes."""
    y, x = np.mgrid[0:128, 0:256] / 128.0  # half turns: from the top, around
    image = np.full((128, 256, 3), 0.4) * (1.2 - y)[..., None]
    image[(np.abs(x - 0.6) < 0.16) & (np.abs(y - 0.22) < 0.1)] = [9.0, 8.5, 7.5]
    image[(np.abs(x - 1.5) < 0.08) & (np.abs(y - 0.2) < 0.12)] = [3.0, 3.6, 4.6]
    return np.float32(image)


arguments = ArgumentParser(description=__doc__)
arguments.add_argument("folder", type=Path, nargs="?", default=".", help="gets the files")
arguments.add_argument("mesh", nargs="?", help="a mesh file; without it a ring is shown")
given = arguments.parse_args()
folder, mesh = given.folder, clpt.load(given.mesh).shapes[0] if given.mesh else ring()
gold = materials.RoughConductor(metal="gold", alpha=0.12)
corners = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
middle, radius = np.add(*corners) / 2, np.linalg.norm(np.subtract(*corners)) / 2
scene = Scene(
    camera=cameras.Perspective(fov=30),
    shapes=[dataclasses.replace(mesh, material=gold)],
    lights=[lights.Envmap(image=studio())],
    film=Film(width=SIZE, height=SIZE, mode="rgb"),
)
frames = []
with clpt.Renderer(scene) as renderer:
    for angle in np.arange(FRAMES) * 2 * np.pi / FRAMES:
        origin = middle + 3.4 * radius * np.array([np.sin(angle), 0.6, np.cos(angle)])
        pose = look_at(origin, middle, [0, 1, 0])
        renderer.update(camera=dataclasses.replace(scene.camera, to_world=pose))
        renderer.run(SAMPLES)
        frames.append(Image.fromarray(renderer.resolve(tone="neutral").get()[..., :3]))

picture, video = folder / "turntable.png", folder / "turntable.mp4"
rows = [np.hstack(frames[i : i + 6]) for i in range(0, FRAMES, 6)]
Image.fromarray(np.vstack(rows)).save(picture)
print(f"wrote {picture}")
try:
    from imageio_ffmpeg import write_frames
except ImportError:
    sys.exit("a video needs pip install 'clpt[video]'")
encoder = write_frames(str(video), (SIZE, SIZE), fps=12)
encoder.send(None)  # starts it
for frame in frames:
    encoder.send(frame.tobytes())
encoder.close()
print(f"wrote {video}")
