"""How fast acceleration structures are built, against Embree's builder in the same minutes.

    python -m bench.builders [--json FILE]

Million triangles a second, of processor time and by the clock, from vertices and faces on the host
to buffers ready for traversal; `binary` is the binned SAH tree alone, `wide8` has the collapse too,
`fast` is the tree over leaves of a space-filling curve.
Embree is timed around rtcCommitScene at medium quality.

`refit` is the speed of a refit to moved vertices on the device, beside `rebuild`, another build of
them; `slower` is the ratio of rays' times in the refitted tree, by the amount of bending.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator

import click
import numpy as np

BUILDS = {
    "binary": {"layout": "binary"},
    "wide8": {"layout": "wide8"},
    "fast": {"layout": "wide8", "quality": "fast"},
}


@click.command(help=__doc__)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
@click.option("--threads", default=1, show_default=True)
@click.option("--rounds", default=7, show_default=True)
@click.option("--copies", default=1, show_default=True, help="of the atrium, side by side")
@click.option("--refit/--no-refit", default=True, show_default=True)
def main(json_file: str | None, threads: int, rounds: int, copies: int, refit: bool) -> None:
    os.environ["POCL_MAX_PTHREAD_COUNT"] = str(threads)
    from bench.embree import Embree
    from bench.traversal import atrium
    from clpt import bvh
    from clpt import device as dev

    device = dev.choose()
    vertices, faces = atrium()
    offsets = np.arange(copies)
    count = len(vertices)
    vertices = np.concatenate([vertices + np.float32([0, 0, 20 * i]) for i in offsets])
    faces = np.concatenate([faces + np.uint32(count * i) for i in offsets])
    vertices, faces = np.float32(vertices), np.uint32(faces)
    seconds: dict[str, list[tuple[float, float]]] = {name: [] for name in (*BUILDS, "Embree")}
    for _ in range(rounds):
        for name, how in BUILDS.items():
            start = time.process_time()
            tree = bvh.build(device, vertices, faces, **how)
            seconds[name].append((tree.stats["seconds"], time.process_time() - start))
            del tree
        reference = Embree(vertices, faces, threads)
        seconds["Embree"].append((reference.build_wall, reference.build_seconds))
        reference.close()
    print(f"{device.info.label}, {threads} threads, {len(faces)} triangles")
    for layout in ("binary", "wide8") if refit else ():
        for row in _refitted(device, vertices, faces, layout, rounds):
            row = {"bench": "refit", "device": device.info.label, "threads": threads, **row}
            print(
                f"{layout:8}{row['mtris_core']:7.1f} Mtri/s a core refitted, "
                f"{row['rebuild']:.2f} rebuilt; bent by {row['bent']:g} of its height "
                f"rays are {row['slower']:.2f} times slower"
            )
            if json_file:
                with open(json_file, "a") as file:
                    file.write(json.dumps(row) + "\n")
    for name, pairs in seconds.items():
        wall, cpu = (min(column) for column in zip(*pairs, strict=True))
        row = {
            "bench": "building",
            "device": device.info.label,
            "threads": threads,
            "triangles": len(faces),
            "builder": name,
            "mtris": len(faces) * 1e-6 / wall,
            "mtris_core": len(faces) * 1e-6 / cpu,
        }
        print(f"{name:8}{row['mtris']:7.2f} Mtri/s{row['mtris_core']:8.2f} Mtri/s a core")
        if json_file:
            with open(json_file, "a") as file:
                file.write(json.dumps(row) + "\n")


def _refitted(
    device, vertices: np.ndarray, faces: np.ndarray, layout: str, rounds: int
) -> Iterator[dict]:
    """How fast a tree follows a scene that bends more and more, and what its rays then take."""
    from bench.traversal import Tracer
    from clpt import bvh
    from clpt import device as dev

    give, building = dev.Buffers(device), bvh.Building(device)
    corners = give.upload("faces", faces, np.uint32)
    low, size = vertices.min(0), np.ptp(vertices, 0)
    rng = np.random.default_rng(1)
    o, d = low + size * (0.1 + 0.8 * rng.random((1 << 16, 3))), rng.normal(0, 1, (1 << 16, 3))
    ends = np.broadcast_to([[1e-3, 1e30]], (len(o), 2))
    rays = np.concatenate([o, ends[:, :1], d, ends[:, 1:]], 1).astype(np.float32)
    tree = bvh.build(device, vertices, faces, layout=layout)
    for bent in (0.0, 0.02, 0.1, 0.5):
        moved = vertices + bent * size[1] * np.sin(12 * vertices[:, [1, 2, 0]] / size[[1, 2, 0]])
        points = give.upload("vertices", moved, np.float32)
        refits, builds, traced = [], [], []
        for _ in range(rounds):  # taking turns, so that a noisy minute meets both
            start = time.process_time()
            bvh.refit(building, tree, points, corners)
            building.stream.wait()
            refits.append(time.process_time() - start)
            start = time.process_time()
            fresh = bvh.build(device, points, corners, layout=layout)
            builds.append(time.process_time() - start)
            traced.append([Tracer(device, t).run("closest", rays, 1)[1] for t in (tree, fresh)])
        after, anew = np.min(traced, axis=0)
        million = len(faces) * 1e-6
        yield {
            "layout": layout,
            "triangles": len(faces),
            "bent": bent,
            "mtris_core": million / min(refits),
            "rebuild": million / min(builds),
            "slower": after / anew,
        }


if __name__ == "__main__":
    main()
