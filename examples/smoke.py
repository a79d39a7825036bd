"""A plume of smoke: a fluid in the program's own kernels, rendered on the device as it rises."""

from argparse import ArgumentParser
from pathlib import Path

import numpy as np
import pyopencl as cl
import pyopencl.array as cl_array

import clpt
from clpt.scene import Film, cameras, integrators, lights, materials, media, shapes
from clpt.transforms import look_at, rotate, scale, translate

KERNEL = """
#define IN(i, n) clamp((int)(i), 0, n - 1)
#define AT(x, y, z) ((IN(x, NX) * NY + IN(y, NY)) * NZ + IN(z, NZ))
#define HERE int x = get_global_id(0), y = get_global_id(1), z = get_global_id(2), i = AT(x, y, z)
#define AROUND(v, sign) v[AT(x + 1, y, z)] sign v[AT(x - 1, y, z)], \
    v[AT(x, y + 1, z)] sign v[AT(x, y - 1, z)], v[AT(x, y, z + 1)] sign v[AT(x, y, z - 1)]
/* Velocities [cells a step] and, as w, smoke come from where they were; smoke lifts (Stam 1999). */
kernel void advect(global const float4 *now, float time, global float4 *then) {
    HERE;
    float4 p = (float4)(x, y, z, 0) - now[i], low = floor(p), share = p - low, sum = 0;
    for (int k = 0; k < 8; k++) {
        float4 c = (float4)(k & 1, k >> 1 & 1, k >> 2, 0), w = mix(1 - share, share, c);
        sum += w.x * w.y * w.z * now[AT(low.x + c.x, low.y + c.y, low.z + c.z)];
    }
    sum.y += 0.03f * sum.w;
    float2 to = (float2)(x, z) - 0.5f * (float2)(NX, NZ) - 2.5f * (float2)(cos(time), sin(time));
    then[i] = y < 4 && dot(to, to) < 9 ? (float4)(0, 0.7f, 0, 1) : sum * 0.998f;
}
kernel void press(global const float4 *v, global const float *now, global float *then) {
    HERE; /* a step toward the pressure that lets as much flow out of a cell as into it */
    float4 all = (float4)(AROUND(now, +), 0), flow[3] = {AROUND(v, -)};
    then[i] = (all.x + all.y + all.z - 0.5f * (flow[0].x + flow[1].y + flow[2].z)) / 6;
}
kernel void project(global const float *p, global float4 *v, global float *density) {
    HERE;
    v[i] -= 0.5f * (float4)(AROUND(p, -), 0);
    density[i] = v[i].w;
}
"""
FRAMES, STEPS, SIZE = 3, 32, (40, 72, 40)


def scene(density):
    """The smoke in its box over a floor, lit from the left."""
    box = translate((-0.5, 0, -0.5)) @ scale((1, 1.8, 1))
    smoke = media.Grid(density=density, to_world=box, sigma_t=40, albedo=0.9)
    inside = box @ translate((0.5, 0.5, 0.5)) @ scale(0.5)
    cube = shapes.Cube(to_world=inside, material=materials.Null(), interior=smoke)
    floor = translate((0, -0.001, 0)) @ rotate((1, 0, 0), -90) @ scale(60)
    floor = shapes.Rectangle(to_world=floor, material=materials.Diffuse(reflectance=0.3))
    sun = lights.Directional(direction=(3, -2, -1), irradiance=(5, 4.4, 3.6))
    camera = cameras.Perspective(to_world=look_at((0, 1.3, 5), (0, 0.85, 0), (0, 1, 0)), fov=23)
    film, path = Film(width=130, height=200, mode="rgb"), integrators.Path(max_depth=12)
    things = {"shapes": [cube, floor], "lights": [sun, lights.Constant(radiance=(0.2, 0.25, 0.35))]}
    return clpt.Scene(camera=camera, film=film, integrator=path, **things)


arguments = ArgumentParser(description=__doc__)
arguments.add_argument("folder", type=Path, nargs="?", default=".", help="gets the picture")
picture = arguments.parse_args().folder / "smoke.png"
queue = cl.CommandQueue(context := cl.create_some_context(interactive=False))
built = cl.Program(context, KERNEL).build("-DNX={} -DNY={} -DNZ={}".format(*SIZE))
advect, press, project = built.advect, built.press, built.project
flow, after = (cl_array.zeros(queue, (*SIZE, 4), "f4") for _ in range(2))
old, new, density = (cl_array.zeros(queue, SIZE, "f4") for _ in range(3))
renderer, pictures = clpt.Renderer(scene(density), queue=queue), []
for step in range(1, FRAMES * STEPS + 1):
    advect(queue, SIZE, None, flow.data, np.float32(0.2 * step), after.data)
    for _ in range(12):
        press(queue, SIZE, None, after.data, old.data, new.data)
        old, new = new, old
    project(queue, SIZE, None, old.data, after.data, density.data)
    flow, after = after, flow
    if step % STEPS == 0:
        renderer.update(scene=scene(density))
        renderer.step(48)
        pictures.append(renderer.image())
clpt.write_image(picture, np.hstack(pictures), tone="agx")
print(f"wrote {picture}")
