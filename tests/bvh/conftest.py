"""Tracing rays through a layout from Python, and the float64 reference it is held against."""

from collections.abc import Callable

import numpy as np
import pyopencl as cl
import pytest

from clpt import bvh
from clpt import device as dev

TREE = """
#include "bvh/{layout}.cl"
kernel void closest(global const float *nodes, global const float *leaves,
                    global const float8 *rays, global TriHit *hits)
{{
    float8 r = rays[get_global_id(0)];
    hits[get_global_id(0)] = {layout}_closest(nodes, leaves, r.s0, r.s1, r.s2, r.s4, r.s5, r.s6, r.s3, r.s7);
}}
kernel void occluded(global const float *nodes, global const float *leaves,
                     global const float8 *rays, global int *hits)
{{
    float8 r = rays[get_global_id(0)];
    hits[get_global_id(0)] = {layout}_occluded(nodes, leaves, r.s0, r.s1, r.s2, r.s4, r.s5, r.s6, r.s3, r.s7);
}}
"""
BRUTE = """
#include "bvh/brute.cl"
inline real part(global const float *rays, int k)
{
    return gather(rays, ((integer)((int)get_global_id(0) * LANES) + LANE_INDEX) * 8 + k);
}
kernel void closest(global const float *tris, uint count, global const float *rays, global float *hits)
{
    vec3 o = {part(rays, 0), part(rays, 1), part(rays, 2)}, d = {part(rays, 4), part(rays, 5), part(rays, 6)};
    BruteHit h = brute_closest(tris, count, o, d, part(rays, 3), part(rays, 7), (mask)(1) == (mask)(1));
    integer at = ((integer)((int)get_global_id(0) * LANES) + LANE_INDEX) * 8;
    scatter(hits, at, h.t);
    scatter(hits, at + 1, h.u);
    scatter(hits, at + 2, h.v);
    scatter(hits, at + 3, as_real(h.prim));
    scatter(hits, at + 4, as_real(h.tag));
    scatter(hits, at + 5, h.n.x);
    scatter(hits, at + 6, h.n.y);
    scatter(hits, at + 7, h.n.z);
}
kernel void occluded(global const float *tris, uint count, global const float *rays, global float *hits)
{
    vec3 o = {part(rays, 0), part(rays, 1), part(rays, 2)}, d = {part(rays, 4), part(rays, 5), part(rays, 6)};
    mask m = brute_occluded(tris, count, o, d, part(rays, 3), part(rays, 7), (mask)(1) == (mask)(1));
    scatter(hits, (integer)((int)get_global_id(0) * LANES) + LANE_INDEX, as_real(m & 1));
}
"""
HIT = np.dtype(
    [("t", "f4"), ("u", "f4"), ("v", "f4"), ("prim", "u4"), ("tag", "u4"), ("n", "f4", 3)]
)
MISS = 0xFFFFFFFF


@pytest.fixture(scope="session")
def device() -> dev.Device:
    return dev.choose()


@pytest.fixture(scope="session")
def trace(device) -> Callable:
    """trace(bvh, rays, lanes=8) -> hits (n,) HIT, occluded (n,) bool; rays are (n, 8) o tmin d tmax."""
    programs = {}

    def program(layout: str, lanes: int) -> dev.Program:
        if (layout, lanes) not in programs:
            text = BRUTE if layout == "brute" else TREE.format(layout=layout)
            source = dev.assemble("test", {"test": text}, {"LANES": lanes})
            programs[layout, lanes] = dev.build(device, source)
        return programs[layout, lanes]

    def run(tree: bvh.Bvh, rays: np.ndarray, lanes: int = 8) -> tuple[np.ndarray, np.ndarray]:
        n = len(rays)
        lanes = lanes if tree.layout == "brute" else 1
        padded = np.zeros((-(-n // lanes) * lanes, 8), np.float32)
        padded[:n] = rays
        flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
        buffer = cl.Buffer(device.context, flags, hostbuf=padded)
        results = []
        for kernel, dtype in (("closest", HIT), ("occluded", np.dtype("i4"))):
            hits = cl.Buffer(device.context, flags, hostbuf=np.zeros(len(padded), dtype))
            arguments = dict(tree.buffers, rays=buffer, hits=hits)
            if tree.layout == "brute":
                arguments["count"] = max(tree.count, 1)
            bound = program(tree.layout, lanes).kernel(kernel).bind(**arguments)
            bound.enqueue(device.queue, (len(padded) // lanes,), (1,))
            result = np.empty(len(padded), dtype)
            cl.enqueue_copy(device.queue, result, hits)
            results.append(result[:n])
        return results[0], results[1] != 0

    return run


@pytest.fixture(scope="session")
def reference() -> Callable:
    """reference(triangles (m, 3, 3), rays (n, 8)) -> t (n, m) float64, inf where not hit; margin
    (n, m): how far inside the triangle the hit is, in barycentrics, negative outside."""

    def intersect(triangles: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        v = triangles.astype(np.float64)[None]
        o, d = (rays[:, None, k : k + 3].astype(np.float64) for k in (0, 4))
        e1, e2 = v[:, :, 1] - v[:, :, 0], v[:, :, 2] - v[:, :, 0]
        n = np.cross(e1, e2)
        s = v[:, :, 0] - o
        w = np.cross(s, d)
        with np.errstate(all="ignore"):
            det = (n * d).sum(-1)
            t, u = (n * s).sum(-1) / det, (e2 * w).sum(-1) / det
            b = -(e1 * w).sum(-1) / det
            margin = np.minimum(np.minimum(u, b), 1 - u - b)
            hit = (margin >= 0) & (t > rays[:, 3:4]) & (t < rays[:, 7:8])
        return np.where(hit, t, np.inf), margin

    return intersect
