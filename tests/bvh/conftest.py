"""Tracing rays through a layout from Python, and the float64 reference it is held against."""

from collections.abc import Callable

import numpy as np
import pyopencl as cl
import pytest

from clpt import bvh
from clpt import device as dev
from clpt.bvh import layouts

TREE = """
#include "bvh/{layout}.cl"
#define RAY r.s0, r.s1, r.s2, r.s4, r.s5, r.s6, r.s3, r.s7
kernel NO_VECTORIZE void closest(global const float *nodes, global const float *leaves,
                                 global const float8 *rays, global TriHit *hits)
{{
    float8 r = rays[get_global_id(0)];
    hits[get_global_id(0)] = {layout}_closest(nodes, leaves, RAY);
}}
kernel NO_VECTORIZE void occluded(global const float *nodes, global const float *leaves,
                                  global const float8 *rays, global int *hits)
{{
    float8 r = rays[get_global_id(0)];
    hits[get_global_id(0)] = {layout}_occluded(nodes, leaves, RAY);
}}
"""
BRUTE = """
#include "bvh/brute.cl"
#define AT ((integer)((int)get_global_id(0) * LANES) + LANE_INDEX)
#define RAY(k) gather(rays, AT * 8 + k)
#define EVERY ((mask)(1) == (mask)(1))
kernel NO_VECTORIZE void closest(global const float *tris, uint count, global const float *rays,
                                 global float *hits)
{
    vec3 o = {RAY(0), RAY(1), RAY(2)}, d = {RAY(4), RAY(5), RAY(6)};
    BruteHit h = brute_closest(tris, count, o, d, RAY(3), RAY(7), EVERY);
    scatter_if(hits, AT * 10, EVERY, h.t);
    scatter_if(hits, AT * 10 + 1, EVERY, h.u);
    scatter_if(hits, AT * 10 + 2, EVERY, h.v);
    scatter_if(hits, AT * 10 + 3, EVERY, as_real(h.prim));
    scatter_if(hits, AT * 10 + 4, EVERY, as_real(h.tag));
    scatter_if(hits, AT * 10 + 5, EVERY, h.n.x);
    scatter_if(hits, AT * 10 + 6, EVERY, h.n.y);
    scatter_if(hits, AT * 10 + 7, EVERY, h.n.z);
    scatter_if(hits, AT * 10 + 8, EVERY, h.plane);
    scatter_if(hits, AT * 10 + 9, EVERY, h.side);
}
kernel NO_VECTORIZE void occluded(global const float *tris, uint count, global const float *rays,
                                  global float *hits)
{
    vec3 o = {RAY(0), RAY(1), RAY(2)}, d = {RAY(4), RAY(5), RAY(6)};
    mask met = brute_occluded(tris, count, o, d, RAY(3), RAY(7), EVERY);
    scatter_if(hits, AT, EVERY, as_real(met & 1));
}
"""
HIT = np.dtype(  # TriHit
    {
        "names": ["t", "u", "v", "prim", "tag", "n", "plane", "side"],
        "formats": ["f4", "f4", "f4", "u4", "u4", "3f4", "f4", "f4"],
    }
)
MISS = 0xFFFFFFFF


@pytest.fixture(scope="session")
def device() -> dev.Device:
    return dev.choose()


@pytest.fixture(scope="session")
def trace(device) -> Callable:
    """trace(bvh, rays, lanes=8) -> hits (n,) HIT, occluded (n,) bool; rays: o tmin d tmax.

    A ray through a tree goes alone; lanes of 1 choose the form for GPUs.
    """
    programs = {}

    def program(layout: str, lanes: int) -> dev.Program:
        if (layout, lanes) not in programs:
            text = BRUTE if layout == "brute" else TREE.format(layout=layout)
            alone = layouts.ALONE if lanes == 1 else {}
            source = dev.assemble("test", {"test": text, **alone}, {"LANES": lanes})
            programs[layout, lanes] = dev.build(device, source)
        return programs[layout, lanes]

    def run(tree: bvh.Bvh, rays: np.ndarray, lanes: int = 8) -> tuple[np.ndarray, np.ndarray]:
        n, side = len(rays), lanes if tree.layout == "brute" else 1
        padded = np.zeros((-(-n // side) * side, 8), np.float32)
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
            bound.enqueue(device.queue, (len(padded) // side,), (1,))
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
