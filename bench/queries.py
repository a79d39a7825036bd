"""Costs of an application's ray queries: beside the bare kernel, beside embreex, and in Python.

    python -m bench.queries [--json FILE]

The rays of bench.traversal in the atrium, four times 512 x 512 of each kind, so 1 M a batch.
`overhead` is the time of a query over the time of a kernel that only traces, with packed rays and
hits: `device` with arrays on the device, `host` with numpy's. embreex is asked through its own
binding, as trimesh does, with the same ends of rays. All of it is processor time, which a busy
machine disturbs least: medians over rounds in turns, and Mrays/s a core. `python_us`: microseconds
by the clock of a call with few rays, without the wait.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import click
import numpy as np

from bench import machine
from bench.traversal import HIT, KERNELS, atrium, ray_sets

BATCH = 1 << 20


class Bare:
    """The traversal alone, bound to buffers of its own."""

    def __init__(self, accel, rays: np.ndarray):
        import pyopencl as cl

        from clpt import device as dev

        source = dev.assemble("bench", {"bench": KERNELS.format(layout=accel.layout)})
        flags = cl.mem_flags
        context, self.queue = accel.queue.context, accel.queue
        self.size, self.bound = len(rays), {}
        program = dev.build(accel.device, source)
        held = cl.Buffer(context, flags.READ_ONLY | flags.COPY_HOST_PTR, hostbuf=rays)
        hits = cl.Buffer(context, flags.READ_WRITE, size=HIT.itemsize * len(rays))
        for kernel in ("closest", "occluded"):
            trees = dict(accel.tree.buffers, rays=held, hits=hits)
            self.bound[kernel] = program.kernel(kernel).bind(**trees)

    def __call__(self, kernel: str) -> None:
        self.bound[kernel].enqueue(self.queue, (self.size,), (64,)).wait()


def turns(runs: dict[str, Callable[[], object]], rounds: int) -> dict[str, np.ndarray]:
    """Seconds of processor time of each, (rounds,); they take turns, so that noise meets all."""
    taken: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(1 + rounds):
        for name, run in runs.items():
            start = time.process_time()
            run()
            taken[name].append(time.process_time() - start)
    return {name: np.array(each[1:]) for name, each in taken.items()}


def compare(accel, embree, name: str, rays: np.ndarray, rounds: int) -> list[dict]:
    """Return rows of closest and any hits of a kind of rays."""
    from pyopencl.array import to_device

    o, d = (np.ascontiguousarray(rays[:, part]) for part in (slice(0, 3), slice(4, 7)))
    near, far = float(rays[0, 3]), float(rays[0, 7])
    ends = np.full(len(o), far, np.float32)
    there = to_device(accel.queue, o), to_device(accel.queue, d)
    hits, met = accel.intersect(*there, near, far), accel.occluded(*there, near, far)
    bare = Bare(accel, rays)
    queries: dict[str, dict[str, Callable[[], object]]] = {
        "closest": {
            "bare": lambda: bare("closest"),
            "device": lambda: accel.intersect(*there, near, far, out=hits).event.wait(),
            "host": lambda: accel.intersect(o, d, near, far),
            "embreex": lambda: embree.run(o, d, dists=ends),
        },
        "occluded": {
            "bare": lambda: bare("occluded"),
            "device": lambda: accel.occluded(*there, near, far, out=met).events[-1].wait(),
            "host": lambda: accel.occluded(o, d, near, far),
            "embreex": lambda: embree.run(o, d, dists=ends, query="OCCLUDED"),
        },
    }
    rows = []
    for query, runs in queries.items():
        taken = turns(runs, rounds)
        ratios = {key: float(np.median(each / taken["bare"])) for key, each in taken.items()}
        mrays = {key: len(rays) * 1e-6 / float(np.median(each)) for key, each in taken.items()}
        rows.append(
            {
                "rays": name,
                "query": query,
                "overhead": round(ratios["device"], 4),
                "overhead_host": round(ratios["host"], 4),
                "mrays": round(mrays["device"], 3),
                "mrays_host": round(mrays["host"], 3),
                "mrays_embreex": round(mrays["embreex"], 3),
                "to_embreex": round(ratios["embreex"] / ratios["host"], 3),
            }
        )
    return rows


def python_times(accel, rays: np.ndarray, calls: int = 300) -> list[dict]:
    """Microseconds of a call: the median, of the host's work alone and until the hits are there."""
    from pyopencl.array import to_device

    rows = []
    for count in (1, 1000):
        o, d = (np.ascontiguousarray(rays[:count, part]) for part in (slice(0, 3), slice(4, 7)))
        there = to_device(accel.queue, o), to_device(accel.queue, d)
        hits = accel.intersect(*there)
        enqueued, whole, host = [], [], []
        for _ in range(calls):
            start = time.perf_counter()
            event = accel.intersect(*there, out=hits).event
            enqueued.append(time.perf_counter() - start)
            event.wait()
            whole.append(time.perf_counter() - start)
            start = time.perf_counter()
            accel.intersect(o, d)
            host.append(time.perf_counter() - start)
        parts = {"python_us": enqueued, "device_us": whole, "host_us": host}
        figures = {key: round(1e6 * float(np.median(each)), 1) for key, each in parts.items()}
        rows.append({"rays": f"{count} rays", "query": "closest", **figures})
    return rows


@click.command(help=__doc__)
@click.option("--json", "json_file", type=click.Path(), help="append the figures as JSON lines")
@click.option("--rounds", default=5, show_default=True)
def main(json_file: str | None, rounds: int) -> None:
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    import clpt
    from bench.embree import Embree
    from clpt import device as dev

    vertices, faces = atrium()
    accel = clpt.Accel(dev.choose().queue, vertices, faces)
    about = {"device": accel.device.info.label, "triangles": len(faces)}
    sets = ray_sets(vertices, faces, Embree(vertices, faces))
    embree = EmbreeScene()
    TriangleMesh(embree, vertices.astype(np.float32), faces.astype(np.int32))
    rows = []
    for name, rays in sets.items():
        many = np.concatenate([rays] * (BATCH // len(rays)))
        rows += compare(accel, embree, name, many, rounds)
    rows += python_times(accel, sets["diffuse"])
    for row in rows:
        print(" ".join(f"{key} {value}" for key, value in row.items()), flush=True)
    machine.append(json_file, "queries", [about | row for row in rows])


if __name__ == "__main__":
    main()
