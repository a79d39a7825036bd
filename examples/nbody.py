"""Two star clusters meet: bodies of an n-body simulation, moved and rendered on the device."""

from argparse import ArgumentParser
from pathlib import Path

import numpy as np
import pyopencl as cl
import pyopencl.array as cl_array

import clpt
from clpt.scene import Film, cameras, lights, materials, shapes, textures
from clpt.transforms import look_at, rotate, scale, translate

KERNEL = """
kernel void advance(global const float4 *now, float dt, global float4 *then, global float4 *speed) {
    int i = get_global_id(0), n = get_global_size(0);
    float4 own = now[i], pull = 0.0f;
    for (int j = 0; j < n; j++) {
        float4 to = now[j] - own;
        float square = now[j].w * now[j].w; /* w: radius; its 4th power times 200: mass */
        float near = rsqrt(dot(to.xyz, to.xyz) + 0.01f);
        pull += to * (200.0f * square * square * near * near * near);
    }
    speed[i] += dt * pull;
    then[i] = (float4)(own.xyz + dt * speed[i].xyz, own.w);
}
"""
FRAMES, STEPS, DT, COUNT, HEART = 3, 50, 0.019, 400, 0.3


def cluster(place, drift, tilt, rng):
    """A disk of bodies around a heavy one: centres with radii, and velocities, (COUNT, 4)."""
    r, turn, zero = 0.5 + 0.9 * rng.random(COUNT) ** 0.5, 6.283 * rng.random(COUNT), np.zeros(COUNT)
    out = np.stack([np.cos(turn), zero, np.sin(turn)], 1)
    pace = np.sqrt(200 * HEART**4 * r**2 / (r**2 + 0.01) ** 1.5)
    centers, speed = r[:, None] * out, pace[:, None] * np.cross(out, (0, 1, 0))
    centers[0], speed[0], radii = 0, 0, np.r_[HEART, rng.uniform(0.025, 0.07, COUNT - 1)]
    turned = rotate((1, 0, 0.4), tilt)[:3, :3].T
    return np.c_[centers @ turned + place, radii], np.c_[speed @ turned + drift, zero]


def scene(bodies, rng):
    """The bodies over a dark floor, below a warm and a cold light."""
    near, far = np.array([(1, 0.6, 0.1), (0.1, 0.8, 0.8)]), [(1, 0.1, 0.2), (0.25, 0.25, 1)]
    colours = near + rng.random((COUNT, 1, 1)) * (far - near)
    colours[0] = (1.0, 0.85, 0.6), (0.75, 0.95, 1.0)
    colours = {"vertex_color": colours.swapaxes(0, 1).reshape(-1, 3)}
    paint = materials.RoughPlastic(diffuse_reflectance=textures.MeshAttribute(), alpha=0.1)
    dark = materials.RoughPlastic(diffuse_reflectance=(0.10, 0.11, 0.15), alpha=0.3)
    ground = translate((0, -1.2, 0)) @ rotate((1, 0, 0), -90) @ scale(40)
    things = [
        shapes.Spheres(centers=bodies, attributes=colours, material=paint, name="bodies"),
        shapes.Rectangle(to_world=ground, material=dark),
        shapes.Sphere(center=(-5, 6, 4), radius=1.2, emission=lights.Area(radiance=(66, 52, 36))),
        shapes.Sphere(center=(7, 4, -4), radius=1, emission=lights.Area(radiance=(18, 36, 66))),
    ]
    camera = cameras.Perspective(to_world=look_at((0, 4, 8), (0, -0.2, 0), (0, 1, 0)), fov=27)
    sky, film = lights.Constant(radiance=(0.2, 0.2, 0.3)), Film(width=200, height=200, mode="rgb")
    return clpt.Scene(camera=camera, shapes=things, lights=[sky], film=film)


arguments = ArgumentParser(description=__doc__)
arguments.add_argument("folder", type=Path, nargs="?", default=".", help="gets the picture")
picture = arguments.parse_args().folder / "nbody.png"
rng, context = np.random.default_rng(3), cl.create_some_context(interactive=False)
queue = cl.CommandQueue(context)
advance = cl.Program(queue.context, KERNEL).build().advance
gold, teal = ((-1.1, 0.25, 0), (0.35, 0, -0.25), 20), ((1.1, -0.1, 0), (-0.35, 0, 0.25), -55)
made = zip(cluster(*gold, rng), cluster(*teal, rng), strict=True)
now, speed = (cl_array.to_device(queue, np.concatenate(p).astype("f4", "C")) for p in made)
then, pictures = cl_array.empty_like(now), []
renderer = clpt.Renderer(scene(now, rng), queue=queue)
for _ in range(FRAMES):
    renderer.update(vertices={"bodies": now})
    renderer.step(48)
    pictures.append(renderer.image())
    for _ in range(STEPS):
        advance(queue, now.shape[:1], None, now.data, np.float32(DT), then.data, speed.data)
        now, then = then, now
clpt.write_image(picture, np.hstack(pictures), exposure=0.7, tone="agx")
print(f"wrote {picture}")
