"""A host whose context spans several devices; run by test_queues.py. Prints JSON."""

from __future__ import annotations

import json
import sys

import numpy as np
import pyopencl as cl

import clpt
from tests.pictures.support import with_film


def main(scene_file: str) -> None:
    there = cl.get_platforms()[0].get_devices()
    context = cl.Context(there)
    scene = with_film(clpt.load(scene_file), mode="rgb", width=24, height=20)
    pictures, hits, built = [], [], []
    rng = np.random.default_rng(1)
    vertices = rng.random((300, 3), np.float32)
    rays = rng.random((64, 3), np.float32), rng.random((64, 3), np.float32) - np.float32(0.5)
    for device in there:
        queue = cl.CommandQueue(context, device)
        with clpt.Renderer(scene, queue=queue, slots=1024) as renderer:
            renderer.step(2)
            renderer.run(2)
            pictures.append(renderer.image())
            found = [p.cl_program for p in renderer._wavefront.programs.values()]
            binaries = [program.get_info(cl.program_info.BINARIES) for program in found]
            built.append(max(len([b for b in several if b]) for several in binaries))
        tree = clpt.Accel(queue, vertices, np.arange(300, dtype=np.uint32).reshape(100, 3))
        hits.append(np.asarray(tree.intersect(*rays).primitive).tolist())
    report = {
        "devices": len(there),
        "same pictures": all(np.array_equal(pictures[0], other) for other in pictures),
        "mean": float(np.mean(pictures[0])),
        "same hits": all(hits[0] == other for other in hits),
        "hits": sum(primitive >= 0 for primitive in hits[0]),
        "built for": max(built),
    }
    json.dump(report, sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1])
