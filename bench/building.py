"""How fast acceleration structures are built, against Embree's builder in the same minutes.

    python -m bench.building [--json FILE]

Million triangles a second of processor time, from vertices and faces on the host to buffers ready
for traversal; `binary` is the binned SAH tree alone, `wide8` has the collapse too. Embree is timed
around rtcCommitScene at medium quality.
"""

from __future__ import annotations

import json
import os
import time

import click
import numpy as np


@click.command(help=__doc__)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
@click.option("--threads", default=1, show_default=True)
@click.option("--rounds", default=7, show_default=True)
@click.option("--copies", default=1, show_default=True, help="of the atrium, side by side")
def main(json_file: str | None, threads: int, rounds: int, copies: int) -> None:
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
    seconds: dict[str, list[tuple[float, float]]] = {"binary": [], "wide8": [], "Embree": []}
    for _ in range(rounds):
        for layout in ("binary", "wide8"):
            start = time.process_time()
            tree = bvh.build(device, vertices, faces, layout=layout)
            seconds[layout].append((tree.stats["seconds"], time.process_time() - start))
        start = time.process_time()
        reference = Embree(vertices, faces, threads)
        seconds["Embree"].append((reference.build_seconds, time.process_time() - start))
        reference.close()
    print(f"{device.info.label}, {threads} threads, {len(faces)} triangles; wide8: {tree.stats}")
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


if __name__ == "__main__":
    main()
