"""How fast rays find triangles, against Embree's single-ray functions in the same minutes.

    python -m bench.traversal [--json FILE]

A thread each, in seconds of processor time. The rays: `primary`, of a camera in tiles of 4 x 4;
`diffuse`, cosine-distributed bounces from their hits; `shadow`, from the hits to points of the open
roof. A result whose hits differ from Embree's is refused. `Accel` is clpt's query class, with
several rays in flight if a tree outgrows the caches; `--finer 2`: 16 triangles of each.
"""

from __future__ import annotations

import json
import os
import statistics
import time

import click
import numpy as np

from bench.meshes import finer

KERNELS = """
#include "bvh/{layout}.cl"
kernel NO_VECTORIZE void closest(global const float *nodes, global const float *leaves,
                                 global const float8 *rays, global TriHit *hits)
{{
    uint i = get_global_id(0);
    float8 r = rays[i];
    hits[i] = {layout}_closest(nodes, leaves, r.s0, r.s1, r.s2, r.s4, r.s5, r.s6, r.s3, r.s7);
}}
kernel NO_VECTORIZE void occluded(global const float *nodes, global const float *leaves,
                                  global const float8 *rays, global int *hits)
{{
    uint i = get_global_id(0);
    float8 r = rays[i];
    hits[i] = {layout}_occluded(nodes, leaves, r.s0, r.s1, r.s2, r.s4, r.s5, r.s6, r.s3, r.s7);
}}
"""
HIT = np.dtype(  # TriHit
    [("t", "f4"), ("uv", "f4", 2), ("prim", "u4"), ("tag", "u4"), ("n", "f4", 3), ("ends", "f4", 2)]
)
MISS = 0xFFFFFFFF


def atrium() -> tuple[np.ndarray, np.ndarray]:
    """The vertices and faces that scenes/atrium is made of."""
    from clpt.bench import atrium as court

    vertices, faces, _ = court.atrium()
    return vertices, faces


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def _rays(o: np.ndarray, d: np.ndarray, tmin: float, tmax: float) -> np.ndarray:
    ends = np.full((len(o), 1), tmin), np.full((len(o), 1), tmax)
    return np.concatenate([o, ends[0], d, ends[1]], 1).astype(np.float32)


def ray_sets(
    vertices: np.ndarray, faces: np.ndarray, reference, side: int = 512
) -> dict[str, np.ndarray]:
    """Rays (side * side, 8) float32 by name, each row origin, tmin, direction, tmax."""
    rng = np.random.default_rng(1)
    tile = np.arange(side).reshape(side // 4, 4)
    y, _, x, _ = np.broadcast_arrays(
        tile[:, None, :, None], 0, tile[None, :, None, :], np.zeros((side // 4, side // 4, 4, 4))
    )
    film = (np.stack([x.ravel(), y.ravel()], -1) + rng.random((side * side, 2))) / side - 0.5
    eye, target = np.array([2.0, 5.5, 9.0]), np.array([40.0, 5.0, 9.5])
    forward = _unit(target - eye)
    right = _unit(np.cross(forward, [0, 1, 0]))
    up = np.cross(right, forward)
    d = _unit(forward + 1.4 * film[:, :1] * right - 1.4 * film[:, 1:] * up)
    primary = _rays(np.broadcast_to(eye, d.shape), d, 1e-3, 1e30)
    t, prim, _ = reference.closest(primary)
    t = np.where(prim == MISS, 0, t)[:, None]
    a, b, c = (vertices[faces[np.where(prim == MISS, 0, prim), k]].astype(float) for k in range(3))
    n = np.cross(b - a, c - a)
    n = _unit(np.where(np.linalg.norm(n, axis=1, keepdims=True) > 0, n, [[0, 1, 0]]))
    n = np.where((n * d).sum(1, keepdims=True) > 0, -n, n)
    o = eye + t * d + 1e-3 * n
    diffuse = _unit(n + _unit(rng.normal(0, 1, n.shape)) * 0.9999)
    roof = rng.random(n.shape) * [34, 0, 9] + [3, 15.9, 4.5]
    return {
        "primary": primary,
        "diffuse": _rays(o, diffuse, 1e-3, 1e30),
        "shadow": _rays(o, roof - o, 1e-4, 0.9999),
    }


class Tracer:
    """A layout with its rays, ready to be timed."""

    def __init__(self, device, tree, kernels: str = KERNELS):
        from clpt import device as dev

        source = dev.assemble("bench", {"bench": kernels.format(layout=tree.layout)})
        self.label, self.tree = tree.layout, tree
        self.device, self.program = device, dev.build(device, source)

    def run(self, kernel: str, rays: np.ndarray, repeats: int = 3) -> tuple[np.ndarray, float]:
        """What the kernel wrote, and the least seconds of processor time it took."""
        import pyopencl as cl

        flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
        result = np.zeros(len(rays), HIT if kernel == "closest" else np.int32)
        buffers = {
            "rays": cl.Buffer(self.device.context, flags, hostbuf=rays),
            "hits": cl.Buffer(self.device.context, flags, hostbuf=result),
        }
        bound = self.program.kernel(kernel).bind(**self.tree.buffers, **buffers)
        queue, seconds = self.device.queue, []
        for _ in range(repeats):
            start = time.process_time()
            bound.enqueue(queue, (len(rays),), (64,))
            queue.finish()
            seconds.append(time.process_time() - start)
        cl.enqueue_copy(queue, result, buffers["hits"])
        return result, min(seconds)


class Asked:
    """The same rays as an application sends them; the layout is clpt's choice."""

    label = "Accel"

    def __init__(self, device, vertices: np.ndarray, faces: np.ndarray):
        import clpt

        self.accel = clpt.Accel(device.queue, vertices, faces)

    def run(self, kernel: str, rays: np.ndarray, repeats: int = 3) -> tuple[np.ndarray, float]:
        """As `Tracer.run`."""
        parts = [np.ascontiguousarray(rays[:, part]) for part in (slice(3), slice(4, 7), 3, 7)]
        seconds = []
        for _ in range(repeats):
            start = time.process_time()
            if kernel == "closest":
                answers = self.accel.intersect(*parts)
            else:
                result = self.accel.occluded(*parts)
            seconds.append(time.process_time() - start)
        if kernel == "closest":
            result = np.zeros(len(rays), HIT)
            result["t"], result["prim"] = answers.t, answers.primitive.view(np.uint32)
        return result, min(seconds)


def agreement(hits: np.ndarray, t: np.ndarray, prim: np.ndarray, rays: np.ndarray) -> float:
    """Return the share of rays without a hit in both, or with hits at the same distance.

    Distances agree within 1e-4 of them, or within 1e-5, a few roundings of the scene's coordinates;
    the latter is more for rays that leave their surface at a grazing angle.
    """
    met, other = hits["prim"] != MISS, prim != MISS
    with np.errstate(invalid="ignore"):
        error = np.abs(hits["t"] - t)
        near = error <= np.maximum(1e-4 * t, 1e-5 / np.linalg.norm(rays[:, 4:7], axis=1))
    return float(((met == other) & (near | ~met)).mean())


def compare(
    tracer: Tracer | Asked, reference, name: str, rays: np.ndarray, rounds: int
) -> list[dict]:
    """Figures of closest and any hit: Mrays/s of both, their ratio, and the agreement of hits."""
    rows = []
    for kernel in ("closest", "occluded"):
        tracer.run(kernel, rays[:4096], 1)
        ours, theirs, agree = [], [], 1.0
        for _ in range(rounds):  # taking turns, so that a noisy minute meets both
            hits, seconds = tracer.run(kernel, rays, 1)
            ours.append(seconds)
            if kernel == "closest":
                t, prim, seconds = reference.closest(rays)
                agree = agreement(hits, t, prim, rays)
            else:
                met, seconds = reference.occluded(rays)
                agree = float(((hits != 0) == met).mean())
            theirs.append(seconds)
        if agree < 0.9999:
            raise SystemExit(f"{tracer.label} {name} {kernel}: only {agree:.4%} hits agree")
        n = len(rays) * 1e-6
        rows.append(
            {
                "layout": tracer.label,
                "rays": name,
                "query": kernel,
                "mrays": n / min(ours),
                "embree": n / min(theirs),
                "ratio": statistics.median(b / a for a, b in zip(ours, theirs, strict=True)),
                "agreement": agree,
            }
        )
    return rows


@click.command(help=__doc__)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
@click.option("--layout", "layouts", multiple=True, default=("wide8", "binary", "Accel"))
@click.option("--finer", "times", default=0, show_default=True, help="4 triangles of 1, so often")
@click.option("--rounds", default=5, show_default=True)
@click.option("--side", default=512, show_default=True, help="rays a set: side * side")
@click.option("--cpu", default=0, show_default=True, help="the core to run on")
def main(
    json_file: str | None, layouts: tuple[str, ...], times: int, rounds: int, side: int, cpu: int
) -> None:
    os.environ["POCL_MAX_PTHREAD_COUNT"] = "1"
    os.sched_setaffinity(0, {cpu})
    from bench.embree import Embree
    from clpt import bvh
    from clpt import device as dev

    device = dev.choose()
    vertices, faces = finer(*atrium(), times)
    reference = Embree(vertices, faces)
    sets = ray_sets(vertices, faces, reference, side)
    print(f"{device.info.label}, one thread, {len(faces)} triangles; Mrays/s")
    print(
        f"{'layout':8}{'rays':10}{'query':10}{'clpt':>8}{'Embree':>8}{'ratio':>7}  agreement",
        flush=True,
    )
    for layout in layouts:
        tracer: Tracer | Asked = (
            Asked(device, vertices, faces)
            if layout == "Accel"
            else Tracer(device, bvh.build(device, vertices, faces, layout=layout))
        )
        for name, rays in sets.items():
            for row in compare(tracer, reference, name, rays, rounds):
                print(
                    f"{row['layout']:8}{row['rays']:10}{row['query']:10}{row['mrays']:8.2f}"
                    f"{row['embree']:8.2f}{row['ratio']:7.2f}  {row['agreement']:.4%}"
                )
                if json_file:
                    row |= {
                        "bench": "traversal",
                        "device": device.info.label,
                        "triangles": len(faces),
                    }
                    with open(json_file, "a") as file:
                        file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
