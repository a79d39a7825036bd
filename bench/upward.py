"""Trees from the leaves up, which GPUs get, beside trees by planes: cost, and what rays visit.

    python -m bench.upward [--json FILE] SCENE ...

By default ten scenes of scenes/; `python scenes/atrium/generate.py` writes the atrium's meshes. No
nodes are reinserted. `cost` is that of a random line; `nodes` and `leaves` are those that a
closest-hit ray visits, in a tree by planes and from the leaves up: blocks of `wide8`, triangles of
`compact`. `equal` is the share of rays that hit at the same distance, to the bit. Half of the rays
leave surfaces in all directions, half cross the scene.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from unittest import mock

import click
import numpy as np
import pyopencl as cl

import clpt
from bench.traversal import Tracer
from clpt import bvh
from clpt import device as dev
from clpt.bench.rays import world
from clpt.bvh import building, layouts
from clpt.render.flow.scene_to_tables import lower

SCENES = (
    "atrium",
    "breakfast",
    "bulb",
    "diamond",
    "fluorescent_paint",
    "glass_caustics",
    "pool",
    "table_glasses",
    "under_a_boat",
    "wine_and_jade",
)
# The loops of the traversals' closest hits, which count.
COUNTING = {
    "wide8": """
    Wide8Ray r = wide8_ray(RAY, tmin);
    ulong waiting[WIDE8_STACK];
    uint n = 0, at = 0, best = BVH_MISS;
    do {
        while (!(at & BVH_LEAF)) {
            union { float8 v; uint at[8]; } entry;
            Mask8 m = wide8_boxes(nodes + (ulong)at * 64, &r, t, &entry.v);
            visits.x++;
            if (!m) break;
            at = wide8_nearest(nodes, at, entry.at, m, waiting, &n);
        }
        if (!(at & BVH_LEAF)) continue;
        visits.y++;
        wide8_nearer(leaves, at & ~BVH_LEAF, &r, &t, &best);
    } while (wide8_next(nodes, &r, waiting, &n, t, &at));
""",
    "compact": """
    CompactRay r = compact_ray(RAY, tmin);
    Shear shear = shear_make(RAY);
    uint2 waiting[COMPACT_STACK], items;
    CompactState state = compact_start(waiting);
    while (compact_next(nodes, &r, t, &state, &items)) {
        visits.x++;
        while (items.y) {
            float at, u, v;
            visits.y++;
            if (shear_intersect(&shear, leaves + (ulong)compact_item(&items) * 12, 1, &at, &u, &v))
                t = at > tmin ? min(t, at) : t;
        }
    }
""",
}
KERNEL = """
#include "bvh/{layout}.cl"
#define RAY ray.s0, ray.s1, ray.s2, ray.s4, ray.s5, ray.s6
kernel NO_VECTORIZE void count_visits(global const float *nodes, global const float *leaves,
                                      global const float8 *rays, global uint2 *counts)
{{
    float8 ray = rays[get_global_id(0)];
    float tmin = ray.s3, t = ray.s7;
    uint2 visits = (uint2)(0);
    {loop}
    counts[get_global_id(0)] = visits;
}}
"""


def rows(on: dev.Device, scene: str, count: int) -> Iterator[dict[str, object]]:
    """Yield a row for each layout of a scene; count: of the rays, a multiple of 64."""
    vertices, faces = world(lower(clpt.load(scene)))
    rays = crossing_rays(vertices[faces], count)
    for layout in COUNTING:
        trees = [built(on, vertices, faces, layout, upward) for upward in (False, True)]
        visited = [visits(on, tree, rays).mean(0) for tree in trees]
        planes, upward = (Tracer(on, tree).run("closest", rays, 1)[0] for tree in trees)
        same = planes["t"] == upward["t"]
        yield {
            "bench": "upward",
            "scene": Path(scene).stem,
            "triangles": len(faces),
            "layout": layout,
            "cost": [tree.stats["cost"] for tree in trees],
            "nodes": [float(seen[0]) for seen in visited],
            "leaves": [float(seen[1]) for seen in visited],
            "equal": float(same.mean()),
        }


def crossing_rays(triangles: np.ndarray, count: int) -> np.ndarray:
    """Return rays with near and far ends, (count, 8) float32; half of them leave surfaces."""
    rng = np.random.default_rng(1)
    low, high = triangles.min((0, 1)), triangles.max((0, 1))
    areas = np.linalg.norm(
        np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1
    )
    chosen = rng.choice(len(areas), count, p=areas.astype(float) / areas.astype(float).sum())
    weights = rng.dirichlet([1, 1, 1], count)[..., None]
    origins = (triangles[chosen] * weights).sum(1)
    origins[::2] = low + (high - low) * rng.random((count // 2, 3))
    ends = np.full((count, 1), 1e-4 * np.ptp(triangles)), np.full((count, 1), 1e30)
    return np.concatenate([origins, ends[0], rng.normal(0, 1, (count, 3)), ends[1]], 1).astype("f4")


def built(
    on: dev.Device, vertices: np.ndarray, faces: np.ndarray, layout: str, upward: bool
) -> bvh.Bvh:
    """Return a tree from the leaves up, or by planes without reinsertion."""
    grain = replace(building.FEW, upward=upward)
    with (
        mock.patch.multiple(building, FEW=grain, MANY=grain),
        mock.patch.object(layouts, "REINSERT_LIMIT", len(faces) + 1),
    ):
        return bvh.build(on, vertices, faces, layout=layout)


def visits(on: dev.Device, tree: bvh.Bvh, rays: np.ndarray) -> np.ndarray:
    """Return the nodes and leaves that each ray visits, (n, 2); n is a multiple of 64."""
    text = KERNEL.format(layout=tree.layout, loop=COUNTING[tree.layout])
    program = dev.build(on, dev.assemble("count", {"count": text}))
    flags = cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR
    counts = np.zeros((len(rays), 2), np.uint32)
    buffers = {
        "rays": cl.Buffer(on.context, flags, hostbuf=rays),
        "counts": cl.Buffer(on.context, flags, hostbuf=counts),
    }
    program.kernel("count_visits").bind(**tree.buffers, **buffers).enqueue(
        on.queue, (len(rays),), (64,)
    )
    cl.enqueue_copy(on.queue, counts, buffers["counts"])
    return counts


@click.command(help=__doc__)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
@click.option("--count", default=1 << 16, show_default=True, help="rays")
@click.argument("scenes", nargs=-1)
def main(json_file: str | None, count: int, scenes: tuple[str, ...]) -> None:
    on = dev.choose()
    print("scene            triangles layout   cost         nodes        leaves       equal")
    for scene in scenes or [f"scenes/{name}" for name in SCENES]:
        for row in rows(on, scene, count):
            pairs = [row["cost"], row["nodes"], row["leaves"]]
            figures = "".join(f"{a:6.2f} {b:6.2f}" for a, b in pairs)  # type: ignore[misc]
            print(
                f"{row['scene']:17}{row['triangles']:9} {row['layout']:8}{figures}"
                f" {row['equal']:.5f}",
                flush=True,
            )
            if json_file:
                with open(json_file, "a") as file:
                    file.write(json.dumps(row) + "\n")


if __name__ == "__main__":
    main()
