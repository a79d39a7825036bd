"""A mesh that the application's own kernel deforms, rendered frame by frame on one queue.

The vertices never leave the device: the kernel writes them, clpt refits its tree to them and
renders, and only the picture comes back. Nothing waits in between: the queue keeps the order.
"""

from argparse import ArgumentParser
from pathlib import Path

import numpy as np
import pyopencl as cl
import trimesh
from pyopencl.array import empty_like, to_device

import clpt
from clpt.scene import Scene, cameras, integrators, lights, materials, shapes
from clpt.transforms import look_at, scale, translate

FRAMES, SAMPLES = 4, 64
DEFORM = """
kernel void deform(global const float *rest, global float *moved, float time)
{
    size_t i = get_global_id(0);
    float3 p = vload3(i, rest);                           /* on the unit sphere */
    float3 q = p + 0.35f * sin(2.3f * p.yzx + time);      /* waves that bend the waves */
    float height = 0.16f * sin(4.0f * q.x + time) * sin(4.0f * q.y) * sin(4.0f * q.z - time)
                 + 0.05f * sin(9.0f * q.z + 2.0f * time);
    vstore3(p * (1.0f + height), i, moved);
}
"""


def scene(mesh: trimesh.Trimesh) -> Scene:
    """A thing of copper over a floor, between a lamp and a dim sky."""
    copper = materials.RoughConductor(metal="copper", alpha=0.2)
    floor = materials.Diffuse(reflectance=(0.2, 0.24, 0.3))
    lamp = lights.Area(radiance=(18.0, 16.0, 13.0))
    return Scene(
        camera=cameras.Perspective(
            to_world=look_at([0, -4.8, 2.6], [0, 0, -0.15], [0, 0, 1]), fov=32
        ),
        shapes=[
            shapes.Mesh(
                name="blob",
                vertices=np.float32(mesh.vertices),
                faces=np.uint32(mesh.faces),
                normals=np.float32(mesh.vertex_normals),
                material=copper,
            ),
            shapes.Rectangle(to_world=translate([0, 0, -1.2]) @ scale(30), material=floor),
            shapes.Rectangle(to_world=look_at([-3, -2, 4], [0, 0, 0], [0, 1, 0]), emission=lamp),
        ],
        lights=[lights.Constant(radiance=(0.35, 0.42, 0.5))],
        film=integrators.Film(width=200, height=200, mode="rgb"),
    )


arguments = ArgumentParser(description=__doc__)
arguments.add_argument("folder", type=Path, nargs="?", default=".", help="gets the picture")
folder = arguments.parse_args().folder
context = cl.create_some_context(interactive=False)
queue = cl.CommandQueue(context)
deform = cl.Program(queue.context, DEFORM).build().deform

mesh = trimesh.creation.icosphere(subdivisions=5)
rest = to_device(queue, np.float32(mesh.vertices))
moved = empty_like(rest)
frames = []
with clpt.Renderer(scene(mesh), queue=queue) as renderer:
    for frame in range(FRAMES):
        deform(queue, (len(mesh.vertices),), None, rest.data, moved.data, np.float32(1.3 * frame))
        renderer.update(vertices={"blob": moved})
        renderer.step(SAMPLES)
        frames.append(renderer.film.get()[:, :, :3])  # waits for the picture
clpt.write_image(folder / "deforming_mesh.png", np.hstack(frames), tone="neutral")
print(f"wrote {folder / 'deforming_mesh.png'}")
